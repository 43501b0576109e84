//! The floor that a listener can reach on foot, also through doors, as a graph of positions at ear height.
//!
//! Own method: the grid of [`crate::open_space`], finer, and its rules of clearance.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use foresound::scene::Scene;
use glam::Vec3;

use crate::open_space::{
    CLEARANCE_M, EAR_HEIGHT_M, STEP_M, can_walk, clear_m, floor_positions, hits,
};

/// Distance of the positions in metres: a doorway has some.
const PITCH_M: f32 = 0.3;

/// Largest horizontal distance from the start along each axis, in metres.
const REACH_M: f32 = 20.0;

/// Positions in open space around a start, joined where one can walk.
#[derive(Debug, Clone)]
pub struct ReachableFloor {
    positions: Vec<Vec3>,
    /// Neighbours of each position.
    neighbours: Vec<Vec<usize>>,
}

impl ReachableFloor {
    /// All that can be reached from a start; `None` if there is no floor around it.
    pub fn around(scene: &Scene, start: Vec3) -> Option<Self> {
        let found = floor_positions(scene, start, REACH_M, PITCH_M);
        let mut squares: BTreeMap<[i32; 2], Vec<usize>> = BTreeMap::new();
        for (index, position) in found.iter().enumerate() {
            squares.entry(position.square).or_default().push(index);
        }
        let distance = |index: &usize| found[*index].at.distance_squared(start);
        let first = (0..found.len())
            .filter(|&index| !hits(scene, start, found[index].at))
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        // Positions in the order in which they are reached.
        let mut reached = vec![first];
        let mut number = vec![usize::MAX; found.len()];
        number[first] = 0;
        let mut neighbours: Vec<Vec<usize>> = Vec::new();
        while neighbours.len() < reached.len() {
            let here = &found[reached[neighbours.len()]];
            let mut joined = Vec::new();
            let [x, z] = here.square;
            for square in (x - 1..=x + 1).flat_map(|x| (z - 1..=z + 1).map(move |z| [x, z])) {
                for &index in squares.get(&square).into_iter().flatten() {
                    let there = found[index].at;
                    let is_step = square != here.square && (there.y - here.at.y).abs() <= STEP_M;
                    if is_step && !hits(scene, here.at, there) {
                        if number[index] == usize::MAX {
                            number[index] = reached.len();
                            reached.push(index);
                        }
                        joined.push(number[index]);
                    }
                }
            }
            neighbours.push(joined);
        }
        let positions = reached.iter().map(|&index| found[index].at).collect();
        Some(Self {
            positions,
            neighbours,
        })
    }

    /// All positions, in metres.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The position nearest to another one.
    pub fn nearest(&self, to: Vec3) -> Vec3 {
        self.positions[self.nearest_index(to)]
    }

    fn nearest_index(&self, to: Vec3) -> usize {
        let distance = |index: &usize| self.positions[*index].distance_squared(to);
        let all = 0..self.positions.len();
        all.min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or(0)
    }

    /// The shortest way between the positions nearest to two others, straight wherever one can walk straight. Starts at
    /// the first of the two positions; empty if there is none.
    pub fn way(&self, scene: &Scene, from: Vec3, to: Vec3) -> Vec<Vec3> {
        let [from, to] = [from, to].map(|end| self.nearest_index(end));
        let steps = self.shortest(from, to);
        let mut way: Vec<Vec3> = steps.first().copied().into_iter().collect();
        let mut here = 0;
        while here + 1 < steps.len() {
            let straight = (here + 2..steps.len())
                .rev()
                .find(|&there| can_walk(scene, steps[here], steps[there]));
            here = straight.unwrap_or(here + 1);
            way.push(steps[here]);
        }
        way
    }

    /// Dijkstra's shortest way over neighbours.
    fn shortest(&self, from: usize, to: usize) -> Vec<Vec3> {
        // Millimetres keep the order total.
        let mut length_mm = vec![u32::MAX; self.positions.len()];
        let mut before = vec![from; self.positions.len()];
        let mut waiting = BinaryHeap::from([(Reverse(0), from)]);
        length_mm[from] = 0;
        while let Some((Reverse(so_far), here)) = waiting.pop() {
            if here == to {
                break;
            }
            if so_far > length_mm[here] {
                continue;
            }
            for &there in &self.neighbours[here] {
                let step_m = self.positions[here].distance(self.positions[there]);
                let total = so_far + (1000.0 * step_m) as u32;
                if total < length_mm[there] {
                    length_mm[there] = total;
                    before[there] = here;
                    waiting.push((Reverse(total), there));
                }
            }
        }
        let mut way = Vec::new();
        if length_mm[to] < u32::MAX {
            let mut here = to;
            while here != from {
                way.push(self.positions[here]);
                here = before[here];
            }
            way.push(self.positions[from]);
            way.reverse();
        }
        way
    }
}

/// Steepest walk, as height over length.
pub(super) const STEEPEST: f32 = 0.3;

/// Where a straight walk from a position along a horizontal vector ends, at ear height above the floor there; `None` if
/// one cannot walk there.
pub(crate) fn walked(scene: &Scene, from: Vec3, along: Vec3) -> Option<Vec3> {
    let flat = from + along;
    let most_m = EAR_HEIGHT_M + STEP_M;
    let above_m = clear_m(scene, flat, Vec3::NEG_Y * most_m);
    let to = flat + Vec3::Y * (EAR_HEIGHT_M - above_m);
    let ahead = along.normalize_or_zero() * CLEARANCE_M;
    let is_free = above_m < most_m && !hits(scene, from, to + ahead);
    let is_flat = (to.y - from.y).abs() <= STEEPEST * along.length();
    (is_free && is_flat && can_walk(scene, from, to)).then_some(to)
}

#[cfg(test)]
mod tests {
    use super::*;
    use foresound::scene::{MaterialTable, SceneSettings, procedural};

    #[test]
    fn a_way_leads_through_the_door() {
        let benchmark = procedural::by_name("doorway").unwrap();
        let settings = SceneSettings::default();
        let scene = Scene::commit(&benchmark.mesh, &MaterialTable::built_in(), &settings).unwrap();
        let [from, to] = [benchmark.walk.from, benchmark.walk.to];
        let floor = ReachableFloor::around(&scene, from).unwrap();
        let far = floor
            .positions()
            .iter()
            .filter(|there| hits(&scene, from, **there))
            .max_by(|a, b| a.distance(from).total_cmp(&b.distance(from)));
        let far = *far.expect("the other room is reached");
        let way = floor.way(&scene, from, far);
        assert!(way.len() > 2, "{way:?} turns at the door");
        for leg in way.windows(2) {
            assert!(!hits(&scene, leg[0], leg[1]), "{leg:?}");
        }
        let length: f32 = way.windows(2).map(|leg| leg[0].distance(leg[1])).sum();
        assert!(length > from.distance(far), "{length} m");
        assert!(floor.nearest(to).distance(to) < 1.0);
    }
}
