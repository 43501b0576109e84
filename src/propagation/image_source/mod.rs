//!

pub(crate) mod direct_validation;
pub mod discovery_history;
pub mod expansion;
pub mod finite_panel;
pub mod image_path;
pub(crate) mod occluder_cache;
pub mod sequence;
pub mod sequence_set;
pub(crate) mod unfold_x4;
pub(crate) mod valid_cache;
pub(crate) mod validation_queue;
pub(crate) mod window_cull;
