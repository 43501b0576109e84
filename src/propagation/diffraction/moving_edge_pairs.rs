//! Pairs of edges of which one at least belongs to an instance: a half-open door and its frame.
//!
//! A commit finds pairs of edges with a line of sight, but not across instances. Such pairs are searched in every update
//! among the shortest paths over one edge from either end. No state is kept between updates, and the search is reciprocal.
//! Own.

use glam::DVec3;

use crate::propagation::diffraction::MAX_DETOUR_M;
use crate::propagation::diffraction::edge_wave::local_positions;
use crate::propagation::diffraction::two_edge_path::{TwoEdgePath, insert_shortest};
use crate::propagation::endpoints::Endpoints;
use crate::scene::Scene;
use crate::scene::edges::{
    DiffractingEdge, DiffractingEdges, Edge, MAX_DIFFRACTING_EDGES, REACH_M,
};

/// Most paths tested for visibility, shortest first. More than in the fixed scene, where the visibility graph excludes
/// occluded pairs.
pub const MAX_TESTED: usize = 32;

/// Allowance in metres for rounding in sums of `f64` distances.
const SLACK_M: f64 = 1e-9;

/// The shortest paths, shortest first.
pub type ShortestPaths = [Option<TwoEdgePath>; MAX_TESTED];

/// An edge near one end of the path.
#[derive(Clone, Copy)]
struct EdgeDistance {
    index: u32,
    edge: Edge,
    /// Length of the path from end to end over this edge alone, a lower bound for paths over it and another.
    alone_m: f64,
    /// Least distance from the end to the edge.
    near_m: f64,
}

/// The edges near one end, shortest path over them alone first.
struct EdgeList([Option<EdgeDistance>; MAX_DIFFRACTING_EDGES]);

impl EdgeList {
    fn of(scene: &Scene, found: &DiffractingEdges, end: DVec3) -> Self {
        let mut edges = [None; MAX_DIFFRACTING_EDGES];
        for (entry, &DiffractingEdge { edge, length_m }) in edges.iter_mut().zip(found.as_slice()) {
            let line = scene.edge(edge);
            let along_m = (end - line.origin).dot(line.direction);
            let nearest = line.at(along_m.clamp(0.0, line.length_m));
            *entry = Some(EdgeDistance {
                index: edge,
                edge: line,
                alone_m: length_m,
                near_m: end.distance(nearest),
            });
        }
        Self(edges)
    }

    fn iter(&self) -> impl Iterator<Item = &EdgeDistance> {
        self.0.iter().flatten()
    }
}

/// The shortest paths over an edge of an instance and one of another instance or of the fixed scene. Occlusion is not
/// tested.
pub fn shortest(scene: &Scene, endpoints: &Endpoints) -> ShortestPaths {
    let mut shortest = [None; MAX_TESTED];
    let (from, to) = local_positions(scene, endpoints);
    let most_m = from.distance(to) + MAX_DETOUR_M * scene.length_scale();
    let parts = [
        scene.first_crossings_of_instances(from, to, most_m),
        scene.first_crossings_of_instances(to, from, most_m),
    ];
    if parts.iter().all(|found| found.as_slice().is_empty()) {
        return shortest;
    }
    let fixed = [
        scene.first_crossings_of_fixed(from, to, most_m),
        scene.first_crossings_of_fixed(to, from, most_m),
    ];
    let [first_fixed, first_parts] = [&fixed[0], &parts[0]].map(|f| EdgeList::of(scene, f, from));
    let [last_fixed, last_parts] = [&fixed[1], &parts[1]].map(|f| EdgeList::of(scene, f, to));
    for (firsts, lasts) in [
        // Pieces of fixed edges that joining has added.
        (&first_fixed, &last_fixed),
        (&first_fixed, &last_parts),
        (&first_parts, &last_fixed),
        (&first_parts, &last_parts),
    ] {
        for first in firsts.iter() {
            for last in lasts.iter() {
                let longest_m = shortest[MAX_TESTED - 1]
                    .as_ref()
                    .map_or(most_m, TwoEdgePath::length_m);
                if last.alone_m.max(first.alone_m) > longest_m {
                    break;
                }
                let edges = [first.index, last.index];
                if may_pair(scene, first, last, longest_m)
                    && let Some(path) =
                        TwoEdgePath::between(edges, [&first.edge, &last.edge], from, to)
                {
                    insert_shortest(&mut shortest, path);
                }
            }
        }
    }
    shortest
}

/// Whether two edges belong to different rigid bodies and a path over both may be as short as `longest_m`.
fn may_pair(scene: &Scene, first: &EdgeDistance, last: &EdgeDistance, longest_m: f64) -> bool {
    if first.near_m + last.near_m > longest_m || scene.is_committed_pair(first.index, last.index) {
        return false;
    }
    let apart_m = first.edge.distance_m(&last.edge);
    apart_m < REACH_M * scene.length_scale()
        && first.near_m + apart_m + last.near_m <= longest_m + SLACK_M
}
