//! Law *shoebox*: every image source to order 4 of a rectangular room, against the closed form.

#[path = "oracles/shoebox.rs"]
#[expect(unreachable_pub, reason = "the oracle is a file of the tests")]
pub(super) mod oracle;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::Vec3;

use super::Row;
use super::rooms::{self, Probe};
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::acoustics::{BANDS, Material};
use foresound::error::Result;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::propagation::{MAX_ORDER, Path, PropagationSettings};
use foresound::scene::Scene;

/// Source and listener pairs tried in each room.
const PAIRS: u64 = 12;

/// Updates after which recall is measured.
const MEASURED_UPDATES: [u32; 3] = [1, 8, 16];

/// Sample rate of arrival errors.
const RATE_HZ: f64 = 48_000.0;

/// Counts and worst errors of one room.
#[derive(Default)]
struct Tally {
    expected: [usize; MAX_ORDER + 1],
    found: BTreeMap<u32, [usize; MAX_ORDER + 1]>,
    wrong: usize,
    compared: usize,
    worst_length: f64,
    worst_arrival_samples: f64,
    worst_amplitude_db: [f64; BANDS],
}

/// The two rooms of the law.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for size in [[8.0, 6.0, 3.0], [30.0, 20.0, 10.0]] {
        rows.extend(room_rows(size)?);
    }
    Ok(rows)
}

fn room_rows(size: [f64; 3]) -> Result<Vec<Row>> {
    // Six different walls: a path with wrong walls has a wrong amplitude.
    let walls = std::array::from_fn(|w| {
        let slope = |b: usize| 0.02 + 0.01 * w as f32 + 0.03 * b as f32;
        Material {
            name: format!("wall{w}"),
            absorption: std::array::from_fn(slope),
            scattering: std::array::from_fn(|b| 0.5 * slope(b)),
            transmission: [0.0; BANDS],
        }
    });
    let scene = rooms::six_walls(Vec3::from(size.map(|s| s as f32)), walls.clone())?;
    let wide = |bands: [f32; BANDS]| bands.map(f64::from);
    let room = oracle::Room {
        size,
        absorption: std::array::from_fn(|w| wide(walls[w].absorption)),
        scattering: std::array::from_fn(|w| wide(walls[w].scattering)),
        air_np_per_m: wide(*scene.air_np_per_m()),
    };
    let mut tally = Tally::default();
    for pair in 0..PAIRS {
        // Anywhere but within 0.2 m of a wall.
        let position = |side: u64| {
            std::array::from_fn::<f32, 3, _>(|axis| {
                let draw = unit(mix(pair << 8 | side << 4 | axis as u64));
                0.2 + draw * (size[axis] as f32 - 0.4)
            })
        };
        measure_pair(&scene, &room, position(0), position(1), &mut tally)?;
    }
    let name = format!("shoebox: {} x {} x {} m", size[0], size[1], size[2]);
    Ok(tally.rows(&name))
}

fn measure_pair(
    scene: &Arc<Scene>,
    room: &oracle::Room,
    source: [f32; 3],
    listener: [f32; 3],
    tally: &mut Tally,
) -> Result<()> {
    let truth = oracle::images(
        room,
        source.map(f64::from),
        listener.map(f64::from),
        MAX_ORDER as u32,
    );
    for image in &truth {
        tally.expected[image.order as usize] += 1;
    }
    let mut probe = Probe::new(scene, source.into(), PropagationSettings::default())?;
    for update in 1..=MEASURED_UPDATES[MEASURED_UPDATES.len() - 1] {
        probe.update(listener.into());
        if MEASURED_UPDATES.contains(&update) {
            compare(scene, room, &truth, &probe.set.paths, update, tally);
        }
    }
    Ok(())
}

/// The oracle's wall of a surface.
fn wall_of(scene: &Scene, room: &oracle::Room, surface: u32) -> usize {
    let plane = scene.surface(surface);
    let axis = plane.normal.abs().max_position();
    let on_plane = scene.to_world(plane.normal * plane.offset_m)[axis];
    2 * axis + usize::from(f64::from(on_plane) > 0.5 * room.size[axis])
}

fn compare(
    scene: &Scene,
    room: &oracle::Room,
    truth: &[oracle::Image],
    paths: &[Path],
    update: u32,
    tally: &mut Tally,
) {
    let mut seen = vec![false; truth.len()];
    for path in paths {
        tally.compared += 1;
        let mut counts = [0; 6];
        for &surface in path.surfaces() {
            counts[wall_of(scene, room, surface)] += 1;
        }
        let position = path.image.to_array().map(f64::from);
        let near =
            |image: &oracle::Image| (0..3).all(|a| (image.position[a] - position[a]).abs() < 1e-3);
        let found = truth
            .iter()
            .position(|image| image.wall_counts == counts && near(image))
            .filter(|&i| !std::mem::replace(&mut seen[i], true));
        let Some(found) = found else {
            tally.wrong += 1;
            continue;
        };
        let image = &truth[found];
        tally.found.entry(update).or_default()[image.order as usize] += 1;
        let off_m = (f64::from(path.length_m) - image.length_m).abs();
        tally.worst_length = tally.worst_length.max(off_m / image.length_m);
        let off_samples = off_m / scene.speed_of_sound_m_s() * RATE_HZ;
        tally.worst_arrival_samples = tally.worst_arrival_samples.max(off_samples);
        for b in 0..BANDS {
            // A factor that passes through zero has no level, nor one below −120 dB.
            let nearest = image.amplitude[b].abs().max(1e-6);
            let off = f64::from(path.amplitude[b]) - image.amplitude[b];
            let off_db = 20.0 * (1.0 + off.abs() / nearest).log10();
            tally.worst_amplitude_db[b] = tally.worst_amplitude_db[b].max(off_db);
        }
    }
}

impl Tally {
    fn rows(&self, name: &str) -> Vec<Row> {
        let share = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
        let mut case = super::Case::new(name.to_owned());
        for (update, bound) in MEASURED_UPDATES.into_iter().zip([99.5, 100.0, 100.0]) {
            let found = self.found.get(&update).copied().unwrap_or_default();
            let all = share(found.iter().sum(), self.expected.iter().sum());
            case.at_least(&format!("recall after {update} updates"), all, bound, "%");
            for order in 0..=MAX_ORDER {
                let what = format!("recall of order {order} after {update} updates");
                let bound = if order < 2 { 100.0 } else { 98.0 };
                case.at_least(&what, share(found[order], self.expected[order]), bound, "%");
            }
        }
        let right = share(self.compared - self.wrong, self.compared);
        case.at_least("precision", right, 100.0, "%");
        case.at_most("path length", self.worst_length, 1e-5, "relative");
        case.at_most(
            "arrival",
            self.worst_arrival_samples,
            0.1,
            "samples at 48 kHz",
        );
        for (worst, hz) in self.worst_amplitude_db.iter().zip(CENTRES_HZ) {
            case.at_most(&format!("amplitude at {hz:.0} Hz"), *worst, 0.05, "dB");
        }
        case.rows
    }
}
