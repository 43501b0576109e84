//! Clips: mono samples at an engine's rate, from the app's samples or from the bytes of a WAV file.
//!
//! Any control thread; allocates. Channels are averaged. Sample rates are converted by a Kaiser-windowed sinc with 32 zero
//! crossings a side, evaluated directly, whose pass band ends at 0.93 of the lower Nyquist frequency.

use std::f64::consts::PI;
use std::sync::Arc;

use hound::{SampleFormat, WavReader};

use super::error::{CallError, Status};
use super::handles::{HandleTable, Kind};
use crate::output::wav_chunks;

/// A clip's samples.
pub struct Clip {
    /// Mono.
    pub samples: Arc<[f32]>,
    /// Sample rate in Hz.
    pub rate_hz: u32,
}

/// Clips.
pub static CLIPS: HandleTable<Clip> = HandleTable::new(Kind::Clip);

/// Zero crossings of the sinc on each side.
const CROSSINGS: f64 = 32.0;
/// Shape of the Kaiser window: side lobes below -80 dB.
const KAISER_BETA: f64 = 8.0;
/// End of the pass band re the lower Nyquist frequency: the window's transition band fills the rest.
const PASS: f64 = 0.93;
/// Maximum samples of a clip: an hour and a half at 48 kHz.
const MOST_SAMPLES: usize = 1 << 28;
/// Maximum magnitude of a sample: 32-bit integers stored as floats. The conversion of larger ones may overflow.
const LOUDEST_SAMPLE: f32 = 2_147_483_648.0;

/// Makes a clip of samples at `rate_hz` for an engine at `engine_rate_hz`.
///
/// # Errors
/// [`Status::BadArgument`] for a rate outside 1,000 to 384,000 Hz, a sample that is NaN or beyond ±2^31, or a clip of more
/// than 2^28 samples; [`Status::Full`].
pub fn from_samples(samples: &[f32], rate_hz: u32, engine_rate_hz: u32) -> Result<u64, CallError> {
    for rate in [rate_hz, engine_rate_hz] {
        if !(1_000..=384_000).contains(&rate) {
            let text = format!("rate: {rate} Hz is outside 1000 to 384000");
            return Err(CallError::bad(text));
        }
    }
    if let Some(at) = samples
        .iter()
        .position(|s| s.is_nan() || s.abs() > LOUDEST_SAMPLE)
    {
        let text = format!("sample {at} is {}, outside ±2^31", samples[at]);
        return Err(CallError::bad(text));
    }
    let length = samples.len() as u64 * u64::from(engine_rate_hz) / u64::from(rate_hz);
    if length > MOST_SAMPLES as u64 {
        let text = format!("{length} samples are more than {MOST_SAMPLES}; use a stream");
        return Err(CallError::bad(text));
    }
    let samples = if rate_hz == engine_rate_hz {
        samples.into()
    } else {
        resample(samples, rate_hz, engine_rate_hz).into()
    };
    CLIPS.insert(Clip {
        samples,
        rate_hz: engine_rate_hz,
    })
}

/// Makes a clip of the bytes of a WAV file: 8 to 32 bits or float, any number of channels.
///
/// # Errors
/// [`Status::Format`] for another file format; those of [`from_samples`].
pub fn from_wav(bytes: &[u8], engine_rate_hz: u32) -> Result<u64, CallError> {
    let wrong = |error: hound::Error| {
        let text = format!("WAV: {error}; pass a file of PCM or float samples");
        CallError::new(Status::Format, text)
    };
    let mut reader = wav_chunks(bytes)
        .map_err(hound::Error::IoError)
        .and_then(WavReader::new)
        .map_err(wrong)?;
    let spec = reader.spec();
    let samples: Vec<f32> = match spec.sample_format {
        SampleFormat::Float => reader.samples::<f32>().collect::<Result<_, _>>(),
        SampleFormat::Int => {
            let scale = 0.5f32.powi(i32::from(spec.bits_per_sample) - 1);
            let scaled = reader.samples::<i32>();
            scaled
                .map(|sample| sample.map(|s| s as f32 * scale))
                .collect::<Result<_, _>>()
        }
    }
    .map_err(wrong)?;
    let channels = usize::from(spec.channels.max(1));
    let mono: Vec<f32> = samples
        .chunks_exact(channels)
        .map(|frame| frame.iter().sum::<f32>() / channels as f32)
        .collect();
    from_samples(&mono, spec.sample_rate, engine_rate_hz)
}

