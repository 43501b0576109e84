//! The baked format of HRTF sets (layout in assets/hrtf/README.md), as it is written.

/// First bytes of a baked set.
pub(crate) const MAGIC: &[u8; 8] = b"FSHRTF1\0";

/// Grid of a set: equal steps of azimuth to the left from straight ahead, and of elevation from straight down to straight up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Directions {
    pub(crate) azimuths: usize,
    pub(crate) elevations: usize,
}

/// The values of a baked set.
#[derive(Debug)]
pub(crate) struct BakedSet {
    pub(crate) rate_hz: u32,
    pub(crate) taps: usize,
    pub(crate) components: usize,
    pub(crate) directions: Directions,
    /// Filter after filter.
    pub(crate) basis: Vec<f32>,
    /// By elevation, azimuth and ear: the delay in seconds, then the weights.
    pub(crate) ears: Vec<f32>,
}

impl BakedSet {
    /// The content of the file.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let Directions {
            azimuths,
            elevations,
        } = self.directions;
        let mut bytes = MAGIC.to_vec();
        bytes.extend(self.rate_hz.to_le_bytes());
        for size in [self.taps, self.components, azimuths, elevations] {
            bytes.extend((size as u32).to_le_bytes());
        }
        let values = self.basis.iter().chain(&self.ears);
        bytes.extend(values.flat_map(|value| value.to_le_bytes()));
        bytes
    }
}
