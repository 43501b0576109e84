//! What an engine is built for.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::extrapolation::PredictorKind;
use crate::generation::{GeneratorSettings, Hrtf};
use crate::propagation::PropagationSettings;
use crate::runtime::budget::Budget;
use crate::runtime::phone::DeviceHintsSettings;
use crate::runtime::threads::affinity::AffinityPolicy;
use crate::runtime::threads::workers::MAX_THREADS;

/// Most sources of an engine.
pub const MAX_SOURCES: usize = 4096;

/// When propagation runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EngineSchedule {
    /// Within every [`super::Controller::tick`], on the app's thread and its helpers ([`EngineSettings::tracing_threads`]):
    /// the baseline.
    Synchronous,
    /// On a thread of its own that never stops, on the newest poses; extrapolation fills the frames in between.
    #[default]
    Asynchronous,
}

/// How long a graphics frame is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum FrameTime {
    /// As long as the app's ticks are apart, measured.
    #[default]
    Measured,
    /// This many seconds, 0.001 to 1: for rendering faster or slower than real time.
    Fixed(f64),
}

/// Sizes, limits and choices of an engine.
#[derive(Debug, Clone)]
pub struct EngineSettings {
    /// Rate, slots for sources and everything else of the sound itself.
    pub generation: GeneratorSettings,
    /// Most sources that the app may add, 1 to [`MAX_SOURCES`]; `None` is one a slot of
    /// [`GeneratorSettings::max_sources`]. Where there are more sources than slots, the loudest at the listener have
    /// slots of their own, neighbours among the others share one, and the masked are not heard; cost grows with slots.
    pub max_sources: Option<usize>,
    /// Head-related set; `None` takes the built-in one for the rate.
    pub hrtf: Option<Arc<Hrtf>>,
    /// Audio frames a block, 32 to 4096.
    pub block_frames: usize,
    /// Most paths of one update that are kept, 1 to 16,384; beyond them the quietest are dropped and counted.
    pub max_paths: usize,
    /// Rays, depth and memory of propagation.
    pub propagation: PropagationSettings,
    /// Threads that trace an update of the synchronous schedule, the app's among them, 1 to [`MAX_THREADS`]. In the
    /// asynchronous schedule the propagation thread traces alone: the other core is the sound's.
    pub tracing_threads: usize,
    /// When propagation runs.
    pub schedule: EngineSchedule,
    /// How paths go on between updates.
    pub predictor: PredictorKind,
    /// Where threads run.
    pub affinity: AffinityPolicy,
    /// What may be spent; [`super::Controller::set_budget`] changes it.
    pub budget: Budget,
    /// Spans that each thread records until [`super::Controller::collect_spans`] takes them, to 2^20; 0 records none.
    pub trace_spans: usize,
    /// How long a graphics frame is.
    pub frame_time: FrameTime,
    /// Whether blocks are to take alike time. A graphics frame that is much work is then worked out over the blocks until
    /// the next one, an even share in each, and heard when it is done; and `best` works each path out in one frame of three
    /// and continues it in between. Otherwise the block that takes a frame does all of it.
    pub even_blocks: bool,
    /// What is asked of a phone's system, and told to it; nothing where it has no such functions.
    pub device_hints: DeviceHintsSettings,
    /// Most paths of an update that [`super::Controller::shown_paths`] gives, the loudest, to 16,384; 0 gives none.
    pub max_snapshot_paths: usize,
    /// Called before every update with its number, on the thread that computes it: a place for a profiler's mark. If it
    /// panics, propagation stops as it would for its own panic.
    pub before_update: Option<fn(u64)>,
}

impl Default for EngineSettings {
    /// Sixteen sources at 44.1 kHz in blocks of 256, and paths to 343 m: delay lines are most of an engine's memory.
    fn default() -> Self {
        Self {
            generation: GeneratorSettings {
                max_delay_s: 1.0,
                ..GeneratorSettings::default()
            },
            max_sources: None,
            hrtf: None,
            block_frames: 256,
            max_paths: 2048,
            propagation: PropagationSettings::default(),
            tracing_threads: 2,
            schedule: EngineSchedule::default(),
            predictor: PredictorKind::default(),
            affinity: AffinityPolicy::default(),
            budget: Budget::default(),
            trace_spans: 0,
            frame_time: FrameTime::default(),
            even_blocks: true,
            device_hints: DeviceHintsSettings::default(),
            max_snapshot_paths: 0,
            before_update: None,
        }
    }
}

impl EngineSettings {
    pub(super) fn check(&self) -> Result<()> {
        let range = |name: &str, value: usize, low: usize, high: usize| {
            if (low..=high).contains(&value) {
                return Ok(());
            }
            let problem = format!("{value} is outside {low} to {high}");
            let advice = "choose a value in that range";
            Err(Error::setting(name, problem, advice))
        };
        range("block_frames", self.block_frames, 32, 4096)?;
        range("max_paths", self.max_paths, 1, 16_384)?;
        range("trace_spans", self.trace_spans, 0, 1 << 20)?;
        range("shown_paths", self.max_snapshot_paths, 0, 16_384)?;
        if let Some(most_sources) = self.max_sources {
            range("most_sources", most_sources, 1, MAX_SOURCES)?;
        }
        self.budget.check()?;
        range("tracing_threads", self.tracing_threads, 1, MAX_THREADS)?;
        match self.frame_time {
            FrameTime::Fixed(seconds) if !(0.001..=1.0).contains(&seconds) => {
                let problem = format!("{seconds} s is outside 0.001 to 1");
                let advice = "choose a time in that range";
                Err(Error::setting("frame_time", problem, advice))
            }
            _ => self.generation.check(),
        }
    }

    /// Most sources that the app may add.
    pub fn source_limit(&self) -> usize {
        self.max_sources.unwrap_or(self.generation.max_sources)
    }

    pub(super) fn load_hrtf(&self) -> Result<Arc<Hrtf>> {
        if let Some(hrtf) = &self.hrtf {
            return Ok(Arc::clone(hrtf));
        }
        #[cfg(feature = "builtin-hrtf")]
        {
            Hrtf::builtin(self.generation.rate_hz).map(Arc::new)
        }
        #[cfg(not(feature = "builtin-hrtf"))]
        {
            let advice = "give one, or build with the feature builtin-hrtf";
            Err(Error::setting(
                "hrtf",
                "no head-related set is built in",
                advice,
            ))
        }
    }
}
