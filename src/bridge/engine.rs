//! An engine behind a handle: its controller, and the settings of sources, which accompany their poses.
//!
//! Any control thread; calls on one engine wait for each other.

use super::VERSION;
use super::enumeration::{DistanceCurve, Effect, Predictor, Schedule};
use super::error::{CallError, Status};
use super::handles::{HandleTable, Kind};
use super::health::{BudgetOptions, EngineHealth};
use super::numbers::{SourceNumbers, SourcePath};
use super::options::Options;
use super::pose::{Pose, source_id};
use super::record::record;
use super::scenes::SCENES;
use super::shown_paths::ShownPath;
use super::sound::{STREAMS, insert_renderer};
use super::statistics::EngineStatistics;
use crate::acoustics::{BANDS, Material};
use crate::generation::Hrtf;
use crate::propagation::PropagationSettings;
use crate::runtime::{Controller, Engine};
use crate::scene::{
    DEFAULT_PRIORITY, Directivity, DirectivityTable, DistanceCurve as Curve, DistanceTable,
    Effects, ListenerPose, SourceExtent, SourceMix, SourcePose, SourceSettings,
};
use glam::Vec3;
use std::sync::Arc;

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
        /// Level by distance, unless the source has a distance table.
        pub distance_curve: DistanceCurve,
        /// Distance of full level in metres, for the inverse and the linear curve.
        pub distance_min_m: f32,
        /// Distance in metres from which the level is constant (inverse curve) or 0 (linear curve), at most 1e6.
        pub distance_max_m: f32,
        /// Linear gain of the direct path, 0 to 1000.
        pub direct_gain: f32,
        /// Linear gain of reflected paths, 0 to 1000.
        pub reflections_gain: f32,
        /// Linear gain of diffracted paths, 0 to 1000.
        pub diffraction_gain: f32,
        /// Linear gain of the late reverb, 0 to 1000.
        pub late_gain: f32,
        /// Strength of occlusion, 0 to 1; 1 is physics. At 0 the direct path is as loud as if nothing were in its way.
        pub occlusion: f32,
        /// Linear gain of a direct path through walls, 0 to 4; 1 is physics.
        pub transmission: f32,
        /// Factor of the delay of direct sound, 0 to 4, whose change is the Doppler shift; 1 is physics. Other sound keeps its
        /// delay after the direct sound.
        pub doppler: f32,
        /// Strength of the air's absorption along paths, 0 to 1; 1 is physics.
        pub air_absorption: f32,
        /// 1: heard without a position, propagation and late reverb, such as music; stereo clips keep their channels.
        pub is_2d: u32,
        /// 0 to 255: with more sources than slots, those of higher priority get slots of their own first.
        pub priority: u32,
        /// Semi-axes in metres of an ellipsoid around the source along its x, y and z, 0 to 1000; all 0: a point. A wide source
        /// sounds from points on the ellipsoid, of which a share may be hidden.
        pub extent_m: [f32; 3],
        /// Number of those points, 4 to 32.
        pub extent_points: u32,
    }
}

