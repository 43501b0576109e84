//! Diffracting edges: found at commit, queried by the end points of a path.
//!
//! Control side to build; queries are wait-free, allocate nothing and are bounded by the number of edges. Own, after the
//! description of edge visibility in \[SCHISSLER14\].

mod border;
mod boundaries;
mod contacts;
mod edge;
mod edge_end;
mod find;
mod flush;
mod free_ends;
mod longest;
mod mirrors;
mod saved;
mod search_budget;
mod tree;
mod visibility_graph;

use glam::{DVec3, Vec3};

pub use crate::scene::edges::visibility_graph::{
    FACE_REACH_M, MOST_LISTED, MOST_NEIGHBOURS, REACH_M,
};
pub use contacts::FLUSH_M;
pub(super) use contacts::{Contact, contacts};
pub(super) use edge::NO_EDGE;
pub use edge::{Edge, EdgeCrossing, LEAST_LENGTH_M, LEAST_TURN_DEG};
pub use edge_end::EdgeEnd;
pub(super) use flush::pieces;
pub use longest::MOST_EDGES;
pub(super) use mirrors::choose;
pub use mirrors::{EdgeMirrors, MOST_EDGE_MIRRORS};

use super::surface::SurfaceSet;
use crate::geometry::Bvh;
use border::BorderEdges;
pub(super) use boundaries::{FreeBoundary, nearest_m};
use tree::EdgeTree;

/// Most edges of one query.
pub const MAX_DIFFRACTING_EDGES: usize = 24;

/// Share of the distance of a crossing beyond an edge's end that is added to its length: among the edges of a corner the order
/// depends on geometry alone.
const CORNER_SHARE: f64 = 1e-6;

/// Most surfaces that reflect diffracted paths: the largest of a scene.
pub const MOST_MIRRORS: usize = 256;

/// All edges of a scene, sorted by [`Edge::key`].
#[derive(Debug, Clone, Default)]
pub struct EdgeSet {
    edges: Vec<Edge>,
    tree: EdgeTree,
    graph: visibility_graph::EdgeVisibilityGraph,
    mirrors: mirrors::EdgeMirrorLists,
    boundaries: boundaries::SurfaceBoundaries,
    /// The largest surfaces, largest first.
    large: Vec<u32>,
    border: BorderEdges,
}

/// What a query calls the edges of a set, and which of them have another shape than at commit.
pub(super) trait EdgeNames {
    /// The number of an edge.
    fn number(&self, edge: u32) -> u32;

    /// An edge as it is now, if that is not as it was committed.
    fn changed(&self, edge: u32) -> Option<&Edge>;
}

/// The names of a scene's own edges.
pub(super) struct OwnEdges;

impl EdgeNames for OwnEdges {
    fn number(&self, edge: u32) -> u32 {
        edge
    }

    fn changed(&self, _: u32) -> Option<&Edge> {
        None
    }
}

/// An edge with the length of the shortest path over it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DiffractingEdge {
    /// Index of the edge.
    pub edge: u32,
    /// Length in metres from start to edge to end.
    pub length_m: f64,
}

/// Result of a query, shortest path first.
#[derive(Debug, Clone, Copy, Default)]
pub struct DiffractingEdges {
    found: [DiffractingEdge; MAX_DIFFRACTING_EDGES],
    count: usize,
}

impl DiffractingEdges {
    /// The edges, shortest path first; equal lengths by index.
    pub fn as_slice(&self) -> &[DiffractingEdge] {
        &self.found[..self.count]
    }

    /// Length in metres of the last of the first `most` paths; infinite if there are fewer.
    pub fn limit_m(&self, most: usize) -> f64 {
        let last = self.as_slice().get(most - 1);
        last.map_or(f64::INFINITY, |last| last.length_m)
    }

    /// Upper bound of the length of a path that still enters the list.
    pub(super) fn bound_m(&self, longest_m: f64) -> f64 {
        if self.count < MAX_DIFFRACTING_EDGES {
            longest_m
        } else {
            longest_m.min(self.found[MAX_DIFFRACTING_EDGES - 1].length_m)
        }
    }

    pub(super) fn insert(&mut self, new: DiffractingEdge) {
        let rank = |e: &DiffractingEdge| (e.length_m, e.edge);
        let rank_index = self.as_slice().partition_point(|e| rank(e) < rank(&new));
        if rank_index == MAX_DIFFRACTING_EDGES || self.as_slice().get(rank_index) == Some(&new) {
            return;
        }
        self.count = (self.count + 1).min(MAX_DIFFRACTING_EDGES);
        self.found[rank_index..self.count].rotate_right(1);
        self.found[rank_index] = new;
    }
}

