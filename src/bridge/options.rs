//! What an engine is made for, as plain numbers.

use std::sync::Arc;

use super::fault::{Fault, Status};
use super::numbers::Numbers;
use crate::extrapolation::PredictorKind;
use crate::extrapolation::geometric::GeometricSettings;
use crate::generation::Hrtf;
use crate::runtime::{AffinityPolicy, EngineSchedule, EngineSettings, FrameTime};

/// How many numbers the structure is as a list.
pub const OPTION_NUMBERS: usize = 24;

/// What an engine is made for. Fill it with the defaults first, then change what is to differ.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Bytes of this structure, as the caller knows it: what lies beyond takes its default.
    pub size: u32,
    /// Sample rate in Hz: 44,100 or 48,000 with the built-in head.
    pub rate_hz: u32,
    /// Audio frames a block, 32 to 4,096.
    pub block_frames: u32,
    /// Most sources, 1 to 256.
    pub max_sources: u32,
    /// Most paths that sound at once, 1 to 16,384.
    pub max_voices: u32,
    /// Of those, the loudest that are rendered in full detail.
    pub fine_voices: u32,
    /// Most paths of one update, 1 to 16,384.
    pub max_paths: u32,
    /// Rays from the listener an update, 1 to 65,536.
    pub guide_rays: u32,
    /// Rays from each source an update, 1 to 65,536.
    pub source_rays: u32,
    /// Highest reflection order, 0 to 4.
    pub depth: u32,
    /// Seed of the rays.
    pub seed: u32,
    /// 0: propagation on a thread of its own; 1: within every tick.
    pub schedule: u32,
    /// Paths between updates: 0 held, 1 linear (the paper's), 2 best.
    pub predictor: u32,
    /// Cores: 0 as the system likes, 1 the fastest two, 2 those of the next two fields.
    pub affinity: u32,
    /// Core of the propagation thread, where `affinity` is 2.
    pub propagation_core: u32,
    /// Core of the sound thread, where `affinity` is 2.
    pub sound_core: u32,
    /// 0: the given head-related set, else the built-in one; 1: none, both ears hear alike.
    pub head: u32,
    /// Whether the late reverb runs: 0 or 1.
    pub late: u32,
    /// Whether the output is limited: 0 or 1.
    pub limiter: u32,
    /// Distance in metres below which a source gets no louder.
    pub nearest_m: f32,
    /// Ceiling of the limiter in dB re full scale, -60 to 0.
    pub ceiling_db: f32,
    /// Seconds of a graphics frame, 0.001 to 1; 0 measures the ticks.
    pub frame_s: f64,
    /// Longest path delay in seconds, 0.01 to 10.
    pub max_delay_s: f64,
    /// What is asked of a phone's system and told to it, a sum of bits: 1 heat lowers detail, 2 performance hints. Nothing
    /// where the system has no such functions.
    pub manners: u32,
    /// Most paths that foresound_engine_paths gives, 0 to 16,384.
    pub shown_paths: u32,
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
            // A library in somebody's app leaves threads where the system puts them.
            affinity: 0,
            propagation_core: 0,
            sound_core: 0,
            head: 0,
            late: generation.late.into(),
            limiter: generation.limiter.into(),
            nearest_m: propagation.min_distance_m,
            ceiling_db: generation.ceiling_db,
            frame_s: 0.0,
            max_delay_s: generation.max_delay_s,
            manners: 3,
            shown_paths: engine.max_snapshot_paths as u32,
        }
    }
}

/// Predictors by their number.
const PREDICTORS: [PredictorKind; 3] = [
    PredictorKind::Hold,
    PredictorKind::Linear,
    PredictorKind::Geometric(GeometricSettings::FULL),
];

/// One of a list by its number.
fn choice<T: Copy>(name: &str, value: u32, choices: &[T]) -> Result<T, Fault> {
    let most = choices.len() - 1;
    choices.get(value as usize).copied().ok_or_else(|| {
        let text = format!("{name}: {value} is no choice; give 0 to {most}");
        Fault::new(Status::BadArgument, text)
    })
}

