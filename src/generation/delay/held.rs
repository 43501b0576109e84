//! Gains of bands that are held while they change little.
//!
//! Audio side; arithmetic. A stretch begins at every multiple of [`STRETCH_TILES`] tiles of a source's time, so what is mixed does
//! not depend on how it is divided into blocks. Gains that grow with every frame cost as much as mixing the bands.

use crate::generation::delay::delay_line::TILE;
use crate::simd::F32x8;

/// Tiles of a stretch.
pub(crate) const STRETCH_TILES: usize = 8;

/// Frames from the beginning of a stretch to its middle, where its gains are exact.
pub(crate) const MIDDLE: f32 = 0.5 * ((STRETCH_TILES * TILE) as f32 - 1.0);

/// Largest deviation of held gains from the exact ramp, relative to the root sum of the squares of all bands: −60 dB.
const HELD_ERROR: f32 = 1e-3;

/// Tiles between the beginning of a stretch and a position where a tile begins.
pub(crate) fn tiles_passed(position: i64) -> usize {
    (position.div_euclid(TILE as i64)).rem_euclid(STRETCH_TILES as i64) as usize
}

/// Whether gains with this growth per frame may be held until they are the target.
pub(crate) fn is_exact(growth: &F32x8, target: &F32x8) -> bool {
    let (growth, size) = ((*growth * *growth).sum(), (*target * *target).sum());
    MIDDLE * MIDDLE * growth <= HELD_ERROR * HELD_ERROR * size
}
