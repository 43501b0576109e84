//! What comes before and after propagation in an update, whoever drives it: the offline renderer on its virtual clock, the
//! engine's worker by the measured time of its updates.
//!
//! Control side. [`update_pipeline::UpdatePipeline`] takes poses as they come, computes an update for the poses at which it
//! will be used, and prepares it for the predictor. No thread, no clock.

pub(crate) mod expected_listener;
pub(crate) mod jump_watch;
pub(crate) mod jumps;
pub(crate) mod line_lengths;
pub(crate) mod loudest_paths;
pub(crate) mod motion_model;
pub(crate) mod pose_history;
pub(crate) mod pose_prediction;
pub(crate) mod update_pipeline;
pub(crate) mod update_timing;
