//! Clips: mono samples at an engine's rate, from the app's samples or from the bytes of a WAV file.
//!
//! Any control thread; allocates four bytes a sample, and four a sample of the result if the rate is converted. Channels
//! are averaged.

use std::sync::Arc;

use hound::{SampleFormat, WavReader};

use super::error::{CallError, Status};
use super::handles::{HandleTable, Kind};
use super::resampling::resample;
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

/// Maximum samples of a clip: an hour and a half at 48 kHz.
const MOST_SAMPLES: u64 = 1 << 28;
/// Maximum samples of a converted clip: 23 minutes at 48 kHz, 256 MiB.
const MOST_CONVERTED: u64 = 1 << 26;
/// Samples up to which a conversion may multiply the number of samples at will: six minutes at 48 kHz.
const MOST_MULTIPLIED: u64 = 1 << 24;
/// Maximum growth of longer clips, as from 6 to 48 kHz.
const MOST_GROWTH: u64 = 8;
/// Maximum magnitude of a sample: 32-bit integers stored as floats. The conversion of larger ones may overflow.
const LOUDEST_SAMPLE: f32 = 2_147_483_648.0;

/// Makes a clip of samples at `rate_hz` for an engine at `engine_rate_hz`.
///
/// # Errors
/// [`Status::BadArgument`] for a rate outside 1,000 to 384,000 Hz, a sample that is NaN or beyond ±2^31, or a clip of more
/// than 2^28 samples, of more than 2^26 after conversion, or of more than 2^24 and eight times as many as before;
/// [`Status::Full`].
pub fn from_samples(samples: &[f32], rate_hz: u32, engine_rate_hz: u32) -> Result<u64, CallError> {
    check_length(samples.len() as u64, rate_hz, engine_rate_hz)?;
    check_samples(samples)?;
    insert(
        match rate_hz == engine_rate_hz {
            true => samples.into(),
            false => resample(samples, rate_hz, engine_rate_hz),
        },
        engine_rate_hz,
    )
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
    check_length(
        u64::from(reader.duration()),
        spec.sample_rate,
        engine_rate_hz,
    )?;
    let channels = usize::from(spec.channels.max(1));
    // A header may promise more than there is.
    let count = (reader.duration() as usize).min(bytes.len());
    let mut mono: Arc<[f32]> = std::iter::repeat_n(0.0, count).collect();
    let frames = Arc::make_mut(&mut mono);
    match spec.sample_format {
        SampleFormat::Float => average(frames, channels, reader.samples::<f32>()),
        SampleFormat::Int => {
            let scale = 0.5f32.powi(i32::from(spec.bits_per_sample) - 1);
            let samples = reader.samples::<i32>();
            average(
                frames,
                channels,
                samples.map(|sample| sample.map(|s| s as f32 * scale)),
            )
        }
    }
    .map_err(wrong)?;
    check_samples(&mono)?;
    insert(
        match spec.sample_rate == engine_rate_hz {
            true => mono,
            false => resample(&mono, spec.sample_rate, engine_rate_hz),
        },
        engine_rate_hz,
    )
}

/// Fills frames with the means of their channels; reads what follows whole frames too.
fn average(
    frames: &mut [f32],
    channels: usize,
    mut samples: impl Iterator<Item = hound::Result<f32>>,
) -> hound::Result<()> {
    for frame in frames {
        let mut sum = 0.0;
        for sample in samples.by_ref().take(channels) {
            sum += sample?;
        }
        *frame = sum / channels as f32;
    }
    samples.try_for_each(|sample| sample.map(drop))
}

fn check_length(count: u64, rate_hz: u32, engine_rate_hz: u32) -> Result<(), CallError> {
    for rate in [rate_hz, engine_rate_hz] {
        if !(1_000..=384_000).contains(&rate) {
            let text = format!("rate: {rate} Hz is outside 1000 to 384000");
            return Err(CallError::bad(text));
        }
    }
    let length = (count * u64::from(engine_rate_hz)).div_ceil(u64::from(rate_hz));
    let most = match rate_hz == engine_rate_hz {
        true => MOST_SAMPLES,
        false => (MOST_GROWTH * count).clamp(MOST_MULTIPLIED, MOST_CONVERTED),
    };
    if length > most {
        let text =
            format!("{length} samples at {engine_rate_hz} Hz are more than {most}; use a stream");
        return Err(CallError::bad(text));
    }
    Ok(())
}

fn check_samples(samples: &[f32]) -> Result<(), CallError> {
    let is_none = |s: &f32| s.is_nan() || s.abs() > LOUDEST_SAMPLE;
    match samples.iter().position(is_none) {
        Some(at) => {
            let text = format!("sample {at} is {}, outside ±2^31", samples[at]);
            Err(CallError::bad(text))
        }
        None => Ok(()),
    }
}

fn insert(samples: Arc<[f32]>, rate_hz: u32) -> Result<u64, CallError> {
    CLIPS.insert(Clip { samples, rate_hz })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

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
