//! A split screen: two players in one scene, each with headphones, and both at one pair of loudspeakers:
//! `cargo run --release --example split_screen [FIRST.wav SECOND.wav BOTH.wav]`.
//!
//! One engine: scene, sources and clips are set once. Each listener has its own paths and late reverb; the sources' rays, what guide
//! rays discover, and the delay lines are common.

use std::sync::Arc;

use foresound::glam::Vec3;
use foresound::offline::WavSink;
use foresound::{
    Engine, EngineSchedule, EngineSettings, FrameTime, ListenerPose, MaterialTable, Result, Scene,
    SceneSettings, shoebox,
};

const RATE_HZ: u32 = 44_100;
/// Audio frames of a graphics frame at 60 Hz.
const FRAMES: usize = 735;

fn main() -> Result<()> {
    let mut settings = EngineSettings::default();
    settings.generation.listeners = 2;
    settings.schedule = EngineSchedule::Synchronous;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    let (mut controller, mut renderer) = Engine::new(settings)?;
    let mesh = shoebox(Vec3::new(12.0, 4.0, 8.0), "brick");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
    let center = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    controller.set_scene(Arc::new(scene))?;
    let mut clip = vec![0.0; RATE_HZ as usize / 2];
    clip[..64].fill(0.5);
    let source = controller.add_source(center + Vec3::new(-4.0, 0.0, 1.0))?;
    controller.play(source, clip.into(), true)?;

    let names: Vec<String> = std::env::args().skip(1).collect();
    let name = |index: usize, default: &str| names.get(index).map_or(default.into(), String::clone);
    let mut first = WavSink::create(name(0, "first.wav"), RATE_HZ, 2)?;
    let mut second = WavSink::create(name(1, "second.wav"), RATE_HZ, 2)?;
    let mut both = WavSink::create(name(2, "both.wav"), RATE_HZ, 2)?;
    // One output after the other; `Renderer::render` gives their mix at once.
    let mut output = [0.0; 2 * 2 * FRAMES];
    for frame in 0..240 {
        let walked = Vec3::X * (frame as f32 * 1.4 / 60.0 - 2.0);
        controller.set_listener(1, ListenerPose::facing(center - walked, 3.1))?;
        controller.tick(ListenerPose::facing(center + walked, 0.0), &[])?;
        renderer.render_listeners(&mut output);
        let (one, other) = output.split_at(2 * FRAMES);
        let mix: Vec<f32> = one.iter().zip(other).map(|(a, b)| 0.5 * (a + b)).collect();
        first.write(one)?;
        second.write(other)?;
        both.write(&mix)?;
    }
    first.finish()?;
    second.finish()?;
    both.finish()
}
