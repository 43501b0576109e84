//! The words of acoustics: bands, the medium, materials.
//!
//! Takes nothing of ours; pure functions and plain data, usable from any thread.

pub mod bands;
pub mod material;
pub mod medium;

pub use bands::{BANDS, BandArray};
pub use material::Material;
pub use medium::Medium;
