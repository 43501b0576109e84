//! WAV file output.
//!
//! Control side: disk writes may block. Input: interleaved or planar blocks; output: one file that is complete or absent
//! ([`WholeFile`]). Equal samples produce equal bytes: there is no dither.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use hound::{SampleFormat, WavSpec, WavWriter};

use super::whole_file::{WholeFile, write_error};
use crate::{Error, Result};

/// Largest data chunk in bytes: RIFF sizes have 32 bits, and the header takes less than 1 KiB.
const MAX_DATA_BYTES: u64 = u32::MAX as u64 - 1024;

/// Offset of the mask of positions in the header: hound's files of floats, and of more than two channels, have one.
const MASK_OFFSET: u64 = 40;

/// Sample format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WavFormat {
    /// 32-bit float: samples are stored bit for bit, also beyond ±1.
    #[default]
    Float32,
    /// 16-bit PCM: rounded to nearest, clipped at full scale.
    Pcm16,
}

impl WavFormat {
    /// Bytes per sample.
    const fn bytes(self) -> u64 {
        match self {
            Self::Float32 => 4,
            Self::Pcm16 => 2,
        }
    }

    const fn spec(self, rate_hz: u32, channels: u16) -> WavSpec {
        let (bits_per_sample, sample_format) = match self {
            Self::Float32 => (32, SampleFormat::Float),
            Self::Pcm16 => (16, SampleFormat::Int),
        };
        WavSpec {
            channels,
            sample_rate: rate_hz,
            bits_per_sample,
            sample_format,
        }
    }
}

/// A WAV file being written. If it is dropped before [`Self::finish`], no file remains.
///
/// ```no_run
/// use foresound::offline::WavSink;
///
/// # fn main() -> foresound::Result<()> {
/// let mut sink = WavSink::create("silence.wav", 44_100, 2)?;
/// sink.write(&[0.0; 2 * 44_100])?;
/// sink.finish()?;
/// # Ok(())
/// # }
/// ```
pub struct WavSink {
    // First field: the writer is dropped, and writes its header, before the file is removed.
    writer: WavWriter<BufWriter<File>>,
    whole: WholeFile,
    path: PathBuf,
    format: WavFormat,
    channels: u16,
    /// Positions of the channels, if they are not those of hound.
    mask: Option<u32>,
    samples_written: u64,
}

impl WavSink {
    /// A 32-bit float file with `rate_hz` in Hz; creates missing folders.
    ///
    /// # Errors
    /// [`Error::Setting`] for zero channels or rate, [`Error::File`] if the file cannot be written.
    pub fn create(path: impl AsRef<Path>, rate_hz: u32, channels: u16) -> Result<Self> {
        Self::create_with(path, rate_hz, channels, WavFormat::default())
    }

    /// A file of the given sample format; creates missing folders.
    ///
    /// # Errors
    /// As [`Self::create`].
    pub fn create_with(
        path: impl AsRef<Path>,
        rate_hz: u32,
        channels: u16,
        format: WavFormat,
    ) -> Result<Self> {
        if channels == 0 || rate_hz == 0 {
            return Err(Error::setting(
                "WAV",
                format!("{channels} channels at {rate_hz} Hz"),
                "set at least one channel and a sample rate",
            ));
        }
        let path = path.as_ref().to_path_buf();
        let (whole, file) = WholeFile::create(&path)?;
        let writer = WavWriter::new(BufWriter::new(file), format.spec(rate_hz, channels))
            .map_err(|e| wav_write_error(&path, e))?;
        Ok(Self {
            writer,
            whole,
            path,
            format,
            channels,
            mask: None,
            samples_written: 0,
        })
    }

    /// States the positions of the channels as the mask of the WAV format: one bit a channel, 0 for none. Without it the
    /// first positions of the format are stated.
    pub fn set_positions(&mut self, mask: u32) {
        self.mask = Some(mask);
    }

    /// Audio frames written so far.
    pub fn audio_frames(&self) -> u64 {
        self.samples_written / u64::from(self.channels)
    }

    /// Appends interleaved samples, full scale ±1.
    ///
    /// # Errors
    /// [`Error::Setting`] if the last audio frame is incomplete; [`Error::File`] if a sample is not finite, the file
    /// exceeds 4 GiB or a write fails.
    pub fn write(&mut self, interleaved: &[f32]) -> Result<()> {
        if !interleaved.len().is_multiple_of(usize::from(self.channels)) {
            return Err(Error::setting(
                "WAV block",
                format!(
                    "{} samples for {} channels",
                    interleaved.len(),
                    self.channels
                ),
                "pass the same number of samples for every channel",
            ));
        }
        let data_bytes = (self.samples_written + interleaved.len() as u64) * self.format.bytes();
        if data_bytes > MAX_DATA_BYTES {
            return Err(Error::file(
                &self.path,
                "exceeds the 4 GiB limit of a WAV file",
                "write a shorter file or 16-bit samples",
            ));
        }
        for &sample in interleaved {
            self.write_sample(sample)?;
        }
        Ok(())
    }