/// The samples at another rate.
fn resample(samples: &[f32], from_hz: u32, to_hz: u32) -> Vec<f32> {
    let ratio = f64::from(from_hz) / f64::from(to_hz);
    // Cut off below half the lower rate, in cycles an input sample, times two.
    let cutoff = PASS * (1.0 / ratio).min(1.0);
    let reach = CROSSINGS / cutoff;
    let length = (samples.len() as u64 * u64::from(to_hz)).div_ceil(u64::from(from_hz));
    let weight = 1.0 / bessel_i0(KAISER_BETA);
    (0..length)
        .map(|n| {
            let centre = n as f64 * ratio;
            let first = (centre - reach).ceil().max(0.0) as usize;
            let end = ((centre + reach).floor() as usize + 1).min(samples.len());
            let tap = |i: usize| {
                let x = i as f64 - centre;
                let edge = (1.0 - (x / reach).powi(2)).max(0.0).sqrt();
                cutoff * sinc(cutoff * x) * bessel_i0(KAISER_BETA * edge) * weight
            };
            let taken = samples.get(first..end).unwrap_or(&[]);
            let terms = taken.iter().zip(first..);
            terms.map(|(s, i)| f64::from(*s) * tap(i)).sum::<f64>() as f32
        })
        .collect()
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        (PI * x).sin() / (PI * x)
    }
}

/// The modified Bessel function of order zero, by its series.
fn bessel_i0(x: f64) -> f64 {
    let quarter = x * x / 4.0;
    let mut term = 1.0;
    let mut sum = 1.0;
    for k in 1..40 {
        term *= quarter / f64::from(k * k);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn sine(rate_hz: u32, frequency_hz: f64, count: usize) -> Vec<f32> {
        let phase = 2.0 * PI * frequency_hz / f64::from(rate_hz);
        (0..count)
            .map(|n| (phase * n as f64).sin() as f32)
            .collect()
    }

    #[test]
    fn a_tone_keeps_its_pitch_and_level() {
        for (from, to) in [(44_100, 48_000), (48_000, 44_100), (16_000, 48_000)] {
            let made = resample(&sine(from, 1000.0, 4800), from, to);
            let wanted = sine(to, 1000.0, made.len());
            // Beyond the sinc's reach from both ends; a window of -80 dB leaves 1e-4.
            let middle = 200..made.len() - 200;
            for n in middle {
                assert!((made[n] - wanted[n]).abs() < 2e-4, "{from} to {to} at {n}");
            }
        }
    }

    #[test]
    fn what_the_lower_rate_cannot_hold_is_gone() {
        let made = resample(&sine(48_000, 12_000.0, 4800), 48_000, 16_000);
        let loudest = made[100..made.len() - 100]
            .iter()
            .fold(0.0f32, |most, s| most.max(s.abs()));
        assert!(loudest < 1e-3, "{loudest}");
    }

    #[test]
    fn bytes_that_are_no_sound_are_refused() {
        for bytes in [&b""[..], b"RIFF", b"not a wav file at all, but long enough"] {
            let error = from_wav(bytes, 48_000).expect_err("no WAV");
            assert_eq!(error.status, Status::Format);
        }
        assert!(from_samples(&[0.0, f32::NAN], 48_000, 48_000).is_err());
        assert!(from_samples(&[0.0], 0, 48_000).is_err());
        assert!(from_samples(&[0.0], 48_000, u32::MAX).is_err());
    }

    #[test]
    fn channels_become_one() {
        let mut bytes = Cursor::new(Vec::new());
        let spec = hound::WavSpec {
            channels: 2,
            sample_rate: 48_000,
            bits_per_sample: 16,
            sample_format: SampleFormat::Int,
        };
        let mut writer = hound::WavWriter::new(&mut bytes, spec).expect("writes");
        for sample in [16_384i16, 0, -16_384, -16_384] {
            writer.write_sample(sample).expect("writes");
        }
        writer.finalize().expect("writes");
        let handle = from_wav(bytes.get_ref(), 48_000).expect("is a sound");
        let clip = CLIPS.remove(handle).expect("is open");
        assert_eq!(*clip.samples, [0.25, -0.5]);
    }
}
