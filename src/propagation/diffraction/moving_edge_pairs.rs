//! Ways over two edges that no committed scene knows together: one of a part that moves and one of the fixed scene, or
//! of two parts. A half-open door and its frame.
//!
//! What a scene's edges see is found when it is committed; such pairs are looked for in every update instead, among the
//! shortest ways over one edge from either end. Nothing is kept between updates, so where a door stands decides what is
//! found and not how it came there; and nothing is found one way that would not be found with source and listener
//! swapped. [`crate::propagation::diffraction::second_order`] has what a way over two edges is worth. Own.

use glam::DVec3;

use crate::propagation::diffraction::second_order::Way;
use crate::propagation::diffraction::{LONGEST_DETOUR_M, second_order};
use crate::propagation::endpoints::Endpoints;
use crate::scene::Scene;
use crate::scene::edges::{
    DiffractingEdge, DiffractingEdges, Edge, MAX_DIFFRACTING_EDGES, REACH_M,
};

/// Ways whose sight lines are tried, shortest first. More than of those that a graph names, which has left out what never
/// sees each other.
pub const MOST_TRIED: usize = 32;

/// Distances are in `f64`; their sums are bounds but for rounding, in metres.
const SLACK_M: f64 = 1e-9;

/// The shortest ways, shortest first.
pub type Tried = [Option<Way>; MOST_TRIED];

/// An edge as one end finds it.
#[derive(Clone, Copy)]
struct Reached {
    number: u32,
    line: Edge,
    /// Length of the way from end to end that bends here alone: none over it and another edge is shorter.
    alone_m: f64,
    /// Least distance from the end to the edge.
    near_m: f64,
}

/// The edges that one end finds, shortest way alone first.
struct List {
    edges: [Option<Reached>; MAX_DIFFRACTING_EDGES],
}

impl List {
    fn of(scene: &Scene, found: &DiffractingEdges, end: DVec3) -> Self {
        let mut edges = [None; MAX_DIFFRACTING_EDGES];
        for (place, &DiffractingEdge { edge, length_m }) in edges.iter_mut().zip(found.as_slice()) {
            let line = scene.edge(edge);
            let along_m = (end - line.origin).dot(line.direction);
            let nearest = line.at(along_m.clamp(0.0, line.length_m));
            *place = Some(Reached {
                number: edge,
                line,
                alone_m: length_m,
                near_m: end.distance(nearest),
            });
        }
        Self { edges }
    }

    fn iter(&self) -> impl Iterator<Item = &Reached> {
        self.edges.iter().flatten()
    }
}

/// The shortest ways over an edge of a part and one of something else, with the bends within the edges' ends and in the
/// air. Says nothing of what stands in between.
pub fn shortest(scene: &Scene, spot: &Endpoints) -> Tried {
    let mut tried = [None; MOST_TRIED];
    let (from, to) = (scene.to_local(spot.from), scene.to_local(spot.to));
    let most_m = from.distance(to) + LONGEST_DETOUR_M;
    let parts = [
        scene.first_crossings_of_instances(from, to, most_m),
        scene.first_crossings_of_instances(to, from, most_m),
    ];
    if parts.iter().all(|found| found.as_slice().is_empty()) {
        return tried;
    }
    let fixed = [
        scene.edges().first_crossings(from, to, most_m),
        scene.edges().first_crossings(to, from, most_m),
    ];
    let [first_fixed, first_parts] = [&fixed[0], &parts[0]].map(|f| List::of(scene, f, from));
    let [last_fixed, last_parts] = [&fixed[1], &parts[1]].map(|f| List::of(scene, f, to));
    for (firsts, lasts) in [
        (&first_fixed, &last_parts),
        (&first_parts, &last_fixed),
        (&first_parts, &last_parts),
    ] {
        for first in firsts.iter() {
            for last in lasts.iter() {
                let longest_m = tried[MOST_TRIED - 1].map_or(most_m, |way: Way| way.length_m());
                if last.alone_m.max(first.alone_m) > longest_m {
                    break;
                }
                if may_join(scene, first, last, longest_m)
                    && let Some(way) = Way::between(
                        [first.number, last.number],
                        [&first.line, &last.line],
                        from,
                        to,
                    )
                {
                    second_order::insert(&mut tried, way);
                }
            }
        }
    }
    tried
}

/// Whether two edges are not of one thing, and near enough to each other for a way of at most this length.
fn may_join(scene: &Scene, first: &Reached, last: &Reached, longest_m: f64) -> bool {
    if first.near_m + last.near_m > longest_m || scene.is_same_rigid_body(first.number, last.number)
    {
        return false;
    }
    let apart_m = first.line.distance_m(&last.line);
    apart_m < REACH_M && first.near_m + apart_m + last.near_m <= longest_m + SLACK_M
}
