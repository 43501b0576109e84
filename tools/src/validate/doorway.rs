//! Law *doorway*: octaves behind openings, screens and walls against finite differences.
//!
//! `examples/finite_differences.rs` solves the cases of [`super::wave_cases`] and has made the table of levels.

use std::f64::consts::PI;

use foresound::error::{Error, Result};
use foresound::propagation::PropagationSettings;
use foresound::propagation::diffraction::complex::Complex;
use foresound::scene::Scene;
use glam::Vec3;

use super::wave_cases::{Point, TONES, WaveCase, cases};
use super::{Row, rooms};

/// Levels by finite differences: case, source, listener, and the octaves of [`OCTAVES`] in dB relative to the free field.
const LEVELS: &str = include_str!("finite_differences.csv");

/// Octaves: their middles, and the bands.
const OCTAVES: [(f64, usize); 3] = [(250.0, 2), (500.0, 3), (1000.0, 4)];

/// Kinds of cases by the words of their names, in the order in which they are looked for, and the bound of the rms in dB.
const KINDS: [(&str, &str, f64); 5] = [
    ("thick", "doorway with jambs of 0.24 m", 1.5),
    ("absorbing", "doorway of absorbing rooms", 1.5),
    ("screen", "screens on the ground", 0.8),
    ("wall", "wall of 0.3 m", 1.0),
    ("", "doorway in a thin wall", 1.5),
];

/// Level at one listener.
struct Level<'a> {
    case: &'a str,
    source: Point,
    listener: Point,
    db: [f64; 3],
}

/// All figures of the law.
pub(super) fn rows() -> Result<Vec<Row>> {
    let levels: Vec<Level<'_>> = LEVELS.lines().filter_map(level).collect();
    let mut sums = [[0.0; 3]; KINDS.len()];
    let mut counts = [0.0; KINDS.len()];
    for case in cases() {
        let kind = (KINDS.iter().position(|(word, ..)| case.name.contains(word))).unwrap_or(0);
        let scene = case.scene()?;
        let of_case = || levels.iter().filter(|level| level.case == case.name);
        if of_case().count() != case.listeners.len() {
            return Err(missing(&case));
        }
        for level in of_case() {
            let ours = octaves_db(&scene, level.source, level.listener)?;
            for (sum, (ours, exact)) in sums[kind].iter_mut().zip(ours.into_iter().zip(level.db)) {
                *sum += (ours - exact).powi(2);
            }
            counts[kind] += 1.0;
        }
    }
    let mut rows = Vec::new();
    for ((&(_, name, bound_db), sums), count) in KINDS.iter().zip(sums).zip(counts) {
        for ((hz, _), sum) in OCTAVES.into_iter().zip(sums) {
            let law = format!("doorway: {name}, {hz:.0} Hz, rms");
            rows.push(Row::at_most(law, f64::sqrt(sum / count), bound_db, "dB"));
        }
    }
    Ok(rows)
}

fn missing(case: &WaveCase) -> Error {
    Error::setting(
        "finite_differences.csv",
        format!("levels of the case {:?} are missing", case.name),
        "run the example finite_differences",
    )
}

/// A line of the table; `None` for the others.
fn level(line: &str) -> Option<Level<'_>> {
    let mut fields = line.split(',');
    let case = fields.next()?;
    let numbers: Vec<f64> = fields.map_while(|field| field.parse().ok()).collect();
    let &[a, b, c, x, y, z, low, middle, high] = numbers.as_slice() else {
        return None;
    };
    Some(Level {
        case,
        source: [a, b, c],
        listener: [x, y, z],
        db: [low, middle, high],
    })
}

/// Energy of all paths in the octaves, their waves added at each tone, without air, in dB relative to the free field.
pub fn octaves_db(
    scene: &std::sync::Arc<Scene>,
    source: Point,
    listener: Point,
) -> Result<[f64; 3]> {
    let [from, to] = [source, listener].map(|p| Vec3::from(p.map(|v| v as f32)));
    let settings = PropagationSettings {
        guide_rays: 512,
        source_rays: 16,
        depth: 2,
        ..PropagationSettings::default()
    };
    let mut probe = rooms::Probe::new(scene, from, settings)?;
    probe.update(to);
    let straight_m = f64::from(from.distance(to));
    Ok(OCTAVES.map(|(hz, band)| {
        let np_per_m = f64::from(scene.air_np_per_m()[band]);
        let energy = |tone: usize| {
            let octaves = (tone as f64 + 0.5) / TONES as f64 - 0.5;
            let wavenumber = 2.0 * PI * hz * octaves.exp2() / scene.speed_of_sound_m_s();
            let mut sum = Complex::ZERO;
            for path in &probe.set.paths {
                let length_m = f64::from(path.length_m);
                let dry = f64::from(path.amplitude[band]) * (np_per_m * length_m).exp();
                sum += Complex::cis(-wavenumber * length_m) * (dry * straight_m);
            }
            sum.abs().powi(2)
        };
        10.0 * ((0..TONES).map(energy).sum::<f64>() / TONES as f64).log10()
    }))
}
