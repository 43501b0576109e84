//! SPS: the sound propagation stage. Rays suggest surfaces, mirrored sources turn a list of surfaces into one exact
//! path, validation throws out what something blocks.
//!
//! Runs on threads that the caller owns (none of its own; [`Workers`]), takes a committed [`crate::scene::Scene`] and poses,
//! gives a [`PathSet`]. Follows the paper's section III-A and \[TAYLOR12\]; differs in that paths are found in merged
//! surfaces and named by canonical sequences, and that valid sequences are remembered for sixteen updates.

pub mod amplitude;
pub mod diffraction;
pub mod diffuse;
pub mod endpoints;
pub mod image_source;
pub mod path;
pub mod propagator;
pub mod quality_level;
pub mod rays;
mod scene_revision;
pub mod settings;
mod source_task;
pub mod transmission;
pub mod workers;

pub use crate::propagation::propagator::Propagator;
pub use crate::propagation::quality_level::PropagationQuality;
pub use path::{
    LATE_SEGMENTS, LateEnergy, MAX_DIFFRACTION_ORDER, MAX_ORDER, Path, PathId, PathSet,
};
pub use settings::PropagationSettings;
pub use workers::{MOST_WORKERS, Serial, Workers};
