//! What a predictor is: the rule by which a path is continued between two updates.

use super::frame::FramePath;
use crate::extrapolation::geometric::{GeometricSettings, PredictionTarget};
use crate::propagation::Path;
use crate::scene::{ListenerPose, Scene};

/// A path of the newest update, with the same path in the one before if it was there.
#[derive(Debug, Clone, Copy)]
pub struct TrackedPath<'a> {
    /// As of the newest update.
    pub current: &'a Path,
    /// As of the update before; `None` for a new path and before a pair of updates is there.
    pub previous: Option<&'a Path>,
    /// The listener that the newest update was computed for.
    pub listener: &'a ListenerPose,
}

/// The graphics frame that is predicted for.
#[derive(Debug, Clone, Copy)]
pub struct FrameContext<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The listener now.
    pub listener: &'a ListenerPose,
    /// Graphics frames since the newest update arrived: 0 in the frame it arrives, k + 1 in the paper's frame k.
    pub frames_since_update: u32,
    /// Target extrapolation level L of this interval.
    pub level: u32,
}

/// Continues reflected paths between updates. Direct paths never pass here: they are validated every frame.
///
/// # Real-time
/// On the sound thread, once a path and graphics frame: no allocation, lock or system call.
pub trait Predictor: Send {
    /// The path as it stands in the frame of `at`.
    fn predict(&mut self, path: &TrackedPath<'_>, at: &FrameContext<'_>) -> FramePath;
}

/// The predictors there are, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PredictorKind {
    /// Zero-order hold: everything stays as the newest update has it.
    Hold,
    /// The paper, literally: amplitudes by Eq. 2 to 4.
    #[default]
    Linear,
    /// Ours: exact geometry in every graphics frame, visibility by a few rays. See [`crate::extrapolation::geometric`].
    Geometric(GeometricSettings),
}

impl PredictorKind {
    /// All of them.
    pub const ALL: [Self; 3] = [
        Self::Hold,
        Self::Linear,
        Self::Geometric(GeometricSettings::FULL),
    ];

    /// The name that the command line uses.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Linear => "linear",
            Self::Geometric(_) => "best",
        }
    }

    /// The same with a cost that a sound thread can bear in every graphics frame.
    pub(crate) fn thrifty(self) -> Self {
        match self {
            Self::Geometric(settings) => Self::Geometric(settings.thrifty()),
            Self::Hold | Self::Linear => self,
        }
    }

    /// Whether this predictor wants updates to name paths nearby ([`crate::propagation::PathSet::nearby`]).
    pub fn wants_nearby(self) -> bool {
        matches!(self, Self::Geometric(settings) if settings.nearby)
    }

    /// The poses that this predictor wants updates to be computed for.
    pub fn lead(self) -> PredictionTarget {
        match self {
            Self::Hold | Self::Linear => PredictionTarget::None,
            Self::Geometric(settings) => settings.lead,
        }
    }
}

/// The path exactly as an update has it: delay and direction as of then. What the paper leaves to every predictor.
pub(super) fn as_of_update(path: &Path, listener: &ListenerPose, scene: &Scene) -> FramePath {
    heard_from(path.image, path.length_m, path, listener, scene)
}

/// A path of an update, but from where it is seen and as long as it is now, in metres.
#[inline]
pub(super) fn heard_from(
    image: glam::Vec3,
    length_m: f32,
    path: &Path,
    listener: &ListenerPose,
    scene: &Scene,
) -> FramePath {
    let ahead = || listener.orientation * glam::Vec3::NEG_Z;
    FramePath {
        id: path.id,
        source: path.source,
        order: path.order,
        amplitude: path.amplitude,
        delay_s: f64::from(length_m) / scene.speed_of_sound_m_s(),
        arrival: (image - listener.position)
            .try_normalize()
            .unwrap_or_else(ahead),
    }
}
