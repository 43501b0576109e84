//! SPS: the sound propagation stage. Rays suggest surface sequences, image sources turn a sequence into one exact path, and
//! validation rejects occluded paths.
//!
//! Runs on threads that the caller owns ([`Workers`]). Input: a committed [`crate::scene::Scene`] and poses. Output: a
//! [`PathSet`]. Follows the paper's section III-A and \[TAYLOR12\]. Own: paths are found in merged surfaces and identified by
//! canonical sequences, and valid sequences stay candidates for sixteen updates.

pub mod amplitude;
pub mod curved_reflection;
pub mod diffraction;
pub mod diffuse;
pub mod endpoints;
pub mod image_source;
pub mod late_group;
pub mod path;
pub mod propagator;
pub mod quality_level;
pub mod rays;
mod scene_revision;
pub mod settings;
mod source_task;
pub mod transmission;
pub mod update_scope;
pub mod workers;

pub use crate::propagation::propagator::Propagator;
pub use crate::propagation::quality_level::PropagationQuality;
pub use late_group::{LATE_DIRECTION_VECTORS, LATE_DIRECTIONS, LATE_GROUPS, LateGroup};
pub use path::{
    EdgeLimits, LATE_SEGMENTS, LateEnergy, MAX_DIFFRACTION_ORDER, MAX_ORDER, Path, PathId, PathSet,
    ReflectionEdge,
};
pub use settings::PropagationSettings;
pub use update_scope::UpdateScope;
pub use workers::{MOST_WORKERS, Serial, Workers};
