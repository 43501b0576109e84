//! What the engine tells about itself, as plain numbers.

use crate::runtime::{EngineState, Statistics, engine};

/// How many numbers the structure is as a list.
pub const STATISTICS_NUMBERS: usize = 36;

/// Percentiles of times, in seconds; zeros of nothing.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Percentiles {
    /// How many times were counted.
    pub count: u64,
    /// The median.
    pub p50_s: f64,
    /// 95 of 100 are no longer.
    pub p95_s: f64,
    /// 999 of 1000 are no longer.
    pub p999_s: f64,
    /// The longest.
    pub worst_s: f64,
}

/// A look at an engine. Counts are since it began.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EngineStatistics {
    /// 0 running, 1 paused, 2 propagation has failed (restart), 3 the renderer was closed (make another engine).
    pub state: u32,
    /// Extrapolation level L in use.
    pub level: u32,
    /// Paths in the update in use.
    pub paths: u32,
    /// Sources.
    pub sources: u32,
    /// Times of propagation updates.
    pub propagation: Percentiles,
    /// Times of extrapolation a graphics frame.
    pub extrapolation: Percentiles,
    /// Times of generation a block.
    pub generation: Percentiles,
    /// Times of whole render calls.
    pub block: Percentiles,
    /// Render calls.
    pub blocks: u64,
    /// Render calls that took longer than what they rendered lasts.
    pub missed_deadlines: u64,
    /// Updates that were taken.
    pub updates: u64,
    /// Paths left out beyond the limit of an update, the quietest.
    pub trimmed_paths: u64,
    /// Paths without a voice.
    pub dropped_paths: u64,
    /// Samples that streams were late with.
    pub starved_samples: u64,
    /// Time of the update in use, in seconds.
    pub propagation_s: f64,
    /// Time between the graphics frames that are heard, in seconds.
    pub graphics_frame_s: f64,
    /// Cores that the propagation thread may run on, a bit each.
    pub propagation_cores: u64,
    /// Cores that the sound thread may run on, a bit each.
    pub sound_cores: u64,
    /// Real-time priority of the sound thread, 0 outside that class.
    pub sound_priority: i32,
    /// Niceness of the sound thread, -20 to 19.
    pub sound_nice: i32,
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

impl Percentiles {
    fn numbers(&self) -> [f64; 5] {
        let count = self.count as f64;
        [count, self.p50_s, self.p95_s, self.p999_s, self.worst_s]
    }
}

impl EngineStatistics {
    /// From what the engine says.
    pub fn new(from: &Statistics, state: EngineState, sources: usize) -> Self {
        Self {
            state: match state {
                EngineState::Running => 0,
                EngineState::Paused => 1,
                EngineState::PropagationFailed => 2,
                EngineState::RendererGone => 3,
            },
            level: from.extrapolation_level,
            paths: from.paths,
            sources: sources as u32,
            propagation: from.propagation.into(),
            extrapolation: from.extrapolation.into(),
            generation: from.generation.into(),
            block: from.block.into(),
            blocks: from.blocks,
            missed_deadlines: from.missed_deadlines,
            updates: from.updates,
            trimmed_paths: from.trimmed_paths,
            dropped_paths: from.dropped_paths,
            starved_samples: from.underrun_samples,
            propagation_s: from.propagation_s,
            graphics_frame_s: from.graphics_frame_s,
            propagation_cores: from.propagation_placement.cores,
            sound_cores: from.sound_placement.cores,
            sound_priority: from.sound_placement.realtime_priority,
            sound_nice: from.sound_placement.nice,
        }
    }

    /// All fields in their order, as numbers: how Java gets them. Counts beyond 2^53 are rounded.
    pub fn numbers(&self) -> [f64; STATISTICS_NUMBERS] {
        let mut numbers = [0.0; STATISTICS_NUMBERS];
        let first = [self.state, self.level, self.paths, self.sources];
        for (number, value) in numbers.iter_mut().zip(first) {
            *number = value.into();
        }
        let times = [
            self.propagation,
            self.extrapolation,
            self.generation,
            self.block,
        ];
        for (five, time) in numbers[4..].chunks_exact_mut(5).zip(times) {
            five.copy_from_slice(&time.numbers());
        }
        let rest = [
            self.blocks as f64,
            self.missed_deadlines as f64,
            self.updates as f64,
            self.trimmed_paths as f64,
            self.dropped_paths as f64,
            self.starved_samples as f64,
            self.propagation_s,
            self.graphics_frame_s,
            self.propagation_cores as f64,
            self.sound_cores as f64,
            self.sound_priority.into(),
            self.sound_nice.into(),
        ];
        numbers[24..].copy_from_slice(&rest);
        numbers
    }
}
