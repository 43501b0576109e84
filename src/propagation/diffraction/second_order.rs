//! Paths of second-order diffraction, such as around a thick wall or through two doorways.

use glam::DVec3;

use crate::propagation::diffraction::direct_edges::DirectEdges;
use crate::propagation::diffraction::edge_wave::local_positions;
use crate::propagation::diffraction::near_list::{
    HIDDEN_ENERGY, LEAST_SHARE, nearest_point, two_edge_share,
};
use crate::propagation::diffraction::ranked_list::{insert_ranked, rank_weight};
use crate::propagation::diffraction::two_edge_path::{
    TwoEdgePath, bound_narrow_face, insert_shortest, meet_at_corner,
};
use crate::propagation::diffraction::{MAX_DETOUR_M, moving_edge_pairs};
use crate::propagation::endpoints::Endpoints;
use crate::propagation::path::{EdgeLimits, Path};
use crate::scene::Scene;
use crate::scene::edges::{DiffractingEdges, Edge, REACH_M};

/// Most paths over two edges of one source.
pub const MAX_TWO_EDGE_PATHS: usize = 8;

/// Most paths tested for visibility, shortest first.
const MAX_TESTED: usize = 32;

/// The same of paths over two near edges that are no neighbours: they may not see each other.
const MAX_TESTED_APART: usize = 12;

/// Near edges that are paired with each other for these, shortest path first.
pub(super) const MAX_PAIRED_APART: usize = 16;

/// Relative error of the lengths by which near edges are ranked, far above it: they exceed those of their paths by a millionth at
/// corners.
const RANK_ROUNDING: f64 = 1e-5;

/// Pairs of edges in the order in which sound crosses them.
#[derive(Debug, Clone, Copy)]
struct PairList<const MOST: usize> {
    list: [[u32; 2]; MOST],
    count: usize,
}

impl<const MOST: usize> Default for PairList<MOST> {
    fn default() -> Self {
        Self {
            list: [[0; 2]; MOST],
            count: 0,
        }
    }
}

impl<const MOST: usize> PairList<MOST> {
    /// The pairs of a full or partly filled list of paths.
    fn of(paths: &[Option<TwoEdgePath>; MOST]) -> Self {
        let mut pairs = Self::default();
        for path in paths.iter().flatten() {
            pairs.list[pairs.count] = path.edges();
            pairs.count += 1;
        }
        pairs
    }

    fn as_slice(&self) -> &[[u32; 2]] {
        &self.list[..self.count]
    }
}

/// The pairs of the shortest paths of a search. Most of them are among the shortest for positions nearby: found first, they exclude
/// most others by a bound of their length.
#[derive(Debug, Clone, Copy, Default)]
pub struct KnownPairs {
    of_neighbours: PairList<MAX_TESTED>,
    apart: PairList<MAX_TESTED_APART>,
}

/// What a search shares.
struct Search<'a> {
    scene: &'a Scene,
    from: DVec3,
    to: DVec3,
    near: &'a DiffractingEdges,
    direct: &'a DirectEdges,
}

/// Emits the loudest paths over two edges, [`MAX_TWO_EDGE_PATHS`] at most. One edge is of `near` and the other its neighbour or of
/// `near` too, or one belongs to an instance ([`moving_edge_pairs`]). Paths that waves over one of the `direct` edges include are
/// left out. Sets [`EdgeLimits::two_edge_floor`], the energy that they fade towards (`ranked_list.rs`): that of the loudest one that is
/// left out of the list, or of the path that continues the wave of `least_energy` over one edge, where that is more; and
/// [`EdgeLimits::two_edge_detour_m`], but not in a scene with instances. Adds the rays cast to `rays`. `known` holds the pairs of an
/// earlier call and is renewed; it shortens the search and does not change the result.
pub fn find(
    scene: &Scene,
    endpoints: &Endpoints,
    (near, direct, limits): (&DiffractingEdges, &DirectEdges, &mut EdgeLimits),
    known: &mut KnownPairs,
    least_energy: f64,
    rays: &mut u64,
    emit: &mut impl FnMut(Path),
) {
    let (from, to) = local_positions(scene, endpoints);
    let search = Search {
        scene,
        from,
        to,
        near,
        direct,
    };
    let shortest = search.pairs_of_neighbours(&known.of_neighbours);
    let apart = search.pairs_apart(&known.apart);
    *known = KnownPairs {
        of_neighbours: PairList::of(&shortest),
        apart: PairList::of(&apart),
    };
    let moving = scene
        .has_instances()
        .then(|| moving_edge_pairs::shortest(scene, endpoints));
    let mut loudest: [Option<(Path, f64)>; MAX_TWO_EDGE_PATHS] = [None; MAX_TWO_EDGE_PATHS];
    let mut floor = HIDDEN_ENERGY * least_energy;
    let listed = |candidate: &TwoEdgePath| {
        let share = two_edge_share(scene, candidate.edges(), [from, to], limits);
        let (path, energy) = candidate.path(scene, endpoints)?;
        (share > 0.0).then(|| (path.scaled(share as f32), energy * share * share))
    };
    let candidates = shortest.iter().chain(&apart);
    for candidate in candidates.chain(moving.iter().flatten()).flatten() {
        if candidate.is_unoccluded(scene, endpoints, rays)
            && let Some(path) = listed(candidate)
            && let Some((_, energy)) = insert_ranked(&mut loudest, path, |old| old.1 >= path.1)
        {
            floor = floor.max(energy);
        }
    }
    for path in loudest.into_iter().flatten() {
        if let Some(path) = ranked(path, floor) {
            emit(path);
        }
    }
    limits.two_edge_floor = floor;
    // Pairs between rigid bodies have other lists.
    if !scene.has_instances() {
        limits.two_edge_detour_m = Some(last_m(&shortest) - from.distance(to));
    }
}

