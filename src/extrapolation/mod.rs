//! EPS, the extrapolation stage: amplitude, delay and direction of every path in every graphics frame.
//!
//! Runs on the sound thread, bounded by the numbers of paths and rays. Input: [`crate::propagation::PathSet`]s as they
//! arrive; output: [`FramePaths`]. After the paper's sections III-C to III-E.

mod direct_lines;
pub mod extrapolator;
pub mod frame;
pub mod frame_effort;
mod frame_mix;
mod frame_steps;
pub mod geometric;
pub mod hold;
pub mod level;
mod line_extrapolation;
pub mod linear;
pub mod predictor;
pub mod scene_pair;
mod source_motion;
pub mod tracking;
mod wide_reflections;
pub mod work_budget;

pub(crate) use crate::extrapolation::direct_lines::MAX_DIRECT_PATHS;
pub use crate::extrapolation::geometric::{GeometricSettings, PredictionTarget, PreparedUpdate};
pub use crate::extrapolation::scene_pair::ScenePair;
pub(crate) use crate::extrapolation::wide_reflections::MAX_WIDE_REFLECTIONS;
pub use crate::extrapolation::work_budget::{Progress, WorkBudget};
pub use extrapolator::{Extrapolator, PredictorState};
pub use frame::{
    FramePath, FramePaths, LATE_DIRECTION_VECTORS, LATE_DIRECTIONS, LATE_GROUPS, LATE_SEGMENTS,
    LateGroup, LateSend, Obstruction, PathKind, WideArrival,
};
pub use frame_effort::FrameEffort;
pub use level::extrapolation_level;
pub use predictor::{FrameContext, Predictor, PredictorKind, TrackedPath};
