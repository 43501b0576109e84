//! Settings of an engine as plain numbers.

use std::sync::Arc;

use super::enumeration::{Affinity, DeviceHint, Hrtf, Layout, Predictor, Schedule};
use super::error::CallError;
use super::record::record;
use crate::extrapolation::PredictorKind;
use crate::extrapolation::geometric::GeometricSettings;
use crate::generation::{Hrtf as HrtfSet, Layout as OutputLayout};
use crate::runtime::{AffinityPolicy, EngineSchedule, EngineSettings, FrameTime};

record! {
    /// Settings of an engine. Begin with FORESOUND_OPTIONS_INIT or foresound_options_default, then change fields.
    pub struct Options[size] {
        /// Sample rate in Hz: 44,100 or 48,000 with the built-in HRTF set.
        pub rate_hz: u32,
        /// Audio frames a block, 32 to 4,096.
        pub block_frames: u32,
        /// Maximum number of sources, 1 to 4,096.
        pub max_sources: u32,
        /// Sources with a slot of their own, 1 to 256; 0: as many as `max_sources`, at most 256. Beyond it neighbours share a
        /// slot, and sources that others mask are silent (`unheard_sources` of ForesoundEngineHealth). Cost and memory grow with
        /// slots.
        pub source_slots: u32,
        /// Maximum number of paths rendered at once, 1 to 16,384.
        pub max_voices: u32,
        /// How many of the paths rendered at once, the loudest, are rendered in full detail. The others use a shorter form of
        /// the HRTF set.
        pub fine_voices: u32,
        /// Maximum number of paths of one update, 1 to 16,384.
        pub max_paths: u32,
        /// Rays from the listener an update, 1 to 65,536.
        pub guide_rays: u32,
        /// Rays from each source an update, 1 to 65,536.
        pub source_rays: u32,
        /// Maximum reflection order, 0 to 4.
        pub depth: u32,
        /// Maximum number of edges that a path is diffracted at, 0 to 2.
        pub diffraction_order: u32,
        /// Seed of the ray directions.
        pub seed: u32,
        /// When propagation runs.
        pub schedule: Schedule,
        /// Threads of an update in the synchronous schedule, the calling one included, 1 to 64.
        pub tracing_threads: u32,
        /// Extrapolation of paths between updates.
        pub predictor: Predictor,
        /// 1: the work of a graphics frame is spread over the blocks until the next one; 0: the first block does all of it.
        pub even_blocks: u32,
        /// Cores of the engine's threads. By default they are not pinned.
        pub affinity: Affinity,
        /// Core of the propagation thread, if `affinity` is FORESOUND_AFFINITY_CHOSEN.
        pub propagation_core: u32,
        /// Core of the audio thread, if `affinity` is FORESOUND_AFFINITY_CHOSEN.
        pub audio_core: u32,
        /// What turns paths into two ears.
        pub hrtf: Hrtf,
        /// 1: with late reverb; 0: without.
        pub late_reverb: u32,
        /// 1: with limiter; 0: without.
        pub limiter: u32,
        /// Exchange with a phone's system, a sum of ForesoundDeviceHint. Without effect where the system lacks the functions.
        pub device_hints: u32,
        /// Maximum number of paths that foresound_engine_paths returns, 0 to 16,384.
        pub shown_paths: u32,
        /// Maximum memory of the engine in MiB, without scenes and sounds; an engine of more is refused. Counted with the
        /// longest delay lines, 32 bytes x `rate_hz` x `max_delay_s` a slot; at first they are of 0.15 s, and grow with the paths.
        pub max_memory_mib: u32,
        /// Distance in metres below which a source gets no louder.
        pub min_distance_m: f32,
        /// Ceiling of the limiter in dB re full scale, -60 to 0.
        pub ceiling_db: f32,
        /// Time from one graphics frame to the next (not of an audio frame) in seconds, 0.001 to 1, for rendering at another
        /// speed than real time; 0: measured from the ticks, for games.
        pub frame_s: f64,
        /// Maximum path delay in seconds, 0.01 to 10.
        pub max_delay_s: f64,
        /// Layout of the output at first.
        pub layout: Layout,
        /// Channels of the output, constant while the layout may change, to 16; 0: those that `layout` has.
        pub output_channels: u32,
        /// 1: sources can be rendered apart (foresound_render_source), for a mixer of the game's own; 0: not.
        pub source_buses: u32,
        /// Listeners, 1 to 4: for a split screen or spectators (foresound_engine_set_listener, foresound_render_listeners).
        pub listeners: u32,
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
            max_sources: engine.source_limit() as u32,
            source_slots: 0,
            max_voices: generation.max_voices as u32,
            fine_voices: generation.fine_voices as u32,
            max_paths: engine.max_paths as u32,
            guide_rays: propagation.guide_rays,
            source_rays: propagation.source_rays,
            depth: propagation.depth as u32,
            diffraction_order: propagation.diffraction_order as u32,
            seed: propagation.seed as u32,
            schedule: Schedule::Asynchronous,
            tracing_threads: engine.tracing_threads as u32,
            predictor: Predictor(
                PREDICTORS
                    .iter()
                    .position(|kind| kind.name() == engine.predictor.name())
                    .unwrap_or(0) as u32,
            ),
            even_blocks: engine.even_blocks.into(),
            // A library in an app leaves its threads to the system's scheduler.
            affinity: Affinity::System,
            propagation_core: 0,
            audio_core: 0,
            hrtf: Hrtf::Set,
            late_reverb: generation.late.into(),
            limiter: generation.limiter.into(),
            device_hints: DeviceHint::Thermal.0 | DeviceHint::Performance.0,
            shown_paths: engine.max_snapshot_paths as u32,
            max_memory_mib: (engine.max_memory_bytes >> 20) as u32,
            min_distance_m: propagation.min_distance_m,
            ceiling_db: generation.ceiling_db,
            frame_s: 0.0,
            max_delay_s: generation.max_delay_s,
            layout: Layout::Binaural,
            output_channels: 0,
            source_buses: generation.source_buses.into(),
            listeners: generation.listeners as u32,
        }
    }
}

