//! Settings of an engine as plain numbers.

use std::sync::Arc;

use super::error::CallError;
use super::record::record;
use crate::extrapolation::PredictorKind;
use crate::extrapolation::geometric::GeometricSettings;
use crate::generation::Hrtf;
use crate::runtime::{AffinityPolicy, EngineSchedule, EngineSettings, FrameTime};

record! {
    /// Settings of an engine. Fill it with the defaults, then change fields.
    pub struct Options[size] {
        /// Sample rate in Hz: 44,100 or 48,000 with the built-in HRTF set.
        pub rate_hz: u32,
        /// Audio frames a block, 32 to 4,096.
        pub block_frames: u32,
        /// Maximum number of sources, 1 to 256.
        pub max_sources: u32,
        /// Maximum number of paths rendered at once, 1 to 16,384.
        pub max_voices: u32,
        /// The loudest of them are rendered in full detail: their number.
        pub fine_voices: u32,
        /// Maximum number of paths of one update, 1 to 16,384.
        pub max_paths: u32,
        /// Rays from the listener an update, 1 to 65,536.
        pub guide_rays: u32,
        /// Rays from each source an update, 1 to 65,536.
        pub source_rays: u32,
        /// Maximum reflection order, 0 to 4.
        pub depth: u32,
        /// Seed of the ray directions.
        pub seed: u32,
        /// 0: propagation on its own thread; 1: within every tick.
        pub schedule: u32,
        /// Extrapolation of paths between updates: 0 hold, 1 linear, 2 geometric.
        pub predictor: u32,
        /// Cores: 0 chosen by the system, 1 the two fastest, 2 those of the next two fields.
        pub affinity: u32,
        /// Core of the propagation thread, if `affinity` is 2.
        pub propagation_core: u32,
        /// Core of the audio thread, if `affinity` is 2.
        pub sound_core: u32,
        /// 0: the HRTF set passed at creation, else the built-in one; 1: none, both ears receive the same signal.
        pub hrtf: u32,
        /// 1: with late reverb; 0: without.
        pub late_reverb: u32,
        /// 1: with limiter; 0: without.
        pub limiter: u32,
        /// Distance in metres below which a source gets no louder.
        pub min_distance_m: f32,
        /// Ceiling of the limiter in dB re full scale, -60 to 0.
        pub ceiling_db: f32,
        /// Duration of a graphics frame in seconds, 0.001 to 1; 0: measured from the ticks.
        pub frame_s: f64,
        /// Maximum path delay in seconds, 0.01 to 10.
        pub max_delay_s: f64,
        /// Exchange with a phone's system, a sum of bits: 1 heat lowers the quality level, 2 performance hints. Without
        /// effect where the system lacks the functions.
        pub device_hints: u32,
        /// Maximum number of paths that foresound_engine_paths returns, 0 to 16,384.
        pub shown_paths: u32,
        /// Maximum memory of the engine in MiB, without scenes and sounds; an engine of more is refused. Most of it is
        /// 32 bytes x `rate_hz` x `max_delay_s` for each of `max_sources`.
        pub max_memory_mib: u32,
    }
}

impl Default for Options {
    fn default() -> Self {
        let engine = EngineSettings::default();
        let (generation, propagation) = (&engine.generation, &engine.propagation);
        Self {
            size: size_of::<Self>() as u32,
            rate_hz: generation.rate_hz,
            block_frames: engine.block_frames as u32,
            max_sources: generation.max_sources as u32,
            max_voices: generation.max_voices as u32,
            fine_voices: generation.fine_voices as u32,
            max_paths: engine.max_paths as u32,
            guide_rays: propagation.guide_rays,
            source_rays: propagation.source_rays,
            depth: propagation.depth as u32,
            seed: propagation.seed as u32,
            schedule: 0,
            predictor: PREDICTORS
                .iter()
                .position(|kind| kind.name() == engine.predictor.name())
                .unwrap_or(0) as u32,
            // A library in an app leaves its threads to the system's scheduler.
            affinity: 0,
            propagation_core: 0,
            sound_core: 0,
            hrtf: 0,
            late_reverb: generation.late.into(),
            limiter: generation.limiter.into(),
            min_distance_m: propagation.min_distance_m,
            ceiling_db: generation.ceiling_db,
            frame_s: 0.0,
            max_delay_s: generation.max_delay_s,
            device_hints: 3,
            shown_paths: engine.max_snapshot_paths as u32,
            max_memory_mib: (engine.max_memory_bytes >> 20) as u32,
        }
    }
}

