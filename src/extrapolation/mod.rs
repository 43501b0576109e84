//! EPS: the extrapolation stage. For every graphics frame it says how loud, how late and from where each path is now.
//!
//! Runs on the sound thread: bounded by the number of paths, and by one ray cast a source for the direct path. Takes
//! [`crate::propagation::PathSet`]s as they arrive, gives [`FramePaths`]. Follows the paper's sections III-C to III-E.

pub mod best;
pub mod effort;
pub mod extrapolator;
pub mod frame;
mod frame_steps;
pub mod hold;
pub mod level;
pub mod linear;
pub mod posed;
pub mod predictor;
pub mod tracking;

pub use best::{BestSettings, Groundwork, Lead};
pub use effort::Effort;
pub use extrapolator::{Continuation, Extrapolator};
pub use frame::{FramePath, FramePaths, LATE_STEPS, LateSend};
pub use frame_steps::Part;
pub use level::extrapolation_level;
pub use posed::PosedScenes;
pub use predictor::{FrameContext, Predictor, PredictorKind, TrackedPath};
