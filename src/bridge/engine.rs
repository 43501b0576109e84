//! An engine behind a handle: its controller, and the settings of sources, which accompany their poses.
//!
//! Any control thread; calls on one engine wait for each other.

use super::VERSION;
use super::clip::CLIPS;
use super::enumeration::{Effect, Predictor, Schedule};
use super::error::{CallError, Status};
use super::handles::{HandleTable, Kind};
use super::health::{BudgetOptions, EngineHealth};
use super::options::Options;
use super::pose::{Pose, source_id};
use super::record::record;
use super::scenes::SCENES;
use super::shown_paths::ShownPath;
use super::sound::{STREAMS, insert_renderer};
use super::statistics::EngineStatistics;
use crate::acoustics::BANDS;
use crate::propagation::PropagationSettings;
use crate::runtime::{Controller, Engine};
use crate::scene::{
    Directivity, DirectivityTable, Effects, ListenerPose, SourcePose, SourceSettings,
};
use glam::Vec3;

// The array below has a literal length, which cbindgen reads.
const _: () = assert!(BANDS == 8);

/// Engines.
pub static ENGINES: HandleTable<EngineControl> = HandleTable::new(Kind::Engine);

record! {
    /// Settings of a source. Begin with FORESOUND_SOURCE_OPTIONS_INIT or foresound_source_options_default, then change fields.
    pub struct SourceOptions[size] {
        /// Computed parts, a sum of ForesoundEffect.
        pub effects: u32,
        /// Radius in metres within which the source gets no louder; 0: the engine's.
        pub radius_m: f32,
        /// Exponent of the directivity, 0 to 64.
        pub order: f32,
        /// Directivity in each octave band, from the lowest: 0 omnidirectional, 0.5 cardioid, 1 dipole.
        pub directivity: [f32; 8],
    }
}

impl Default for SourceOptions {
    fn default() -> Self {
        Self {
            size: size_of::<Self>() as u32,
            effects: Effect::All.0,
            radius_m: 0.0,
            order: Directivity::OMNI.order,
            directivity: Directivity::OMNI.weight,
        }
    }
}

record! {
    /// Rays and orders of propagation. Begin with FORESOUND_PROPAGATION_OPTIONS_INIT or
    /// foresound_propagation_options_default, then change fields.
    pub struct PropagationOptions[size] {
        /// Rays from the listener an update, 1 to 65,536.
        pub guide_rays: u32,
        /// Rays from each source an update, 1 to 65,536.
        pub source_rays: u32,
        /// Maximum reflection order, 0 to 4.
        pub depth: u32,
        /// Maximum number of edges that a path is diffracted at, 0 to 2.
        pub diffraction_order: u32,
    }
}

impl Default for PropagationOptions {
    fn default() -> Self {
        let settings = PropagationSettings::default();
        Self {
            size: size_of::<Self>() as u32,
            guide_rays: settings.guide_rays,
            source_rays: settings.source_rays,
            depth: settings.depth as u32,
            diffraction_order: settings.diffraction_order as u32,
        }
    }
}

impl SourceOptions {
    fn settings(&self) -> Result<SourceSettings, CallError> {
        let out_of_range =
            |name, value: f32, range| CallError::bad(format!("{name}: {value} is outside {range}"));
        if self.effects > Effect::All.0 {
            return Err(out_of_range("effects", self.effects as f32, "0 to 31"));
        }
        if !(0.0..=64.0).contains(&self.order) {
            return Err(out_of_range("order", self.order, "0 to 64"));
        }
        if !(0.0..f32::INFINITY).contains(&self.radius_m) {
            return Err(out_of_range("radius_m", self.radius_m, "0 to infinity"));
        }
        if let Some(weight) = self.directivity.iter().find(|w| !(0.0..=1.0).contains(*w)) {
            return Err(out_of_range("directivity", *weight, "0 to 1"));
        }
        let has = |effect: Effect| self.effects & effect.0 != 0;
        Ok(SourceSettings {
            directivity: Directivity {
                weight: self.directivity,
                order: self.order,
                table: None,
            },
            radius_m: (self.radius_m > 0.0).then_some(self.radius_m),
            effects: Effects {
                direct: has(Effect::Direct),
                reflections: has(Effect::Reflections),
                diffraction: has(Effect::Diffraction),
                transmission: has(Effect::Transmission),
                late: has(Effect::LateReverb),
            },
        })
    }
}

