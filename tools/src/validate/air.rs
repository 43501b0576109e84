//! Law *air*: ISO 9613-1 at the eight centres, 20 °C, 50 %, 101.325 kPa, as it acts on a path.

use glam::Vec3;

use super::{Row, rooms};
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::error::Result;
use foresound::propagation::transmission::direct_path;
use foresound::scene::SourceId;

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
    Ok((0..8)
        .map(|b| {
            let db_per_km = (near[b] - far[b]) / metres * 1000.0;
            let error = 100.0 * (db_per_km / DB_PER_KM[b] - 1.0).abs();
            Row::at_most(format!("air: {:.0} Hz", CENTRES_HZ[b]), error, 1.0, "%")
        })
        .collect())
}
