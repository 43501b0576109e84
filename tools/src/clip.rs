//! The dry sound of a source, from a WAV, FLAC or Ogg Vorbis file.
//!
//! Control side. Reads a file of any usual sample rate, told by its content, and resamples it. A source has one channel: other files are
//! refused ([`load_clip`]) or mixed down ([`load_recording`]).

use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;

use hound::{SampleFormat, WavReader};
use rubato::audioadapter_buffers::direct::InterleavedSlice;
use rubato::{Fft, FixedSync, Resampler};

use foresound::output::{compressed, wav_chunks};
use foresound::{Error, Result};

/// Accepted sample rates in Hz.
const RATES_HZ: std::ops::RangeInclusive<u32> = 1_000..=768_000;

/// Channels of a recording that are mixed down: as many as microphone arrays have.
pub const MOST_CHANNELS: u16 = 64;

/// Most samples of a file, all channels together, unless [`load_clip_within`] sets another limit: 25 minutes of one
/// channel at 44.1 kHz, 256 MiB. A longer file is refused by its header, before its content is in memory. So is one that
/// would be longer after conversion to another rate.
pub const MOST_SAMPLES: usize = 1 << 26;

/// Samples up to which a conversion may multiply the number of samples at will: six minutes at 44.1 kHz.
const MOST_MULTIPLIED: usize = 1 << 24;

/// Largest growth of longer files, as from 6 to 48 kHz.
const MOST_GROWTH: usize = 8;

/// Largest accepted float sample: 32-bit integers written as floats. The resampler turns larger ones into infinity.
const LOUDEST_SAMPLE: f32 = 2_147_483_648.0;

/// Audio frames the resampler takes at once. Its filter is at least as long: 4096 taps keep the transition band
/// below 1 % of the lower rate and still fit a cache.
const RESAMPLER_CHUNK: usize = 4096;

/// A mono sound, full scale ±1, never empty and all finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Clip {
    /// Sample rate in Hz.
    pub rate_hz: u32,
    /// The samples.
    pub samples: Vec<f32>,
}

impl Clip {
    /// Length in seconds.
    pub fn duration_s(&self) -> f64 {
        self.samples.len() as f64 / f64::from(self.rate_hz)
    }

    /// Fills `out` with the clip from sample `start` on, over and over. `start` may lie beyond the end.
    pub fn looped(&self, start: usize, out: &mut [f32]) {
        let length = self.samples.len();
        if length == 0 {
            out.fill(0.0);
            return;
        }
        let (mut at, mut done) = (start % length, 0);
        while done < out.len() {
            let count = (length - at).min(out.len() - done);
            out[done..done + count].copy_from_slice(&self.samples[at..at + count]);
            done += count;
            at = 0;
        }
    }
}

/// Reads a mono file and brings it to `rate_hz`: WAV (PCM of 16, 24 or 32 bits, or 32-bit float), FLAC or Ogg Vorbis.
///
/// The notes, one line each, report that the file was resampled, is silent or exceeds full scale.
///
/// # Errors
/// [`Error::File`] if the file cannot be opened, [`Error::Format`] if it is of another format, is not mono, has another
/// sample format, is empty, longer than [`MOST_SAMPLES`] before or after conversion, ends early or holds a sample that is not
/// finite. The text has advice on conversion.
pub fn load_clip(path: impl AsRef<Path>, rate_hz: u32) -> Result<(Clip, Vec<String>)> {
    load_clip_within(path, rate_hz, MOST_SAMPLES)
}

/// [`load_clip`] with another limit than [`MOST_SAMPLES`].
///
/// # Errors
/// As [`load_clip`].
pub fn load_clip_within(
    path: impl AsRef<Path>,
    rate_hz: u32,
    most_samples: usize,
) -> Result<(Clip, Vec<String>)> {
    let path = path.as_ref();
    let (found, samples) = read_samples(path, rate_hz, 1, most_samples)?;
    finished(path, rate_hz, found, samples, Vec::new())
}

