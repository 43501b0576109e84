//! The walk that the bridges and other machines are compared with, through the Rust interface: writes its sound as raw
//! floats to one file and the paths of sixteen updates as lines of text to another (update, identity, order, length in
//! metres, eight amplitudes).

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use foresound::Result;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::{AffinityPolicy, Engine, EngineSchedule, EngineSettings, FrameTime};
use foresound::scene::obj::{ObjOptions, load_obj};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose};
use glam::{Quat, Vec3};

const RATE_HZ: u32 = 48_000;
/// Audio frames a graphics frame, at 60 Hz.
const FRAMES: usize = 800;
const TICKS: u32 = 90;

/// Two seconds of noise and clicks that every language makes with the same bits.
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
    let file = load_obj(path, &ObjOptions::default())?;
    let table = MaterialTable::built_in();
    Scene::commit(&file.mesh, &table, &SceneSettings::default()).map(Arc::new)
}

fn listener_at(part: f32) -> ListenerPose {
    ListenerPose {
        position: Vec3::new(12.5 - 6.0 * part, 1.65, 0.5 + 4.0 * part),
        orientation: Quat::from_xyzw(0.0, 0.5 * part, 0.0, 1.0),
    }
}

fn walk(scene: Arc<Scene>) -> Result<Vec<u8>> {
    let mut settings = EngineSettings {
        schedule: EngineSchedule::Synchronous,
        frame_time: FrameTime::Fixed(1.0 / 60.0),
        affinity: AffinityPolicy::None,
        ..EngineSettings::default()
    };
    settings.generation.rate_hz = RATE_HZ;
    settings.propagation.guide_rays = 256;
    let (mut controller, mut renderer) = Engine::new(settings)?;
    controller.set_scene(scene)?;
    let clip: Arc<[f32]> = signal().into();
    let near = controller.add_source(Vec3::new(5.0, 1.5, 3.2))?;
    let far = controller.add_source(Vec3::new(10.0, 1.5, 2.0))?;
    controller.play(near, Arc::clone(&clip), true)?;
    controller.play(far, clip, false)?;
    controller.set_source_gain(far, 0.5)?;
    let mut all = Vec::new();
    let mut block = vec![0.0; 2 * FRAMES];
    for tick in 0..TICKS {
        let part = tick as f32 / TICKS as f32;
        let moving = SourcePose::at(near, Vec3::new(5.0, 1.5, 3.25 - part));
        controller.tick(listener_at(part), &[moving])?;
        renderer.render(&mut block);
        all.extend(block.iter().flat_map(|sample| sample.to_le_bytes()));
    }
    Ok(all)
}

fn paths(scene: Arc<Scene>) -> Result<String> {
    let mut propagator = Propagator::new(scene, PropagationSettings::default())?;
    let places = [Vec3::new(5.0, 1.5, 3.2), Vec3::new(10.0, 1.5, 2.0)];
    let source = |slot: usize| SourcePose::at(SourceId::new(slot as u16, 0), places[slot]);
    let sources = [source(0), source(1)];
    let (mut set, mut text) = (PathSet::default(), String::new());
    for update in 0..16u32 {
        let part = update as f32 / 16.0;
        let time_s = f64::from(update) / 10.0;
        propagator.update(&listener_at(part), &sources, time_s, &mut set);
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
    let scene = load(Path::new(scene))?;
    write(path_list, paths(Arc::clone(&scene))?.as_bytes())?;
    write(sound, &walk(scene)?)
}
