//! Statistics of an engine as plain numbers.

use super::enumeration::EngineState;
use super::record::record;
use crate::runtime::{self, Statistics, engine};

impl From<runtime::EngineState> for EngineState {
    fn from(from: runtime::EngineState) -> Self {
        match from {
            runtime::EngineState::Running => Self::Running,
            runtime::EngineState::Paused => Self::Paused,
            runtime::EngineState::PropagationFailed => Self::PropagationFailed,
            runtime::EngineState::RendererGone => Self::RendererGone,
        }
    }
}

record! {
    /// Percentiles of durations in seconds; zeros without a measurement. Part of other structures: never changes.
    pub struct Percentiles {
        /// Number of measurements.
        pub count: u64,
        /// 50th percentile.
        pub p50_s: f64,
        /// 95th percentile.
        pub p95_s: f64,
        /// 99.9th percentile.
        pub p999_s: f64,
        /// Maximum.
        pub worst_s: f64,
    }
}

record! {
    /// Statistics of an engine. Counts are since its creation.
    pub struct EngineStatistics[size, zeros] {
        /// State of the engine.
        pub state: EngineState,
        /// Graphics frames that an update lasts (the paper's L); at 0 every frame has an update of its own.
        pub extrapolation_level: u32,
        /// Paths in the update in use.
        pub paths: u32,
        /// Number of sources.
        pub sources: u32,
        /// Quality level in use, 0 full detail to 5 the coarsest.
        pub quality_level: u32,
        /// Real-time priority of the audio thread; 0 outside that class.
        pub audio_priority: i32,
        /// Niceness of the audio thread, -20 to 19.
        pub audio_nice: i32,
        /// Durations of propagation updates.
        pub propagation: Percentiles,
        /// Durations of extrapolation a graphics frame.
        pub extrapolation: Percentiles,
        /// Durations of generation a block.
        pub generation: Percentiles,
        /// Durations of whole render calls.
        pub block: Percentiles,
        /// Render calls.
        pub blocks: u64,
        /// Render calls that took longer than the duration of their sound.
        pub missed_deadlines: u64,
        /// Propagation updates in use so far.
        pub updates: u64,
        /// The quietest paths, dropped beyond the limit of an update.
        pub trimmed_paths: u64,
        /// Paths without a voice.
        pub dropped_paths: u64,
        /// Samples missing from streams at their time.
        pub underrun_samples: u64,
        /// Duration of the update in use, in seconds.
        pub propagation_s: f64,
        /// Time between graphics frames in seconds.
        pub graphics_frame_s: f64,
        /// Cores allowed for the propagation thread, a bit each.
        pub propagation_cores: u64,
        /// Cores allowed for the audio thread, a bit each.
        pub audio_cores: u64,
    }
}

impl From<engine::Percentiles> for Percentiles {
    fn from(from: engine::Percentiles) -> Self {
        Self {
            count: from.count,
            p50_s: from.p50_s,
            p95_s: from.p95_s,
            p999_s: from.p999_s,
            worst_s: from.worst_s,
        }
    }
}

impl EngineStatistics {
    /// From the engine's statistics and state.
    pub fn new(from: &Statistics, state: runtime::EngineState, sources: usize) -> Self {
        Self {
            size: size_of::<Self>() as u32,
            state: state.into(),
            extrapolation_level: from.extrapolation_level,
            paths: from.paths,
            sources: sources as u32,
            quality_level: from.quality_level.0.into(),
            audio_priority: from.sound_placement.realtime_priority,
            audio_nice: from.sound_placement.nice,
            propagation: from.propagation.into(),
            extrapolation: from.extrapolation.into(),
            generation: from.generation.into(),
            block: from.block.into(),
            blocks: from.blocks,
            missed_deadlines: from.missed_deadlines,
            updates: from.updates,
            trimmed_paths: from.trimmed_paths,
            dropped_paths: from.dropped_paths,
            underrun_samples: from.underrun_samples,
            propagation_s: from.propagation_s,
            graphics_frame_s: from.graphics_frame_s,
            propagation_cores: from.propagation_placement.cores,
            audio_cores: from.sound_placement.cores,
        }
    }
}
