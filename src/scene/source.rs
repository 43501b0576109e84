//! What a source is like: where it sends its sound to, how large it is, and which parts of its sound are wanted.
//!
//! Small and `Copy`, so that it travels with the pose and every stage sees the same.

use glam::Vec3;

use super::directivity::Directivity;

/// Which parts of a source's sound are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effects {
    /// The direct path.
    pub direct: bool,
    /// Reflected paths.
    pub reflections: bool,
    /// Bending around edges.
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

/// Everything about a source but its place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SourceSettings {
    /// Where it sends its sound to.
    pub directivity: Directivity,
    /// Radius in metres within which it gets no louder; `None` as propagation's settings say.
    pub radius_m: Option<f32>,
    /// What is computed of it.
    pub effects: Effects,
}

impl SourceSettings {
    /// Radius in metres within which the source gets no louder, given what holds for sources that do not say.
    pub fn min_distance_m(&self, otherwise_m: f64) -> f64 {
        match self.radius_m {
            Some(radius_m) if radius_m.is_finite() && radius_m > 0.0 => f64::from(radius_m),
            _ => otherwise_m,
        }
    }
}

/// Front of a source that is not turned, as of a head.
pub(super) const FRONT: Vec3 = Vec3::NEG_Z;
