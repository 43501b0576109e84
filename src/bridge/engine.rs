//! An engine behind a handle: its controller, and the settings of sources, which accompany their poses.
//!
//! Any control thread; calls on one engine wait for each other.

use super::clip::CLIPS;
use super::error::CallError;
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
use crate::runtime::{Controller, Engine};
use crate::scene::{Directivity, Effects, ListenerPose, SourcePose, SourceSettings};
use glam::Vec3;

// The array below has a literal length, which cbindgen reads.
const _: () = assert!(BANDS == 8);

/// Engines.
pub static ENGINES: HandleTable<EngineControl> = HandleTable::new(Kind::Engine);

record! {
    /// Settings of a source. Fill it with the defaults, then change fields.
    pub struct SourceOptions[size] {
        /// Computed parts, a sum of bits: 1 direct, 2 reflections, 4 diffraction, 8 transmission, 16 late reverb.
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
            effects: 31,
            radius_m: 0.0,
            order: Directivity::OMNI.order,
            directivity: Directivity::OMNI.weight,
        }
    }
}

impl SourceOptions {
    fn settings(&self) -> Result<SourceSettings, CallError> {
        let out_of_range =
            |name, value: f32, range| CallError::bad(format!("{name}: {value} is outside {range}"));
        if self.effects > 31 {
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
        let has = |bit: u32| self.effects & bit != 0;
        Ok(SourceSettings {
            directivity: Directivity {
                weight: self.directivity,
                order: self.order,
                table: None,
            },
            radius_m: (self.radius_m > 0.0).then_some(self.radius_m),
            effects: Effects {
                direct: has(1),
                reflections: has(2),
                diffraction: has(4),
                transmission: has(8),
                late: has(16),
            },
        })
    }
}

/// The control half of an engine.
pub struct EngineControl {
    controller: Controller,
    /// Scratch: the poses of a tick.
    poses: Vec<SourcePose>,
}

/// Creates an engine; returns the handles of its control half and of its renderer.
///
/// # Errors
/// `Status::BadArgument` names an option out of range, `Status::Format` for an invalid HRTF set, `Status::State` if
/// no thread can be started, `Status::Full`.
pub fn create(options: &Options, hrtf: Option<&[u8]>) -> Result<(u64, u64), CallError> {
    let (controller, renderer) = Engine::new(options.settings(hrtf)?)?;
    let slots = options.max_sources as usize;
    let control = EngineControl {
        controller,
        poses: Vec::with_capacity(2 * slots),
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

    /// Sets a source's options from the next tick on.
    ///
    /// # Errors
    /// `Status::BadArgument` names the value out of range, `Status::StaleSource`.
    pub fn configure(&mut self, source: u32, options: &SourceOptions) -> Result<(), CallError> {
        let settings = options.settings()?;
        Ok(self
            .controller
            .configure_source(source_id(source), settings)?)
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

    /// Sets rays and reflection order of propagation.
    ///
    /// # Errors
    /// `Status::BadArgument` names the value out of range.
    pub fn set_propagation(
        &mut self,
        guide_rays: u32,
        source_rays: u32,
        depth: u32,
    ) -> Result<(), CallError> {
        let mut settings = self.controller.settings().propagation;
        settings.guide_rays = guide_rays;
        settings.source_rays = source_rays;
        settings.depth = depth as usize;
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
