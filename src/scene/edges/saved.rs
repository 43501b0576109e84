//! Edges that are saved with a scene. The tree over them is built again: that takes no time worth a file.

use super::border::BorderEdges;
use super::boundaries::SurfaceBoundaries;
use super::mirrors::EdgeMirrorLists;
use super::tree::EdgeTree;
use super::visibility_graph::EdgeVisibilityGraph;
use super::{Edge, EdgeSet};
use crate::binary::{Reader, Stored, Writer, are_below};
use crate::scene::surface::SurfaceSet;

impl Stored for EdgeSet {
    const LEAST_BYTES: usize = 8;

    fn store(&self, to: &mut Writer) {
        let Self {
            edges,
            tree: _,
            graph,
            mirrors,
            boundaries,
            large,
            border,
        } = self;
        edges.store(to);
        graph.store(to);
        mirrors.store(to);
        boundaries.store(to);
        large.store(to);
        border.store(to);
    }

    fn load(from: &mut Reader<'_>) -> Self {
        let edges: Vec<Edge> = Vec::load(from);
        Self {
            tree: EdgeTree::build(&edges),
            edges,
            graph: EdgeVisibilityGraph::load(from),
            mirrors: EdgeMirrorLists::load(from),
            boundaries: SurfaceBoundaries::load(from),
            large: Vec::load(from),
            border: BorderEdges::load(from),
        }
    }
}

impl EdgeSet {
    /// Whether edges that were loaded belong to a set of surfaces and to each other.
    pub(in crate::scene) fn is_consistent(&self, set: &SurfaceSet) -> bool {
        let surfaces = set.surfaces.len();
        let pieces = set.border().as_slice().len();
        let is_good = |edge: &Edge| edge.length_m >= 0.0 && are_below(&edge.faces, surfaces);
        self.edges.iter().all(is_good)
            && self.graph.is_consistent(self.edges.len())
            && self.mirrors.is_consistent(self.edges.len(), surfaces)
            && self.boundaries.is_consistent(surfaces)
            && are_below(&self.large, surfaces)
            && self.border.is_consistent(surfaces, pieces)
    }
}