impl Options {
    /// The engine's own settings, with a head-related set as the file has it, or none.
    ///
    /// # Errors
    /// [`Status::BadArgument`] for a choice that is none, [`Status::Format`] for a head-related set that cannot be read.
    /// Ranges are the engine's to check.
    pub fn settings(&self, hrtf: Option<&[u8]>) -> Result<EngineSettings, Fault> {
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
            // Not a number is not zero, and the engine refuses it.
            frame_time: if self.frame_s == 0.0 {
                FrameTime::Measured
            } else {
                FrameTime::Fixed(self.frame_s)
            },
            ..EngineSettings::default()
        };
        if self.manners > 3 {
            let text = format!("manners: {} has unknown bits; give 0 to 3", self.manners);
            return Err(Fault::new(Status::BadArgument, text));
        }
        settings.device_hints.thermal = self.manners & 1 != 0;
        settings.device_hints.hints = self.manners & 2 != 0;
        settings.max_snapshot_paths = self.shown_paths as usize;
        settings.generation.rate_hz = self.rate_hz;
        settings.generation.max_sources = self.max_sources as usize;
        settings.generation.max_voices = self.max_voices as usize;
        settings.generation.fine_voices = self.fine_voices as usize;
        settings.generation.max_delay_s = self.max_delay_s;
        settings.generation.late = choice("late", self.late, &[false, true])?;
        settings.generation.limiter = choice("limiter", self.limiter, &[false, true])?;
        settings.generation.ceiling_db = self.ceiling_db;
        settings.propagation.guide_rays = self.guide_rays;
        settings.propagation.source_rays = self.source_rays;
        settings.propagation.depth = self.depth as usize;
        settings.propagation.seed = self.seed.into();
        settings.propagation.min_distance_m = self.nearest_m;
        settings.hrtf = match (choice("head", self.head, &[false, true])?, hrtf) {
            (true, _) => Some(Arc::new(Hrtf::omnidirectional(self.rate_hz)?)),
            (false, Some(bytes)) => Some(Arc::new(Hrtf::parse(bytes, "the given head")?)),
            (false, None) => None,
        };
        Ok(settings)
    }

    /// From numbers in the order of the fields, without `size`: how Java gives them.
    ///
    /// # Errors
    /// [`Status::BadArgument`] for another number of numbers, and for one that its field cannot hold.
    pub fn from_numbers(numbers: &[f64]) -> Result<Self, Fault> {
        let mut next = Numbers::new("options", numbers, OPTION_NUMBERS)?;
        Ok(Self {
            size: size_of::<Self>() as u32,
            rate_hz: next.count()?,
            block_frames: next.count()?,
            max_sources: next.count()?,
            max_voices: next.count()?,
            fine_voices: next.count()?,
            max_paths: next.count()?,
            guide_rays: next.count()?,
            source_rays: next.count()?,
            depth: next.count()?,
            seed: next.count()?,
            schedule: next.count()?,
            predictor: next.count()?,
            affinity: next.count()?,
            propagation_core: next.count()?,
            sound_core: next.count()?,
            head: next.count()?,
            late: next.count()?,
            limiter: next.count()?,
            nearest_m: next.number()? as f32,
            ceiling_db: next.number()? as f32,
            frame_s: next.number()?,
            max_delay_s: next.number()?,
            manners: next.count()?,
            shown_paths: next.count()?,
        })
    }

    /// The other way round.
    pub fn numbers(&self) -> [f64; OPTION_NUMBERS] {
        let counts = [
            self.rate_hz,
            self.block_frames,
            self.max_sources,
            self.max_voices,
            self.fine_voices,
            self.max_paths,
            self.guide_rays,
            self.source_rays,
            self.depth,
            self.seed,
            self.schedule,
            self.predictor,
            self.affinity,
            self.propagation_core,
            self.sound_core,
            self.head,
            self.late,
            self.limiter,
        ];
        let mut numbers = [0.0; OPTION_NUMBERS];
        for (number, count) in numbers.iter_mut().zip(counts) {
            *number = count.into();
        }
        numbers[18] = self.nearest_m.into();
        numbers[19] = self.ceiling_db.into();
        numbers[20] = self.frame_s;
        numbers[21] = self.max_delay_s;
        numbers[22] = self.manners.into();
        numbers[23] = self.shown_paths.into();
        numbers
    }
}

#[cfg(test)]
mod tests {
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
        assert_eq!(Options::from_numbers(&options.numbers()), Ok(options));
    }

    #[test]
    fn numbers_that_cannot_be_are_refused() {
        let mut numbers = Options::default().numbers();
        assert!(Options::from_numbers(&numbers[1..]).is_err());
        for wrong in [-1.0, 0.5, f64::NAN, f64::INFINITY, 1e10] {
            numbers[0] = wrong;
            let fault = Options::from_numbers(&numbers).expect_err("is no rate");
            assert_eq!(fault.status, Status::BadArgument);
        }
        let head = Options {
            head: 7,
            ..Options::default()
        };
        assert!(head.settings(None).is_err());
    }
}
