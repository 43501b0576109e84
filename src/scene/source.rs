//! Properties of a source: directivity, radius, effects.
//!
//! Small and `Copy`: part of the pose, which every stage receives.

use glam::Vec3;

use super::directivity::Directivity;
use super::source_mix::SourceMix;
use crate::error::Result;

/// Parts of a source's sound that are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effects {
    /// The direct path.
    pub direct: bool,
    /// Reflected paths.
    pub reflections: bool,
    /// Diffraction at edges.
    pub diffraction: bool,
    /// The direct path through walls.
    pub transmission: bool,
    /// The late reverb.
    pub late: bool,
}

impl Default for Effects {
    /// All.
    fn default() -> Self {
        Self {
            direct: true,
            reflections: true,
            diffraction: true,
            transmission: true,
            late: true,
        }
    }
}

/// Priority of a source unless set.
pub const DEFAULT_PRIORITY: u8 = 128;

/// Properties of a source other than its pose.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SourceSettings {
    /// Level by direction.
    pub directivity: Directivity,
    /// Distance in metres below which the level is constant; `None` for that of the propagation settings.
    pub radius_m: Option<f32>,
    /// Effects that are computed.
    pub effects: Effects,
    /// Distance curve, gains of the parts, strengths.
    pub mix: SourceMix,
    /// Whether the source is heard without a position, such as music and the sounds of an interface: no propagation, no
    /// HRTF, no late reverb. Stereo clips keep their channels. It takes no slot.
    pub is_2d: bool,
    /// Priority, 0 to 255, [`DEFAULT_PRIORITY`] unless set. With more sources than slots, those of higher priority get
    /// slots of their own first.
    pub priority: u8,
}

impl Default for SourceSettings {
    fn default() -> Self {
        Self {
            directivity: Directivity::OMNI,
            radius_m: None,
            effects: Effects::default(),
            mix: SourceMix::PHYSICAL,
            is_2d: false,
            priority: DEFAULT_PRIORITY,
        }
    }
}

impl SourceSettings {
    /// Checks the ranges of the mix; other values out of range count as the nearest valid one.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) names the value out of range.
    pub fn check(&self) -> Result<()> {
        self.mix.check()
    }

    /// Distance in metres below which the level is constant, or `otherwise_m` if the source has none.
    pub fn min_distance_m(&self, otherwise_m: f64) -> f64 {
        match self.radius_m {
            Some(radius_m) if radius_m.is_finite() && radius_m > 0.0 => f64::from(radius_m),
            _ => otherwise_m,
        }
    }
}

/// Front of a source and of a head without rotation.
pub(super) const FRONT: Vec3 = Vec3::NEG_Z;
