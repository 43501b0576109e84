//! Law *doppler*: pitch and level of sources and listeners in motion, by the time of emission.
//!
//! The truth is s(t − τ) / r with c τ = r, the distance between the listener at t and the source at t − τ, solved by
//! bisection. A tone is rendered, and the sound is demodulated by the truth's phase and level.

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::free_field::GRAPHICS_HZ;
use super::{Row, free_field, rooms};
use foresound::acoustics::Medium;
use foresound::error::Result;
use foresound::offline::Poses;
use foresound::scene::{Scene, SourceId, SourcePose};

const RATE_HZ: u32 = 48_000;
const TONE_HZ: f64 = 1000.0;

/// Length of the motion and of a window of analysis, in seconds.
const LASTS_S: f64 = 1.0;
const WINDOW_S: f64 = 0.1;

/// A straight motion: position in metres at time 0 and velocity in m/s.
#[derive(Clone, Copy)]
struct Motion(DVec3, DVec3);

impl Motion {
    fn at(self, time_s: f64) -> DVec3 {
        self.0 + self.1 * time_s
    }
}

/// Pitch within 0.5 cents and level within 0.1 dB for each motion.
pub(super) fn rows() -> Result<Vec<Row>> {
    let scene = rooms::uniform(Vec3::new(400.0, 200.0, 400.0), 0.5, 0.5)?;
    let rest = DVec3::ZERO;
    let listener = DVec3::new(200.0, 100.0, 200.0);
    let ahead = |distance_m: f64| listener + DVec3::X * distance_m;
    let cases = [
        ("source approaches, 20 m/s", 40.0, -20.0, 0.0),
        ("source recedes, 20 m/s", 10.0, 20.0, 0.0),
        ("source approaches, 60 m/s", 90.0, -60.0, 0.0),
        ("source approaches, 100 m/s", 140.0, -100.0, 0.0),
        ("source recedes, 100 m/s", 10.0, 100.0, 0.0),
        ("listener approaches, 60 m/s", 90.0, 0.0, 60.0),
        ("both recede, 50 m/s", 10.0, 50.0, -50.0),
    ];
    let mut rows = Vec::new();
    for (name, distance_m, source_m_s, listener_m_s) in cases {
        let source = Motion(ahead(distance_m), DVec3::X * source_m_s);
        let ear = Motion(listener, DVec3::X * listener_m_s);
        push(&mut rows, name, &scene, source, ear)?;
    }
    let passing = Motion(ahead(30.0) - DVec3::Z * 30.0, DVec3::Z * 60.0);
    push(
        &mut rows,
        "source passes, 60 m/s",
        &scene,
        passing,
        Motion(listener, rest),
    )?;
    rows.push(reflection(&scene, Motion(listener, rest))?);
    Ok(rows)
}

/// The pitch of the floor's reflection of a passing source, by the delays of two graphics frames.
fn reflection(scene: &Arc<Scene>, ear: Motion) -> Result<Row> {
    let source = Motion(ear.0 + DVec3::new(20.0, -95.0, -30.0), DVec3::Z * 60.0);
    let image = Motion(source.0 * DVec3::new(1.0, -1.0, 1.0), source.1);
    let mut renderer = free_field::renderer(scene, RATE_HZ, 1)?;
    let mut cents = 0.0f64;
    let mut last: Option<[f64; 2]> = None;
    for frame in 0..(LASTS_S * GRAPHICS_HZ) as u32 {
        let time_s = f64::from(frame) / GRAPHICS_HZ;
        let mut silence = |_slot: usize, _from: u64, samples: &mut [f32]| samples.fill(0.0);
        renderer.next_frame(&poses(source, ear, time_s), &mut silence, &mut |_| Ok(()))?;
        let paths = &renderer.frame_paths().paths;
        let floor = paths
            .iter()
            .find(|path| path.order == 1 && path.arrival.y < -0.9);
        let Some(floor) = floor else {
            cents = f64::NAN;
            break;
        };
        let delays_s = [floor.delay_s, emission_delay_s(image, ear, time_s)];
        let ratio = |last_s: f64, new_s: f64| 1.0 - (new_s - last_s) * GRAPHICS_HZ;
        if let Some(last) = last.replace(delays_s).filter(|_| time_s > 0.6) {
            let [found, exact] = [0, 1].map(|of| ratio(last[of], delays_s[of]));
            let off = (1200.0 * (found / exact).log2()).abs();
            cents = if off.is_nan() {
                f64::NAN
            } else {
                cents.max(off)
            };
        }
    }
    Ok(Row::at_most(
        "doppler: reflection of a passing source, 60 m/s",
        cents,
        0.5,
        "cents",
    ))
}

