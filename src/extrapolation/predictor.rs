//! Predictors: extrapolation of paths between two updates.

use glam::Vec3;

use super::frame::FramePath;
use crate::extrapolation::geometric::{GeometricSettings, PredictionTarget};
use crate::propagation::Path;
use crate::scene::{ListenerPose, Scene};

/// A path of the newest update, and the same path in the update before.
#[derive(Debug, Clone, Copy)]
pub struct TrackedPath<'a> {
    /// The path in the newest update.
    pub current: &'a Path,
    /// The path in the update before; `None` for a new path and before the second update.
    pub previous: Option<&'a Path>,
    /// The present position of its source.
    pub source: Vec3,
    /// The listener of the newest update.
    pub listener: &'a ListenerPose,
}

/// The graphics frame to predict.
#[derive(Debug, Clone, Copy)]
pub struct FrameContext<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The present listener.
    pub listener: &'a ListenerPose,
    /// Graphics frames since the newest update arrived: 0 in the frame of its arrival, k + 1 in the paper's frame k.
    pub frames_since_update: u32,
    /// Target extrapolation level L of this interval.
    pub level: u32,
}

/// Predicts paths separately. Paths of the direct field are computed in every frame and not predicted.
///
/// # Real-time
/// Runs on the sound thread, once per path and graphics frame: no allocation, lock or system call.
pub trait Predictor: Send {
    /// Predicts the path in the frame of `at`.
    fn predict(&mut self, path: &TrackedPath<'_>, at: &FrameContext<'_>) -> FramePath;
}

/// The available predictors. The command line, JSON and the pages on experiments call them by [`Self::name`]: `hold`, `linear` and, for
/// [`Self::Geometric`], `best`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PredictorKind {
    /// Zero-order hold: every path is unchanged from the newest update.
    Hold,
    /// The paper's predictor: amplitudes by Eq. 2 to 4.
    Linear,
    /// Own: exact geometry for the poses of graphics frames, visibility by a few rays. The default; `best` on the command line.
    Geometric(GeometricSettings),
}

impl Default for PredictorKind {
    fn default() -> Self {
        Self::Geometric(GeometricSettings::FULL)
    }
}

impl PredictorKind {
    /// All predictors.
    pub const ALL: [Self; 3] = [
        Self::Hold,
        Self::Linear,
        Self::Geometric(GeometricSettings::FULL),
    ];

    /// The name on the command line and in JSON: `best` for [`Self::Geometric`].
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Linear => "linear",
            Self::Geometric(_) => "best",
        }
    }

    /// A cheaper predictor, so many steps from geometric over linear to hold.
    pub(crate) fn lowered(self, steps: u8) -> Self {
        match (self, steps) {
            (kind, 0) => kind,
            (Self::Geometric(_), 1) => Self::Linear,
            _ => Self::Hold,
        }
    }

    /// Whether updates must list nearby paths ([`crate::propagation::PathSet::nearby`]).
    pub fn uses_nearby(self) -> bool {
        matches!(self, Self::Geometric(settings) if settings.nearby)
    }

    /// The listener position for which updates are computed.
    pub fn prediction_target(self) -> PredictionTarget {
        match self {
            Self::Hold | Self::Linear => PredictionTarget::None,
            Self::Geometric(settings) => settings.prediction_target,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hold_is_the_last_step_down() {
        let steps = |kind: PredictorKind| [0, 1, 2, 3].map(|steps| kind.lowered(steps).name());
        assert_eq!(
            steps(PredictorKind::default()),
            ["best", "linear", "hold", "hold"]
        );
        assert_eq!(
            steps(PredictorKind::Linear),
            ["linear", "hold", "hold", "hold"]
        );
    }
}
