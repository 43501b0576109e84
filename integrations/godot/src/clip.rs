//! The bytes of an `AudioStreamWAV` as a clip.

use foresound::Clip;

/// Formats of an `AudioStreamWAV` that are read. Compressed ones are for Godot's own decoder, which gives no samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Signed, eight bits.
    Eight,
    /// Signed, sixteen bits, little-endian.
    Sixteen,
}

/// The samples, 1 being full scale.
pub fn clip(bytes: &[u8], format: Format, is_stereo: bool) -> Clip {
    let samples: Vec<f32> = match format {
        Format::Eight => bytes
            .iter()
            .map(|&byte| f32::from(byte as i8) / 128.0)
            .collect(),
        Format::Sixteen => bytes
            .as_chunks::<2>()
            .0
            .iter()
            .map(|&pair| f32::from(i16::from_le_bytes(pair)) / 32_768.0)
            .collect(),
    };
    match is_stereo {
        true => Clip::stereo(samples),
        false => Clip::mono(samples),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_scale_is_one_at_both_widths() {
        assert_eq!(
            clip(&[0x80, 0x40], Format::Eight, false).samples(),
            [-1.0, 0.5]
        );
        let wide = clip(&[0x00, 0x80, 0x00, 0x40, 9], Format::Sixteen, true);
        assert_eq!((wide.samples(), wide.channels()), (&[-1.0, 0.5][..], 2));
    }
}
