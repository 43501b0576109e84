//! Edges of border pieces, which are edges of the scene only where a piece is a panel together with other parts.

use super::boundaries::{self, FreeBoundary};
use super::edge::Edge;
use super::find::NO_PIECE;
use crate::binary::{are_below, are_starts, stored};
use crate::geometry::Bvh;
use crate::scene::surface::SurfaceSet;

/// Edges that no panel of their own mesh has. Their numbers follow those of the other edges.
#[derive(Debug, Clone, Default)]
pub(in crate::scene) struct BorderEdges {
    pub(super) edges: Vec<Edge>,
    /// The border piece of each edge's faces.
    pieces: Vec<[u32; 2]>,
    boundaries: Vec<FreeBoundary>,
    /// Start of each edge's boundaries, and the end of the list; empty without edges.
    first: Vec<u32>,
}

impl BorderEdges {
    /// `pieces` has those of each edge.
    pub(super) fn new(
        edges: Vec<Edge>,
        pieces: Vec<[u32; 2]>,
        set: &SurfaceSet,
        bvh: &Bvh,
    ) -> Self {
        let mut result = Self::default();
        if edges.is_empty() {
            return result;
        }
        let most_pieces = boundaries::most_pieces(edges.len(), bvh);
        for edge in &edges {
            result.first.push(result.boundaries.len() as u32);
            boundaries::add_of_edge(&mut result.boundaries, edge, set, bvh, most_pieces);
        }
        result.first.push(result.boundaries.len() as u32);
        Self {
            edges,
            pieces,
            ..result
        }
    }

    /// The edges.
    pub(in crate::scene) fn as_slice(&self) -> &[Edge] {
        &self.edges
    }

    /// The border pieces of an edge.
    pub(in crate::scene) fn pieces_of(&self, edge: usize) -> impl Iterator<Item = u32> {
        let pieces = self.pieces[edge].into_iter();
        pieces.filter(|piece| *piece != NO_PIECE)
    }

    /// The free boundaries of an edge's faces.
    pub(in crate::scene) fn boundaries_of(&self, edge: usize) -> &[FreeBoundary] {
        &self.boundaries[self.first[edge] as usize..self.first[edge + 1] as usize]
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.edges.as_slice())
            + size_of_val(self.pieces.as_slice())
            + size_of_val(self.boundaries.as_slice())
            + size_of_val(self.first.as_slice())
    }

    /// Whether edges that were loaded belong to so many surfaces and border pieces.
    pub(super) fn is_consistent(&self, surfaces: usize, pieces: usize) -> bool {
        let is_edge = |edge: &Edge| edge.length_m >= 0.0 && are_below(&edge.faces, surfaces);
        let is_piece = |&piece: &u32| piece == NO_PIECE || (piece as usize) < pieces;
        let is_boundary = |b: &FreeBoundary| (b.surface as usize) < surfaces && b.length_m >= 0.0;
        let starts = match self.edges.is_empty() {
            true => self.first.is_empty(),
            false => are_starts(&self.first, self.edges.len(), self.boundaries.len()),
        };
        starts
            && self.pieces.len() == self.edges.len()
            && self.edges.iter().all(is_edge)
            && self.pieces.as_flattened().iter().all(is_piece)
            && self.boundaries.iter().all(is_boundary)
    }
}

stored!(BorderEdges {
    edges: Vec<Edge>,
    pieces: Vec<[u32; 2]>,
    boundaries: Vec<FreeBoundary>,
    first: Vec<u32>,
});