/// [`load_clip`] for a file of up to [`MOST_CHANNELS`] channels; returns their mean, with a note.
///
/// # Errors
/// As [`load_clip`], more channels instead of one.
pub fn load_recording(path: impl AsRef<Path>, rate_hz: u32) -> Result<(Clip, Vec<String>)> {
    let path = path.as_ref();
    let (found, samples) = read_samples(path, rate_hz, MOST_CHANNELS, MOST_SAMPLES)?;
    let channels = usize::from(found.channels);
    if channels == 1 {
        return finished(path, rate_hz, found, samples, Vec::new());
    }
    let mean = |frame: &[f32]| frame.iter().sum::<f32>() / channels as f32;
    let mixed: Vec<f32> = samples.chunks_exact(channels).map(mean).collect();
    let note = format!("{}: {channels} channels mixed to one", path.display());
    finished(path, rate_hz, found, mixed, vec![note])
}

/// Adds notes on the file, and resamples it if necessary.
fn finished(
    path: &Path,
    rate_hz: u32,
    found: Layout,
    samples: Vec<f32>,
    mut notes: Vec<String>,
) -> Result<(Clip, Vec<String>)> {
    if !RATES_HZ.contains(&rate_hz) {
        return Err(Error::setting(
            "sample rate",
            format!("{rate_hz} Hz"),
            "choose 44100 or 48000",
        ));
    }
    let peak = samples.iter().fold(0.0f32, |p, s| p.max(s.abs()));
    if peak == 0.0 {
        notes.push(format!("{}: is silent", path.display()));
    } else if peak > 1.0 {
        notes.push(format!(
            "{}: peaks at {}, above full scale",
            path.display(),
            if peak < 1e4 {
                format!("{peak:.2}")
            } else {
                format!("{peak:.1e}")
            }
        ));
    }
    let samples = if found.rate_hz == rate_hz {
        samples
    } else {
        notes.push(format!(
            "{}: resampled from {} Hz to {rate_hz} Hz",
            path.display(),
            found.rate_hz
        ));
        resample(&samples, found.rate_hz, rate_hz)
            .map_err(|e| Error::format(path, None, e, &conversion(path, "")))?
    };
    Ok((Clip { rate_hz, samples }, notes))
}

/// Resamples by a windowed sinc filter in the frequency domain; the filter's delay is removed. The length is that of the
/// input times the ratio, rounded up. One chunk at a time is in double precision.
///
/// # Errors
/// Errors of the resampler; none is known for rates above zero.
pub fn resample(
    samples: &[f32],
    from_hz: u32,
    to_hz: u32,
) -> std::result::Result<Vec<f32>, String> {
    if from_hz == to_hz || samples.is_empty() {
        return Ok(samples.to_vec());
    }
    let (from, to) = (from_hz as usize, to_hz as usize);
    // The filter is centred on a sample, and the delay a whole number, only if its length is even.
    let step = from / greatest_common_divisor(from, to);
    let chunk = step * RESAMPLER_CHUNK.div_ceil(step).next_multiple_of(2);
    let mut resampler =
        Fft::<f64>::new(from, to, chunk, 1, FixedSync::Both).map_err(|e| e.to_string())?;
    let mut input = vec![0.0; resampler.input_frames_max()];
    let mut output = vec![0.0; resampler.output_frames_max()];
    let mut chunks = samples.chunks(input.len());
    let mut delay = resampler.output_delay();
    let length = converted_length(samples.len(), from_hz, to_hz);
    let mut resampled = Vec::with_capacity(length);
    while resampled.len() < length {
        // Silence follows the samples.
        let taken = chunks.next().unwrap_or(&[]);
        let padded = taken.iter().copied().chain(std::iter::repeat(0.0));
        input
            .iter_mut()
            .zip(padded)
            .for_each(|(slot, sample)| *slot = f64::from(sample));
        let (input_len, output_len) = (input.len(), output.len());
        let from = InterleavedSlice::new(&input, 1, input_len).map_err(|e| e.to_string())?;
        let mut to =
            InterleavedSlice::new_mut(&mut output, 1, output_len).map_err(|e| e.to_string())?;
        let (_, made) = resampler
            .process_into_buffer(&from, &mut to, None)
            .map_err(|e| e.to_string())?;
        let skipped = delay.min(made);
        delay -= skipped;
        let room = length - resampled.len();
        let samples = output[skipped..made].iter().take(room);
        resampled.extend(samples.map(|&sample| sample as f32));
    }
    Ok(resampled)
}

