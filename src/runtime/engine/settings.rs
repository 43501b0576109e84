//! Settings of an engine.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::extrapolation::{MAX_DIRECT_PATHS, PredictorKind, PredictorState};
use crate::generation::{GeneratorSettings, Hrtf, Layout};
use crate::propagation::PropagationSettings;
use crate::runtime::budget::Budget;
use crate::runtime::phone::DeviceHintsSettings;
use crate::runtime::threads::affinity::AffinityPolicy;
use crate::runtime::threads::workers::MAX_THREADS;

/// Greatest number of sources of an engine.
pub const MAX_SOURCES: usize = 4096;

// Measured; `tools/tests/limits.rs` compares them with what is allocated.
/// Bytes of a path of an update for one listener.
const PATH_BYTES: usize = 230;
/// Further bytes of one whose candidates the geometric predictor keeps.
const CANDIDATE_BYTES: usize = 3950;
/// Bytes of every engine, whatever it holds.
const ENGINE_BYTES: usize = 2_300_000;
/// Bytes of a source besides its slot.
const SOURCE_BYTES: usize = 820;
/// Bytes of a span in the rings of three threads.
const SPAN_BYTES: usize = 96;

/// When propagation runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EngineSchedule {
    /// Within every [`super::Controller::tick`], on the app's thread and helpers ([`EngineSettings::tracing_threads`]).
    Synchronous,
    /// Continuously on a separate thread, with the newest poses; extrapolation covers the frames in between.
    #[default]
    Asynchronous,
}

/// Length of a graphics frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum FrameTime {
    /// The measured time between ticks.
    #[default]
    Measured,
    /// A fixed time in seconds, 0.001 to 1: for rendering faster or slower than real time.
    Fixed(f64),
}

/// Settings of an engine; start from [`Default`] and assign fields.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct EngineSettings {
    /// Sample rate, layout, source slots, voices, limiter.
    pub generation: GeneratorSettings,
    /// Greatest number of sources, 1 to 4096; `None` is the number of slots, [`GeneratorSettings::max_sources`]. With
    /// more sources than slots the loudest have slots of their own, neighbours among the others share one, and masked
    /// ones are silent. Cost grows with slots.
    pub max_sources: Option<usize>,
    /// HRTF set of binaural sound; `None` is the built-in one for the sample rate.
    pub hrtf: Option<Arc<Hrtf>>,
    /// Audio frames per block, 32 to 4096.
    pub block_frames: usize,
    /// Greatest number of paths of an update, 1 to 16,384; beyond it the quietest are dropped and counted.
    pub max_paths: usize,
    /// Rays, reflection orders and caches of propagation.
    pub propagation: PropagationSettings,
    /// Threads of an update in the synchronous schedule, including the app's, 1 to `MAX_THREADS`. In the asynchronous
    /// schedule the propagation thread traces alone and leaves the other core to sound.
    pub tracing_threads: usize,
    /// When propagation runs.
    pub schedule: EngineSchedule,
    /// How paths continue between updates.
    pub predictor: PredictorKind,
    /// Cores of the threads.
    pub affinity: AffinityPolicy,
    /// Limits of computing time; [`super::Controller::set_budget`] changes them.
    pub budget: Budget,
    /// Capacity of each thread's ring of trace spans, to 2^20; 0 records none. See
    /// [`super::Controller::collect_spans`].
    pub trace_spans: usize,
    /// Length of a graphics frame.
    pub frame_time: FrameTime,
    /// Whether the work of a graphics frame is spread evenly over the blocks until the next one, and limited: where it would
    /// take more than 8 % of a core, the geometric predictor casts fewer visibility rays, down to an eighth, and extrapolates
    /// waves at edges and amplitudes over longer distances. Otherwise the
    /// block that receives a frame does all of it.
    pub even_blocks: bool,
    /// Thermal and performance hints of a phone's system; ignored on other systems.
    pub device_hints: DeviceHintsSettings,
    /// Greatest [`Self::memory_bytes`]; more is refused. The largest engine of all ranges takes gigabytes.
    pub max_memory_bytes: usize,
    /// Greatest number of paths of [`super::Controller::path_snapshot`], to 16,384; 0 turns it off.
    pub max_snapshot_paths: usize,
    /// Called before every update with its number, on the propagating thread, for instance for a profiler's mark. A
    /// panic stops propagation.
    pub before_update: Option<fn(u64)>,
}

impl Default for EngineSettings {
    /// Sixteen sources at 44.1 kHz in blocks of 256, paths up to 343 m: delay lines are most of an engine's memory.
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
            max_memory_bytes: 1 << 30,
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
        range("max_snapshot_paths", self.max_snapshot_paths, 0, 16_384)?;
        if let Some(max_sources) = self.max_sources {
            range("max_sources", max_sources, 1, MAX_SOURCES)?;
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
        }?;
        self.check_memory()
    }

    fn check_memory(&self) -> Result<()> {
        let megabytes = |bytes: usize| bytes.div_ceil(1 << 20);
        let [wanted, most] = [self.memory_bytes(), self.max_memory_bytes].map(megabytes);
        if self.memory_bytes() <= self.max_memory_bytes {
            return Ok(());
        }
        let problem = format!("the engine takes {wanted} MiB, more than {most} MiB");
        let advice = "choose fewer slots of sources or a shorter max_delay_s, or allow more";
        Err(Error::setting("max_memory_bytes", problem, advice))
    }

    /// Bytes of an engine of these settings, without scenes, caches of propagation and sounds; stated to a quarter. Delay
    /// lines are most of it.
    pub fn memory_bytes(&self) -> usize {
        let path_bytes = match self.predictor {
            PredictorKind::Geometric(_) => PATH_BYTES + CANDIDATE_BYTES,
            PredictorKind::Hold | PredictorKind::Linear => PATH_BYTES,
        };
        [
            self.max_paths
                .saturating_mul(path_bytes)
                .saturating_mul(self.generation.listeners),
            self.source_limit().saturating_mul(SOURCE_BYTES),
            self.trace_spans.saturating_mul(SPAN_BYTES),
            ENGINE_BYTES,
        ]
        .into_iter()
        .fold(self.generation.memory_bytes(), usize::saturating_add)
    }

    /// Greatest number of sources: [`Self::max_sources`], or the number of slots.
    pub fn source_limit(&self) -> usize {
        self.max_sources.unwrap_or(self.generation.max_sources)
    }

    /// Greatest number of paths of a listener's graphics frame: those of the predictor, and the direct ones of each source.
    pub(super) fn max_frame_paths(&self) -> usize {
        let direct = self.generation.max_sources * MAX_DIRECT_PATHS;
        PredictorState::most_paths(self.max_paths) + direct
    }

    /// The HRTF set of a layout; any in layouts without one.
    pub(super) fn hrtf_of(&self, layout: Layout) -> Result<Arc<Hrtf>> {
        match layout {
            Layout::Binaural => self.load_hrtf(),
            _ => Hrtf::omnidirectional(self.generation.rate_hz).map(Arc::new),
        }
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
            Err(Error::setting("hrtf", "no HRTF set is built in", advice))
        }
    }
}
