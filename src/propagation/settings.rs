//! Settings of the propagation stage.

use super::path::{MAX_DIFFRACTION_ORDER, MAX_ORDER};
use crate::error::{Error, Result};

/// Settings of a propagator: rays, orders, caches.
///
/// ```
/// use foresound::PropagationSettings;
///
/// // Half of the rays, and no diffraction.
/// let settings = PropagationSettings {
///     guide_rays: 512,
///     source_rays: 64,
///     diffraction_order: 0,
///     ..PropagationSettings::default()
/// };
/// assert_eq!(settings.depth, 4);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PropagationSettings {
    /// Guide rays of each of sixteen rotations, 1 to 65,536: cast when the listener enters another cell of two metres, at most
    /// two rotations an update. The paper: 1,024.
    pub guide_rays: u32,
    /// Source rays of each source, 1 to 65,536. The paper: 128.
    pub source_rays: u32,
    /// Highest reflection order, 0 to [`MAX_ORDER`]. The paper: 4.
    pub depth: usize,
    /// Seed of the rays' rotations and diffuse bounces.
    pub seed: u64,
    /// Updates for which a sequence stays a candidate after it was valid.
    pub cache_updates: u64,
    /// Valid sequences kept for each source, 1 to 65,536.
    pub cache_capacity: usize,
    /// Distance in metres below which the level is constant, above 0. Sources may have their own.
    pub min_distance_m: f32,
    /// Most edges that one path is diffracted at, 0 (no diffraction) to [`MAX_DIFFRACTION_ORDER`].
    pub diffraction_order: usize,
}

impl Default for PropagationSettings {
    fn default() -> Self {
        Self {
            guide_rays: 1024,
            source_rays: 128,
            depth: MAX_ORDER,
            seed: 1,
            cache_updates: 16,
            cache_capacity: 2048,
            min_distance_m: 0.3,
            diffraction_order: MAX_DIFFRACTION_ORDER,
        }
    }
}

impl PropagationSettings {
    pub(super) fn check(&self) -> Result<()> {
        let range = |name: &str, value: u64, low: u64, high: u64| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            let problem = format!("{value} is outside {low} to {high}");
            Err(Error::setting(
                name,
                problem,
                "choose a value in that range",
            ))
        };
        range("guide_rays", self.guide_rays.into(), 1, 65_536)?;
        range("source_rays", self.source_rays.into(), 1, 65_536)?;
        range("depth", self.depth as u64, 0, MAX_ORDER as u64)?;
        range(
            "diffraction_order",
            self.diffraction_order as u64,
            0,
            MAX_DIFFRACTION_ORDER as u64,
        )?;
        range("cache_capacity", self.cache_capacity as u64, 1, 65_536)?;
        if self.min_distance_m.is_finite() && self.min_distance_m > 0.0 {
            return Ok(());
        }
        let problem = format!("{} is no distance", self.min_distance_m);
        Err(Error::setting(
            "min_distance_m",
            problem,
            "give metres above zero",
        ))
    }
}
