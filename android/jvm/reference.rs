//! The walk that the bridges are compared with, through the Rust interface: writes raw floats to the named file.

use std::io::Write as _;
use std::path::Path;
use std::sync::Arc;

use foresound::Result;
use foresound::runtime::{AffinityPolicy, Engine, EngineSchedule, EngineSettings, FrameTime};
use foresound::scene::obj::{ObjOptions, load_obj};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, SourcePose};
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

fn walk(path: &Path, out: &Path) -> Result<()> {
    let mut settings = EngineSettings {
        schedule: EngineSchedule::Synchronous,
        frame_time: FrameTime::Fixed(1.0 / 60.0),
        affinity: AffinityPolicy::None,
        ..EngineSettings::default()
    };
    settings.generation.rate_hz = RATE_HZ;
    settings.propagation.guide_rays = 256;
    let (mut controller, mut renderer) = Engine::new(settings)?;
    let file = load_obj(path, &ObjOptions::default())?;
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&file.mesh, &table, &SceneSettings::default())?;
    controller.set_scene(Arc::new(scene))?;
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
        let listener = ListenerPose {
            position: Vec3::new(12.5 - 6.0 * part, 1.65, 0.5 + 4.0 * part),
            orientation: Quat::from_xyzw(0.0, 0.5 * part, 0.0, 1.0),
        };
        let moving = SourcePose::at(near, Vec3::new(5.0, 1.5, 3.25 - part));
        controller.tick(listener, &[moving])?;
        renderer.render(&mut block);
        all.extend(block.iter().flat_map(|sample| sample.to_le_bytes()));
    }
    let advice = "name a file that can be written";
    std::fs::File::create(out)
        .and_then(|mut file| file.write_all(&all))
        .map_err(|error| foresound::Error::file(out, error, advice))
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, out] = arguments.as_slice() else {
        let advice = "reference SCENE.obj OUT.raw";
        return Err(foresound::Error::setting("arguments", "not two", advice));
    };
    walk(Path::new(scene), Path::new(out))
}
