//! `ForesoundEngine`: the engine, its player, and the frame.

use std::collections::BTreeSet;

use foresound::{Controller, Engine, EngineSettings, EngineState, ListenerPose};
use godot::classes::{AudioServer, AudioStreamPlayer, INode, Node};
use godot::prelude::*;

use crate::coordinates::to_godot;
use crate::nodes::{
    ForesoundGeometry, ForesoundInstance, ForesoundListener3D, ForesoundSource3D, GEOMETRY,
    INSTANCES, LISTENERS, SOURCES,
};
use crate::playback::ForesoundStream;
use crate::scene::{Scenes, posed};
use crate::sources::Voices;

/// After the nodes of a game have moved.
const PROCESS_PRIORITY: i32 = 1 << 16;

/// The engine: one node a game. It reads all Foresound nodes once a frame and plays through a bus.
#[derive(GodotClass)]
#[class(base = Node, init)]
pub(crate) struct ForesoundEngine {
    /// Sources with a slot of their own, 1 to 256.
    #[export]
    #[init(val = 16)]
    source_slots: i32,
    /// Sources, to 4096: beyond the slots the loudest keep slots of their own, and neighbours share one.
    #[export]
    #[init(val = 16)]
    max_sources: i32,
    /// The bus that it plays through.
    #[export]
    #[init(val = "Master".into())]
    bus: StringName,
    /// Paths of `drawn_paths`, to 16384.
    #[export]
    max_drawn_paths: i32,
    running: Option<Running>,
    base: Base<Node>,
}

struct Running {
    controller: Controller,
    player: Gd<AudioStreamPlayer>,
    scenes: Scenes,
    voices: Voices,
    listener: ListenerPose,
    problems: Problems,
}

/// Messages, each of which is printed once: a wrong value stays wrong in every frame.
#[derive(Default)]
pub(crate) struct Problems(BTreeSet<String>);

impl Problems {
    pub(crate) fn report(&mut self, about: &str, problem: &dyn std::fmt::Display) {
        let text = format!("{about}: {problem}");
        if self.0.len() < 256 && !self.0.contains(&text) {
            godot_warn!("Foresound: {text}");
            self.0.insert(text);
        }
    }
}

#[godot_api]
impl ForesoundEngine {
    /// Builds the fixed scene anew, after walls were moved or deformed.
    #[func]
    fn rebuild(&mut self) {
        if let Some(running) = &mut self.running {
            running.scenes.rebuild();
        }
    }

    /// Whether a scene is being built.
    #[func]
    fn is_building(&self) -> bool {
        let running = self.running.as_ref();
        running.is_some_and(|running| running.controller.is_building())
    }

    /// Milliseconds of the newest update.
    #[func]
    fn update_ms(&self) -> f64 {
        let running = self.running.as_ref();
        running.map_or(0.0, |own| 1e3 * own.controller.statistics().propagation_s)
    }

    /// Number of updates that were heard so far: what moved is heard from the second one after it on.
    #[func]
    fn update_count(&self) -> i64 {
        let running = self.running.as_ref();
        running.map_or(0, |own| own.controller.statistics().updates as i64)
    }

    /// Number of paths of the newest update.
    #[func]
    fn path_count(&self) -> i64 {
        let running = self.running.as_ref();
        running.map_or(0, |own| own.controller.statistics().paths as i64)
    }

    /// The loudest paths of the newest update: the corners of each, from the source to the listener, in world coordinates.
    #[func]
    fn drawn_paths(&mut self) -> Array<PackedVector3Array> {
        let Some(running) = &mut self.running else {
            return Array::new();
        };
        let paths = running.controller.path_snapshot().iter();
        paths
            .map(|path| {
                let corners: Vec<Vector3> = path.corners().iter().map(|c| to_godot(*c)).collect();
                PackedVector3Array::from(corners)
            })
            .collect()
    }

    /// Pauses all sound, or continues it.
    #[func]
    fn set_paused(&mut self, paused: bool) {
        if let Some(running) = &mut self.running {
            match paused {
                true => running.controller.pause(),
                false => running.controller.resume(),
            }
        }
    }

    fn start(&mut self) -> foresound::Result<()> {
        let mut settings = EngineSettings::default();
        settings.generation.rate_hz = AudioServer::singleton().get_mix_rate() as u32;
        settings.generation.max_sources = usize::try_from(self.source_slots).unwrap_or(0);
        settings.max_sources = Some(usize::try_from(self.max_sources).unwrap_or(0));
        settings.max_snapshot_paths = usize::try_from(self.max_drawn_paths).unwrap_or(0);
        let (controller, renderer) = Engine::new(settings)?;
        let mut player = AudioStreamPlayer::new_alloc();
        player.set_stream(&ForesoundStream::of(renderer));
        player.set_bus(&self.bus);
        self.base_mut().add_child(&player);
        player.play();
        self.running = Some(Running {
            controller,
            player,
            scenes: Scenes::default(),
            voices: Voices::default(),
            listener: ListenerPose::default(),
            problems: Problems::default(),
        });
        Ok(())
    }
}

#[godot_api]
impl INode for ForesoundEngine {
    fn ready(&mut self) {
        self.base_mut().set_process_priority(PROCESS_PRIORITY);
        if let Err(error) = self.start() {
            godot_error!("Foresound is silent: {error}");
        }
    }

    fn process(&mut self, _delta: f64) {
        let Some(mut running) = self.running.take() else {
            return;
        };
        let tree = self.base().get_tree();
        running.frame(&tree);
        self.running = Some(running);
    }

    fn exit_tree(&mut self) {
        if let Some(mut running) = self.running.take() {
            running.player.stop();
            running.player.queue_free();
        }
        // A node that comes back into the tree starts anew.
        self.base_mut().request_ready();
    }
}

/// The nodes of a group.
fn group<T: GodotClass + Inherits<Node>>(tree: &Gd<SceneTree>, name: &str) -> Vec<Gd<T>> {
    let nodes = tree.clone().get_nodes_in_group(name);
    nodes
        .iter_shared()
        .filter_map(|node| node.try_cast::<T>().ok())
        .collect()
}

impl Running {
    /// Reads all nodes and sends the frame.
    fn frame(&mut self, tree: &Gd<SceneTree>) {
        let problems = &mut self.problems;
        let controller = &mut self.controller;
        let walls = group::<ForesoundGeometry>(tree, GEOMETRY);
        self.scenes.update_fixed(&walls, controller, problems);
        let parts = posed(group::<ForesoundInstance>(tree, INSTANCES), problems);
        self.scenes.update_parts(&parts, controller, problems);
        let sources = posed(group::<ForesoundSource3D>(tree, SOURCES), problems);
        self.voices.update(&sources, controller, problems);
        let ears = posed(group::<ForesoundListener3D>(tree, LISTENERS), problems);
        match ears.as_slice() {
            [] if !self.voices.is_empty() => {
                problems.report("listener", &"add a ForesoundListener3D below the camera");
            }
            [_, _, ..] => problems.report("listener", &"there are several: the first is taken"),
            _ => {}
        }
        if let Some((_, pose)) = ears.first() {
            self.listener = ListenerPose {
                position: pose.position,
                orientation: pose.orientation,
            };
        }
        if let Err(error) = controller.tick(self.listener, &self.voices.poses) {
            problems.report("frame", &error);
        }
        if controller.state() == EngineState::PropagationFailed
            && let Err(error) = controller.restart()
        {
            problems.report("engine", &error);
        }
    }
}
