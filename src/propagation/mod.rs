//! SPS: the sound propagation stage. Rays suggest surfaces, mirrored sources turn a list of surfaces into one exact
//! path, validation throws out what something blocks.
//!
//! Runs on one thread that the caller owns (none of its own), takes a committed [`crate::scene::Scene`] and poses,
//! gives a [`PathSet`]. Follows the paper's section III-A and [TAYLOR12]; differs in that paths are found in merged
//! surfaces and named by canonical sequences, and that valid sequences are remembered for sixteen updates.

pub mod amplitude;
pub mod diffraction;
pub mod direct;
pub mod discovery;
pub mod image_source;
pub mod late;
pub mod path;
pub mod sampling;
pub mod sequence;
pub mod update;

pub use path::{LateSource, MAX_BENDS, MAX_ORDER, Path, PathId, PathSet};
pub use update::{PropagationSettings, Propagator};
