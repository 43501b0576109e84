//! Paths of second-order diffraction, such as around a thick wall or through two doorways.

use glam::DVec3;

use crate::propagation::diffraction::edge_wave::local_positions;
use crate::propagation::diffraction::first_order::DirectEdges;
use crate::propagation::diffraction::ranked_list::{insert_ranked, rank_weight};
use crate::propagation::diffraction::two_edge_path::{
    TwoEdgePath, bound_narrow_face, insert_shortest, meet_at_corner,
};
use crate::propagation::diffraction::{MAX_DETOUR_M, moving_edge_pairs};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::path::Path;
use crate::scene::Scene;
use crate::scene::edges::{DiffractingEdges, Edge, REACH_M};

/// Most paths over two edges of one source.
pub const MAX_TWO_EDGE_PATHS: usize = 8;

/// Most paths tested for visibility, shortest first.
const MAX_TESTED: usize = 32;

/// The same of paths over two near edges that are no neighbours: they may not see each other.
const MAX_TESTED_APART: usize = 12;

/// Near edges that are paired with each other for these, shortest path first.
const MAX_PAIRED_APART: usize = 16;

/// Emits the loudest paths over two edges, [`MAX_TWO_EDGE_PATHS`] at most. One edge is of `near` and the other its neighbour or of
/// `near` too, or one belongs to an instance ([`moving_edge_pairs`]). Paths that waves over one of the `direct` edges include are
/// left out. Returns the energy of the loudest one that is left out of the list, which the others fade towards ([`rank_weight`]).
/// Adds the rays cast to `rays`.
pub fn find(
    scene: &Scene,
    endpoints: &Endpoints,
    near: &DiffractingEdges,
    direct: &DirectEdges,
    rays: &mut u64,
    emit: &mut impl FnMut(Path),
) -> f64 {
    let (from, to) = local_positions(scene, endpoints);
    let most_m = from.distance(to) + MAX_DETOUR_M * scene.length_scale();
    let mut shortest: [Option<TwoEdgePath>; MAX_TESTED] = [None; MAX_TESTED];
    for found in near.as_slice() {
        // The path over this edge alone is a lower bound.
        let longest_m = shortest[MAX_TESTED - 1].map_or(most_m, |path| path.length_m());
        if found.length_m > longest_m {
            break;
        }
        let edge = &scene.edge(found.edge);
        let (is_first, is_second) = (edge.is_outside(from), edge.is_outside(to));
        for neighbour in scene.edge_neighbours(found.edge) {
            let other = &scene.edge(neighbour);
            let alone = other.at(other.apex_m(from, to).clamp(0.0, other.length_m));
            let alone_m = from.distance(alone) + alone.distance(to);
            let pair = ([found.edge, neighbour], [edge, other]);
            if alone_m >= longest_m
                || alone_m > last_m(&shortest)
                || is_in_direct_field(direct, pair)
            {
                continue;
            }
            if is_first
                && other.is_outside(to)
                && let Some(path) = TwoEdgePath::up_to(last_m(&shortest), pair.0, pair.1, from, to)
            {
                insert_shortest(&mut shortest, path);
            }
            // A pair of two near edges is found from its first one.
            let reverse = ([neighbour, found.edge], [other, edge]);
            if is_second
                && other.is_outside(from)
                && near.as_slice().iter().all(|other| other.edge != neighbour)
                && let Some(path) =
                    TwoEdgePath::up_to(last_m(&shortest), reverse.0, reverse.1, from, to)
            {
                insert_shortest(&mut shortest, path);
            }
        }
    }
    let apart = pairs_apart(scene, (from, to), near, direct);
    let moving = scene
        .has_instances()
        .then(|| moving_edge_pairs::shortest(scene, endpoints));
    let mut loudest: [Option<(Path, f64)>; MAX_TWO_EDGE_PATHS] = [None; MAX_TWO_EDGE_PATHS];
    let mut floor: f64 = 0.0;
    let candidates = shortest.iter().chain(&apart);
    for candidate in candidates.chain(moving.iter().flatten()).flatten() {
        if candidate.is_unoccluded(scene, endpoints, rays)
            && let Some(path) = candidate.path(scene, endpoints)
            && let Some((_, energy)) = insert_ranked(&mut loudest, path, |old| old.1 >= path.1)
        {
            floor = floor.max(energy);
        }
    }
    for path in loudest.into_iter().flatten() {
        emit(ranked(path, floor));
    }
    floor
}

/// A path with its weight in a list of the loudest, of which the loudest that is left out has the energy `floor`. The weight is by
/// squares of energies: a frame may have the floor of an update some frames old, and a path 3 dB above it is then within a quarter.
pub(super) fn ranked((mut path, energy): (Path, f64), floor: f64) -> Path {
    let weight = rank_weight(energy.powi(2), floor.powi(2)) as f32;
    path.amplitude = path.amplitude.map(|value| value * weight);
    path
}

/// The shortest paths over two of the nearest edges that are no neighbours, since they are far from each other or have nearer ones,
/// and that [`moving_edge_pairs`] leaves out: where one obstacle hides the edge of another, however far behind it, no other path
/// continues that edge's wave. Sound crosses first the edge that it would cross nearer to the source if each were alone.
fn pairs_apart(
    scene: &Scene,
    (from, to): (DVec3, DVec3),
    near: &DiffractingEdges,
    direct: &DirectEdges,
) -> [Option<TwoEdgePath>; MAX_TESTED_APART] {
    let mut shortest = [None; MAX_TESTED_APART];
    let mut before: [Option<(u32, Edge, f64)>; MAX_PAIRED_APART] = [None; MAX_PAIRED_APART];
    for (index, found) in near.as_slice().iter().take(MAX_PAIRED_APART).enumerate() {
        // Either edge alone is a lower bound, and this one is the longer of two.
        if found.length_m > last_m(&shortest) {
            break;
        }
        let edge = scene.edge(found.edge);
        let alone = edge.at(edge.apex_m(from, to).clamp(0.0, edge.length_m));
        let along_m = (alone - from).dot(to - from);
        for (other, other_edge, other_along_m) in before.iter().flatten() {
            let is_found = match scene.is_committed_pair(*other, found.edge) {
                true => scene.edge_neighbours(found.edge).any(|n| n == *other),
                false => edge.distance_m(other_edge) < REACH_M * scene.length_scale(),
            };
            let pair = ([found.edge, *other], [&edge, other_edge]);
            if is_found || is_in_direct_field(direct, pair) {
                continue;
            }
            let (edges, lines) = match along_m < *other_along_m {
                true => ([found.edge, *other], [&edge, other_edge]),
                false => ([*other, found.edge], [other_edge, &edge]),
            };
            let path = TwoEdgePath::up_to(last_m(&shortest), edges, lines, from, to);
            if let Some(path) = path {
                insert_shortest(&mut shortest, path);
            }
        }
        before[index] = Some((found.edge, edge, along_m));
    }
    shortest
}

/// Length in metres up to which a path is among the shortest: any while there is room.
fn last_m(shortest: &[Option<TwoEdgePath>]) -> f64 {
    let last = shortest.last().copied().flatten();
    last.map_or(f64::INFINITY, |path| path.length_m())
}

/// Whether waves over one edge include that over two: along a narrow face, and at a corner, where the edge's end does.
fn is_in_direct_field(direct: &DirectEdges, (edges, lines): ([u32; 2], [&Edge; 2])) -> bool {
    let is_direct = |edge| direct.as_slice().contains(edge);
    edges.iter().any(is_direct) && (meet_at_corner(lines) || bound_narrow_face(lines))
}