impl Default for SourceOptions {
    fn default() -> Self {
        let mix = SourceMix::PHYSICAL;
        Self {
            size: size_of::<Self>() as u32,
            effects: Effect::All.0,
            radius_m: 0.0,
            order: Directivity::OMNI.order,
            directivity: Directivity::OMNI.weight,
            distance_curve: DistanceCurve::Physical,
            distance_min_m: 1.0,
            distance_max_m: 100.0,
            direct_gain: mix.direct_gain,
            reflections_gain: mix.reflections_gain,
            diffraction_gain: mix.diffraction_gain,
            late_gain: mix.late_gain,
            occlusion: mix.occlusion,
            transmission: mix.transmission,
            doppler: mix.doppler,
            air_absorption: mix.air_absorption,
            is_2d: 0,
            priority: DEFAULT_PRIORITY.into(),
            extent_m: [0.0; 3],
            extent_points: SourceExtent::POINT.points as u32,
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

record! {
    /// Properties of a material in octave bands, from the lowest: shares of energy, 0 to 1.
    pub struct MaterialOptions[size, zeros] {
        /// Share of the incident energy that is not reflected, what passes through included.
        pub absorption: [f32; 8],
        /// Share of the reflected energy outside the specular direction.
        pub scattering: [f32; 8],
        /// Share of the incident energy behind the surface, at most the absorption.
        pub transmission: [f32; 8],
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

impl DistanceCurve {
    fn curve(self, min_m: f32, max_m: f32) -> Result<Curve, CallError> {
        match self {
            Self::Physical => Ok(Curve::Physical),
            Self::Inverse => Ok(Curve::Inverse { min_m, max_m }),
            Self::Linear => Ok(Curve::Linear { min_m, max_m }),
            Self(number) => {
                let text = format!("distance_curve: {number} is outside 0 to 2");
                Err(CallError::bad(text))
            }
        }
    }
}

impl SourceOptions {
    pub(super) fn settings(&self) -> Result<SourceSettings, CallError> {
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
        if self.is_2d > 1 {
            return Err(out_of_range("is_2d", self.is_2d as f32, "0 to 1"));
        }
        let Ok(priority) = u8::try_from(self.priority) else {
            let text = format!("priority: {} is outside 0 to 255", self.priority);
            return Err(CallError::bad(text));
        };
        let (min_m, max_m) = (self.distance_min_m, self.distance_max_m);
        for (name, value) in [("distance_min_m", min_m), ("distance_max_m", max_m)] {
            if !(0.0..=1e6).contains(&value) {
                return Err(out_of_range(name, value, "0 to 1e6"));
            }
        }
        let mix = SourceMix {
            distance: self.distance_curve.curve(min_m, max_m)?,
            direct_gain: self.direct_gain,
            reflections_gain: self.reflections_gain,
            diffraction_gain: self.diffraction_gain,
            late_gain: self.late_gain,
            occlusion: self.occlusion,
            transmission: self.transmission,
            doppler: self.doppler,
            air_absorption: self.air_absorption,
        };
        let has = |effect: Effect| self.effects & effect.0 != 0;
        Ok(SourceSettings {
            directivity: Directivity {
                weight: self.directivity,
                order: self.order,
                table: None,
            },
            radius_m: (self.radius_m > 0.0).then_some(self.radius_m),
            extent: SourceExtent {
                semi_axes_m: Vec3::from_array(self.extent_m),
                points: self.extent_points as usize,
            },
            effects: Effects {
                direct: has(Effect::Direct),
                reflections: has(Effect::Reflections),
                diffraction: has(Effect::Diffraction),
                transmission: has(Effect::Transmission),
                late: has(Effect::LateReverb),
            },
            mix,
            is_2d: self.is_2d == 1,
            priority,
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
/// `Status::Version` for another major version; `Status::BadArgument` names an option out of range, `Status::Format` for an
/// invalid HRTF set, `Status::State` if no thread can be started, `Status::Full`.
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

/// Sets an engine's HRTF set from the content of its file, baked or SOFA; `None` is the built-in one. The conversion of a SOFA
/// file does not keep the engine: other calls go on meanwhile.
///
/// # Errors
/// `Status::Format` for an invalid set, `Status::BadArgument` for one of another sample rate; the set stays.
pub fn set_hrtf(engine: u64, bytes: Option<&[u8]>) -> Result<(), CallError> {
    let rate_hz = ENGINES.with(engine, |engine| {
        Ok(engine.controller.settings().generation.rate_hz)
    })?;
    let set = bytes.map(|bytes| Hrtf::read(bytes, "the HRTF set", rate_hz));
    let set = set.transpose()?.map(Arc::new);
    ENGINES.with(engine, |engine| Ok(engine.controller.set_hrtf(set)?))
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

    /// Sets a source's options from the next tick on. Its directivity table and its distance table stay.
    ///
    /// # Errors
    /// `Status::BadArgument` names the value out of range, `Status::StaleSource`.
    pub fn configure(&mut self, source: u32, options: &SourceOptions) -> Result<(), CallError> {
        let id = source_id(source);
        let mut settings = options.settings()?;
        let before = self.controller.source_settings(id)?;
        settings.directivity.table = before.directivity.table;
        if let Curve::Table(_) = before.mix.distance {
            settings.mix.distance = before.mix.distance;
        }
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

    /// Sets a source's distance table from the next tick on: pairs of a distance in metres and a linear gain, which replace
    /// the curve of the options. Without pairs the source has the physical curve until its next options.
    ///
    /// # Errors
    /// `Status::BadArgument` for an odd number of values and for values out of range, `Status::StaleSource`.
    pub fn set_distance_table(&mut self, source: u32, points: &[f32]) -> Result<(), CallError> {
        let id = source_id(source);
        let (points, rest) = points.as_chunks::<2>();
        if !rest.is_empty() {
            return Err(CallError::bad(
                "points: pass pairs of a distance and a gain",
            ));
        }
        let mut settings = self.controller.source_settings(id)?;
        settings.mix.distance = match points {
            [] => Curve::Physical,
            points => Curve::Table(DistanceTable::new(points)?),
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

    /// Changes a material of the scene.
    ///
    /// # Errors
    /// `Status::BadArgument` names the value out of range, or the name that no surface has.
    pub fn set_material(&mut self, name: &str, options: &MaterialOptions) -> Result<(), CallError> {
        let material = Material {
            name: name.to_owned(),
            absorption: options.absorption,
            scattering: options.scattering,
            transmission: options.transmission,
        };
        Ok(self.controller.set_material(&material)?)
    }

    /// Takes the numbers of the newest graphics frame; returns the number of its tick, 0 before the first.
    pub fn take_frame(&mut self) -> u64 {
        self.controller.frame_numbers().tick()
    }

    /// The numbers of a source in the frame taken last, zeros if it has none.
    ///
    /// # Errors
    /// `Status::StaleSource`.
    pub fn source_numbers(&self, source: u32) -> Result<SourceNumbers, CallError> {
        let id = source_id(source);
        self.controller.source_settings(id)?;
        let frame = self.controller.last_frame_numbers();
        let numbers = frame.source(id);
        Ok(numbers.map_or_else(SourceNumbers::default, |numbers| {
            SourceNumbers::new(numbers, frame.paths(id).len())
        }))
    }

    /// The paths of a source in the frame taken last.
    ///
    /// # Errors
    /// `Status::StaleSource`.
    pub fn source_paths(&self, source: u32) -> Result<impl Iterator<Item = SourcePath>, CallError> {
        let id = source_id(source);
        self.controller.source_settings(id)?;
        let paths = self.controller.last_frame_numbers().paths(id);
        Ok(paths.iter().map(SourcePath::from))
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