/// Schedules by their number.
const SCHEDULES: [EngineSchedule; 2] = [EngineSchedule::Asynchronous, EngineSchedule::Synchronous];

/// Predictors by their number.
const PREDICTORS: [PredictorKind; 3] = [
    PredictorKind::Hold,
    PredictorKind::Linear,
    PredictorKind::Geometric(GeometricSettings::FULL),
];

/// Most slots of sources.
const MAX_SLOTS: u32 = 256;

/// An element of a list by its index.
fn choice<T: Copy>(name: &str, value: u32, choices: &[T]) -> Result<T, CallError> {
    let last = choices.len() - 1;
    choices
        .get(value as usize)
        .copied()
        .ok_or_else(|| CallError::bad(format!("{name}: {value} is outside 0 to {last}")))
}

impl Schedule {
    /// The engine's schedule.
    ///
    /// # Errors
    /// `Status::BadArgument`.
    pub fn choice(self) -> Result<EngineSchedule, CallError> {
        choice("schedule", self.0, &SCHEDULES)
    }
}

impl Layout {
    /// The engine's layout.
    ///
    /// # Errors
    /// `Status::BadArgument`.
    pub fn choice(self) -> Result<OutputLayout, CallError> {
        choice("layout", self.0, &OutputLayout::ALL)
    }
}

