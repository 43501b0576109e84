//! The app behind the page: an engine in real time with a null device, a listener who walks, sources and doors that are
//! dragged.

use std::sync::{Arc, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use foresound::extrapolation::{LATE_DIRECTION_VECTORS, PredictorKind};
use foresound::runtime::engine::{FrameNumbers, SnapshotPath};
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSettings, EngineState, NullDevice,
};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    procedural,
};
use foresound::{BANDS, Result};
use glam::{DVec3, Quat, Vec3};
use serde::Deserialize;
use serde_json::{Value, json};

use super::heard::Heard;
use crate::inputs::{LoadedScene, voice};
use crate::walker::{Pressed, Walker};

/// The app's graphics frame.
const GRAPHICS_FRAME: Duration = Duration::from_micros(16_667);
/// Graphics frames between two states for the page.
const STATE_FRAMES: u64 = 2;
/// Most paths that are drawn.
const MAX_SHOWN_PATHS: usize = 512;
/// Width, height and thickness of a door in metres.
const DOOR_M: Vec3 = Vec3::new(0.05, 2.06, 0.9);
/// Energy that is shown as silence: -120 dB.
const QUIETEST_ENERGY: f32 = 1e-12;
/// Farthest coordinate that a source is dragged to, in metres.
const FARTHEST_M: f32 = 1e5;

/// What the command line asks for.
pub(crate) struct Wanted {
    pub(crate) sources: usize,
    /// Feet of hinges.
    pub(crate) doors: Vec<Vec3>,
    pub(crate) predictor: PredictorKind,
}

/// A request of the page: what is pressed now, and what is dragged.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Input {
    /// Letters of w, a, s, d, q, e.
    #[serde(default)]
    keys: String,
    /// Sources by number, with their new positions in metres.
    #[serde(default)]
    sources: Vec<(usize, [f32; 3])>,
    /// Doors by number, with their new angles in radians.
    #[serde(default)]
    doors: Vec<(usize, f32)>,
}

/// What the page's requests share with the app's thread.
pub(crate) struct Shared {
    #[expect(
        clippy::disallowed_types,
        reason = "between the app's thread and requests of the page"
    )]
    inputs: std::sync::Mutex<Vec<Input>>,
    #[expect(
        clippy::disallowed_types,
        reason = "between the app's thread and requests of the page"
    )]
    state: std::sync::Mutex<String>,
    pub(crate) heard: Arc<Heard>,
}

/// Requests that wait for the app's thread; more are dropped.
const MAX_INPUTS: usize = 64;

impl Shared {
    /// Queues a request.
    pub(crate) fn push(&self, input: Input) {
        let mut inputs = self.inputs.lock().unwrap_or_else(PoisonError::into_inner);
        if inputs.len() < MAX_INPUTS {
            inputs.push(input);
        }
    }

    /// The newest state as JSON.
    pub(crate) fn state(&self) -> String {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.clone()
    }
}

/// A door: a leaf that turns about its hinge.
struct Door {
    id: InstanceId,
    hinge: DVec3,
    angle: f32,
}

impl Door {
    fn pose(&self) -> InstancePose {
        let mut pose = InstancePose::at(self.id, self.hinge);
        pose.rotation = Quat::from_rotation_y(self.angle);
        pose
    }
}

/// The app.
pub(crate) struct Simulation {
    controller: Controller,
    /// Renders until it is dropped.
    _device: NullDevice,
    shared: Arc<Shared>,
    walker: Walker,
    /// Whether a key was pressed: until then the listener takes the scene's own walk.
    by_keys: bool,
    sources: Vec<(SourceId, Vec3)>,
    doors: Vec<Door>,
}

