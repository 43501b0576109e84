//! The engine on the sound device: `cargo run --release --features play --example live`.
//!
//! A clicking source circles the listener for ten seconds. A game has its own loop instead of the sleeping one.

use std::sync::Arc;
use std::time::{Duration, Instant};

use foresound::device::{CpalBackend, NullDeviceSettings, Supervisor};
use foresound::glam::Vec3;
use foresound::{
    Engine, EngineSettings, ListenerPose, MaterialTable, Result, Scene, SceneSettings, shoebox,
};

#[expect(clippy::disallowed_methods, reason = "an app keeps time")]
fn main() -> Result<()> {
    let settings = EngineSettings::default();
    let rate_hz = settings.generation.rate_hz;
    // Keeps the time while no device is open.
    let null_device = NullDeviceSettings {
        rate_hz,
        block_frames: settings.block_frames,
        affinity: settings.affinity,
    };
    let (mut controller, mut renderer) = Engine::new(settings)?;
    let mesh = shoebox(Vec3::new(12.0, 4.0, 8.0), "brick");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
    let center = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    controller.set_scene(Arc::new(scene))?;
    let source = controller.add_source(center + Vec3::X)?;
    let mut clip = vec![0.0; rate_hz as usize / 2];
    clip[..64].fill(0.5);
    controller.play(source, clip.into(), true)?;

    // The device calls the renderer; the supervisor reopens a lost device.
    let render = move |block: &mut [f32]| {
        renderer.render(block);
    };
    let mut device = Supervisor::new(CpalBackend::new(rate_hz), render, Some(null_device));
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(10) {
        let time_s = began.elapsed().as_secs_f32();
        device.poll(time_s.into());
        let position = center + 2.0 * Vec3::new(time_s.cos(), 0.0, time_s.sin());
        controller.move_source(source, position)?;
        controller.tick(ListenerPose::facing(center, 0.0), &[])?;
        std::thread::sleep(Duration::from_millis(16));
    }
    Ok(())
}