impl Predictor {
    /// The engine's predictor.
    ///
    /// # Errors
    /// `Status::BadArgument`.
    pub fn choice(self) -> Result<PredictorKind, CallError> {
        choice("predictor", self.0, &PREDICTORS)
    }
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
            max_sources: Some(self.max_sources as usize),
            max_paths: self.max_paths as usize,
            schedule: self.schedule.choice()?,
            tracing_threads: self.tracing_threads as usize,
            predictor: self.predictor.choice()?,
            even_blocks: choice("even_blocks", self.even_blocks, &[false, true])?,
            affinity: choice(
                "affinity",
                self.affinity.0,
                &[
                    AffinityPolicy::System,
                    AffinityPolicy::Fastest,
                    AffinityPolicy::Chosen {
                        propagation: self.propagation_core as usize,
                        sound: self.audio_core as usize,
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
        let (hints, all) = (
            self.device_hints,
            DeviceHint::Thermal.0 | DeviceHint::Performance.0,
        );
        if hints > all {
            return Err(CallError::bad(format!(
                "device_hints: {hints} is outside 0 to {all}"
            )));
        }
        settings.device_hints.thermal = hints & DeviceHint::Thermal.0 != 0;
        settings.device_hints.hints = hints & DeviceHint::Performance.0 != 0;
        settings.max_snapshot_paths = self.shown_paths as usize;
        settings.max_memory_bytes = (self.max_memory_mib as usize).saturating_mul(1 << 20);
        settings.generation.rate_hz = self.rate_hz;
        settings.generation.max_sources = self.slots() as usize;
        settings.generation.max_voices = self.max_voices as usize;
        settings.generation.fine_voices = self.fine_voices as usize;
        settings.generation.max_delay_s = self.max_delay_s;
        settings.generation.late = choice("late_reverb", self.late_reverb, &[false, true])?;
        settings.generation.limiter = choice("limiter", self.limiter, &[false, true])?;
        settings.generation.source_buses =
            choice("source_buses", self.source_buses, &[false, true])?;
        settings.generation.listeners = self.listeners as usize;
        settings.generation.ceiling_db = self.ceiling_db;
        settings.generation.layout = self.layout.choice()?;
        settings.generation.channels = match self.output_channels {
            0 => None,
            channels => Some(channels as usize),
        };
        settings.propagation.guide_rays = self.guide_rays;
        settings.propagation.source_rays = self.source_rays;
        settings.propagation.depth = self.depth as usize;
        settings.propagation.diffraction_order = self.diffraction_order as usize;
        settings.propagation.seed = self.seed.into();
        settings.propagation.min_distance_m = self.min_distance_m;
        settings.hrtf = match (choice("hrtf", self.hrtf.0, &[false, true])?, hrtf) {
            (true, _) => Some(Arc::new(HrtfSet::omnidirectional(self.rate_hz)?)),
            (false, Some(bytes)) => Some(Arc::new(HrtfSet::read(
                bytes,
                "the HRTF set",
                self.rate_hz,
            )?)),
            (false, None) => None,
        };
        Ok(settings)
    }

    /// Sources with a slot of their own.
    fn slots(&self) -> u32 {
        match self.source_slots {
            0 => self.max_sources.min(MAX_SLOTS),
            slots => slots,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::enumeration::Enumeration;
    use super::super::record::Record;
    use super::*;

    #[test]
    fn defaults_are_the_engines_but_for_cores() {
        let options = Options::default();
        let ours = options.settings(None).expect("can be");
        let theirs = EngineSettings {
            affinity: AffinityPolicy::System,
            max_sources: Some(EngineSettings::default().source_limit()),
            ..EngineSettings::default()
        };
        assert_eq!(format!("{ours:?}"), format!("{theirs:?}"));
        assert_eq!(
            Options::from_list("options", &options.to_list()),
            Ok(options)
        );
    }

    #[test]
    fn layouts_have_the_numbers_of_the_enumeration() {
        for (number, layout) in OutputLayout::ALL.into_iter().enumerate() {
            let options = Options {
                layout: Layout(number as u32),
                output_channels: 16,
                ..Options::default()
            };
            let settings = options.settings(None).expect("can be");
            assert_eq!(settings.generation.layout, layout);
            let name = layout.name().replace(['.', '_'], "");
            let own = Enumeration::name(Layout(number as u32)).expect("a member");
            let own = own.to_lowercase().replace("surround", "");
            assert_eq!(own.replace("ambisonics", "ambix"), name);
        }
        assert!(Layout(9).choice().is_err());
    }

    #[test]
    fn unknown_choices_are_refused() {
        let options = Options {
            hrtf: Hrtf(7),
            ..Options::default()
        };
        assert!(options.settings(None).is_err());
    }
}