/// Compares a caller's version with this library's: the major number.
fn check_version(api_version: u32) -> Result<(), CallError> {
    let numbers = |version: u32| {
        let [_, major, minor, patch] = version.to_be_bytes();
        format!("{major}.{minor}.{patch}")
    };
    if api_version >> 16 == VERSION >> 16 {
        return Ok(());
    }
    let [caller, library] = [api_version, VERSION].map(numbers);
    let text = format!(
        "api_version: the caller's header is of interface {caller} and the library of {library}; compile with this library's foresound.h and pass FORESOUND_API_VERSION"
    );
    Err(CallError::new(Status::Version, text))
}

/// The control half of an engine.
pub struct EngineControl {
    controller: Controller,
    /// Scratch: the poses of a tick.
    poses: Vec<SourcePose>,
}

/// Creates an engine; returns the handles of its control half and of its renderer. `api_version` is that of the caller's
/// header.
///
/// # Errors
/// `Status::Version` for another major version; `Status::BadArgument` names an option out of range, `Status::Format` for an invalid HRTF set, `Status::State` if
/// no thread can be started, `Status::Full`.
pub fn create(
    api_version: u32,
    options: &Options,
    hrtf: Option<&[u8]>,
) -> Result<(u64, u64), CallError> {
    check_version(api_version)?;
    let (controller, renderer) = Engine::new(options.settings(hrtf)?)?;
    let sources = options.max_sources as usize;
    let control = EngineControl {
        controller,
        poses: Vec::with_capacity(2 * sources),
    };
    let engine = ENGINES.insert(control)?;
    match insert_renderer(renderer) {
        Ok(renderer) => Ok((engine, renderer)),
        Err(full) => {
            drop(ENGINES.remove(engine));
            Err(full)
        }
    }
}

impl EngineControl {
    /// Submits one graphics frame.
    ///
    /// # Errors
    /// Names the first invalid pose or unknown source; the frame is submitted with the last valid poses.
    pub fn tick(
        &mut self,
        listener: ListenerPose,
        sources: impl Iterator<Item = Pose>,
    ) -> Result<(), CallError> {
        self.poses.clear();
        // As many as the list holds without allocation.
        for pose in sources.take(self.poses.capacity()) {
            let settings = self.controller.source_settings(source_id(pose.source));
            self.poses.push(pose.source(settings.unwrap_or_default()));
        }
        Ok(self.controller.tick(listener, &self.poses)?)
    }

    /// Adds a silent source.
    ///
    /// # Errors
    /// `Status::State` if all slots are in use, `Status::BadArgument` for a position that is not finite.
    pub fn add_source(&mut self, position_m: [f32; 3]) -> Result<u32, CallError> {
        let position = Vec3::from_array(position_m);
        Ok(self.controller.add_source(position)?.bits())
    }

    /// Removes a source.
    ///
    /// # Errors
    /// `Status::StaleSource`.
    pub fn remove_source(&mut self, source: u32) -> Result<(), CallError> {
        Ok(self.controller.remove_source(source_id(source))?)
    }

    /// Sets a source's options from the next tick on. Its directivity table stays.
    ///
    /// # Errors
    /// `Status::BadArgument` names the value out of range, `Status::StaleSource`.
    pub fn configure(&mut self, source: u32, options: &SourceOptions) -> Result<(), CallError> {
        let id = source_id(source);
        let mut settings = options.settings()?;
        settings.directivity.table = self.controller.source_settings(id)?.directivity.table;
        Ok(self.controller.configure_source(id, settings)?)
    }

    /// Sets a source's directivity table from the next tick on: rows of levels in dB by band. Without rows the source has
    /// none.
    ///
    /// # Errors
    /// `Status::BadArgument` for a number of levels or a level out of range, `Status::StaleSource`.
    pub fn set_directivity_table(
        &mut self,
        source: u32,
        levels_db: &[f32],
    ) -> Result<(), CallError> {
        let id = source_id(source);
        let (rows, rest) = levels_db.as_chunks::<BANDS>();
        if !rest.is_empty() {
            let text = format!("levels_db: {} levels are no rows of 8", levels_db.len());
            return Err(CallError::bad(text));
        }
        let mut settings = self.controller.source_settings(id)?;
        settings.directivity.table = match rows {
            [] => None,
            rows => Some(DirectivityTable::from_levels_db(rows)?),
        };
        Ok(self.controller.configure_source(id, settings)?)
    }

