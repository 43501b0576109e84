//! An engine behind a handle: the controller, and what sources are like, which travels with their poses.
//!
//! Control side, any thread, one call at a time: calls on one engine wait for each other.

use super::clip::CLIPS;
use super::fault::{Fault, Status};
use super::health::{BudgetOptions, EngineHealth};
use super::options::Options;
use super::picture::ShownPath;
use super::pose::{Pose, source_id};
use super::scenes::SCENES;
use super::sound::{RENDERERS, STREAMS};
use super::statistics::EngineStatistics;
use super::table::{Kind, Table};
use crate::acoustics::BANDS;
use crate::runtime::{Controller, Engine};
use crate::scene::{Directivity, Effects, ListenerPose, SourcePose, SourceSettings};
use glam::Vec3;

// The header says eight.
const _: () = assert!(BANDS == 8);

/// All engines.
pub static ENGINES: Table<Session> = Table::new(Kind::Engine);

/// What a source is like. Fill it with the defaults first, then change what is to differ.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SourceOptions {
    /// Bytes of this structure, as the caller knows it: what lies beyond takes its default.
    pub size: u32,
    /// What is computed of it, a sum of bits: 1 direct, 2 reflections, 4 diffraction, 8 transmission, 16 late reverb.
    pub effects: u32,
    /// Radius in metres within which it gets no louder; 0 as the engine has it.
    pub radius_m: f32,
    /// Exponent of the directivity, 0 to 64.
    pub order: f32,
    /// Directivity in each band, from the lowest: 0 sounds all around, 0.5 is a cardioid, 1 a dipole.
    pub directivity: [f32; 8],
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
    fn settings(&self) -> Result<SourceSettings, Fault> {
        let wrong = |text: String| Err(Fault::new(Status::BadArgument, text));
        if self.effects > 31 {
            let text = format!("effects: {} has unknown bits; give 0 to 31", self.effects);
            return wrong(text);
        }
        if !(0.0..=64.0).contains(&self.order) {
            return wrong(format!("order: {} is outside 0 to 64", self.order));
        }
        if !(self.radius_m.is_finite() && self.radius_m >= 0.0) {
            let text = format!("radius: {} is none; give metres, or 0", self.radius_m);
            return wrong(text);
        }
        if let Some(weight) = self.directivity.iter().find(|w| !(0.0..=1.0).contains(*w)) {
            return wrong(format!("directivity: {weight} is outside 0 to 1"));
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

/// An engine's control side.
pub struct Session {
    controller: Controller,
    /// Each slot's pose as it was last given.
    last: Vec<Option<SourcePose>>,
    /// Slots whose settings have changed since the last tick.
    changed: Vec<usize>,
    /// The poses of a tick.
    poses: Vec<SourcePose>,
}

/// Makes an engine; gives the handles of its two halves.
///
/// # Errors
/// [`Status::BadArgument`] names an option outside its range, [`Status::Format`] for a head-related set that is none,
/// [`Status::State`] if no thread can be started, [`Status::Full`].
pub fn create(options: &Options, hrtf: Option<&[u8]>) -> Result<(u64, u64), Fault> {
    let (controller, renderer) = Engine::new(options.settings(hrtf)?)?;
    let slots = options.max_sources as usize;
    let session = Session {
        controller,
        last: vec![None; slots],
        changed: Vec::with_capacity(slots),
        poses: Vec::with_capacity(2 * slots),
    };
    let engine = ENGINES.insert(session)?;
    match RENDERERS.insert(renderer.into()) {
        Ok(renderer) => Ok((engine, renderer)),
        Err(full) => {
            drop(ENGINES.remove(engine));
            Err(full)
        }
    }
}

impl Session {
    /// One graphics frame.
    ///
    /// # Errors
    /// The first pose that is none or a source's that is not there; the frame goes out all the same, with the last good
    /// poses.
    pub fn tick(
        &mut self,
        listener: ListenerPose,
        sources: impl Iterator<Item = Pose>,
    ) -> Result<(), Fault> {
        self.poses.clear();
        let most = self.poses.capacity().max(self.last.len());
        for pose in sources.take(most) {
            let slot = source_id(pose.source).slot();
            let last = self.last.get_mut(slot).and_then(Option::as_mut);
            let settings = last
                .as_ref()
                .map_or_else(SourceSettings::default, |last| last.settings);
            let pose = pose.source(settings);
            let is_good = pose.position.is_finite() && pose.orientation.is_finite();
            if let Some(last) = last.filter(|last| is_good && last.id == pose.id) {
                *last = pose;
            }
            self.poses.push(pose);
        }
        // A source that has changed but not moved.
        for slot in self.changed.drain(..) {
            if let Some(Some(pose)) = self.last.get(slot)
                && !self.poses.iter().any(|given| given.id == pose.id)
            {
                self.poses.push(*pose);
            }
        }
        Ok(self.controller.tick(listener, &self.poses)?)
    }

    /// Adds a silent source.
    ///
    /// # Errors
    /// [`Status::State`] if all slots are in use, [`Status::BadArgument`] for a place that is none.
    pub fn add_source(&mut self, position_m: [f32; 3]) -> Result<u32, Fault> {
        let position = Vec3::from_array(position_m);
        let id = self.controller.add_source(position)?;
        if let Some(last) = self.last.get_mut(id.slot()) {
            *last = Some(SourcePose::at(id, position));
        }
        Ok(id.bits())
    }

    /// Removes a source.
    ///
    /// # Errors
    /// [`Status::StaleSource`].
    pub fn remove_source(&mut self, source: u32) -> Result<(), Fault> {
        let id = source_id(source);
        self.controller.remove_source(id)?;
        if let Some(last) = self.last.get_mut(id.slot()) {
            *last = None;
        }
        Ok(())
    }

    /// Says what a source is like, from the next tick on.
    ///
    /// # Errors
    /// [`Status::BadArgument`] names what is out of range, [`Status::StaleSource`].
    pub fn configure(&mut self, source: u32, options: &SourceOptions) -> Result<(), Fault> {
        let settings = options.settings()?;
        let id = source_id(source);
        let last = self.last.get_mut(id.slot()).and_then(Option::as_mut);
        let Some(last) = last.filter(|last| last.id == id) else {
            // The engine's own words for it.
            return Ok(self.controller.mute_source(id, false)?);
        };
        last.settings = settings;
        if !self.changed.contains(&id.slot()) {
            self.changed.push(id.slot());
        }
        Ok(())
    }

    /// The engine's controller.
    pub fn controller(&mut self) -> &mut Controller {
        &mut self.controller
    }

    /// What the engine tells about itself.
    pub fn statistics(&self) -> EngineStatistics {
        let controller = &self.controller;
        let sources = controller.source_count();
        EngineStatistics::new(&controller.statistics(), controller.state(), sources)
    }

    /// How the engine bears its load, and the phone its heat.
    pub fn health(&self) -> EngineHealth {
        EngineHealth::new(&self.controller.statistics(), self.controller.state())
    }

    /// Says what may be spent.
    ///
    /// # Errors
    /// [`Status::BadArgument`] names what is out of range; nothing changes then.
    pub fn set_budget(&mut self, options: &BudgetOptions) -> Result<(), Fault> {
        Ok(self.controller.set_budget(options.budget()?)?)
    }

    /// The loudest paths of the newest update, as many as the options say.
    pub fn shown_paths(&mut self) -> impl Iterator<Item = ShownPath> {
        self.controller.path_snapshot().iter().map(ShownPath::from)
    }

    /// Sets rays and depth of propagation.
    ///
    /// # Errors
    /// [`Status::BadArgument`] names what is out of range.
    pub fn set_propagation(
        &mut self,
        guide_rays: u32,
        source_rays: u32,
        depth: u32,
    ) -> Result<(), Fault> {
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
/// The handles'.
pub fn set_scene(engine: u64, scene: u64) -> Result<(), Fault> {
    let scene = SCENES.with(scene, |scene| Ok(scene.clone()))?;
    ENGINES.with(engine, |session| Ok(session.controller.set_scene(scene)?))
}

/// Plays a clip from its beginning. The clip's handle may be closed afterwards.
///
/// # Errors
/// The handles'; [`Status::StaleSource`]; [`Status::BadArgument`] for a clip that was made for another rate.
pub fn play(engine: u64, source: u32, clip: u64, looped: bool) -> Result<(), Fault> {
    let (samples, rate_hz) = CLIPS.with(clip, |clip| Ok((clip.samples.clone(), clip.rate_hz)))?;
    ENGINES.with(engine, |session| {
        let wanted_hz = session.controller.settings().generation.rate_hz;
        if rate_hz != wanted_hz {
            let text = format!(
                "the clip was made for {rate_hz} Hz and the engine runs at {wanted_hz}; make it for the engine's rate"
            );
            return Err(Fault::new(Status::BadArgument, text));
        }
        Ok(session.controller.play(source_id(source), samples, looped)?)
    })
}

/// Plays what is written to a stream from now on; gives its handle.
///
/// # Errors
/// The handle's; [`Status::StaleSource`]; [`Status::BadArgument`] for a capacity outside 1 to 2^24 samples.
pub fn stream(engine: u64, source: u32, capacity: usize) -> Result<u64, Fault> {
    let writer = ENGINES.with(engine, |session| {
        Ok(session.controller.stream(source_id(source), capacity)?)
    })?;
    STREAMS.insert(writer)
}
