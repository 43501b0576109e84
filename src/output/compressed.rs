//! FLAC and Ogg Vorbis files, decoded by the crate `symphonia`.
//!
//! Control side; blocks on the reader. The reader is told by its content. What is held in memory is bounded by the limit of the
//! samples, whatever a header promises.

use std::io::ErrorKind;

use symphonia::core::codecs::audio::AudioDecoderOptions;
use symphonia::core::common::Limit;
use symphonia::core::errors::Error;
use symphonia::core::formats::probe::Hint;
use symphonia::core::formats::{FormatOptions, TrackType};
use symphonia::core::io::{MediaSource, MediaSourceStream};
use symphonia::core::meta::MetadataOptions;

/// Greatest number of channels.
const MOST_CHANNELS: usize = 64;

/// Longest text and longest picture beside the sound, in bytes.
const MOST_METADATA: usize = 1 << 20;

/// A decoded file.
#[derive(Debug, Clone, PartialEq)]
pub struct Decoded {
    /// Sample rate in Hz.
    pub rate_hz: u32,
    /// Number of channels.
    pub channels: usize,
    /// Interleaved samples, full scale ±1.
    pub samples: Vec<f32>,
}

/// Whether a file that begins with these bytes is for [`decode`].
pub fn is_compressed(first: &[u8]) -> bool {
    first.starts_with(b"fLaC") || first.starts_with(b"OggS")
}

/// Decodes a file of at most so many samples, all channels together.
///
/// # Errors
/// What is wrong, to follow a file's name: another format, damaged, cut off, or too long.
pub fn decode<'s>(source: impl MediaSource + 's, most_samples: usize) -> Result<Decoded, String> {
    let stream = MediaSourceStream::new(Box::new(source), Default::default());
    let metadata = MetadataOptions::default()
        .limit_tag_bytes(Limit::Maximum(MOST_METADATA))
        .limit_visual_bytes(Limit::Maximum(MOST_METADATA));
    let mut format = symphonia::default::get_probe()
        .probe(&Hint::new(), stream, FormatOptions::default(), metadata)
        .map_err(problem)?;
    let track = format
        .default_track(TrackType::Audio)
        .ok_or("has no sound")?;
    let (id, promised) = (track.id, track.num_frames);
    let parameters = track.codec_params.as_ref();
    let parameters = parameters
        .and_then(|parameters| parameters.audio())
        .ok_or("has no sound")?;
    let mut decoder = symphonia::default::get_codecs()
        .make_audio_decoder(parameters, &AudioDecoderOptions::default())
        .map_err(problem)?;
    let mut decoded = Decoded {
        rate_hz: 0,
        channels: 0,
        samples: Vec::new(),
    };
    let mut packet_samples: Vec<f32> = Vec::new();
    loop {
        let packet = match format.next_packet() {
            Ok(Some(packet)) => packet,
            Ok(None) => break,
            Err(Error::IoError(error)) if error.kind() == ErrorKind::UnexpectedEof => break,
            Err(error) => return Err(problem(error)),
        };
        if packet.track_id != id {
            continue;
        }
        let audio = decoder.decode(&packet).map_err(problem)?;
        let (rate_hz, channels) = (audio.spec().rate(), audio.spec().channels().count());
        if decoded.channels == 0 {
            if !(1..=MOST_CHANNELS).contains(&channels) || rate_hz == 0 {
                return Err(format!("has {channels} channels at {rate_hz} Hz"));
            }
            (decoded.rate_hz, decoded.channels) = (rate_hz, channels);
        }
        if (rate_hz, channels) != (decoded.rate_hz, decoded.channels) {
            return Err("changes its sample rate or its channels on the way".to_owned());
        }
        if decoded.samples.len() + audio.samples_interleaved() > most_samples {
            return Err(format!("has more than {most_samples} samples"));
        }
        audio.copy_to_vec_interleaved(&mut packet_samples);
        decoded.samples.extend_from_slice(&packet_samples);
    }
    let frames = decoded.samples.len() / decoded.channels.max(1);
    match promised {
        Some(promised) if (frames as u64) < promised => Err(format!(
            "ends too early: {frames} of {promised} audio frames"
        )),
        _ if frames == 0 => Err("holds no samples".to_owned()),
        _ => Ok(decoded),
    }
}

fn problem(error: Error) -> String {
    match error {
        Error::IoError(error) if error.kind() == ErrorKind::UnexpectedEof => {
            "ends too early".to_owned()
        }
        Error::IoError(error) => format!("cannot be read ({error})"),
        Error::ResetRequired => "has several sounds one after another".to_owned(),
        other => format!("is damaged or of another format ({other})"),
    }
}