impl Simulation {
    /// An engine with a scene, voices and doors, and what the page shares with it.
    pub(crate) fn new(loaded: &LoadedScene, wanted: &Wanted) -> Result<(Self, Arc<Shared>)> {
        let mut settings = EngineSettings::default();
        settings.generation.max_sources = wanted.sources;
        settings.predictor = wanted.predictor;
        settings.max_snapshot_paths = MAX_SHOWN_PATHS;
        let rate_hz = settings.generation.rate_hz;
        let block_frames = settings.block_frames;
        let (mut controller, mut renderer) = Engine::new(settings)?;
        controller.set_scene(Arc::clone(&loaded.scene))?;
        let walker = Walker::new(loaded);
        let mut sources = Vec::new();
        for number in 0..wanted.sources {
            let position = source_position(loaded, &walker, number);
            let id = controller.add_source(position)?;
            controller.play(id, voice(number, rate_hz)?.samples.into(), true)?;
            sources.push((id, position));
        }
        let doors = add_doors(&mut controller, &wanted.doors)?;
        let heard = Heard::new(rate_hz);
        let mut writer = heard.writer();
        let device = NullDevice::start(
            rate_hz,
            block_frames,
            AffinityPolicy::System,
            move |block| {
                renderer.render(block);
                writer.write(block);
            },
        )?;
        let shared = Arc::new(Shared {
            inputs: Vec::with_capacity(MAX_INPUTS).into(),
            state: String::from("{}").into(),
            heard,
        });
        let simulation = Self {
            controller,
            _device: device,
            shared: Arc::clone(&shared),
            walker,
            by_keys: false,
            sources,
            doors,
        };
        Ok((simulation, shared))
    }

    /// Ticks the engine until the time is over; without one until the program ends.
    #[expect(clippy::disallowed_methods, reason = "an app keeps time")]
    pub(crate) fn keep_going(mut self, length: Option<Duration>) -> Result<()> {
        let began = Instant::now();
        let mut due = began;
        for frame in 0u64.. {
            if length.is_some_and(|length| began.elapsed() >= length) {
                break;
            }
            self.take_inputs()?;
            let listener = match self.by_keys {
                true => self.walker.step(GRAPHICS_FRAME.as_secs_f32()),
                false => self.walker.follow(began.elapsed().as_secs_f64()),
            };
            self.controller.tick(listener, &[])?;
            if self.controller.state() == EngineState::PropagationFailed {
                self.controller.restart()?;
            }
            if frame % STATE_FRAMES == 0 {
                let state = self.state(&listener).to_string();
                let mut shown = self
                    .shared
                    .state
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner);
                *shown = state;
            }
            due += GRAPHICS_FRAME;
            let rest = due.saturating_duration_since(Instant::now());
            if rest.is_zero() {
                due = Instant::now();
            }
            thread::sleep(rest);
        }
        Ok(())
    }

    fn take_inputs(&mut self) -> Result<()> {
        let mut inputs = self
            .shared
            .inputs
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        for input in inputs.drain(..) {
            for key in input.keys.chars() {
                if let Some(pressed) = pressed(key) {
                    self.walker.press(pressed);
                    self.by_keys = true;
                }
            }
            for (number, position) in input.sources {
                let position = Vec3::from(position);
                let is_near = position.is_finite() && position.abs().max_element() <= FARTHEST_M;
                if let Some((id, at)) = self.sources.get_mut(number).filter(|_| is_near) {
                    *at = position;
                    self.controller.move_source(*id, position)?;
                }
            }
            for (number, angle) in input.doors {
                if let Some(door) = self.doors.get_mut(number).filter(|_| angle.is_finite()) {
                    door.angle = angle.rem_euclid(std::f32::consts::TAU);
                    self.controller.set_instance_pose(&door.pose())?;
                }
            }
        }
        Ok(())
    }

    /// All that the page draws, in metres, seconds and dB.
    fn state(&mut self, listener: &ListenerPose) -> Value {
        let ahead = listener.orientation * Vec3::NEG_Z;
        let paths: Vec<Value> = self
            .controller
            .path_snapshot()
            .iter()
            .map(|path| shown_path(path, &self.sources))
            .collect();
        let reverb = shown_reverb(self.controller.frame_numbers());
        let statistics = self.controller.statistics();
        let settings = self.controller.settings();
        let period_s = settings.block_frames as f64 / f64::from(settings.generation.rate_hz);
        let doors: Vec<Value> = self
            .doors
            .iter()
            .map(|door| json!({ "hinge": door.hinge.to_array(), "angle": door.angle }))
            .collect();
        let sources: Vec<[f32; 3]> = self.sources.iter().map(|(_, at)| at.to_array()).collect();
        json!({
            "listener": listener.position.to_array(),
            "ahead": ahead.to_array(),
            "sources": sources,
            "doors": doors,
            "door_m": DOOR_M.to_array(),
            "paths": paths,
            "reverb": reverb,
            "update_ms": 1e3 * statistics.propagation_s,
            "level": statistics.extrapolation_level,
            "quality": statistics.quality_level.0,
            "all_paths": statistics.paths,
            "rays": statistics.rays,
            "block_percent": 100.0 * statistics.block.p50_s / period_s,
            "worst_percent": 100.0 * statistics.block.worst_s / period_s,
            "missed": statistics.missed_deadlines,
            "predictor": settings.predictor.name(),
        })
    }
}