/// Predictors by their index.
const PREDICTORS: [PredictorKind; 3] = [
    PredictorKind::Hold,
    PredictorKind::Linear,
    PredictorKind::Geometric(GeometricSettings::FULL),
];

/// An element of a list by its index.
fn choice<T: Copy>(name: &str, value: u32, choices: &[T]) -> Result<T, CallError> {
    let last = choices.len() - 1;
    choices
        .get(value as usize)
        .copied()
        .ok_or_else(|| CallError::bad(format!("{name}: {value} is outside 0 to {last}")))
}

impl Options {
    /// The engine's settings. `hrtf` is the content of an HRTF set's file.
    ///
    /// # Errors
    /// `Status::BadArgument` for an enumeration out of range,
    /// `Status::Format` for an invalid HRTF set. The engine checks the other ranges.
    pub fn settings(&self, hrtf: Option<&[u8]>) -> Result<EngineSettings, CallError> {
        let mut settings = EngineSettings {
            block_frames: self.block_frames as usize,
            max_paths: self.max_paths as usize,
            schedule: choice(
                "schedule",
                self.schedule,
                &[EngineSchedule::Asynchronous, EngineSchedule::Synchronous],
            )?,
            predictor: choice("predictor", self.predictor, &PREDICTORS)?,
            affinity: choice(
                "affinity",
                self.affinity,
                &[
                    AffinityPolicy::None,
                    AffinityPolicy::PreferBig,
                    AffinityPolicy::Exact {
                        propagation: self.propagation_core as usize,
                        sound: self.sound_core as usize,
                    },
                ],
            )?,
            // The engine refuses NaN.
            frame_time: if self.frame_s == 0.0 {
                FrameTime::Measured
            } else {
                FrameTime::Fixed(self.frame_s)
            },
            ..EngineSettings::default()
        };
        let hints = self.device_hints;
        if hints > 3 {
            return Err(CallError::bad(format!(
                "device_hints: {hints} is outside 0 to 3"
            )));
        }
        settings.device_hints.thermal = hints & 1 != 0;
        settings.device_hints.hints = hints & 2 != 0;
        settings.max_snapshot_paths = self.shown_paths as usize;
        settings.max_memory_bytes = (self.max_memory_mib as usize).saturating_mul(1 << 20);
        settings.generation.rate_hz = self.rate_hz;
        settings.generation.max_sources = self.max_sources as usize;
        settings.generation.max_voices = self.max_voices as usize;
        settings.generation.fine_voices = self.fine_voices as usize;
        settings.generation.max_delay_s = self.max_delay_s;
        settings.generation.late = choice("late_reverb", self.late_reverb, &[false, true])?;
        settings.generation.limiter = choice("limiter", self.limiter, &[false, true])?;
        settings.generation.ceiling_db = self.ceiling_db;
        settings.propagation.guide_rays = self.guide_rays;
        settings.propagation.source_rays = self.source_rays;
        settings.propagation.depth = self.depth as usize;
        settings.propagation.seed = self.seed.into();
        settings.propagation.min_distance_m = self.min_distance_m;
        settings.hrtf = match (choice("hrtf", self.hrtf, &[false, true])?, hrtf) {
            (true, _) => Some(Arc::new(Hrtf::omnidirectional(self.rate_hz)?)),
            (false, Some(bytes)) => Some(Arc::new(Hrtf::parse(bytes, "the HRTF set")?)),
            (false, None) => None,
        };
        Ok(settings)
    }
}

#[cfg(test)]
mod tests {
    use super::super::record::Record;
    use super::*;

    #[test]
    fn defaults_are_the_engines_but_for_cores() {
        let options = Options::default();
        let ours = options.settings(None).expect("can be");
        let theirs = EngineSettings {
            affinity: AffinityPolicy::None,
            ..EngineSettings::default()
        };
        assert_eq!(format!("{ours:?}"), format!("{theirs:?}"));
        assert_eq!(
            Options::from_list("options", &options.to_list()),
            Ok(options)
        );
    }

    #[test]
    fn unknown_choices_are_refused() {
        let options = Options {
            hrtf: 7,
            ..Options::default()
        };
        assert!(options.settings(None).is_err());
    }
}