impl EdgeSet {
    /// Finds the edges of a mesh with vertices relative to `centre`, and the pairs with a line of sight. `length_scale` is
    /// [`Edge::length_scale`].
    pub(super) fn build(
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        surfaces: &SurfaceSet,
        centre: DVec3,
        bvh: &Bvh,
        length_scale: f64,
    ) -> Self {
        let found = find::find(vertices, triangles, surfaces, centre, length_scale);
        let (mut edges, mut of_border) = (found.of_panels, found.of_border);
        free_ends::mark(&mut edges, bvh);
        free_ends::mark(&mut of_border, bvh);
        let tree = EdgeTree::build(&edges);
        let graph = visibility_graph::EdgeVisibilityGraph::build(&edges, &tree, bvh, length_scale);
        let mut mirrors: Vec<u32> = (0..surfaces.surfaces.len() as u32)
            .filter(|&s| surfaces.surfaces[s as usize].panel_triangle_count > 0)
            .collect();
        let area_m2 = |s: &u32| surfaces.surfaces[*s as usize].area_m2;
        mirrors.sort_by(|a, b| area_m2(b).total_cmp(&area_m2(a)).then(a.cmp(b)));
        mirrors.truncate(MOST_MIRRORS);
        Self {
            mirrors: mirrors::EdgeMirrorLists::build(&edges, &surfaces.surfaces, &mirrors),
            boundaries: boundaries::SurfaceBoundaries::build(&edges, surfaces, bvh),
            border: BorderEdges::new(of_border, found.pieces, surfaces, bvh),
            edges,
            tree,
            graph,
            large: mirrors,
        }
    }

    /// Edges without pairs, mirrors and boundaries.
    pub(super) fn of_edges(edges: Vec<Edge>) -> Self {
        Self {
            tree: EdgeTree::build(&edges),
            edges,
            ..Self::default()
        }
    }

    /// The edges of border pieces.
    pub(super) fn border(&self) -> &BorderEdges {
        &self.border
    }

    /// Calls `visit` with every edge in a box.
    pub(super) fn visit_box(&self, low: DVec3, high: DVec3, mut visit: impl FnMut(u32)) {
        let is_apart = |min: DVec3, max: DVec3| min.cmpgt(high).any() || max.cmplt(low).any();
        self.tree.walk(|min, max, leaf| {
            if is_apart(min, max) {
                return false;
            }
            for &index in leaf {
                let edge = self.get(index);
                let (from, to) = (edge.origin, edge.at(edge.length_m));
                if !is_apart(from.min(to), from.max(to)) {
                    visit(index);
                }
            }
            true
        });
    }

    /// The free boundaries of a surface.
    pub(super) fn boundaries_of(&self, surface: u32) -> &[FreeBoundary] {
        self.boundaries.of(surface)
    }

    /// The free boundaries of all surfaces.
    pub(super) fn all_boundaries(&self) -> &[FreeBoundary] {
        self.boundaries.all()
    }

    /// All edges.
    pub fn as_slice(&self) -> &[Edge] {
        &self.edges
    }

    /// Number of edges.
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// An edge by its index.
    ///
    /// # Panics
    /// If there is none.
    #[inline]
    pub fn get(&self, index: u32) -> &Edge {
        &self.edges[index as usize]
    }

    /// Edges visible from an edge, nearest first, at most [`MOST_LISTED`]: about [`MOST_NEIGHBOURS`] within [`REACH_M`], some
    /// beyond it that share a face with the edge, and those whose neighbour the edge is.
    pub fn neighbours(&self, index: u32) -> &[u32] {
        self.graph.of(index)
    }

    /// Distance in metres from a point of a surface to the nearest edge that it ends at, if that is below `within_m`.
    /// Edges at which another surface continues it on the normal's side (`in_front`) or on the other do not count there.
    pub fn distance_m(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
        within_m: f64,
    ) -> Option<f64> {
        self.boundaries
            .distance_m(surface, point, in_front, within_m)
    }

    /// Surfaces of large solid angle from an edge, largest first, at most [`MOST_EDGE_MIRRORS`]: candidates for
    /// a reflection before or after its diffraction.
    pub fn mirrors(&self, index: u32) -> EdgeMirrors {
        self.mirrors.of(index)
    }

    /// The largest surfaces, largest first, at most [`MOST_MIRRORS`]: the candidates for [`Self::mirrors`].
    pub fn large_surfaces(&self) -> &[u32] {
        &self.large
    }