/// The direction of a key.
fn pressed(key: char) -> Option<Pressed> {
    Some(match key {
        'w' => Pressed::Ahead,
        's' => Pressed::Back,
        'a' => Pressed::Left,
        'd' => Pressed::Right,
        'q' => Pressed::TurnLeft,
        'e' => Pressed::TurnRight,
        _ => return None,
    })
}

fn shown_path(path: &SnapshotPath, sources: &[(SourceId, Vec3)]) -> Value {
    let source = sources.iter().position(|(id, _)| *id == path.source);
    let corners: Vec<f32> = path
        .corners()
        .iter()
        .flat_map(|corner| corner.to_array())
        // Millimetres: the page draws them.
        .map(|metres| (1e3 * metres).round() / 1e3)
        .collect();
    json!({
        "source": source,
        "order": path.order,
        "edges": path.diffraction_order,
        "db": (10.0 * path.level_db).round() / 10.0,
        "corners": corners,
    })
}

/// The late reverb of all sources: its level in dB by direction and band, where the directions are, and its decay times.
fn shown_reverb(numbers: &FrameNumbers) -> Value {
    let tenths = |value: f32| (10.0 * value).round() / 10.0;
    let levels: Vec<Vec<f32>> = numbers
        .reverb_energy_by_direction()
        .iter()
        .map(|bands| {
            bands
                .map(|energy| tenths(10.0 * energy.max(QUIETEST_ENERGY).log10()))
                .into()
        })
        .collect();
    // The mean over sources by energy.
    let decay_s: Vec<f32> = (0..BANDS)
        .map(|b| {
            let own = numbers.sources().iter();
            let energies = own.map(|own| (own.reverb_send[b].powi(2), own.decay_time_s[b]));
            let (sum, weighted) = energies.fold((0.0, 0.0), |(sum, weighted), (energy, time_s)| {
                (sum + energy, weighted + energy * time_s)
            });
            (100.0 * weighted / f32::max(sum, QUIETEST_ENERGY)).round() / 100.0
        })
        .collect();
    json!({
        "directions": LATE_DIRECTION_VECTORS.map(|direction| direction.to_array()),
        "levels_db": levels,
        "decay_s": decay_s,
    })
}

/// A position of the layout, or one around the listener's first.
fn source_position(loaded: &LoadedScene, walker: &Walker, number: usize) -> Vec3 {
    let given = loaded.sources();
    given.get(number).copied().unwrap_or_else(|| {
        let angle = number as f32 * 2.4;
        walker.position() + 2.0 * Vec3::new(angle.cos(), 0.0, angle.sin())
    })
}

fn add_doors(controller: &mut Controller, hinges: &[Vec3]) -> Result<Vec<Door>> {
    if hinges.is_empty() {
        return Ok(Vec::new());
    }
    let mut leaf = procedural::shoebox(DOOR_M, "door_wood");
    for vertex in &mut leaf.vertices {
        vertex.x -= 0.5 * DOOR_M.x;
    }
    let table = MaterialTable::built_in();
    let leaf = Arc::new(Scene::commit(&leaf, &table, &SceneSettings::default())?);
    let add = |hinge: &Vec3| {
        let mut door = Door {
            id: InstanceId::default(),
            hinge: hinge.as_dvec3(),
            angle: 0.0,
        };
        door.id = controller.add_instance(Arc::clone(&leaf), &door.pose())?;
        Ok(door)
    };
    hinges.iter().map(add).collect()
}
