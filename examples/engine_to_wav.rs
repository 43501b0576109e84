//! The engine with a walking listener, into a WAV file: `cargo run --release --example engine_to_wav [OUT.wav]`.
//!
//! A game calls `tick` once a graphics frame, and its audio device calls `render`. Here both alternate on one thread, with
//! a fixed frame time and propagation within each tick. Real-time use takes the defaults of both settings instead.

use std::sync::Arc;

use foresound::glam::Vec3;
use foresound::offline::WavSink;
use foresound::{
    Engine, EngineSchedule, EngineSettings, FrameTime, ListenerPose, MaterialTable, Result, Scene,
    SceneSettings, shoebox,
};

const RATE_HZ: u32 = 44_100;
/// Audio frames of a graphics frame at 60 Hz.
const AUDIO_FRAMES: usize = 735;

fn main() -> Result<()> {
    let mut settings = EngineSettings::default();
    settings.schedule = EngineSchedule::Synchronous;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    let (mut controller, mut renderer) = Engine::new(settings)?;

    // The scene: a room of 12 m x 4 m x 8 m.
    let mesh = shoebox(Vec3::new(12.0, 4.0, 8.0), "brick");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
    let center = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    controller.set_scene(Arc::new(scene))?;

    // A source: a click every half second.
    let mut clip = vec![0.0; RATE_HZ as usize / 2];
    clip[..64].fill(0.5);
    let source = controller.add_source(center + Vec3::new(-4.0, 0.0, 1.0))?;
    controller.play(source, clip.into(), true)?;

    // The listener walks for four seconds at 1.4 m/s.
    let out = std::env::args().nth(1);
    let mut wav = WavSink::create(out.as_deref().unwrap_or("engine.wav"), RATE_HZ, 2)?;
    let mut block = [0.0; 2 * AUDIO_FRAMES];
    for frame in 0..240 {
        let walked = Vec3::X * (frame as f32 * 1.4 / 60.0 - 2.0);
        controller.tick(ListenerPose::facing(center + walked, 0.0), &[])?;
        renderer.render(&mut block);
        wav.write(&block)?;
    }
    wav.finish()
}
