//! Generators and their input for the tests of the generation stage.

use std::f64::consts::TAU;
use std::sync::Arc;

use foresound::extrapolation::{FramePath, FramePaths, LATE_GROUPS, LateGroup, LateSend, PathKind};
use foresound::generation::{Generator, GeneratorSettings, Hrtf};
use foresound::propagation::PathId;
use foresound::scene::SourceId;
use glam::{Quat, Vec3};

use super::synthetic_hrtf;

/// Audio frames of a graphics frame at 75 a second and 44.1 kHz.
pub const RAMP: u32 = 588;
/// Speed of sound in m/s.
pub const SPEED_M_S: f64 = 343.4;

pub fn settings(rate_hz: u32) -> GeneratorSettings {
    GeneratorSettings {
        rate_hz,
        max_sources: 2,
        max_voices: 32,
        fine_voices: 32,
        max_delay_s: 0.5,
        limiter: false,
        late: false,
        ..GeneratorSettings::default()
    }
}

pub fn generator(settings: GeneratorSettings) -> Generator {
    let set = synthetic_hrtf::bytes(settings.rate_hz);
    let hrtf = Hrtf::parse(&set, "synthetic").unwrap();
    Generator::new(settings, Arc::new(hrtf)).unwrap()
}

pub fn generator_with_built_in_head(settings: GeneratorSettings) -> Generator {
    let hrtf = Hrtf::builtin(settings.rate_hz).unwrap();
    Generator::new(settings, Arc::new(hrtf)).unwrap()
}

pub fn path(id: u64, amplitude: f32, delay_s: f64, arrival: Vec3) -> FramePath {
    FramePath {
        id: PathId(id),
        source: SourceId::new(0, 0),
        kind: PathKind::Reflected,
        order: 0,
        amplitude: [amplitude; 8],
        delay_s,
        air_delay_s: delay_s,
        arrival,
        departure: Vec3::ZERO,
    }
}

pub fn frame(paths: Vec<FramePath>) -> FramePaths {
    FramePaths {
        paths,
        ..FramePaths::default()
    }
}

pub fn tone(hz: f64, rate_hz: f64, start: usize, frames: usize) -> Vec<f32> {
    (start..start + frames)
        .map(|n| (TAU * hz / rate_hz * n as f64).sin() as f32)
        .collect()
}

pub fn noise(frames: usize) -> Vec<f32> {
    let mut state = 0x1234_5678u32;
    (0..frames)
        .map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32 - 0.5
        })
        .collect()
}

/// Runs one source through a frame for every [`RAMP`] audio frames.
pub fn run(
    generator: &mut Generator,
    frames: impl Iterator<Item = FramePaths>,
    input: impl Fn(usize) -> Vec<f32>,
) -> [Vec<f32>; 2] {
    let mut ears = [Vec::new(), Vec::new()];
    let mut output = vec![0.0; 2 * RAMP as usize];
    for frame in frames {
        generator.set_frame(&frame, RAMP);
        let input = input(ears[0].len());
        generator.render(&[&input], &mut output);
        for pair in output.chunks_exact(2) {
            ears[0].push(pair[0]);
            ears[1].push(pair[1]);
        }
    }
    ears
}

pub fn largest_step(signal: &[f32]) -> f32 {
    signal
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .fold(0.0, f32::max)
}

pub fn energy(signal: &[f32]) -> f64 {
    signal.iter().map(|&s| f64::from(s).powi(2)).sum()
}

/// Two sources, several moving paths, HRTF and late reverb.
pub fn busy(k: u32) -> FramePaths {
    let t = f64::from(k);
    let mut paths: Vec<FramePath> = (0..9u64)
        .filter(|i| !(u64::from(k) + i).is_multiple_of(6))
        .map(|i| FramePath {
            source: SourceId::new((i % 2) as u16, 0),
            amplitude: std::array::from_fn(|b| {
                0.3 * (1.0 + 0.1 * (t + i as f64).sin() as f32) * 0.9f32.powi(b as i32)
            }),
            ..path(
                i,
                1.0,
                0.004 + 0.007 * i as f64 + 1e-4 * (0.8 * t + i as f64).sin(),
                Vec3::new((t * 0.05 + i as f64).sin() as f32, 0.2, -0.7).normalize(),
            )
        })
        .collect();
    if k % 8 == 5 {
        paths[2].delay_s += 0.1;
    }
    FramePaths {
        orientation: Quat::from_rotation_y(0.02 * k as f32),
        paths,
        late: vec![LateSend {
            source: SourceId::new(0, 0),
            group: 0,
            energy_per_s: [0.8; 8],
            start_s: if k < 15 { 0.05 } else { 0.09 },
        }],
        late_groups: [LateGroup::isotropic([1.5, 1.4, 1.3, 1.2, 1.1, 1.0, 0.8, 0.6]); LATE_GROUPS],
        wide: Vec::new(),
        obstructions: Vec::new(),
        high_air_np_per_s: [5.0, 8.7, 11.5, 14.4],
    }
}
