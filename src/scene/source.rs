//! Properties of a source: directivity, radius, effects.
//!
//! Small and `Copy`: part of the pose, which every stage receives.

use glam::Vec3;

use super::directivity::Directivity;

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

/// Properties of a source other than its pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct SourceSettings {
    /// Level by direction.
    pub directivity: Directivity,
    /// Distance in metres below which the level is constant; `None` for that of the propagation settings.
    pub radius_m: Option<f32>,
    /// Effects that are computed.
    pub effects: Effects,
}

impl SourceSettings {
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