    /// Sets the extrapolation between updates, from the next update on.
    ///
    /// # Errors
    /// `Status::BadArgument`.
    pub fn set_predictor(&mut self, predictor: Predictor) -> Result<(), CallError> {
        self.controller.set_predictor(predictor.choice()?);
        Ok(())
    }

    /// Sets when propagation runs. Waits for the running update.
    ///
    /// # Errors
    /// `Status::BadArgument`; `Status::State` if no thread can be started.
    pub fn set_schedule(&mut self, schedule: Schedule) -> Result<(), CallError> {
        Ok(self.controller.set_schedule(schedule.choice()?)?)
    }

    /// The engine's controller.
    pub fn controller(&mut self) -> &mut Controller {
        &mut self.controller
    }

    /// Statistics.
    pub fn statistics(&self) -> EngineStatistics {
        let controller = &self.controller;
        let sources = controller.source_count();
        EngineStatistics::new(&controller.statistics(), controller.state(), sources)
    }

    /// Load of the engine and temperature of the phone.
    pub fn health(&self) -> EngineHealth {
        EngineHealth::new(&self.controller.statistics(), self.controller.state())
    }

    /// Sets the budget.
    ///
    /// # Errors
    /// `Status::BadArgument` names the value out of range; the budget stays.
    pub fn set_budget(&mut self, options: &BudgetOptions) -> Result<(), CallError> {
        Ok(self.controller.set_budget(options.budget()?)?)
    }

    /// The loudest paths of the newest update, at most [`Options::shown_paths`], in no order.
    pub fn shown_paths(&mut self) -> impl Iterator<Item = ShownPath> {
        self.controller.path_snapshot().iter().map(ShownPath::from)
    }

    /// Sets rays and orders of propagation.
    ///
    /// # Errors
    /// `Status::BadArgument` names the value out of range.
    pub fn set_propagation(&mut self, options: &PropagationOptions) -> Result<(), CallError> {
        let mut settings = self.controller.settings().propagation;
        settings.guide_rays = options.guide_rays;
        settings.source_rays = options.source_rays;
        settings.depth = options.depth as usize;
        settings.diffraction_order = options.diffraction_order as usize;
        Ok(self.controller.set_propagation(settings)?)
    }
}

/// Replaces an engine's scene. The scene's handle may be closed afterwards.
///
/// # Errors
/// Those of the handles.
pub fn set_scene(engine: u64, scene: u64) -> Result<(), CallError> {
    let scene = SCENES.with(scene, |scene| Ok(scene.clone()))?;
    ENGINES.with(engine, |engine| Ok(engine.controller.set_scene(scene)?))
}

/// Plays a clip from its beginning. The clip's handle may be closed afterwards.
///
/// # Errors
/// Those of the handles; `Status::StaleSource`; `Status::BadArgument` for a clip at another rate.
pub fn play(engine: u64, source: u32, clip: u64, looped: bool) -> Result<(), CallError> {
    let (samples, rate_hz) = CLIPS.with(clip, |clip| Ok((clip.samples.clone(), clip.rate_hz)))?;
    ENGINES.with(engine, |engine| {
        let wanted_hz = engine.controller.settings().generation.rate_hz;
        if rate_hz != wanted_hz {
            let text = format!(
                "the clip is at {rate_hz} Hz and the engine at {wanted_hz} Hz; make it for the engine's rate"
            );
            return Err(CallError::bad(text));
        }
        Ok(engine.controller.play(source_id(source), samples, looped)?)
    })
}

/// Attaches a stream to a source; returns the handle of its writing end.
///
/// # Errors
/// Those of the handle; `Status::StaleSource`; `Status::BadArgument` for a capacity outside 1 to 2^24 samples;
/// `Status::Full`. The source then plays on as before.
pub fn stream(engine: u64, source: u32, capacity: usize) -> Result<u64, CallError> {
    STREAMS.insert_with(|| {
        ENGINES.with(engine, |engine| {
            Ok((engine.controller.stream(source_id(source), capacity)?, 0))
        })
    })
}
