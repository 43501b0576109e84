//! SPS: the sound propagation stage. Rays suggest surfaces, mirrored sources turn a list of surfaces into one exact
//! path, validation throws out what something blocks.
//!
//! Runs on threads that the caller owns (none of its own; [`Workers`]), takes a committed [`crate::scene::Scene`] and poses,
//! gives a [`PathSet`]. Follows the paper's section III-A and \[TAYLOR12\]; differs in that paths are found in merged
//! surfaces and named by canonical sequences, and that valid sequences are remembered for sixteen updates.

pub mod amplitude;
mod beginnings;
mod cache;
mod candidates;
pub mod diffraction;
pub mod direct;
pub mod discovery;
pub mod effort;
mod few_sources;
pub mod finite_panel;
mod four;
pub mod guide_memory;
pub mod image_source;
pub mod late;
pub mod neighbours;
mod occluders;
pub mod path;
pub mod sampling;
mod scene_state;
pub mod sequence;
pub mod sequence_set;
pub mod settings;
mod side_by_side;
mod source_task;
pub mod update;
mod waiting;
pub mod workers;

pub use effort::Effort;
pub use path::{LATE_STEPS, LateSource, MAX_BENDS, MAX_ORDER, Path, PathId, PathSet};
pub use settings::PropagationSettings;
pub use update::Propagator;
pub use workers::{MOST_WORKERS, Serial, Workers};
