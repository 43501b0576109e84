//! A walk through a room, rendered offline into a WAV file: `cargo run --release --example offline_render [OUT.wav]`.
//!
//! On a virtual clock and one thread: the same input gives the same bits.

use std::sync::Arc;

use foresound::glam::Vec3;
use foresound::offline::{OfflineRenderer, OfflineSettings, Poses, WavSink};
use foresound::{
    Hrtf, ListenerPose, MaterialTable, Result, Scene, SceneSettings, SourceId, SourcePose, shoebox,
};

const RATE_HZ: u32 = 44_100;

fn main() -> Result<()> {
    let mesh = shoebox(Vec3::new(12.0, 4.0, 8.0), "brick");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())?;
    let center = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    let hrtf = Arc::new(Hrtf::builtin(RATE_HZ)?);
    let settings = OfflineSettings::default();
    let mut renderer = OfflineRenderer::new(Arc::new(scene), hrtf, settings)?;
    let out = std::env::args().nth(1);
    let mut wav = WavSink::create(out.as_deref().unwrap_or("offline.wav"), RATE_HZ, 2)?;

    let mut poses = Poses::default();
    let position = center + Vec3::new(-4.0, 0.0, 1.0);
    poses
        .sources
        .push(SourcePose::at(SourceId::new(0, 0), position));
    // A click every half second from every source.
    let mut clicks = |_slot: usize, first: u64, samples: &mut [f32]| {
        for (index, sample) in (first..).zip(samples) {
            *sample = f32::from(index % u64::from(RATE_HZ / 2) < 64) * 0.5;
        }
    };
    for frame in 0..240 {
        let walked = Vec3::X * (frame as f32 * 1.4 / 60.0 - 2.0);
        poses.listener = ListenerPose::facing(center + walked, 0.0);
        renderer.next_frame(&poses, &mut clicks, &mut |block| wav.write(block))?;
    }
    wav.finish()
}
