//! Layouts of the output: which channels it has, and in which order.

use std::fmt;
use std::str::FromStr;

use crate::error::{Error, Result};

/// Channels of the output and their meaning.
///
/// Levels: a source of level L at the listener has the same total energy in all layouts: the sum over both ears in
/// [`Self::Binaural`], over all loudspeakers, and of the omnidirectional channel in Ambisonics. It is that of two ears in a
/// diffuse field: a sample of 1 at 1 m has the energy 2.
///
/// Directions are relative to the listener's orientation, in Ambisonics too. For a scene that a head tracker turns later,
/// keep the listener's orientation fixed.
///
/// ```
/// use foresound::Layout;
///
/// assert_eq!(Layout::Surround714.channels(), 12);
/// assert_eq!("7.1.4".parse::<Layout>()?, Layout::Surround714);
/// # Ok::<(), foresound::Error>(())
/// ```
///
/// References: directions of loudspeakers \[BS2051\]; Ambisonics channels in the order ACN with SN3D normalisation
/// \[NACHBAR11\].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum Layout {
    /// Left and right ear through an HRTF set, for headphones.
    #[default]
    Binaural,
    /// Left and right by amplitude panning, for loudspeakers, such as those of a phone.
    Stereo,
    /// One channel; in an output of more channels the first two have it equally.
    Mono,
    /// Left, right, centre, LFE (silent), left and right surround at 110 degrees.
    Surround51,
    /// Left, right, centre, LFE (silent), left and right back at 135 degrees, left and right side at 90 degrees.
    Surround71,
    /// [`Self::Surround71`], then top front left and right and top back left and right.
    Surround714,
    /// Ambisonics of order 1 as AmbiX: W, Y, Z, X.
    Ambisonics1,
    /// Ambisonics of order 2 as AmbiX: nine channels.
    Ambisonics2,
    /// Ambisonics of order 3 as AmbiX: sixteen channels.
    Ambisonics3,
}

impl Layout {
    /// All layouts.
    pub const ALL: [Self; 9] = [
        Self::Binaural,
        Self::Stereo,
        Self::Mono,
        Self::Surround51,
        Self::Surround71,
        Self::Surround714,
        Self::Ambisonics1,
        Self::Ambisonics2,
        Self::Ambisonics3,
    ];

    /// Number of channels.
    pub const fn channels(self) -> usize {
        match self {
            Self::Mono => 1,
            Self::Binaural | Self::Stereo => 2,
            Self::Ambisonics1 => 4,
            Self::Surround51 => 6,
            Self::Surround71 => 8,
            Self::Ambisonics2 => 9,
            Self::Surround714 => 12,
            Self::Ambisonics3 => 16,
        }
    }

    /// The order of an Ambisonics layout.
    pub const fn ambisonics_order(self) -> Option<usize> {
        match self {
            Self::Ambisonics1 => Some(1),
            Self::Ambisonics2 => Some(2),
            Self::Ambisonics3 => Some(3),
            _ => None,
        }
    }

    /// Name: `binaural`, `stereo`, `mono`, `5.1`, `7.1`, `7.1.4`, `ambix1`, `ambix2` or `ambix3`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Binaural => "binaural",
            Self::Stereo => "stereo",
            Self::Mono => "mono",
            Self::Surround51 => "5.1",
            Self::Surround71 => "7.1",
            Self::Surround714 => "7.1.4",
            Self::Ambisonics1 => "ambix1",
            Self::Ambisonics2 => "ambix2",
            Self::Ambisonics3 => "ambix3",
        }
    }

    /// Positions of the channels as in the mask of a WAV file; 0 where the channels are no loudspeakers.
    pub const fn wav_mask(self) -> u32 {
        match self {
            Self::Binaural | Self::Stereo => 0x3,
            Self::Mono => 0x4,
            Self::Surround51 => 0x3f,
            Self::Surround71 => 0x63f,
            Self::Surround714 => 0x2d63f,
            Self::Ambisonics1 | Self::Ambisonics2 | Self::Ambisonics3 => 0,
        }
    }

    /// Checks that an output of `channels` channels has room for the layout.
    ///
    /// # Errors
    /// [`Error::Setting`] for fewer channels than the layout has.
    pub(crate) fn check_channels(self, channels: usize) -> Result<()> {
        let needed = self.channels();
        if needed <= channels {
            return Ok(());
        }
        let problem = format!("{self} has {needed} channels, but the output has {channels}");
        let advice =
            "choose a layout with at most that many, or make the engine with more channels";
        Err(Error::setting("layout", problem, advice))
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl FromStr for Layout {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let named = Self::ALL.into_iter().find(|layout| layout.name() == name);
        named.ok_or_else(|| {
            let problem = format!("there is no layout \"{name}\"");
            let names = Self::ALL.map(Self::name).join(", ");
            Error::setting("layout", problem, &format!("choose one of {names}"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_have_as_many_bits_as_channels() {
        for layout in Layout::ALL {
            let bits = layout.wav_mask().count_ones() as usize;
            assert!(bits == 0 || bits == layout.channels(), "{layout}");
            assert_eq!(layout.name().parse::<Layout>().unwrap(), layout);
        }
        assert!("9.1".parse::<Layout>().is_err());
    }

    #[test]
    fn an_output_with_too_few_channels_is_refused() {
        assert!(Layout::Surround51.check_channels(2).is_err());
        assert!(Layout::Mono.check_channels(2).is_ok());
    }
}
