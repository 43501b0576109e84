//! Messages between the engine's threads.

use std::sync::Arc;
use std::time::Instant;

use crate::extrapolation::{
    Extrapolator, PredictorKind, PredictorState, PreparedUpdate, ScenePair,
};
use crate::generation::{LongerLine, OutputStage};
use crate::propagation::{MAX_ORDER, PathSet};
use crate::runtime::budget::Budget;
use crate::runtime::pipeline::pose_history::PoseHistory;
use crate::scene::{InstancePose, ListenerPose, Scene, SourceId, SourcePose};

use crate::runtime::engine::playback::PlayState;
use crate::runtime::engine::sample_source::SampleSource;

/// No slot: the source is inaudible.
pub(super) const NO_SLOT: u16 = u16::MAX;

/// The bed of sources without a position, in place of a slot.
pub(super) const BED: u16 = u16::MAX - 1;

/// The slot and gain of a source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SourceRoute {
    /// The app's source.
    pub(super) id: SourceId,
    /// The generator's slot, [`BED`] or [`NO_SLOT`].
    pub(super) slot: u16,
    pub(super) gain: f32,
    /// Seconds in which the gain is reached; 0 for at once.
    pub(super) ramp_s: f32,
    pub(super) play: PlayState,
}

/// One graphics frame for the renderer, with all sources that exist; only the newest is used.
#[derive(Debug, Default)]
pub(super) struct AudioFrame {
    pub(super) listener: ListenerPose,
    /// Poses of further listeners.
    pub(super) others: Vec<ListenerPose>,
    /// Poses of the generator's slots.
    pub(super) sources: Vec<SourcePose>,
    /// Poses of all instances.
    pub(super) instances: Vec<InstancePose>,
    /// Routes of all sources, sorted by the index of their handles.
    pub(super) routes: Vec<SourceRoute>,
    pub(super) paused: bool,
    /// Number of ticks so far.
    pub(super) ticks: u64,
    /// Whether this is a new graphics frame, or the last one with other settings.
    pub(super) is_new: bool,
}

impl AudioFrame {
    pub(super) fn with_capacity(sources: usize, slots: usize, listeners: usize) -> Self {
        Self {
            others: vec![ListenerPose::default(); listeners - 1],
            sources: Vec::with_capacity(slots),
            routes: Vec::with_capacity(sources),
            ..Self::default()
        }
    }
}

/// Poses for propagation; only the newest are used.
#[derive(Debug)]
pub(super) struct WorldFrame {
    pub(super) listener: ListenerPose,
    /// Further listeners, and their positions as `recent`.
    pub(super) others: Vec<(ListenerPose, PoseHistory)>,
    pub(super) sources: Vec<SourcePose>,
    /// The scene with all its instances, at their poses when one was last added or removed.
    pub(super) scene: Arc<Scene>,
    /// Poses of all instances.
    pub(super) instances: Vec<InstancePose>,
    pub(super) predictor: PredictorKind,
    pub(super) budget: Budget,
    /// Seconds since the engine was made.
    pub(super) time_s: f64,
    /// When this was sent.
    pub(super) sent: Instant,
    /// Positions of this graphics frame and of those before it that propagation has not taken.
    pub(super) recent: PoseHistory,
}

/// One propagation update for the renderer, with replacements of other state. The renderer swaps the old state into the
/// same box, which travels back.
#[derive(Default)]
pub(super) struct UpdateMessage {
    pub(super) paths: PathSet,
    /// Values for the predictor, computed beforehand.
    pub(super) prepared: PreparedUpdate,
    /// Time of the update, T_SPS, plus the pause after it, in seconds.
    pub(super) interval_s: f64,
    /// Gain of each reflection order under the budget.
    pub(super) order_gain: [f32; MAX_ORDER + 1],
    /// Whether the update was computed within its graphics frame.
    pub(super) synchronous: bool,
    /// Extrapolator for another scene, used from this update on.
    pub(super) extrapolator: Option<Box<Extrapolator>>,
    /// The scene with other instances, used from this update on.
    pub(super) scenes: Option<ScenePair>,
    /// Another predictor, used from this update on.
    pub(super) predictor: Option<PredictorState>,
    /// More of the delay lines of sources whose paths are longer than those so far.
    pub(super) lines: Vec<LongerLine>,
    /// Paths and replacements for further listeners.
    pub(super) others: Vec<ListenerUpdate>,
}

/// What an update has for a further listener.
#[derive(Default)]
pub(super) struct ListenerUpdate {
    pub(super) paths: PathSet,
    pub(super) prepared: PreparedUpdate,
    pub(super) extrapolator: Option<Box<Extrapolator>>,
    pub(super) scenes: Option<ScenePair>,
    pub(super) predictor: Option<PredictorState>,
}

impl ListenerUpdate {
    /// Takes over what came with an update that nobody took.
    pub(super) fn take_missed(&mut self, missed: &mut Self) {
        if self.extrapolator.is_none() {
            self.extrapolator = missed.extrapolator.take();
            self.scenes = self.scenes.take().or_else(|| missed.scenes.take());
        }
        if self.predictor.is_none() {
            self.predictor = missed.predictor.take();
        }
    }
}

impl UpdateMessage {
    /// Whether a scene, an extrapolator or a predictor travels with it.
    pub(super) fn has_replacements(&self) -> bool {
        self.extrapolator.is_some() || self.scenes.is_some() || self.predictor.is_some()
    }
}

/// Another output for the renderer: voices, plane waves and buses of a layout or HRTF set, for each listener. The old ones travel
/// back in the same box when they are silent.
#[derive(Default)]
pub(super) struct OutputChange {
    pub(super) stages: Vec<Box<OutputStage>>,
}

/// New samples of a source.
pub(super) struct SampleSourceChange {
    pub(super) id: SourceId,
    pub(super) source: SampleSource,
}
