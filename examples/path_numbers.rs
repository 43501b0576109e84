//! The numbers of each source in each graphics frame, for the panner and the reverb of a middleware:
//! `cargo run --release --example path_numbers`.
//!
//! The middleware plays the sounds; the engine's sources are silent and say where sound comes from. Its renderer must be driven
//! all the same: it takes the graphics frames. With silent sources a block costs little.
#![expect(clippy::print_stdout, reason = "the result")]

use std::sync::Arc;

use foresound::glam::Vec3;
use foresound::paths::PathKind;
use foresound::{
    Engine, EngineSchedule, EngineSettings, FrameTime, ListenerPose, MaterialTable, Result, Scene,
    SceneSettings, shoebox,
};

/// Audio frames of a graphics frame at 60 Hz.
const AUDIO_FRAMES: usize = 735;
/// The band of 1 kHz.
const KILOHERTZ: usize = 4;

fn main() -> Result<()> {
    let mut settings = EngineSettings::default();
    settings.schedule = EngineSchedule::Synchronous;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    let (mut controller, mut renderer) = Engine::new(settings)?;
    let mesh = shoebox(Vec3::new(12.0, 4.0, 8.0), "brick");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
    let center = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    controller.set_scene(Arc::new(scene))?;
    let source = controller.add_source(center + Vec3::new(-4.0, 0.0, 1.0))?;

    // The first call begins the copying of frames.
    controller.frame_numbers();
    let mut block = [0.0; 2 * AUDIO_FRAMES];
    for frame in 0..120 {
        let walked = Vec3::X * (frame as f32 * 1.4 / 60.0 - 2.0);
        controller.tick(ListenerPose::facing(center + walked, 0.0), &[])?;
        renderer.render(&mut block);
        if frame % 30 > 0 {
            continue;
        }
        let numbers = controller.frame_numbers();
        let Some(own) = numbers.source(source) else {
            continue;
        };
        println!(
            "frame {}: {} paths, occlusion {:.1}, reverb {:.3} after {:.0} ms with T60 {:.2} s",
            numbers.tick(),
            numbers.paths(source).len(),
            own.occlusion,
            own.reverb_send[KILOHERTZ],
            1e3 * own.reverb_delay_s,
            own.decay_time_s[KILOHERTZ],
        );
        // What a panner needs of a path: its gain, its delay, and where it arrives from.
        for path in numbers.paths(source) {
            if path.kind != PathKind::Reflected || path.order == 1 {
                println!(
                    "  {:?} of order {}: {:+.3} after {:5.1} ms from {:.2}",
                    path.kind,
                    path.order,
                    path.amplitude[KILOHERTZ],
                    1e3 * path.delay_s,
                    path.arrival,
                );
            }
        }
    }
    Ok(())
}
