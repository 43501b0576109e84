//! A walk through a room, rendered offline into a WAV: `cargo run --release --example offline_render [OUT.wav]`.
//!
//! Everything on a virtual clock and one thread; the same input gives the same bits.

use std::sync::Arc;

use foresound::Result;
use foresound::extrapolation::PredictorKind;
use foresound::generation::{GeneratorSettings, Hrtf};
use foresound::output::WavSink;
use foresound::propagation::PropagationSettings;
use foresound::runtime::{OfflineRenderer, OfflineSettings, Poses, Schedule};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};
use glam::Vec3;

const RATE_HZ: u32 = 44_100;

fn main() -> Result<()> {
    let mesh = procedural::shoebox(Vec3::new(12.0, 4.0, 8.0), "brick");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
    let middle = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    let mut settings = OfflineSettings::default();
    settings.graphics_rate_hz = 60.0;
    settings.block_frames = 256;
    settings.schedule = Schedule::Synchronous;
    // a whole propagation in every graphics frame
    settings.predictor = PredictorKind::Hold;
    let head = Arc::new(Hrtf::builtin(RATE_HZ)?);
    let mut renderer = OfflineRenderer::new(Arc::new(scene), head, settings)?;
    let out = std::env::args().nth(1);
    let mut wav = WavSink::create(out.as_deref().unwrap_or("offline.wav"), RATE_HZ, 2)?;

    let source = SourcePose::at(SourceId::new(0, 0), middle + Vec3::new(-4.0, 0.0, 1.0));
    let mut poses = Poses {
        sources: vec![source],
        ..Poses::default()
    };
    // A click every half second, whichever source asks.
    let mut clicks = |_slot: usize, from: u64, samples: &mut [f32]| {
        for (at, sample) in (from..).zip(samples) {
            *sample = f32::from(at % u64::from(RATE_HZ / 2) < 64) * 0.5;
        }
    };
    for frame in 0..240 {
        let walked = Vec3::X * (frame as f32 * 1.4 / 60.0 - 2.0);
        poses.listener = ListenerPose::facing(middle + walked, 0.0);
        renderer.next_frame(&poses, &mut clicks, &mut |block| wav.write(block))?;
    }
    wav.finish()
}
