//! Law *recall*: the share of all paths to order 4 that propagation finds in non-rectangular rooms, after one update and
//! after sixteen, and the share of false births and deaths while a listener walks. The oracle enumerates all paths.

#[path = "oracles/full_enumeration.rs"]
#[expect(unreachable_pub, reason = "the oracle is a file of the tests")]
pub(super) mod oracle;
#[path = "oracles/visibility.rs"]
#[expect(unreachable_pub, reason = "the oracle is a file of the tests")]
#[allow(dead_code, reason = "only part of the oracle is used here")]
mod visibility;

use std::collections::HashMap;

use glam::Vec3;

use super::Row;
use super::recall_rooms::{ABSORPTION, RecallRoom, all};
use super::rooms::Probe;
use foresound::error::Result;
use foresound::propagation::{MAX_ORDER, PathSet};

/// Source and listener pairs in each room.
const PAIRS: u64 = 24;

/// Updates of a walk, and metres between two of them: 1.4 m/s at 20 updates a second.
const WALK: (u32, f32) = (40, 0.07);

/// Walks in each room.
const WALKS: u64 = 2;

/// Least share of the energy that must be found, in per cent.
const ENERGY: f64 = 99.5;

/// Most births and deaths without cause, in per cent of the paths an update.
const SPURIOUS: f64 = 0.2;

/// Planes of each true path from source to listener, and its energy.
type TruePaths = HashMap<Vec<usize>, f64>;

/// Recall and steadiness of every room.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for room in all()? {
        let oracle_room = OracleRoom::of(&room);
        let first = room.probe()?;
        rows.extend(recall(&room, &oracle_room, &first)?);
        rows.push(walks(&room, &oracle_room, &first)?);
    }
    Ok(rows)
}

/// A room in the oracle's representation.
pub(super) struct OracleRoom {
    triangles: Vec<[Vec3; 3]>,
    planes: Vec<oracle::Plane>,
    /// The oracle's plane of each surface.
    plane_of: Vec<usize>,
}

impl OracleRoom {
    pub(super) fn of(room: &RecallRoom) -> Self {
        let triangles: Vec<[Vec3; 3]> = room.scene.triangles().collect();
        // Small pieces block but do not mirror.
        let panels: Vec<[Vec3; 3]> = (0..)
            .zip(&triangles)
            .filter(|(number, _)| room.scene.is_panel(*number))
            .map(|(_, triangle)| *triangle)
            .collect();
        let planes = oracle::planes(&panels);
        let mut plane_of = vec![usize::MAX; room.scene.surfaces().len()];
        for (number, triangle) in triangles.iter().enumerate() {
            if !room.scene.is_panel(number as u32) {
                continue;
            }
            let off = |plane: &oracle::Plane| {
                let far = |p: &Vec3| plane.distance(p.as_dvec3()).abs();
                triangle.iter().map(far).fold(0.0, f64::max)
            };
            let surface = room.scene.surface_of(number as u32) as usize;
            let nearest =
                (0..planes.len()).min_by(|&a, &b| off(&planes[a]).total_cmp(&off(&planes[b])));
            plane_of[surface] = nearest.unwrap_or(usize::MAX);
        }
        Self {
            triangles,
            planes,
            plane_of,
        }
    }

    /// All reflected paths.
    pub(super) fn paths(&self, source: Vec3, listener: Vec3) -> Vec<oracle::Reflected> {
        let is_free = |from, to| visibility::is_visible(&self.triangles, from, to, |_| false);
        let (source, listener) = (source.as_dvec3(), listener.as_dvec3());
        oracle::paths(&self.planes, source, listener, MAX_ORDER, is_free)
    }

    fn truth(&self, source: Vec3, listener: Vec3) -> TruePaths {
        self.paths(source, listener)
            .into_iter()
            .map(|path| {
                let kept = f64::from(1.0 - ABSORPTION).powi(path.planes.len() as i32);
                (path.planes, kept / (path.length * path.length))
            })
            .collect()
    }

    /// Planes of each reflected path of a set.
    fn found(&self, set: &PathSet) -> Vec<Vec<usize>> {
        let planes = |surfaces: &[u32]| -> Vec<usize> {
            surfaces
                .iter()
                .map(|&s| self.plane_of[s as usize])
                .collect()
        };
        let reflected = set
            .paths
            .iter()
            .filter(|path| path.order > 0 && path.diffraction_order == 0);
        reflected.map(|path| planes(path.surfaces())).collect()
    }
}