    /// Appends one slice per channel, all of equal length.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_planar(&mut self, channels: &[&[f32]]) -> Result<()> {
        let audio_frames = channels.first().map_or(0, |c| c.len());
        if channels.len() != usize::from(self.channels)
            || channels.iter().any(|c| c.len() != audio_frames)
        {
            return Err(Error::setting(
                "WAV block",
                format!("{} slices for {} channels", channels.len(), self.channels),
                "pass one slice per channel, all of equal length",
            ));
        }
        let interleaved: Vec<f32> = (0..audio_frames)
            .flat_map(|i| channels.iter().map(move |c| c[i]))
            .collect();
        self.write(&interleaved)
    }

    /// Completes the header and renames the file to its final name.
    ///
    /// # Errors
    /// [`Error::File`] if a write fails; no file remains.
    pub fn finish(self) -> Result<()> {
        let Self {
            writer,
            whole,
            path,
            mask,
            ..
        } = self;
        writer.finalize().map_err(|e| wav_write_error(&path, e))?;
        if let Some(mask) = mask {
            whole.patch(MASK_OFFSET, &mask.to_le_bytes())?;
        }
        whole.keep()
    }

    fn write_sample(&mut self, sample: f32) -> Result<()> {
        if !sample.is_finite() {
            return Err(Error::file(
                &self.path,
                format!("sample {} to write is {sample}", self.samples_written),
                "this is a fault of Foresound: report it with the command line",
            ));
        }
        let written = match self.format {
            WavFormat::Float32 => self.writer.write_sample(sample),
            // Full scale is 2^15, as in the reader: samples read from 16 bits are written unchanged.
            WavFormat::Pcm16 => {
                let code = (sample * 32768.0).round().clamp(-32768.0, 32767.0);
                self.writer.write_sample(code as i16)
            }
        };
        written.map_err(|e| wav_write_error(&self.path, e))?;
        self.samples_written += 1;
        Ok(())
    }
}

fn wav_write_error(path: &Path, error: hound::Error) -> Error {
    match error {
        hound::Error::IoError(e) => write_error(path, e),
        other => Error::file(path, other, "check channels and sample format"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn float_samples_are_stored_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/folder/out.wav");
        let samples = [0.0, -1.0, 0.123_456_79, 3.5e-20, 1.7, -0.0];
        let mut sink = WavSink::create(&path, 44_100, 2).unwrap();
        sink.write(&samples[..4]).unwrap();
        sink.write_planar(&[&samples[4..5], &samples[5..]]).unwrap();
        assert_eq!(sink.audio_frames(), 3);
        sink.finish().unwrap();
        let mut reader = hound::WavReader::open(&path).unwrap();
        assert_eq!(
            (reader.spec().channels, reader.spec().sample_rate),
            (2, 44_100)
        );
        let read: Vec<f32> = reader.samples().map(|s| s.unwrap()).collect();
        assert_eq!(read.map_bits(), samples.to_vec().map_bits());
    }

    trait Bits {
        fn map_bits(&self) -> Vec<u32>;
    }
    impl Bits for Vec<f32> {
        fn map_bits(&self) -> Vec<u32> {
            self.iter().map(|s| s.to_bits()).collect()
        }
    }

    #[test]
    fn sixteen_bits_round_to_nearest_and_clip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.wav");
        let mut sink = WavSink::create_with(&path, 16_000, 1, WavFormat::Pcm16).unwrap();
        sink.write(&[0.0, 0.5, -0.5, 2.0, -2.0, 1.4 / 32768.0])
            .unwrap();
        sink.finish().unwrap();
        let codes: Vec<i16> = hound::WavReader::open(&path)
            .unwrap()
            .samples()
            .map(|s| s.unwrap())
            .collect();
        assert_eq!(codes, [0, 16384, -16384, 32767, -32768, 1]);
    }

    #[test]
    fn dropping_leaves_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.wav");
        let mut sink = WavSink::create(&path, 44_100, 1).unwrap();
        sink.write(&[0.5; 100_000]).unwrap();
        drop(sink);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn invalid_blocks_and_folders_are_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.wav");
        let mut sink = WavSink::create(&path, 44_100, 2).unwrap();
        assert!(sink.write(&[0.0; 3]).is_err());
        assert!(sink.write_planar(&[&[0.0], &[0.0, 0.0]]).is_err());
        let error = sink.write(&[0.0, f32::NAN]).unwrap_err().to_string();
        assert!(
            error.contains("out.wav") && error.contains("sample 1"),
            "{error}"
        );
        assert!(WavSink::create(folder.path(), 44_100, 2).is_err());
        assert!(WavSink::create(&path, 44_100, 0).is_err());
    }
}