    /// Adds paths over those of the `known` edges that are of the set to a list: with short paths in the list,
    /// [`Self::add_crossings`] ends sooner.
    pub(super) fn add_known(
        &self,
        near: &mut DiffractingEdges,
        known: &DiffractingEdges,
        (from, to): (DVec3, DVec3),
        longest_m: f64,
        names: &impl EdgeNames,
    ) {
        for &DiffractingEdge { edge, .. } in known.as_slice() {
            let found = self.edges.get(edge as usize);
            let found = found.map(|own| names.changed(edge).unwrap_or(own));
            if let Some(length_m) = found.and_then(|e| e.crossing_rank_m(from, to, longest_m)) {
                near.insert(DiffractingEdge { edge, length_m });
            }
        }
    }

    /// Adds the shortest paths between two points over one edge, up to `longest_m`: both points in the exterior wedge, the
    /// crossing within the edge's ends. Occlusion is not tested.
    pub(super) fn add_crossings(
        &self,
        near: &mut DiffractingEdges,
        from: DVec3,
        to: DVec3,
        longest_m: f64,
        names: &impl EdgeNames,
    ) {
        self.nearest(near, (from, to), longest_m, names, |edge, bound_m| {
            // Most paths are too long for a full list; lengths are cheaper than angles.
            edge.crossing_rank_m(from, to, bound_m)
        });
    }

    /// The [`MAX_DIFFRACTING_EDGES`] shortest paths between two points over one edge, up to `longest_m`, for paths of
    /// several interactions: only `from` must lie in the exterior wedge, and a crossing beyond an edge's end counts as one
    /// at its end.
    pub fn first_crossings(&self, from: DVec3, to: DVec3, longest_m: f64) -> DiffractingEdges {
        let mut near = DiffractingEdges::default();
        self.add_first_crossings(&mut near, (from, to), longest_m, &OwnEdges);
        near
    }

    /// Adds [`Self::first_crossings`] to a list.
    pub(super) fn add_first_crossings(
        &self,
        near: &mut DiffractingEdges,
        ends: (DVec3, DVec3),
        longest_m: f64,
        names: &impl EdgeNames,
    ) {
        let counts = |edge: &Edge| edge.is_outside(ends.0);
        self.add_shortest(near, ends, longest_m, counts, names);
    }

    /// The same where either end lies in the exterior wedge: the list does not change if they are exchanged.
    pub(super) fn add_outer_crossings(
        &self,
        near: &mut DiffractingEdges,
        ends: (DVec3, DVec3),
        longest_m: f64,
        names: &impl EdgeNames,
    ) {
        let counts = |edge: &Edge| edge.is_outside(ends.0) || edge.is_outside(ends.1);
        self.add_shortest(near, ends, longest_m, counts, names);
    }

    fn add_shortest(
        &self,
        near: &mut DiffractingEdges,
        (from, to): (DVec3, DVec3),
        longest_m: f64,
        counts: impl Fn(&Edge) -> bool,
        names: &impl EdgeNames,
    ) {
        self.nearest(near, (from, to), longest_m, names, |edge, bound_m| {
            let least_m = edge.min_path_length_m(from, to);
            if least_m > bound_m || !counts(edge) {
                return None;
            }
            let at = edge.at(edge.apex_m(from, to).clamp(0.0, edge.length_m));
            let length_m = from.distance(at) + at.distance(to);
            Some(length_m + CORNER_SHARE * (length_m - least_m))
        });
    }

    fn nearest(
        &self,
        near: &mut DiffractingEdges,
        (from, to): (DVec3, DVec3),
        longest_m: f64,
        names: &impl EdgeNames,
        path_length_m: impl Fn(&Edge, f64) -> Option<f64>,
    ) {
        let slack_m = self.tree.slack_m();
        self.tree.walk(|min, max, leaf| {
            let outside_m = |p: DVec3| p.distance(p.clamp(min, max));
            if outside_m(from) + outside_m(to) - slack_m > near.bound_m(longest_m) {
                return false;
            }
            for &edge in leaf {
                let bound_m = near.bound_m(longest_m);
                let now = names.changed(edge).unwrap_or_else(|| self.get(edge));
                if let Some(length_m) = path_length_m(now, bound_m).filter(|l| *l <= longest_m) {
                    let edge = names.number(edge);
                    near.insert(DiffractingEdge { edge, length_m });
                }
            }
            true
        });
    }

    /// Memory that the set occupies, in bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.edges.as_slice())
            + self.tree.memory_bytes()
            + self.graph.memory_bytes()
            + self.mirrors.memory_bytes()
            + self.boundaries.memory_bytes()
            + size_of_val(self.large.as_slice())
            + self.border.memory_bytes()
    }
}
