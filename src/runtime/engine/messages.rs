//! What the engine's threads tell each other.

use std::sync::Arc;

use crate::extrapolation::{
    Extrapolator, PredictorKind, PredictorState, PreparedUpdate, ScenePair,
};
use crate::propagation::{MAX_ORDER, PathSet};
use crate::runtime::budget::Budget;
use crate::scene::{InstancePose, ListenerPose, Scene, SourceId, SourcePose};

use crate::runtime::engine::sample_source::SampleSource;

/// A slot that is none: the source is not heard.
pub(super) const NO_SLOT: u16 = u16::MAX;

/// Where a source's sound goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SourceRoute {
    /// The app's source.
    pub(super) id: SourceId,
    /// The generator's slot, or [`NO_SLOT`].
    pub(super) slot: u16,
    pub(super) gain: f32,
}

/// One graphics frame for the renderer: the newest counts. It is the whole truth about which sources there are.
#[derive(Debug, Default)]
pub(super) struct AudioFrame {
    pub(super) listener: ListenerPose,
    /// What has a slot of the generator's: a source each, unless sources share slots.
    pub(super) sources: Vec<SourcePose>,
    /// Where instances stand.
    pub(super) instances: Vec<InstancePose>,
    /// Every source's sound, in the order of their handles' slots.
    pub(super) routes: Vec<SourceRoute>,
    pub(super) paused: bool,
    /// The app's graphics frames so far.
    pub(super) ticks: u64,
    /// Whether this is a graphics frame, or the last one again because something else changed.
    pub(super) is_new: bool,
}

impl AudioFrame {
    pub(super) fn with_capacity(sources: usize, slots: usize) -> Self {
        Self {
            sources: Vec::with_capacity(slots),
            routes: Vec::with_capacity(sources),
            ..Self::default()
        }
    }
}

/// Poses for propagation: the newest count.
#[derive(Debug)]
pub(super) struct WorldFrame {
    pub(super) listener: ListenerPose,
    pub(super) sources: Vec<SourcePose>,
    /// The scene with all its instances, wherever they stood when one was added or removed last.
    pub(super) scene: Arc<Scene>,
    /// Where instances stand.
    pub(super) instances: Vec<InstancePose>,
    pub(super) predictor: PredictorKind,
    pub(super) budget: Budget,
    /// Seconds since the engine began.
    pub(super) time_s: f64,
}

/// One propagation update on its way to the renderer, and what it brings along. The renderer puts what it replaces in
/// the same box, which travels back.
#[derive(Default)]
pub(super) struct UpdateMessage {
    pub(super) paths: PathSet,
    /// What the predictor would otherwise have to work out of them.
    pub(super) prepared: PreparedUpdate,
    /// Time that the update took, T_SPS, in seconds, and the rest after it.
    pub(super) interval_s: f64,
    /// Gain of each order of reflection under the budget.
    pub(super) order_gain: [f32; MAX_ORDER + 1],
    /// Whether the update was computed within its graphics frame.
    pub(super) synchronous: bool,
    /// Extrapolation for another scene, to be used from this update on.
    pub(super) extrapolator: Option<Box<Extrapolator>>,
    /// The scene with other instances, to be used from this update on.
    pub(super) scenes: Option<ScenePair>,
    /// Another predictor, to be used from this update on.
    pub(super) predictor: Option<PredictorState>,
}

/// A source's new sound.
pub(super) struct SampleSourceChange {
    pub(super) id: SourceId,
    pub(super) source: SampleSource,
}
