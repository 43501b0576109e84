//! Predictors: rules that continue paths between two updates.

use super::frame::FramePath;
use crate::extrapolation::geometric::{GeometricSettings, PredictionTarget};
use crate::propagation::Path;
use crate::scene::{ListenerPose, Scene};

/// A path of the newest update, and the same path in the update before.
#[derive(Debug, Clone, Copy)]
pub struct TrackedPath<'a> {
    /// As of the newest update.
    pub current: &'a Path,
    /// As of the update before; `None` for a new path and before the second update.
    pub previous: Option<&'a Path>,
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

/// Continues paths one by one. Paths of the direct field are computed anew in every frame and not predicted.
///
/// # Real-time
/// On the sound thread, once a path and graphics frame: no allocation, lock or system call.
pub trait Predictor: Send {
    /// The path in the frame of `at`.
    fn predict(&mut self, path: &TrackedPath<'_>, at: &FrameContext<'_>) -> FramePath;
}

/// The available predictors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PredictorKind {
    /// Zero-order hold: every path stays as the newest update has it.
    Hold,
    /// The paper's: amplitudes by Eq. 2 to 4.
    #[default]
    Linear,
    /// Own: exact geometry in every graphics frame, visibility by a few rays. See `geometric`.
    Geometric(GeometricSettings),
}

impl PredictorKind {
    /// All of them.
    pub const ALL: [Self; 3] = [
        Self::Hold,
        Self::Linear,
        Self::Geometric(GeometricSettings::FULL),
    ];

    /// Its name on the command line and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Linear => "linear",
            Self::Geometric(_) => "best",
        }
    }

    /// The same at a cost for the sound thread.
    pub(crate) fn reduced(self) -> Self {
        match self {
            Self::Geometric(settings) => Self::Geometric(settings.reduced()),
            Self::Hold | Self::Linear => self,
        }
    }

    /// Whether updates have to list nearby paths ([`crate::propagation::PathSet::nearby`]).
    pub fn uses_nearby(self) -> bool {
        matches!(self, Self::Geometric(settings) if settings.nearby)
    }

    /// The listener position that updates are computed for.
    pub fn prediction_target(self) -> PredictionTarget {
        match self {
            Self::Hold | Self::Linear => PredictionTarget::None,
            Self::Geometric(settings) => settings.prediction_target,
        }
    }
}
