//! Image sources: candidate sequences, their cull, and the exact paths of those that are valid.
//!
//! [`discovery_history`] and [`expansion`] extend the sequences of the guide rays, `window_cull` rejects most of them in
//! single precision, `unfold_x4` unfolds the rest exactly, and `validation_queue` tests them for occlusion. Runs on the
//! threads of the propagation update. Sources: \[ALLEN79\], \[BORISH84\].

pub mod discovery_history;
pub mod expansion;
pub mod finite_panel;
mod hull;
pub mod image_path;
pub(crate) mod miss_distance;
pub(crate) mod nearby_gate;
pub(crate) mod occluder_cache;
pub mod sequence;
pub mod sequence_set;
pub(crate) mod unfold;
pub(crate) mod unfold_x4;
pub(crate) mod valid_cache;
pub(crate) mod validation_queue;
pub(crate) mod window_cull;