/// Samples after conversion; integers, because the resampler's own length is a rounded product.
fn converted_length(count: usize, from_hz: u32, to_hz: u32) -> usize {
    (count * to_hz as usize).div_ceil(from_hz as usize)
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}

/// Channels and sample rate of a file.
#[derive(Debug, Clone, Copy)]
struct Layout {
    channels: u16,
    rate_hz: u32,
}

/// Interleaved samples of a file with at most `most_channels` channels.
fn read_samples(
    path: &Path,
    rate_hz: u32,
    most_channels: u16,
    most_samples: usize,
) -> Result<(Layout, Vec<f32>)> {
    let wrong = |problem: String, advice: &str| Error::format(path, None, problem, advice);
    let unreadable =
        |e: std::io::Error| Error::file(path, e, "check the name and that the file may be read");
    let mut file = File::open(path).map_err(unreadable)?;
    let mut first = Vec::new();
    let begun = file.by_ref().take(4).read_to_end(&mut first);
    // A folder cannot be read, which the reader of WAV files says.
    let is_compressed = begun.is_ok() && compressed::is_compressed(&first);
    let checked = |found: Layout, count: usize| {
        check_layout(path, most_channels, found)?;
        check_length(path, rate_hz, most_samples, found, count).map(|()| found)
    };
    let (found, samples) = match is_compressed {
        true => {
            file.rewind().map_err(unreadable)?;
            let decoded = compressed::decode(file, most_samples).map_err(|problem| {
                let problem = format!("cannot be decoded: it {problem}");
                wrong(problem, &conversion(path, ""))
            })?;
            let found = Layout {
                channels: decoded.channels as u16,
                rate_hz: decoded.rate_hz,
            };
            (checked(found, decoded.samples.len())?, decoded.samples)
        }
        // A pipe cannot be read again.
        false => read_wav(path, Cursor::new(first).chain(file), checked)?,
    };
    if samples.is_empty() {
        return Err(wrong(
            "holds no samples".into(),
            "choose a file with sound in it",
        ));
    }
    let is_none = |s: &f32| s.is_nan() || s.abs() > LOUDEST_SAMPLE;
    if let Some(i) = samples.iter().position(is_none) {
        return Err(wrong(
            format!("sample {i} is {}", samples[i]),
            "export the file again from its origin",
        ));
    }
    Ok((found, samples))
}

fn check_layout(path: &Path, most_channels: u16, found: Layout) -> Result<()> {
    let wrong = |problem: String, advice: &str| Error::format(path, None, problem, advice);
    if !(1..=most_channels).contains(&found.channels) {
        let problem = match most_channels {
            1 => format!("has {} channels, a source needs one", found.channels),
            most => format!("has {} channels, not 1 to {most}", found.channels),
        };
        return Err(wrong(problem, &conversion(path, " -c 1")));
    }
    if !RATES_HZ.contains(&found.rate_hz) {
        return Err(wrong(
            format!("has a sample rate of {} Hz", found.rate_hz),
            &conversion(path, " -r 44100"),
        ));
    }
    Ok(())
}

/// Refuses files that are too long, or would be after conversion.
fn check_length(
    path: &Path,
    rate_hz: u32,
    most_samples: usize,
    found: Layout,
    count: usize,
) -> Result<()> {
    let wrong = |problem: String, advice: &str| Error::format(path, None, problem, advice);
    if count > most_samples {
        let problem = format!("has {count} samples, more than {most_samples}");
        return Err(wrong(problem, "cut it into shorter files"));
    }
    let frames = count / usize::from(found.channels);
    let length = converted_length(frames, found.rate_hz, rate_hz);
    let most = (MOST_GROWTH * frames).clamp(MOST_MULTIPLIED, MOST_SAMPLES);
    if found.rate_hz != rate_hz && length > most {
        let problem = format!("would be {length} samples at {rate_hz} Hz, more than {most}");
        return Err(wrong(problem, "cut it into shorter files"));
    }
    Ok(())
}

