//! The reference walk for the comparison of the bridges and of other machines, through the Rust interface: writes its sound
//! as raw floats to one file and the paths of sixteen updates as lines of text to another (update, identity, order, length in
//! metres, eight amplitudes).

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use foresound::glam::{Quat, Vec3};
use foresound::mesh::{MeshOptions, load_mesh};
use foresound::paths::{PathSet, Propagator};
use foresound::{
    AffinityPolicy, Engine, EngineSchedule, EngineSettings, FrameTime, InstanceId, InstancePose,
    ListenerPose, MaterialTable, PropagationSettings, Result, Scene, SceneSettings, SourceId,
    SourcePose, TriangleMesh,
};

const RATE_HZ: u32 = 48_000;
/// Audio frames a graphics frame, at 60 Hz.
const FRAMES: usize = 800;
const TICKS: u32 = 90;

/// Two seconds of noise and clicks, with the same bits in every language.
fn signal() -> Vec<f32> {
    let mut state = 12_345u32;
    let mut sample = |n: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = ((state >> 16) as i32 - 32_768) as f32 / 262_144.0;
        if n % 9600 < 8 { 0.5 } else { noise }
    };
    (0..2 * RATE_HZ).map(&mut sample).collect()
}

fn load(path: &Path) -> Result<Arc<Scene>> {
    let file = load_mesh(path, &MeshOptions::default())?;
    let table = MaterialTable::built_in();
    Scene::commit(&file.mesh, &table, &SceneSettings::default()).map(Arc::new)
}

/// A panel of 2 m x 2 m.
fn panel() -> Result<Arc<Scene>> {
    let corners = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 2.0, 0.0],
        [0.0, 2.0, 0.0],
    ];
    let mesh = TriangleMesh::from_slices(&corners, &[0, 1, 2, 0, 2, 3], &[], &[])?;
    let table = MaterialTable::built_in();
    Scene::commit(&mesh, &table, &SceneSettings::default()).map(Arc::new)
}

/// Positions in metres; the near source moves a metre along z down from its start, the panel a metre up.
struct Stage {
    near: Vec3,
    near_start_z: f32,
    far: Vec3,
    panel: Vec3,
    from: Vec3,
    along: Vec3,
}

/// The walk of the bridges' programs, through the doorway.
const DOORWAY: Stage = Stage {
    near: Vec3::new(5.0, 1.5, 3.2),
    near_start_z: 3.25,
    far: Vec3::new(10.0, 1.5, 2.0),
    panel: Vec3::new(9.0, 0.0, 1.0),
    from: Vec3::new(12.5, 1.65, 0.5),
    along: Vec3::new(-6.0, 0.0, 4.0),
};
/// Down the aisle of the hall, before two of its players.
const HALL: Stage = Stage {
    near: Vec3::new(5.2, 2.5, 10.0),
    near_start_z: 10.0,
    far: Vec3::new(4.4, 2.5, 6.0),
    panel: Vec3::new(5.0, 1.5, 9.0),
    from: Vec3::new(7.75, 1.65, 3.0),
    along: Vec3::new(0.0, 0.0, 14.0),
};

fn listener_at(stage: &Stage, part: f32) -> ListenerPose {
    ListenerPose {
        position: stage.from + stage.along * part,
        orientation: Quat::from_xyzw(0.0, 0.5 * part, 0.0, 1.0),
    }
}

fn walk(scene: Arc<Scene>, stage: &Stage) -> Result<Vec<u8>> {
    let mut settings = EngineSettings::default();
    settings.schedule = EngineSchedule::Synchronous;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    settings.affinity = AffinityPolicy::System;
    settings.generation.rate_hz = RATE_HZ;
    settings.propagation.guide_rays = 256;
    let (mut controller, mut renderer) = Engine::new(settings)?;
    controller.set_scene(scene)?;
    let clip: Arc<[f32]> = signal().into();
    let near = controller.add_source(stage.near)?;
    let far = controller.add_source(stage.far)?;
    controller.play(near, Arc::clone(&clip), true)?;
    controller.play(far, clip, false)?;
    controller.set_source_gain(far, 0.5)?;
    let swing = |part: f32, id| InstancePose {
        id,
        position: (stage.panel + part * Vec3::Z).as_dvec3(),
        rotation: Quat::from_xyzw(0.0, 0.6, 0.0, 0.8),
    };
    let door = controller.add_instance(panel()?, &swing(0.0, InstanceId::default()))?;
    let mut all = Vec::new();
    let mut block = vec![0.0; 2 * FRAMES];
    for tick in 0..TICKS {
        let part = tick as f32 / TICKS as f32;
        let moving = stage.near.with_z(stage.near_start_z - part);
        controller.set_instance_pose(&swing(part, door))?;
        controller.tick(listener_at(stage, part), &[SourcePose::at(near, moving)])?;
        renderer.render(&mut block);
        all.extend(block.iter().flat_map(|sample| sample.to_le_bytes()));
    }
    Ok(all)
}

fn paths(scene: Arc<Scene>, stage: &Stage) -> Result<String> {
    let mut propagator = Propagator::new(scene, PropagationSettings::default())?;
    let source = |slot, position| SourcePose::at(SourceId::new(slot, 0), position);
    let sources = [source(0, stage.near), source(1, stage.far)];
    let (mut set, mut text) = (PathSet::default(), String::new());
    for update in 0..16u32 {
        let part = update as f32 / 16.0;
        let time_s = f64::from(update) / 10.0;
        propagator.update(&listener_at(stage, part), &sources, time_s, &mut set);
        for path in &set.paths {
            let (id, order, length_m) = (path.id.0, path.order, path.length_m);
            let _ = write!(text, "{update} {id:016x} {order} {length_m}");
            for amplitude in path.amplitude {
                let _ = write!(text, " {amplitude:e}");
            }
            text.push('\n');
        }
    }
    Ok(text)
}

fn write(path: &str, bytes: &[u8]) -> Result<()> {
    let advice = "name a file that can be written";
    std::fs::write(path, bytes).map_err(|error| foresound::Error::file(path, error, advice))
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, sound, path_list] = arguments.as_slice() else {
        let advice = "give SCENE.obj SOUND.raw PATHS.txt";
        return Err(foresound::Error::setting("arguments", "not three", advice));
    };
    let stage = if scene.ends_with("concert_hall.obj") {
        HALL
    } else {
        DOORWAY
    };
    let scene = load(Path::new(scene))?;
    write(path_list, paths(Arc::clone(&scene), &stage)?.as_bytes())?;
    write(sound, &walk(scene, &stage)?)
}