fn push(
    rows: &mut Vec<Row>,
    name: &str,
    scene: &Arc<Scene>,
    source: Motion,
    ear: Motion,
) -> Result<()> {
    let (sound, latency_s) = render(scene, source, ear)?;
    // Begins after the longest delay: before time 0 the source was at rest.
    let first = (0.6 * f64::from(RATE_HZ)) as usize;
    let length = (WINDOW_S * f64::from(RATE_HZ)) as usize;
    let windows = (first..sound.len() - length).step_by(length / 2);
    let mut last: Option<f64> = None;
    let (mut cents, mut level_db) = (0.0f64, 0.0f64);
    for from in windows {
        let (level, phase, frequency_hz) = compare(&sound, from..from + length, |time_s| {
            truth(source, ear, time_s - latency_s)
        });
        level_db = level_db.max((20.0 * level.log10()).abs());
        if let Some(last) = last.replace(phase) {
            let turned = (phase - last) / TAU;
            let off_hz = (turned - turned.round()) / (0.5 * WINDOW_S);
            cents = cents.max((1200.0 * (1.0 + off_hz / frequency_hz).log2()).abs());
        }
    }
    rows.push(Row::at_most(
        format!("doppler: {name}"),
        cents,
        0.5,
        "cents",
    ));
    rows.push(Row::at_most(
        format!("doppler: {name}, level"),
        level_db,
        0.1,
        "dB",
    ));
    Ok(())
}

/// The poses of a graphics frame.
fn poses(source: Motion, ear: Motion, time_s: f64) -> Poses {
    let mut poses = Poses::default();
    poses.listener.position = ear.at(time_s).as_vec3();
    let pose = SourcePose::at(SourceId::new(0, 0), source.at(time_s).as_vec3());
    poses.sources.push(pose);
    poses
}

/// The direct sound of a tone at the left ear, and the latency of the renderer in seconds.
fn render(scene: &Arc<Scene>, source: Motion, ear: Motion) -> Result<(Vec<f64>, f64)> {
    let mut renderer = free_field::renderer(scene, RATE_HZ, 0)?;
    let mut sound = Vec::new();
    let mut signal = |_slot: usize, from: u64, samples: &mut [f32]| {
        for (index, sample) in samples.iter_mut().enumerate() {
            let time_s = (from as f64 + index as f64) / f64::from(RATE_HZ);
            *sample = (TAU * TONE_HZ * time_s).sin() as f32;
        }
    };
    for frame in 0..(LASTS_S * GRAPHICS_HZ) as u32 {
        let poses = poses(source, ear, f64::from(frame) / GRAPHICS_HZ);
        renderer.next_frame(&poses, &mut signal, &mut |block| {
            sound.extend(block.chunks_exact(2).map(|pair| f64::from(pair[0])));
            Ok(())
        })?;
    }
    let latency_s = renderer.latency_frames() as f64 / f64::from(RATE_HZ);
    Ok((sound, latency_s))
}

/// Amplitude, and phase in radians, of the exact sound at a time of the output without latency. The paths of a graphics
/// frame are reached at its end.
fn truth(source: Motion, ear: Motion, time_s: f64) -> (f64, f64) {
    let air = Medium::default();
    let pose_s = time_s - 1.0 / GRAPHICS_HZ;
    let delay_s = emission_delay_s(source, ear, pose_s);
    let distance_m = air.speed_of_sound_m_s() * delay_s;
    let loss_db = air.absorption_db_per_m(TONE_HZ) * distance_m;
    let phase = TAU * TONE_HZ * (time_s - delay_s);
    (10f64.powf(-0.05 * loss_db) / distance_m, phase)
}

/// Time from emission to arrival at a time of the poses.
fn emission_delay_s(source: Motion, ear: Motion, time_s: f64) -> f64 {
    let speed_m_s = Medium::default().speed_of_sound_m_s();
    let at = ear.at(time_s);
    let (mut low_s, mut high_s) = (0.0, 10.0);
    for _ in 0..60 {
        let delay_s = 0.5 * (low_s + high_s);
        match source.at(time_s - delay_s).distance(at) > speed_m_s * delay_s {
            true => low_s = delay_s,
            false => high_s = delay_s,
        }
    }
    low_s
}

/// Level and phase of a window of a sound relative to the truth, and the truth's mean frequency in Hz.
fn compare(
    sound: &[f64],
    window: Range<usize>,
    truth: impl Fn(f64) -> (f64, f64),
) -> (f64, f64, f64) {
    let length = window.len() as f64;
    let time_s = |frame: usize| frame as f64 / f64::from(RATE_HZ);
    let (mut re, mut im) = (0.0, 0.0);
    for (index, frame) in window.clone().enumerate() {
        let (amplitude, phase) = truth(time_s(frame));
        let hann = 1.0 - (TAU * (index as f64 + 0.5) / length).cos();
        let weight = 2.0 * hann * sound[frame] / (amplitude * length);
        re += weight * phase.sin();
        im += weight * phase.cos();
    }
    let phases = [window.start, window.end].map(|frame| truth(time_s(frame)).1);
    (
        re.hypot(im),
        im.atan2(re),
        (phases[1] - phases[0]) / (TAU * WINDOW_S),
    )
}
