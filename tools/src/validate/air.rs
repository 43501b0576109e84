//! Law *air*: ISO 9613-1 at the eight centres, 20 °C, 50 %, 101.325 kPa, as it acts on a path, and up to 16 kHz as it is
//! heard.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::Vec3;

use super::free_field::{self, GRAPHICS_HZ};
use super::{Row, rooms};
use foresound::acoustics::Medium;
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::error::Result;
use foresound::offline::Poses;
use foresound::propagation::transmission::direct_path;
use foresound::scene::{Scene, SourceId, SourcePose};

/// Published values in dB/km from the standard's formula.
const DB_PER_KM: [f64; 8] = [0.123, 0.445, 1.318, 2.733, 4.665, 9.855, 29.419, 103.912];

/// Loss over a kilometre against the table.
pub(super) fn rows() -> Result<Vec<Row>> {
    let scene = rooms::uniform(Vec3::new(2000.0, 10.0, 10.0), 0.1, 0.0)?;
    let level_db = |x: f32| {
        let (from, to) = (Vec3::new(1.0, 5.0, 5.0), Vec3::new(x, 5.0, 5.0));
        let path = direct_path(&scene, SourceId::default(), from, to, 0.3, &mut 0);
        path.map_or([f64::NAN; 8], |p| {
            p.amplitude
                .map(|a| 20.0 * f64::from(a).log10() + 20.0 * f64::from(p.length_m).log10())
        })
    };
    let (near, far) = (level_db(2.0), level_db(1001.0));
    let metres = 999.0;
    let mut rows: Vec<Row> = (0..8)
        .map(|b| {
            let db_per_km = (near[b] - far[b]) / metres * 1000.0;
            let error = 100.0 * (db_per_km / DB_PER_KM[b] - 1.0).abs();
            Row::at_most(format!("air: {:.0} Hz", CENTRES_HZ[b]), error, 1.0, "%")
        })
        .collect();
    for (rate_hz, distance_m) in [
        (44_100, 5.0),
        (44_100, 30.004),
        (44_100, 99.9),
        (44_100, 100.0),
        (48_000, 100.0),
    ] {
        let name = format!("air: 1 to 16 kHz, {distance_m} m, {rate_hz} Hz");
        let error_db = heard_error_db(&scene, rate_hz, distance_m)?;
        rows.push(Row::at_most(name, error_db, 1.0, "dB"));
    }
    Ok(rows)
}

/// Largest error in dB of the direct sound of an impulse at thirds of an octave and at 14 kHz.
fn heard_error_db(scene: &Arc<Scene>, rate_hz: u32, distance_m: f32) -> Result<f64> {
    let mut renderer = free_field::renderer(scene, rate_hz, 0)?;
    let mut poses = Poses::default();
    poses.listener.position = Vec3::new(1.0, 5.0, 5.0);
    let source = poses.listener.position + Vec3::X * distance_m;
    let mut pose = SourcePose::at(SourceId::new(0, 0), source);
    pose.settings.effects.reflections = false;
    poses.sources.push(pose);
    // Three graphics frames before the impulse, in which the path's voice fades in.
    let start = u64::from(rate_hz / 20);
    let mut impulse = |_slot: usize, from: u64, samples: &mut [f32]| {
        for (index, sample) in samples.iter_mut().enumerate() {
            *sample = f32::from(u8::from(from + index as u64 == start));
        }
    };
    let mut sound = Vec::new();
    for _ in 0..(0.5 * GRAPHICS_HZ) as u32 {
        renderer.next_frame(&poses, &mut impulse, &mut |block| {
            sound.extend(block.chunks_exact(2).map(|pair| f64::from(pair[0])));
            Ok(())
        })?;
    }
    let mut error_db = 0.0f64;
    let thirds = (0..=12u8).map(|third| 1000.0 * 10f64.powf(0.1 * f64::from(third)));
    for frequency_hz in thirds.chain([14_000.0, 16_000.0]) {
        let step = TAU * frequency_hz / f64::from(rate_hz);
        let (mut re, mut im) = (0.0, 0.0);
        for (index, sample) in sound.iter().enumerate() {
            re += sample * (step * index as f64).cos();
            im += sample * (step * index as f64).sin();
        }
        let level_db = 20.0 * (f64::hypot(re, im) * f64::from(distance_m)).log10();
        let loss_db = Medium::default().absorption_db_per_m(frequency_hz) * f64::from(distance_m);
        error_db = error_db.max((level_db + loss_db).abs());
    }
    Ok(error_db)
}
