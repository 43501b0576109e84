//! The engine with a walking listener, into a WAV: `cargo run --release --example engine_to_wav [OUT.wav]`.
//!
//! A game calls `tick` once a graphics frame and lets its device call `render`; here both follow in turn, so the frame
//! time is given and propagation runs within each tick. For real time take the defaults of both instead.

use std::sync::Arc;

use foresound::Result;
use foresound::output::WavSink;
use foresound::runtime::{Engine, EngineSchedule, EngineSettings, FrameTime};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, procedural};
use glam::Vec3;

const RATE_HZ: u32 = 44_100;
const AUDIO_FRAMES: usize = 735; // of a graphics frame at 60 Hz

fn main() -> Result<()> {
    let mut settings = EngineSettings::default();
    settings.schedule = EngineSchedule::Synchronous;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    let (mut controller, mut renderer) = Engine::new(settings)?;

    // A scene: any triangles with material names.
    let mesh = procedural::shoebox(Vec3::new(12.0, 4.0, 8.0), "brick");
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&mesh, &table, &SceneSettings::default())?;
    let middle = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    controller.set_scene(Arc::new(scene))?;

    // A source: a click every half second.
    let mut clip = vec![0.0; RATE_HZ as usize / 2];
    clip[..64].fill(0.5);
    let source = controller.add_source(middle + Vec3::new(-4.0, 0.0, 1.0))?;
    controller.play(source, clip.into(), true)?;

    let out = std::env::args().nth(1);
    let mut wav = WavSink::create(out.as_deref().unwrap_or("engine.wav"), RATE_HZ, 2)?;
    let mut block = [0.0; 2 * AUDIO_FRAMES];
    for frame in 0..240 {
        let walked = Vec3::X * (frame as f32 * 1.4 / 60.0 - 2.0);
        controller.tick(ListenerPose::facing(middle + walked, 0.0), &[])?;
        renderer.render(&mut block);
        wav.write(&block)?;
    }
    wav.finish()
}
