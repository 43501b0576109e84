//! Assets: files of materials, and sounds.

use std::io::Cursor;

use bevy_asset::io::Reader;
use bevy_asset::{Asset, AssetLoader, LoadContext};
use bevy_reflect::TypePath;
use foresound::{Clip, MaterialTable};

/// Materials of a TOML file that ends in `.materials.toml`, in the format of the command line's `--materials`:
///
/// ```toml
/// [materials.curtain]
/// absorption = [0.05, 0.07, 0.31, 0.49, 0.75, 0.70, 0.60, 0.60]  # energy, 63 Hz to 8 kHz, or one number
/// scattering = 0.3
/// transmission_loss_db = 3
/// ```
#[derive(Asset, TypePath, Debug, Clone)]
pub struct MaterialFile(pub MaterialTable);

/// A sound of one or two channels, in floats.
#[derive(Asset, TypePath, Debug, Clone)]
pub struct SoundClip {
    /// The samples; 1 is the pressure at 1 m.
    pub clip: Clip,
    /// Sample rate in Hz. Another one than the engine's is played at another speed, interpolated.
    pub rate_hz: u32,
}

/// Why an asset was not loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file could not be read.
    #[error("{0}")]
    Read(#[from] std::io::Error),
    /// Not a file of materials; the message has the line.
    #[error("{0}")]
    Materials(#[from] foresound::Error),
    /// Not a text.
    #[error("{0}: save the file as UTF-8")]
    Text(#[from] std::string::FromUtf8Error),
    /// Not a WAV file that is read.
    #[error("{0}: give a WAV file of 16, 24 or 32 bits or of floats")]
    Wav(#[from] hound::Error),
    /// Another number of channels.
    #[error("{0} channels: give a WAV file of one or two")]
    Channels(u16),
}

/// Reads `.materials.toml` files.
#[derive(TypePath, Default)]
pub(crate) struct MaterialLoader;

impl AssetLoader for MaterialLoader {
    type Asset = MaterialFile;
    type Settings = ();
    type Error = LoadError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        (): &(),
        context: &mut LoadContext<'_>,
    ) -> Result<MaterialFile, LoadError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        let text = String::from_utf8(bytes)?;
        let path = context.path().path().to_owned();
        Ok(MaterialFile(MaterialTable::parse(&path, &text)?))
    }

    fn extensions(&self) -> &[&str] {
        &["materials.toml"]
    }
}

/// Reads WAV files.
#[derive(TypePath, Default)]
pub(crate) struct SoundLoader;

impl AssetLoader for SoundLoader {
    type Asset = SoundClip;
    type Settings = ();
    type Error = LoadError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        (): &(),
        _: &mut LoadContext<'_>,
    ) -> Result<SoundClip, LoadError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        SoundClip::from_wav(&bytes)
    }

    fn extensions(&self) -> &[&str] {
        &["wav"]
    }
}

impl SoundClip {
    /// The sound of a WAV file's bytes.
    ///
    /// # Errors
    /// [`LoadError::Wav`], [`LoadError::Channels`].
    pub fn from_wav(bytes: &[u8]) -> Result<Self, LoadError> {
        let mut wav = hound::WavReader::new(Cursor::new(bytes))?;
        let spec = wav.spec();
        let samples: Vec<f32> = match spec.sample_format {
            hound::SampleFormat::Float => wav.samples::<f32>().collect::<Result<_, _>>()?,
            hound::SampleFormat::Int => {
                let full = 0.5f32.powi(i32::from(spec.bits_per_sample) - 1);
                let scaled = wav
                    .samples::<i32>()
                    .map(|sample| Ok::<f32, hound::Error>(sample? as f32 * full));
                scaled.collect::<Result<_, _>>()?
            }
        };
        let clip = match spec.channels {
            1 => Clip::mono(samples),
            2 => Clip::stereo(samples),
            other => return Err(LoadError::Channels(other)),
        };
        Ok(Self {
            clip,
            rate_hz: spec.sample_rate,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wav(channels: u16, bits: u16, samples: &[i32]) -> Vec<u8> {
        let spec = hound::WavSpec {
            channels,
            sample_rate: 48_000,
            bits_per_sample: bits,
            sample_format: hound::SampleFormat::Int,
        };
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = hound::WavWriter::new(&mut bytes, spec).expect("a header");
        for &sample in samples {
            writer.write_sample(sample).expect("a sample");
        }
        writer.finalize().expect("an end");
        bytes.into_inner()
    }

    #[test]
    fn full_scale_is_one_at_every_width() {
        for bits in [16, 24, 32] {
            let half = 1 << (bits - 2);
            let sound = SoundClip::from_wav(&wav(1, bits, &[half, -half])).expect("a sound");
            assert_eq!(sound.clip.samples(), [0.5, -0.5], "{bits}");
            assert_eq!(sound.rate_hz, 48_000);
        }
    }

    #[test]
    fn what_is_no_sound_says_what_to_give() {
        let error = SoundClip::from_wav(b"OggS").expect_err("no WAV file");
        assert!(error.to_string().contains("give a WAV file"), "{error}");
        let error = SoundClip::from_wav(&wav(3, 16, &[1, 2, 3])).expect_err("three channels");
        assert!(error.to_string().contains("one or two"), "{error}");
    }
}