/// A path with its weight in a list of the loudest that ends at the energy `floor`, if it has one.
pub(super) fn ranked((path, energy): (Path, f64), floor: f64) -> Option<Path> {
    let weight = rank_weight(energy, floor);
    (weight > LEAST_SHARE).then(|| path.scaled(weight as f32))
}

impl Search<'_> {
    /// The shortest paths over a near edge and one of its neighbours.
    fn pairs_of_neighbours(
        &self,
        known: &PairList<MAX_TESTED>,
    ) -> [Option<TwoEdgePath>; MAX_TESTED] {
        let (scene, from, to) = (self.scene, self.from, self.to);
        let most_m = from.distance(to) + MAX_DETOUR_M * scene.length_scale();
        let mut shortest: [Option<TwoEdgePath>; MAX_TESTED] = [None; MAX_TESTED];
        for edges in known.as_slice() {
            let lines = &edges.map(|edge| scene.edge(edge));
            if self.are_paired(*edges, lines) {
                self.add(&mut shortest, *edges, [&lines[0], &lines[1]]);
            }
        }
        for found in self.near.as_slice() {
            // The path over this edge alone is a lower bound.
            let longest_m = last_m(&shortest).min(most_m);
            if found.length_m > longest_m * (1.0 + RANK_ROUNDING) {
                break;
            }
            let edge = &scene.edge(found.edge);
            let (is_first, is_second) = (edge.is_outside(from), edge.is_outside(to));
            for neighbour in scene.edge_neighbours(found.edge) {
                // Edges of paths that are too long are not copied.
                let alone = scene.part_of_edge(neighbour, |other| nearest_point(other, from, to));
                let alone_m = from.distance(alone) + alone.distance(to);
                if alone_m >= most_m || alone_m > last_m(&shortest) {
                    continue;
                }
                let other = &scene.edge(neighbour);
                let [pair, reverse] = [[found.edge, neighbour], [neighbour, found.edge]];
                if is_in_direct_field(self.direct, pair, [edge, other]) {
                    continue;
                }
                let is_new = |pair| !known.as_slice().contains(&pair);
                if is_first && is_new(pair) {
                    self.add(&mut shortest, pair, [edge, other]);
                }
                // A pair of two near edges is found from its first one.
                if is_second && is_new(reverse) && !self.is_near(neighbour) {
                    self.add(&mut shortest, reverse, [other, edge]);
                }
            }
        }
        shortest
    }

    fn is_near(&self, edge: u32) -> bool {
        self.near.as_slice().iter().any(|found| found.edge == edge)
    }

    /// Whether [`Self::pairs_of_neighbours`] finds two edges in this order.
    fn are_paired(&self, [first, second]: [u32; 2], [a, b]: &[Edge; 2]) -> bool {
        let lists = |edge: u32, other: u32| self.scene.edge_neighbours(edge).any(|n| n == other);
        let is_direct = |edges, lines| is_in_direct_field(self.direct, edges, lines);
        match self.is_near(first) {
            true => lists(first, second) && !is_direct([first, second], [a, b]),
            false => {
                self.is_near(second) && lists(second, first) && !is_direct([second, first], [b, a])
            }
        }
    }

    /// Adds the path over two edges to the shortest ones if it is one of them.
    fn add(&self, shortest: &mut [Option<TwoEdgePath>], edges: [u32; 2], lines: [&Edge; 2]) {
        let path = TwoEdgePath::up_to(last_m(shortest), edges, lines, self.from, self.to);
        if let Some(path) = path {
            insert_shortest(shortest, path);
        }
    }

    /// The shortest paths over two of the nearest edges that are no neighbours, since they are far from each other or have nearer
    /// ones, and that [`moving_edge_pairs`] leaves out: where one obstacle hides the edge of another, however far behind it, no other
    /// path continues that edge's wave. Sound crosses first the edge that it would cross nearer to the source if each were alone.
    fn pairs_apart(
        &self,
        known: &PairList<MAX_TESTED_APART>,
    ) -> [Option<TwoEdgePath>; MAX_TESTED_APART] {
        let (scene, from, to) = (self.scene, self.from, self.to);
        let mut shortest = [None; MAX_TESTED_APART];
        let near = self.near.as_slice();
        let near = &near[..near.len().min(MAX_PAIRED_APART)];
        let mut nearest: [Option<NearEdge>; MAX_PAIRED_APART] = [None; MAX_PAIRED_APART];
        for (nearest, found) in nearest.iter_mut().zip(near) {
            let edge = scene.edge(found.edge);
            *nearest = Some(NearEdge {
                index: found.edge,
                edge,
                along_m: (nearest_point(&edge, from, to) - from).dot(to - from),
            });
        }
        let place = |edge: u32| near.iter().position(|found| found.edge == edge);
        // One bit for each edge before another.
        let mut tried = [0_u32; MAX_PAIRED_APART];
        for [a, b] in known.as_slice() {
            if let (Some(a), Some(b)) = (place(*a), place(*b)) {
                let (before, after) = (a.min(b), a.max(b));
                tried[after] |= 1 << before;
                if let (Some(other), Some(edge)) = (&nearest[before], &nearest[after]) {
                    self.add_apart(&mut shortest, edge, other);
                }
            }
        }
        for ((found, edge), tried) in near.iter().zip(nearest.iter().flatten()).zip(tried) {
            // Either edge alone is a lower bound, and this one is the longer of two.
            if found.length_m > last_m(&shortest) * (1.0 + RANK_ROUNDING) {
                break;
            }
            let before = nearest.iter().flatten().enumerate();
            for (index, other) in before.take_while(|(_, other)| other.index != edge.index) {
                if tried >> index & 1 == 0 {
                    self.add_apart(&mut shortest, edge, other);
                }
            }
        }
        shortest
    }

    /// Adds the path over an edge and a nearer one, if they are paired here and it is one of the shortest.
    fn add_apart(&self, shortest: &mut [Option<TwoEdgePath>], edge: &NearEdge, other: &NearEdge) {
        let scene = self.scene;
        let is_found = match scene.is_committed_pair(other.index, edge.index) {
            true => scene.edge_neighbours(edge.index).any(|n| n == other.index),
            false => edge.edge.distance_m(&other.edge) < REACH_M * scene.length_scale(),
        };
        let lines = [&edge.edge, &other.edge];
        if is_found || is_in_direct_field(self.direct, [edge.index, other.index], lines) {
            return;
        }
        let [first, second] = match edge.along_m < other.along_m {
            true => [edge, other],
            false => [other, edge],
        };
        let edges = [first.index, second.index];
        self.add(shortest, edges, [&first.edge, &second.edge]);
    }
}

/// A near edge, and how far towards the listener the path over it alone crosses it, times the distance.
#[derive(Clone, Copy)]
struct NearEdge {
    index: u32,
    edge: Edge,
    along_m: f64,
}

/// Length in metres up to which a path is among the shortest: any while there is room.
fn last_m(shortest: &[Option<TwoEdgePath>]) -> f64 {
    let last = shortest.last().and_then(Option::as_ref);
    last.map_or(f64::INFINITY, TwoEdgePath::length_m)
}

/// Whether waves over one edge include that over two: along a narrow face, and at a corner, where the edge's end does.
fn is_in_direct_field(direct: &DirectEdges, edges: [u32; 2], lines: [&Edge; 2]) -> bool {
    let is_direct = |edge| direct.as_slice().contains(edge);
    edges.iter().any(is_direct) && (meet_at_corner(lines) || bound_narrow_face(lines))
}
