//! Law *mesh*: noise on a mesh, its winding and its tessellation change neither the image paths nor the energy.
//!
//! Twins of a room (`mesh_rooms`) are compared with the clean room of a few large triangles. An image path has a counterpart
//! where a path of the same order has its image source nearby.

use std::collections::HashSet;
use std::sync::Arc;

use glam::Vec3;

use super::Case;
use super::Row;
use super::mesh_rooms::{BlockRoom, ROOMS, add_noise, as_scan, rewind};
use super::rooms::{Probe, commit, even};
use foresound::acoustics::BANDS;
use foresound::error::Result;
use foresound::propagation::{PathId, PathSet, PropagationSettings};
use foresound::scene::{Scene, TriangleMesh};

/// Tessellations in metres, and noise on each vertex along its normal, as a standard deviation in metres.
const EDGES_M: [f32; 3] = [0.05, 0.1, 0.3];
const SIGMAS_M: [f32; 4] = [0.0, 0.001, 0.005, 0.01];

/// Tessellation and noise of the scans, which are decimated and lack triangles.
const SCANS: [(f32, f32); 2] = [(0.05, 0.005), (0.1, 0.01)];

/// Updates of which the last one is compared.
const UPDATES: u32 = 16;

/// Least recall in percent to order 3 and of order 4, and most paths without a counterpart in the clean room.
const RECALL: [f64; 2] = [99.0, 97.0];
const SPURIOUS: f64 = 2.0;

/// Bounds of the differences of amplitudes to 1 kHz in dB: median, and at 95 %.
const AMPLITUDE_DB: [f64; 2] = [0.5, 1.5];

/// Bands to 1 kHz.
const COMPARED: usize = 5;

/// Bound of the difference of all energy in dB.
const ENERGY_DB: f64 = 0.5;

/// Distance of the image sources of one path, in metres: far below that of two paths.
const SAME_IMAGE_M: f32 = 0.2;

/// Bound of the difference between windings in dB.
const WINDING_DB: f64 = 0.01;

/// Updates of a walk after those, metres between two of them (1.4 m/s at 20 updates a second), and most births and deaths in
/// percent of the paths an update, beyond those of the clean room.
const WALK: (u32, f32) = (20, 0.07);
const UNSTEADY: f64 = 0.5;

/// What a listener receives.
struct Heard {
    paths: Vec<Image>,
    energy: f64,
    /// Births and deaths in percent of the paths an update, while the listener walks.
    changes: f64,
}

struct Image {
    order: u8,
    image: Vec3,
    length_m: f64,
    amplitude: [f32; BANDS],
}

pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for room in &ROOMS {
        let clean = heard(room, &scene(&room.tessellated(f32::MAX))?)?;
        for edge_m in EDGES_M {
            for sigma_m in SIGMAS_M {
                let mut mesh = room.tessellated(edge_m);
                add_noise(&mut mesh, sigma_m, 1);
                let twin = heard(room, &scene(&mesh)?)?;
                let name = format!(
                    "mesh/noise: {}, {:.0} cm, {:.0} mm",
                    room.name,
                    100.0 * edge_m,
                    1000.0 * sigma_m
                );
                rows.extend(compared(Case::new(name), &clean, &twin, sigma_m));
            }
        }
        for (edge_m, sigma_m) in SCANS {
            let mut mesh = room.tessellated(edge_m);
            as_scan(&mut mesh, 3);
            add_noise(&mut mesh, sigma_m, 1);
            let twin = heard(room, &scene(&mesh)?)?;
            let (cm, mm) = (100.0 * edge_m, 1000.0 * sigma_m);
            let name = format!("mesh/scan: {}, {cm:.0} cm, {mm:.0} mm", room.name);
            rows.extend(compared(Case::new(name), &clean, &twin, sigma_m));
        }
        rows.extend(windings(room, &clean)?);
    }
    Ok(rows)
}

/// The clean room wound outwards, at random, and with every triangle in both windings.
fn windings(room: &BlockRoom, clean: &[Heard]) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (name, share, doubled) in [
        ("outward", 1.0, false),
        ("random", 0.5, false),
        ("doubled", 0.0, true),
    ] {
        let mut mesh = room.tessellated(0.3);
        rewind(&mut mesh, share, 7);
        if doubled {
            let mut other = mesh.clone();
            rewind(&mut other, 1.0, 7);
            mesh.triangles.extend(other.triangles);
            mesh.triangle_materials.extend(other.triangle_materials);
        }
        let twin = heard(room, &scene(&mesh)?)?;
        let mut case = Case::new(format!("mesh/winding: {}, {name}", room.name));
        let (mut worst, mut unmatched) = (0f64, 0);
        for (clean, twin) in clean.iter().zip(&twin) {
            let matched = Matched::of(clean, twin);
            unmatched += matched.missing[0] + matched.missing[1] + matched.spurious;
            worst = matched.levels_db.iter().copied().fold(worst, f64::max);
        }
        case.at_most("paths without a counterpart", f64::from(unmatched), 0.0, "");
        case.at_most("amplitude", worst, WINDING_DB, "dB");
        rows.extend(case.rows);
    }
    Ok(rows)
}

fn scene(mesh: &TriangleMesh) -> Result<Arc<Scene>> {
    commit(mesh, vec![even("wall", 0.1, 0.05)])
}