fn recall(room: &RecallRoom, oracle_room: &OracleRoom, first: &Probe) -> Result<Vec<Row>> {
    let (mut expected, mut wrong, mut compared) = (0usize, 0usize, 0usize);
    let mut energy_expected = 0.0;
    let (mut found, mut energy_found) = ([0usize; 2], [0.0; 2]);
    for number in 0..PAIRS {
        let (source, listener) = (room.position(2 * number), room.position(2 * number + 1));
        let truth = oracle_room.truth(source, listener);
        expected += truth.len();
        energy_expected += truth.values().sum::<f64>();
        let mut pair = first.beside(source)?;
        for update in 1..=16 {
            pair.update(listener);
            let Some(index) = [1, 16].iter().position(|&at| at == update) else {
                continue;
            };
            for planes in oracle_room.found(&pair.set) {
                compared += 1;
                match truth.get(&planes) {
                    Some(energy) => {
                        found[index] += 1;
                        energy_found[index] += energy;
                    }
                    None => wrong += 1,
                }
            }
        }
    }
    let percent = |share: f64, whole: f64| 100.0 * share / whole.max(f64::MIN_POSITIVE);
    let mut case = super::Case::new(format!("recall: {}", room.name));
    for (index, after) in ["one update", "sixteen updates"].into_iter().enumerate() {
        let paths = percent(found[index] as f64, expected as f64);
        case.at_least(after, paths, room.bounds[index], "% of paths");
        let energy = percent(energy_found[index], energy_expected);
        case.at_least(after, energy, ENERGY, "% of energy");
    }
    // One in a thousand is nearer to an edge than single precision resolves.
    let invented = percent(wrong as f64, compared as f64);
    case.at_most("false paths", invented, 0.1, "% of paths");
    Ok(case.rows)
}

/// Changes of the path set that the true set does not have, while a listener walks.
fn walks(room: &RecallRoom, oracle_room: &OracleRoom, first: &Probe) -> Result<Row> {
    let (mut spurious, mut paths) = (0usize, 0usize);
    for number in 0..WALKS {
        let (steps, step_m) = WALK;
        let source = room.position(1000 + 3 * number);
        let (start, onward) = free_line(room, 1001 + 50 * number, steps as f32 * step_m);
        let mut pair = first.beside(source)?;
        for _ in 0..16 {
            pair.update(start);
        }
        let mut before: Option<(Vec<Vec<usize>>, TruePaths)> = None;
        for step in 0..=steps {
            let listener = start + onward * (step as f32 * step_m);
            pair.update(listener);
            let (now, truth) = (
                oracle_room.found(&pair.set),
                oracle_room.truth(source, listener),
            );
            if let Some((old, old_truth)) = &before {
                let births = now.iter().filter(|p| !old.contains(p));
                let deaths = old.iter().filter(|p| !now.contains(p));
                spurious += births.filter(|p| old_truth.contains_key(*p)).count();
                spurious += deaths.filter(|p| truth.contains_key(*p)).count();
                paths += now.len();
            }
            before = Some((now, truth));
        }
    }
    let share = 100.0 * spurious as f64 / paths.max(1) as f64;
    let law = format!("recall: {}, births and deaths without cause", room.name);
    Ok(Row::at_most(law, share, SPURIOUS, "% an update"))
}

/// A start and a horizontal direction free of walls for a distance.
fn free_line(room: &RecallRoom, seed: u64, distance_m: f32) -> (Vec3, Vec3) {
    for attempt in 0u64..1000 {
        let (start, towards) = (
            room.position(seed * 1000 + 2 * attempt),
            room.position(seed * 1000 + 2 * attempt + 1),
        );
        let level = (towards - start) * Vec3::new(1.0, 0.0, 1.0);
        let onward = level.normalize_or(Vec3::X);
        let free = |i: u16| room.is_free(start + onward * (distance_m * f32::from(i) / 20.0));
        if (0..=20).all(free) {
            return (start, onward);
        }
    }
    (room.position(seed), Vec3::ZERO)
}
