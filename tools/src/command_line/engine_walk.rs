//! The engine on a virtual clock: a walk whose sounds begin after silent graphics frames, and its numbers.
//!
//! Quality stays at its highest: the budget would act on this machine's clock.

use std::sync::Arc;

use foresound::Result;
use foresound::runtime::engine::Statistics;
use foresound::runtime::{
    Controller, EngineSettings, Poses, QualityChoice, QualityLevel, VirtualClock, VirtualEngine,
};
use foresound::scene::{Scene, SourceId};

/// Silent graphics frames before the sounds begin: every source has its slot.
pub(crate) const LEAD_IN_FRAMES: u32 = 20;

/// An engine whose sources have sounded since its walk began.
pub(crate) struct EngineWalk {
    engine: VirtualEngine,
    ids: Vec<SourceId>,
    start_s: f64,
}

/// Adds the sources where they are at first and returns their handles.
pub(crate) fn add_sources(controller: &mut Controller, poses: &Poses) -> Result<Vec<SourceId>> {
    let sources = poses.sources.iter();
    sources
        .map(|pose| controller.add_source(pose.position))
        .collect()
}

/// Puts poses under the engine's handles.
pub(crate) fn give_handles(ids: &[SourceId], poses: &mut Poses) {
    for (pose, id) in poses.sources.iter_mut().zip(ids) {
        pose.id = *id;
    }
}

impl EngineWalk {
    /// An engine at the walk's first poses; `play` gives each source its sound.
    pub(crate) fn begin(
        mut settings: EngineSettings,
        clock: VirtualClock,
        scene: &Arc<Scene>,
        first: &Poses,
        play: impl FnOnce(&mut Controller, &[SourceId]) -> Result<()>,
    ) -> Result<Self> {
        settings.budget.quality = QualityChoice::Exactly(QualityLevel(0));
        let mut engine = VirtualEngine::new(settings, clock)?;
        engine.controller().set_scene(Arc::clone(scene))?;
        let ids = add_sources(engine.controller(), first)?;
        let mut poses = first.clone();
        give_handles(&ids, &mut poses);
        for _ in 0..LEAD_IN_FRAMES {
            engine.next_frame(poses.listener, &poses.sources, |_| ())?;
        }
        play(engine.controller(), &ids)?;
        Ok(Self {
            start_s: engine.time_s(),
            engine,
            ids,
        })
    }

    /// Time of the next graphics frame since the sounds began, in seconds.
    pub(crate) fn time_s(&self) -> f64 {
        self.engine.time_s() - self.start_s
    }

    /// One graphics frame at poses whose handles are replaced by the engine's.
    pub(crate) fn next_frame(&mut self, poses: &mut Poses, sink: impl FnMut(&[f32])) -> Result<()> {
        give_handles(&self.ids, poses);
        self.engine.next_frame(poses.listener, &poses.sources, sink)
    }

    pub(crate) fn statistics(&mut self) -> Statistics {
        self.engine.controller().statistics()
    }

    /// Audio frames of a block.
    pub(crate) fn block_frames(&self) -> usize {
        self.engine.renderer().block_frames()
    }
}

/// Numbers of each update of an engine.
#[derive(Default)]
pub(crate) struct Observed {
    pub(crate) updates: u64,
    pub(crate) levels: Vec<f64>,
    pub(crate) paths: Vec<usize>,
    pub(crate) rays: Vec<u64>,
}

impl Observed {
    /// Nothing yet; the engine has had so many updates.
    pub(crate) fn after(updates: u64) -> Self {
        Self {
            updates,
            ..Self::default()
        }
    }

    /// Adds the update in use, if it is a new one.
    pub(crate) fn add(&mut self, statistics: &Statistics) {
        if statistics.updates > self.updates {
            self.updates = statistics.updates;
            self.levels.push(statistics.extrapolation_level.into());
            self.paths.push(statistics.paths as usize);
            self.rays.push(statistics.rays);
        }
    }
}