/// Channels, rate and samples of a WAV file, whose header is checked before the samples are read.
fn read_wav(
    path: &Path,
    file: impl Read,
    checked: impl Fn(Layout, usize) -> Result<Layout>,
) -> Result<(Layout, Vec<f32>)> {
    let mut reader = wav_chunks(file)
        .map_err(hound::Error::IoError)
        .and_then(|chunks| WavReader::new(BufReader::new(chunks)))
        .map_err(|e| read_error(path, e))?;
    let spec = reader.spec();
    let found = Layout {
        channels: spec.channels,
        rate_hz: spec.sample_rate,
    };
    let found = checked(found, reader.len() as usize)?;
    let samples: hound::Result<Vec<f32>> = match (spec.sample_format, spec.bits_per_sample) {
        (SampleFormat::Float, 32) => reader.samples::<f32>().collect(),
        (SampleFormat::Int, bits @ (16 | 24 | 32)) => {
            let scale = 1.0 / 2f64.powi(i32::from(bits) - 1);
            let to_float = |code: i32| (f64::from(code) * scale) as f32;
            reader.samples::<i32>().map(|s| s.map(to_float)).collect()
        }
        (_, bits) => {
            return Err(Error::format(
                path,
                None,
                format!("has {bits}-bit samples, not 16, 24, 32 or float"),
                &conversion(path, " -b 16"),
            ));
        }
    };
    let samples = samples.map_err(|e| read_error(path, e))?;
    Ok((found, samples))
}

fn read_error(path: &Path, error: hound::Error) -> Error {
    match error {
        hound::Error::IoError(e) => Error::format(
            path,
            None,
            format!("ends too early or cannot be read ({e})"),
            &conversion(path, ""),
        ),
        other => Error::format(
            path,
            None,
            format!("is no WAV file Foresound reads ({other})"),
            &conversion(path, " -b 16"),
        ),
    }
}

/// The command that converts this file into a readable one.
fn conversion(path: &Path, options: &str) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let bits = if options.contains("-b") { "" } else { " -b 16" };
    format!("convert it, e.g. `sox {name}{options}{bits} out.wav`")
}

#[cfg(test)]
mod tests {
    use super::*;
    use foresound::output::WavSink;
    use hound::WavSpec;
    use std::f64::consts::TAU;
    use std::path::PathBuf;

    fn sine(rate_hz: u32, hz: f64, length: usize) -> Vec<f32> {
        (0..length)
            .map(|i| (0.5 * (TAU * hz * i as f64 / f64::from(rate_hz)).sin()) as f32)
            .collect()
    }

    fn write(path: &Path, rate_hz: u32, channels: u16, samples: &[f32]) {
        let mut sink = WavSink::create(path, rate_hz, channels).unwrap();
        sink.write(samples).unwrap();
        sink.finish().unwrap();
    }

    fn write_int(path: &Path, bits: u16, codes: &[i32]) {
        let spec = WavSpec {
            channels: 1,
            sample_rate: 44_100,
            bits_per_sample: bits,
            sample_format: SampleFormat::Int,
        };
        let mut writer = hound::WavWriter::create(path, spec).unwrap();
        codes.iter().for_each(|&c| writer.write_sample(c).unwrap());
        writer.finalize().unwrap();
    }

    #[test]
    fn every_word_length_has_the_same_full_scale() {
        let folder = tempfile::tempdir().unwrap();
        for bits in [16u16, 24, 32] {
            let path = folder.path().join(format!("{bits}.wav"));
            let half = 1i32 << (bits - 2);
            write_int(&path, bits, &[0, half, -half, half.wrapping_mul(-2)]);
            let (clip, notes) = load_clip(&path, 44_100).unwrap();
            assert_eq!(clip.samples, [0.0, 0.5, -0.5, -1.0], "{bits}");
            assert!(notes.is_empty());
        }
    }