fn heard(room: &BlockRoom, scene: &Arc<Scene>) -> Result<Vec<Heard>> {
    let [from, to] = room.pairs[0];
    let mut first = Probe::new(scene, from, PropagationSettings::default())?;
    first.update(to);
    let pair = |[from, to]: &[Vec3; 2]| -> Result<Heard> {
        let mut probe = first.beside(*from)?;
        for _ in 0..UPDATES {
            probe.update(*to);
        }
        let mut heard = Heard::of(&probe.set);
        heard.changes = changes(&mut probe, *to, Vec3::new(room.walk[0], 0.0, room.walk[1]));
        Ok(heard)
    };
    room.pairs.iter().map(pair).collect()
}

/// Births and deaths of image paths in percent of the paths an update, on a walk in a direction.
fn changes(probe: &mut Probe, from: Vec3, direction: Vec3) -> f64 {
    let images = |set: &PathSet| -> HashSet<PathId> {
        let images = set.paths.iter().filter(|p| p.diffraction_order == 0);
        images.map(|path| path.id).collect()
    };
    let mut before = images(&probe.set);
    let (mut changed, mut all) = (0, 0);
    for step in 1..=WALK.0 {
        probe.update(from + direction * WALK.1 * step as f32);
        let now = images(&probe.set);
        changed += now.symmetric_difference(&before).count();
        all += now.len();
        before = now;
    }
    100.0 * changed as f64 / all.max(1) as f64
}

impl Heard {
    fn of(set: &PathSet) -> Self {
        let square =
            |amplitude: &[f32; BANDS]| -> f64 { amplitude.iter().map(|a| f64::from(a * a)).sum() };
        let discrete: f64 = set.paths.iter().map(|p| square(&p.amplitude)).sum();
        let late = set.late.iter().flat_map(|late| late.total());
        let images = set.paths.iter().filter(|p| p.diffraction_order == 0);
        Self {
            paths: images
                .map(|path| Image {
                    order: path.order,
                    image: path.image,
                    length_m: f64::from(path.length_m),
                    amplitude: path.amplitude,
                })
                .collect(),
            energy: discrete + late.map(f64::from).sum::<f64>(),
            changes: 0.0,
        }
    }
}

/// Counterparts of one pair's paths: counts to order 3 and of order 4.
#[derive(Default)]
struct Matched {
    all: [u32; 2],
    missing: [u32; 2],
    spurious: u32,
    lengths_m: Vec<f64>,
    levels_db: Vec<f64>,
}

impl Matched {
    fn of(clean: &Heard, twin: &Heard) -> Self {
        let mut matched = Self::default();
        let mut rest: Vec<&Image> = twin.paths.iter().collect();
        for path in &clean.paths {
            let class = usize::from(path.order > 3);
            matched.all[class] += 1;
            let nearest = rest
                .iter()
                .enumerate()
                .filter(|(_, other)| other.order == path.order)
                .map(|(index, other)| (other.image.distance(path.image), index))
                .min_by(|a, b| a.0.total_cmp(&b.0))
                .filter(|(distance_m, _)| *distance_m < SAME_IMAGE_M);
            let Some((_, index)) = nearest else {
                matched.missing[class] += 1;
                continue;
            };
            let other = rest.swap_remove(index);
            matched
                .lengths_m
                .push((other.length_m - path.length_m).abs());
            for band in 0..COMPARED {
                let ratio = other.amplitude[band] / path.amplitude[band];
                let level_db = 20.0 * f64::from(ratio.abs()).log10();
                matched.levels_db.push(level_db.abs());
            }
        }
        matched.spurious = rest.len() as u32;
        matched
    }

    fn add(&mut self, other: Self) {
        for class in 0..2 {
            self.all[class] += other.all[class];
            self.missing[class] += other.missing[class];
        }
        self.spurious += other.spurious;
        self.lengths_m.extend(other.lengths_m);
        self.levels_db.extend(other.levels_db);
    }
}

fn compared(mut case: Case, clean: &[Heard], twin: &[Heard], sigma_m: f32) -> Vec<Row> {
    let mut all = Matched::default();
    let (mut energy_db, mut unsteady) = (0f64, 0f64);
    for (clean, twin) in clean.iter().zip(twin) {
        unsteady = unsteady.max(twin.changes - clean.changes);
        all.add(Matched::of(clean, twin));
        energy_db = energy_db.max((10.0 * (twin.energy / clean.energy).log10()).abs());
    }
    let percent = |part: u32, of: u32| 100.0 * f64::from(part) / f64::from(of.max(1));
    for (class, name) in ["recall to order 3", "recall of order 4"]
        .into_iter()
        .enumerate()
    {
        let recall = percent(all.all[class] - all.missing[class], all.all[class]);
        case.at_least(name, recall, RECALL[class], "%");
    }
    let paths = all.all[0] + all.all[1];
    case.at_most(
        "spurious paths",
        percent(all.spurious, paths),
        SPURIOUS,
        "%",
    );
    let length_m = all.lengths_m.iter().copied().fold(0.0, f64::max);
    case.at_most("length", length_m, 3.0 * f64::from(sigma_m) + 0.005, "m");
    all.levels_db.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = (share * all.levels_db.len() as f64) as usize;
        all.levels_db.get(index).copied().unwrap_or(f64::INFINITY)
    };
    case.at_most("amplitude, median", at(0.5), AMPLITUDE_DB[0], "dB");
    case.at_most("amplitude, 95 %", at(0.95), AMPLITUDE_DB[1], "dB");
    case.at_most("energy", energy_db, ENERGY_DB, "dB");
    case.at_most("births and deaths", unsteady, UNSTEADY, "%");
    case.rows
}
