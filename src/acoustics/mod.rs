//! Acoustic quantities: octave bands, the medium, materials.
//!
//! Pure functions and plain data. Any thread.

pub mod bands;
pub mod material;
pub mod medium;

pub use bands::{BANDS, BandArray};
pub use material::Material;
pub use medium::Medium;

/// Cubic smoothstep 3t² − 2t³ with `t` clamped to 0..1.
pub(crate) fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
