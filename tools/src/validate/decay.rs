//! Law *decay*: reverberation time in each band against Eyring in rooms whose field is diffuse.

use glam::Vec3;

use super::Row;
use super::late;
use super::rooms::{self, Probe};
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::acoustics::{BANDS, BandArray, Material};
use foresound::error::Result;
use foresound::propagation::PropagationSettings;

/// Absorption that rises over the bands from 0.05 to 0.3.
const RISING: BandArray = [0.05, 0.08, 0.1, 0.13, 0.16, 0.2, 0.25, 0.3];

/// Absorption that falls and rises again.
const HOLLOW: BandArray = [0.25, 0.15, 0.1, 0.06, 0.08, 0.1, 0.15, 0.25];

/// Proportionate rooms: size in metres, absorption of all walls, their scattering.
const ROOMS: [([f32; 3], BandArray, f32); 5] = [
    ([8.0, 6.0, 3.5], [0.1; BANDS], 0.5),
    ([30.0, 20.0, 12.0], [0.3; BANDS], 0.5),
    ([5.0, 4.0, 3.0], RISING, 0.3),
    ([12.0, 9.0, 5.0], HOLLOW, 0.6),
    ([20.0, 12.0, 7.0], RISING, 0.8),
];

/// One room's reverberation times.
#[derive(Debug, Clone)]
pub struct Case {
    /// Size and scattering.
    pub name: String,
    /// From propagation, in seconds.
    pub ours_s: BandArray,
    /// Eyring's, with air.
    pub eyring_s: BandArray,
}

/// All rooms, after sixteen updates.
///
/// # Errors
/// Those of committing a scene.
pub fn cases() -> Result<Vec<Case>> {
    ROOMS
        .iter()
        .map(|(size, absorption, scattering)| case(*size, *absorption, *scattering))
        .collect()
}

fn case(size: [f32; 3], absorption: BandArray, scattering: f32) -> Result<Case> {
    let [x, y, z] = size;
    let wall = |w: usize| Material {
        name: format!("wall{w}"),
        absorption,
        scattering: [scattering; BANDS],
        transmission: [0.0; BANDS],
    };
    let scene = rooms::six_walls(Vec3::from(size), std::array::from_fn(wall))?;
    let source = Vec3::new(0.3 * x, 0.4 * y, 0.4 * z);
    let mut probe = Probe::new(&scene, source, PropagationSettings::default())?;
    for _ in 0..16 {
        probe.update(Vec3::new(0.7 * x, 0.6 * y, 0.5 * z));
    }
    let (volume, surface) = (
        f64::from(x * y * z),
        f64::from(2.0 * (x * y + y * z + z * x)),
    );
    let eyring_s = std::array::from_fn(|b| {
        let air = 8.0 * f64::from(scene.air_np_per_m()[b]) * volume;
        let sabines = -surface * f64::from(1.0 - absorption[b]).ln() + air;
        (24.0 * std::f64::consts::LN_10 / scene.speed_of_sound_m_s() * volume / sabines) as f32
    });
    Ok(Case {
        name: format!("{x} x {y} x {z} m, scattering {scattering}"),
        ours_s: late::late_decay_times(&probe.set),
        eyring_s,
    })
}

/// Every band of every room.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for case in cases()? {
        for b in 0..BANDS {
            let law = format!("decay: {} at {:.0} Hz", case.name, CENTRES_HZ[b]);
            let off = f64::from(case.ours_s[b] / case.eyring_s[b] - 1.0).abs();
            rows.push(Row::at_most(law, 100.0 * off, 10.0, "%"));
        }
    }
    Ok(rows)
}