    #[test]
    fn resampling_keeps_tone_time_and_length() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tone.wav");
        for (from_hz, to_hz) in [
            (16_000, 44_100),
            (48_000, 44_100),
            (22_050, 48_000),
            (44_101, 44_100),
        ] {
            let length = from_hz as usize;
            write(&path, from_hz, 1, &sine(from_hz, 997.0, length));
            let (clip, notes) = load_clip(&path, to_hz).unwrap();
            assert_eq!(clip.rate_hz, to_hz);
            assert_eq!(clip.samples.len(), to_hz as usize);
            assert!(notes[0].contains("resampled"), "{notes:?}");
            // The abrupt ends spread over half the filter; between them only the filter's stop band remains.
            let exact = sine(to_hz, 997.0, clip.samples.len());
            let margin = to_hz as usize / 5;
            let worst = (margin..exact.len() - margin)
                .map(|i| (clip.samples[i] - exact[i]).abs())
                .fold(0.0, f32::max);

            assert!(worst < 1e-5, "{from_hz} to {to_hz}: {worst}");
        }
    }

    #[test]
    fn looping_wraps_around_from_any_start() {
        let clip = Clip {
            rate_hz: 44_100,
            samples: vec![0.0, 1.0, 2.0],
        };
        let mut out = [9.0; 8];
        clip.looped(5, &mut out);
        assert_eq!(out, [2.0, 0.0, 1.0, 2.0, 0.0, 1.0, 2.0, 0.0]);
        clip.looped(1, &mut out[..1]);
        assert_eq!(out[0], 1.0);
    }

    #[test]
    fn unusable_files_are_refused_by_name_with_advice() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| -> PathBuf { folder.path().join(name) };
        write(&file("stereo.wav"), 44_100, 2, &[0.1; 8]);
        write(&file("empty.wav"), 44_100, 1, &[]);
        write_int(&file("eight.wav"), 8, &[1, 2, 3]);
        std::fs::write(file("text.wav"), "this is no sound at all").unwrap();
        std::fs::write(file("no_bytes.wav"), "").unwrap();
        write(&file("cut.wav"), 44_100, 1, &[0.1; 1000]);
        let whole = std::fs::read(file("cut.wav")).unwrap();
        std::fs::write(file("cut.wav"), &whole[..whole.len() / 2]).unwrap();
        write(&file("nan.wav"), 44_100, 1, &[0.25, 0.5]);
        let mut bytes = std::fs::read(file("nan.wav")).unwrap();
        let end = bytes.len();
        bytes[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
        std::fs::write(file("nan.wav"), bytes).unwrap();
        for (name, words) in [
            ("stereo.wav", "2 channels"),
            ("empty.wav", "no samples"),
            ("eight.wav", "8-bit"),
            ("text.wav", "no WAV"),
            ("no_bytes.wav", "too early"),
            ("cut.wav", "too early"),
            ("nan.wav", "sample 1 is NaN"),
            ("missing.wav", "check the name"),
        ] {
            let text = load_clip(file(name), 44_100).unwrap_err().to_string();
            assert!(text.contains(name) && text.contains(words), "{text}");
        }
        let text = load_clip(file("stereo.wav"), 44_100)
            .unwrap_err()
            .to_string();
        assert!(
            text.ends_with("`sox stereo.wav -c 1 -b 16 out.wav`"),
            "{text}"
        );
    }

    #[test]
    fn recordings_of_several_channels_become_their_mean() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("stereo.wav");
        write(&path, 44_100, 2, &[0.5, 0.25, -0.5, 0.5]);
        let (clip, notes) = load_recording(&path, 44_100).unwrap();
        assert_eq!(clip.samples, [0.375, 0.0]);
        assert!(notes[0].contains("2 channels mixed"), "{notes:?}");
        write(&path, 44_100, 65, &[0.0; 65]);
        let text = load_recording(&path, 44_100).unwrap_err().to_string();
        assert!(text.contains("65 channels, not 1 to 64"), "{text}");
    }

    #[test]
    fn silence_and_overload_are_noted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.wav");
        write(&path, 44_100, 1, &[0.0; 4]);
        assert!(load_clip(&path, 44_100).unwrap().1[0].contains("silent"));
        write(&path, 44_100, 1, &[1.5; 4]);
        assert!(load_clip(&path, 44_100).unwrap().1[0].contains("1.50"));
    }
}
