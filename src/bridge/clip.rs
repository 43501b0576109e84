//! Clips: samples of one or two channels at an engine's rate, from the app's samples or from the bytes of a WAV file.
//!
//! Any control thread; allocates four bytes a sample, and four a sample of the result if the rate is converted.

use std::sync::Arc;

use hound::{SampleFormat, WavReader};

use super::error::{CallError, Status};
use super::handles::{HandleTable, Kind};
use super::resampling::resample;
use crate::output::wav_chunks;
use crate::runtime;

/// A clip's samples.
pub struct Clip {
    /// One channel or two.
    pub samples: runtime::Clip,
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

/// Makes a clip of samples at `rate_hz` for an engine at `engine_rate_hz`; `channels` interleaved ones, 1 or 2.
///
/// # Errors
/// [`Status::BadArgument`] for a rate outside 1,000 to 384,000 Hz, another number of channels, a sample that is NaN or beyond
/// ±2^31, or a clip of more than 2^28 samples, of more than 2^26 after conversion, or of more than 2^24 and eight times as many
/// as before; [`Status::Full`].
pub fn from_samples(
    samples: &[f32],
    channels: u32,
    rate_hz: u32,
    engine_rate_hz: u32,
) -> Result<u64, CallError> {
    check_channels(channels)?;
    if !samples.len().is_multiple_of(channels as usize) {
        let text = format!("samples: {} samples are no frames of 2", samples.len());
        return Err(CallError::bad(text));
    }
    check_length(samples.len() as u64, rate_hz, engine_rate_hz)?;
    check_samples(samples)?;
    let samples = match rate_hz == engine_rate_hz {
        true => samples.into(),
        false => converted(samples, channels, rate_hz, engine_rate_hz),
    };
    insert(samples, channels, engine_rate_hz)
}

/// Samples at another rate.
fn converted(samples: &[f32], channels: u32, rate_hz: u32, engine_rate_hz: u32) -> Arc<[f32]> {
    if channels == 1 {
        return resample(samples, rate_hz, engine_rate_hz);
    }
    let convert = |first: usize| {
        let channel: Vec<f32> = samples.iter().skip(first).step_by(2).copied().collect();
        resample(&channel, rate_hz, engine_rate_hz)
    };
    let [left, right] = [0, 1].map(convert);
    let pairs = left.iter().zip(right.iter());
    pairs.flat_map(|(left, right)| [*left, *right]).collect()
}

fn check_channels(channels: u32) -> Result<(), CallError> {
    match channels {
        1 | 2 => Ok(()),
        _ => Err(CallError::bad(format!(
            "channels: {channels} is outside 1 to 2"
        ))),
    }
}

/// Makes a clip of the bytes of a WAV file: 8 to 32 bits or float, any number of channels, which are averaged (`kept` 1) or
/// of which the first two are kept (`kept` 2; one counts twice).
///
/// # Errors
/// [`Status::Format`] for another file format; those of [`from_samples`].
pub fn from_wav(bytes: &[u8], kept: u32, engine_rate_hz: u32) -> Result<u64, CallError> {
    check_channels(kept)?;
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
        u64::from(kept) * u64::from(reader.duration()),
        spec.sample_rate,
        engine_rate_hz,
    )?;
    let channels = usize::from(spec.channels.max(1));
    // A header may promise more than there is.
    let count = (reader.duration() as usize).min(bytes.len());
    let kept_channels = kept as usize;
    let mut kept_samples: Arc<[f32]> = std::iter::repeat_n(0.0, kept_channels * count).collect();
    let frames = Arc::make_mut(&mut kept_samples);
    match spec.sample_format {
        SampleFormat::Float => read(frames, kept_channels, channels, reader.samples::<f32>()),
        SampleFormat::Int => {
            let scale = 0.5f32.powi(i32::from(spec.bits_per_sample) - 1);
            let samples = reader.samples::<i32>();
            read(
                frames,
                kept_channels,
                channels,
                samples.map(|sample| sample.map(|s| s as f32 * scale)),
            )
        }
    }
    .map_err(wrong)?;
    check_samples(&kept_samples)?;
    let samples = match spec.sample_rate == engine_rate_hz {
        true => kept_samples,
        false => converted(&kept_samples, kept, spec.sample_rate, engine_rate_hz),
    };
    insert(samples, kept, engine_rate_hz)
}

/// Fills frames with the means of their channels or with the first two; reads what follows whole frames too.
fn read(
    frames: &mut [f32],
    kept: usize,
    channels: usize,
    mut samples: impl Iterator<Item = hound::Result<f32>>,
) -> hound::Result<()> {
    for frame in frames.chunks_exact_mut(kept) {
        let mut sum = 0.0;
        for (channel, sample) in samples.by_ref().take(channels).enumerate() {
            let sample = sample?;
            sum += sample;
            // A single channel is both.
            if channel == 0 {
                frame.fill(sample);
            } else if let Some(own) = frame.get_mut(channel) {
                *own = sample;
            }
        }
        if kept == 1 {
            frame[0] = sum / channels as f32;
        }
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

fn insert(samples: Arc<[f32]>, channels: u32, rate_hz: u32) -> Result<u64, CallError> {
    let samples = match channels {
        1 => runtime::Clip::mono(samples),
        _ => runtime::Clip::stereo(samples),
    };
    CLIPS.insert(Clip { samples, rate_hz })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn bytes_that_are_no_sound_are_refused() {
        for bytes in [&b""[..], b"RIFF", b"not a wav file at all, but long enough"] {
            let error = from_wav(bytes, 1, 48_000).expect_err("no WAV");
            assert_eq!(error.status, Status::Format);
        }
        assert!(from_samples(&[0.0, f32::NAN], 1, 48_000, 48_000).is_err());
        assert!(from_samples(&[0.0], 1, 0, 48_000).is_err());
        assert!(from_samples(&[0.0], 1, 48_000, u32::MAX).is_err());
        for channels in [0, 3, u32::MAX] {
            assert!(from_samples(&[0.0; 6], channels, 48_000, 48_000).is_err());
        }
        assert!(from_samples(&[0.0; 3], 2, 48_000, 48_000).is_err());
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
        let samples = |kept: u32| {
            let handle = from_wav(bytes.get_ref(), kept, 48_000).expect("is a sound");
            CLIPS.remove(handle).expect("is open").samples
        };
        assert_eq!(*samples(1).samples(), [0.25, -0.5]);
        assert_eq!(*samples(2).samples(), [0.5, 0.0, -0.5, -0.5]);
        assert_eq!((samples(2).frames(), samples(2).channels()), (2, 2));
    }
}
