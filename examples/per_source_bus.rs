//! A game with a mixer of its own: each source's dry block in, its sound in the room out, and the late reverb as one more bus:
//! `cargo run --release --example per_source_bus [OUT.wav]`.
//!
//! The game's mixer has a strip for each bus. Here it lowers the engine's hum and the reverb while the guide speaks. The mix has
//! no limiter of the engine's: the game's comes last.
#![expect(clippy::print_stdout, reason = "the result")]

use std::f32::consts::TAU;
use std::sync::Arc;

use foresound::glam::Vec3;
use foresound::offline::WavSink;
use foresound::{
    BusStatus, Engine, EngineSchedule, EngineSettings, FrameTime, ListenerPose, MaterialTable,
    Result, Scene, SceneSettings, shoebox,
};

const RATE_HZ: u32 = 44_100;
/// Audio frames of a block; here also those of a graphics frame at 60 Hz.
const FRAMES: usize = 735;

fn main() -> Result<()> {
    let mut settings = EngineSettings::default();
    settings.generation.source_buses = true;
    settings.block_frames = FRAMES;
    settings.schedule = EngineSchedule::Synchronous;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    let (mut controller, mut renderer) = Engine::new(settings)?;
    let mesh = shoebox(Vec3::new(12.0, 4.0, 8.0), "brick");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
    let center = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    controller.set_scene(Arc::new(scene))?;
    let hum = controller.add_source(center + Vec3::new(-4.0, 0.0, 1.0))?;
    let guide = controller.add_source(center + Vec3::new(3.0, 0.0, -2.0))?;

    let out = std::env::args().nth(1);
    let mut wav = WavSink::create(out.as_deref().unwrap_or("buses.wav"), RATE_HZ, 2)?;
    let (mut dry, mut bus, mut mix) = ([0.0; FRAMES], [0.0; 2 * FRAMES], [0.0; 2 * FRAMES]);
    let mut energy = [0.0; 3];
    for frame in 0..240 {
        let walked = Vec3::X * (frame as f32 * 1.4 / 60.0 - 2.0);
        controller.tick(ListenerPose::facing(center + walked, 0.0), &[])?;

        // The game's audio callback. One block, every source once, then the reverb.
        let speaks = (60..180).contains(&frame);
        let begun = renderer.begin_block(FRAMES);
        assert_eq!(begun, BusStatus::Own, "the block fits");
        mix.fill(0.0);
        let strips = [
            (Some(hum), 110.0, 0.3),
            (Some(guide), 440.0, 1.0),
            (None, 0.0, 0.5),
        ];
        for (strip, (source, tone_hz, ducked)) in strips.into_iter().enumerate() {
            match source {
                Some(source) => {
                    for (n, sample) in dry.iter_mut().enumerate() {
                        let time_s = (frame * FRAMES + n) as f32 / RATE_HZ as f32;
                        let is_on = source == hum || speaks && time_s % 0.5 < 0.2;
                        let level = if is_on { 0.2 } else { 0.0 };
                        *sample = level * (TAU * tone_hz * time_s).sin();
                    }
                    // A source that no graphics frame has yet is silent.
                    renderer.render_source(source, &dry, &mut bus);
                }
                None => {
                    renderer.render_reverb(&mut bus);
                }
            }
            let gain = if speaks { ducked } else { 1.0 };
            for (sum, sample) in mix.iter_mut().zip(&bus) {
                *sum += gain * sample;
                energy[strip] += sample * sample;
            }
        }
        // The game's own limiter.
        mix.iter_mut().for_each(|sample| *sample = sample.tanh());
        wav.write(&mix)?;
    }
    for (name, energy) in ["hum", "guide", "reverb"].into_iter().zip(energy) {
        println!(
            "{name}: {:.1} dB",
            10.0 * (energy / 240.0 / FRAMES as f32).log10()
        );
    }
    wav.finish()
}
