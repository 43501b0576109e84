//! Cost of a 256-frame block at 44.1 kHz: 16 sources with 60 paths each and the late reverb.
//!
//! `moving` sets a frame every 588 audio frames in which every delay, gain and direction changes, as a walking and
//! turning listener makes it; `resting` holds one frame; `set_frame` is the cost of one frame's change.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use foresound::extrapolation::{FramePath, FramePaths, LATE_GROUPS, LateGroup, LateSend, PathKind};
use foresound::generation::{Generator, GeneratorSettings, Hrtf};
use foresound::propagation::PathId;
use foresound::scene::SourceId;
use glam::{Quat, Vec3};

#[path = "../tests/reference/synthetic_hrtf.rs"]
mod synthetic_hrtf;

const SOURCES: usize = 16;
const PATHS: usize = 60;
const BLOCK: usize = 256;
/// Audio frames of a graphics frame at 75 a second.
const RAMP: u32 = 588;

/// A hall-like set of paths after `step` graphics frames of walking at 1.4 m/s and turning at 30 degrees a second.
fn frame(step: u32) -> FramePaths {
    let time_s = f64::from(step) / 75.0;
    let mut paths = Vec::new();
    for source in 0..SOURCES {
        for path in 0..PATHS {
            let seed = (source * PATHS + path) as f64;
            let away_m = 3.0 + 40.0 * (path as f64 / PATHS as f64) + (seed * 0.618).fract();
            let length_m = away_m + 1.4 * time_s * (seed * 1.7).cos();
            let azimuth = seed * 2.4 + 0.02 * time_s;
            let loudness = 0.8f64.powi((path / 12) as i32) / length_m;
            paths.push(FramePath {
                id: PathId((seed as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)),
                source: SourceId::new(source as u16, 0),
                kind: PathKind::Reflected,
                order: (path / 12) as u8,
                amplitude: std::array::from_fn(|b| (loudness * 0.95f64.powi(b as i32)) as f32),
                delay_s: length_m / 343.4,
                air_delay_s: length_m / 343.4,
                arrival: Vec3::new(
                    azimuth.sin() as f32,
                    0.3 * (seed * 0.9).sin() as f32,
                    -azimuth.cos() as f32,
                ),
                departure: Vec3::ZERO,
            });
        }
    }
    paths.sort_by_key(|path| path.id);
    FramePaths {
        orientation: Quat::from_rotation_y((30f64.to_radians() * time_s) as f32),
        paths,
        late: (0..SOURCES)
            .map(|source| LateSend {
                source: SourceId::new(source as u16, 0),
                group: 0,
                energy_per_s: [0.5; 8],
                start_s: 0.12,
            })
            .collect(),
        late_groups: [LateGroup::isotropic([2.0, 2.0, 1.9, 1.8, 1.7, 1.5, 1.2, 0.8]); LATE_GROUPS],
        wide: Vec::new(),
        obstructions: Vec::new(),
        high_air_np_per_s: [5.0, 8.7, 11.5, 14.4],
    }
}

fn noise() -> Vec<Vec<f32>> {
    let mut state = 1u32;
    (0..SOURCES)
        .map(|_| {
            (0..BLOCK)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (state >> 8) as f32 / (1 << 25) as f32 - 0.25
                })
                .collect()
        })
        .collect()
}

fn generation(criterion: &mut Criterion) {
    let hrtf = Arc::new(
        Hrtf::parse(&synthetic_hrtf::bytes(44_100), "synthetic").expect("the set is well formed"),
    );
    let noise = noise();
    let inputs: Vec<&[f32]> = noise.iter().map(Vec::as_slice).collect();
    let mut output = vec![0.0; 2 * BLOCK];
    let frames: Vec<FramePaths> = (0..75).map(frame).collect();
    let mut group = criterion.benchmark_group("generation");
    for (name, fine_voices) in [("all_fine", 1024), ("quarter_fine", 256)] {
        let settings = GeneratorSettings {
            fine_voices,
            ..GeneratorSettings::default()
        };
        let new =
            || Generator::new(settings.clone(), Arc::clone(&hrtf)).expect("settings are in range");

        let mut generator = new();
        generator.set_frame(&frames[0], RAMP);
        for _ in 0..50 {
            generator.render(&inputs, &mut output);
        }
        group.bench_function(format!("block_resting_{name}"), |bencher| {
            bencher.iter(|| black_box(generator.render(&inputs, &mut output)));
        });

        let mut generator = new();
        let (mut step, mut since) = (0, RAMP);
        group.bench_function(format!("block_moving_{name}"), |bencher| {
            bencher.iter(|| {
                if since >= RAMP {
                    since -= RAMP;
                    step += 1;
                    // Back and forth, without jumps.
                    let index = step % (2 * frames.len() - 2);
                    let index = index.min(2 * frames.len() - 2 - index);
                    generator.set_frame(&frames[index], RAMP);
                }
                since += BLOCK as u32;
                black_box(generator.render(&inputs, &mut output))
            });
        });
    }
    let mut generator = Generator::new(GeneratorSettings::default(), Arc::clone(&hrtf))
        .expect("settings are in range");
    let mut step = 0;
    group.bench_function("set_frame", |bencher| {
        bencher.iter(|| {
            step ^= 1;
            generator.set_frame(&frames[step], RAMP);
        });
    });
    let mut idle =
        Generator::new(GeneratorSettings::default(), hrtf).expect("settings are in range");
    idle.set_frame(&frames[0], RAMP);
    group.bench_function("block_silent", |bencher| {
        bencher.iter(|| black_box(idle.render(&[], &mut output)));
    });
    group.finish();
}

criterion_group!(benches, generation);
criterion_main!(benches);
