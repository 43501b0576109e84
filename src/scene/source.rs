//! Properties of a source: directivity, radius, extent, effects.
//!
//! Small and `Copy`: part of the pose, which every stage receives.

use glam::Vec3;

use super::directivity::Directivity;
use super::source_mix::SourceMix;
use crate::error::{Error, Result};

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

/// Most points of a wide source.
pub const MAX_EXTENT_POINTS: usize = 32;

/// Fewest points of a wide source.
pub(super) const MIN_EXTENT_POINTS: usize = 4;

/// Longest semi-axis of a source in metres.
const MAX_EXTENT_M: f32 = 1e3;

/// Size of a source: an ellipsoid around its position, which turns with it. The default is a point.
///
/// A wide source is heard as points on the ellipsoid that sound independently. Each has a straight path and edge waves of its own;
/// their mean energy is the level of the direct sound, and their directions its image. A share of the points may be hidden, so
/// the source fades while a listener walks past an edge. Reflections have the mean level of all points, the nearest ones their image as
/// well, and are hidden where that of the centre is. The late reverb is that of all points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SourceExtent {
    /// Semi-axes in metres along the source's +x, +y and +z, 0 to 1000. Three equal ones are a sphere, two a disc, one a line
    /// such as a river; all 0 a point.
    pub semi_axes_m: Vec3,
    /// Number of points, 4 to [`MAX_EXTENT_POINTS`]: two rays each in every graphics frame, and as many edge waves as a source.
    pub points: usize,
}

impl SourceExtent {
    /// A point.
    pub const POINT: Self = Self {
        semi_axes_m: Vec3::ZERO,
        points: 16,
    };

    /// A sphere of this radius in metres.
    pub const fn sphere(radius_m: f32) -> Self {
        Self {
            semi_axes_m: Vec3::splat(radius_m),
            ..Self::POINT
        }
    }

    /// Whether the source has a size.
    pub fn is_wide(&self) -> bool {
        self.semi_axes_m != Vec3::ZERO
    }

    fn check(&self) -> Result<()> {
        let axes = self.semi_axes_m.to_array();
        if let Some(axis) = axes.iter().find(|m| !(0.0..=MAX_EXTENT_M).contains(*m)) {
            let problem = format!("a semi-axis of {axis} m is out of range");
            let advice = "choose values from 0 to 1000 m; a point has 0 in all axes";
            return Err(Error::setting("extent", problem, advice));
        }
        if !(MIN_EXTENT_POINTS..=MAX_EXTENT_POINTS).contains(&self.points) {
            let problem = format!("{} points are out of range", self.points);
            return Err(Error::setting("extent", problem, "choose 4 to 32 points"));
        }
        Ok(())
    }
}

impl Default for SourceExtent {
    fn default() -> Self {
        Self::POINT
    }
}

/// Properties of a source other than its pose.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SourceSettings {
    /// Level by direction.
    pub directivity: Directivity,
    /// Distance in metres below which the level is constant; `None` for that of the propagation settings.
    pub radius_m: Option<f32>,
    /// Size of the source.
    pub extent: SourceExtent,
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
            extent: SourceExtent::POINT,
            effects: Effects::default(),
            mix: SourceMix::PHYSICAL,
            is_2d: false,
            priority: DEFAULT_PRIORITY,
        }
    }
}

impl SourceSettings {
    /// Checks the ranges of extent and mix; other values out of range count as the nearest valid one.
    ///
    /// # Errors
    /// [`Error::Setting`] names the value out of range.
    pub fn check(&self) -> Result<()> {
        self.extent.check()?;
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
