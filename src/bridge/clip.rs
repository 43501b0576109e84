//! Clips: samples of one, two or four channels at an engine's rate, from the app's samples or from the bytes of a sound file.
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
    /// One channel, two or four.
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

/// Makes a clip of samples at `rate_hz` for an engine at `engine_rate_hz`; `channels` interleaved ones, 1, 2 or 4 (AmbiX).
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
        let text = format!(
            "samples: {} samples are no frames of {channels}",
            samples.len()
        );
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
    let channels = channels as usize;
    let convert = |first: usize| {
        let own = samples.iter().skip(first).step_by(channels);
        resample(&own.copied().collect::<Vec<f32>>(), rate_hz, engine_rate_hz)
    };
    let each: Vec<Arc<[f32]>> = (0..channels).map(convert).collect();
    let frames = 0..each[0].len();
    frames
        .flat_map(|frame| each.iter().map(move |channel| channel[frame]))
        .collect()
}

fn check_channels(channels: u32) -> Result<(), CallError> {
    match channels {
        1 | 2 | 4 => Ok(()),
        _ => Err(CallError::bad(format!(
            "channels: {channels} is not 1, 2 or 4"
        ))),
    }
}

/// Refuses a file without a sound field where one is wanted.
fn check_field(kept: u32, channels: usize) -> Result<(), CallError> {
    if kept != 4 || channels == 4 {
        return Ok(());
    }
    let text = format!(
        "the file has {channels} channels; a sound field needs four, W, Y, Z and X in AmbiX form"
    );
    Err(CallError::new(Status::Format, text))
}

/// Makes a clip of the bytes of a sound file, told by its content: WAV as of [`from_wav`], or FLAC or Ogg Vorbis where the
/// library has its feature `compressed`.
///
/// # Errors
/// [`Status::Format`] for another file format or one that the library is built without; those of [`from_samples`].
pub fn from_file(bytes: &[u8], kept: u32, engine_rate_hz: u32) -> Result<u64, CallError> {
    if !(bytes.starts_with(b"fLaC") || bytes.starts_with(b"OggS")) {
        return from_wav(bytes, kept, engine_rate_hz);
    }
    check_channels(kept)?;
    from_compressed(bytes, kept, engine_rate_hz)
}

#[cfg(not(feature = "compressed"))]
fn from_compressed(_: &[u8], _: u32, _: u32) -> Result<u64, CallError> {
    let text =
        "FLAC and Ogg files need a library built with its feature `compressed`; pass a WAV file";
    Err(CallError::new(Status::Format, text))
}

#[cfg(feature = "compressed")]
fn from_compressed(bytes: &[u8], kept: u32, engine_rate_hz: u32) -> Result<u64, CallError> {
    let file =
        crate::output::compressed::decode(std::io::Cursor::new(bytes), MOST_SAMPLES as usize)
            .map_err(|problem| CallError::new(Status::Format, format!("the file {problem}")))?;
    let (channels, rate_hz) = (file.channels, file.rate_hz);
    check_field(kept, channels)?;
    let count = u64::from(kept) * (file.samples.len() / channels) as u64;
    check_length(count, rate_hz, engine_rate_hz)?;
    let mut samples = vec![0.0; count as usize];
    let found = file.samples.into_iter().map(Ok);
    // No sample is an error.
    let _ = read(&mut samples, kept as usize, channels, found);
    check_samples(&samples)?;
    let samples = match rate_hz == engine_rate_hz {
        true => samples.into(),
        false => converted(&samples, kept, rate_hz, engine_rate_hz),
    };
    insert(samples, kept, engine_rate_hz)
}

/// Makes a clip of the bytes of a WAV file: 8 to 32 bits or float, any number of channels, which are averaged (`kept` 1) or
/// of which the first two are kept (`kept` 2; one counts twice), or four, a sound field (`kept` 4).
///
/// # Errors
/// [`Status::Format`] for another file format, and for other than four channels with `kept` 4; those of [`from_samples`].
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
    check_field(kept, channels)?;
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
        2 => runtime::Clip::stereo(samples),
        _ => runtime::Clip::ambisonic(samples),
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
        assert!(from_samples(&[0.0; 6], 4, 48_000, 48_000).is_err());
        for bytes in [&b"fLaC"[..], b"OggS", b"fLaC\0\0\0\x22 and no more"] {
            let error = from_file(bytes, 1, 48_000).expect_err("is cut off");
            assert_eq!(error.status, Status::Format, "{error}");
        }
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
        let error = from_file(bytes.get_ref(), 4, 48_000).expect_err("is no field");
        assert!(error.message.contains("2 channels"), "{error}");
        let field = from_samples(&[0.25; 8], 4, 48_000, 96_000).expect("is a field");
        let field = CLIPS.remove(field).expect("is open").samples;
        assert_eq!((field.frames(), field.channels()), (4, 4));
    }
}
