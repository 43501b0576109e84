//! Connected parts of a mesh without boundary edges: solids, whichever way they are wound.
//!
//! Control side.

use super::surface::panel::DisjointSets;
use super::weld::sorted_edges;

/// Whether each triangle belongs to a connected part of the mesh without boundary edges.
pub(super) fn closed_parts(triangles: &[[u32; 3]]) -> Vec<bool> {
    let sides = sorted_edges(triangles);
    let mut sets = DisjointSets::new(triangles.len());
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        for (_, side) in &same[1..] {
            sets.union(same[0].1 / 3, side / 3);
        }
    }
    let mut has_boundary = vec![false; triangles.len()];
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        if same.len() == 1 {
            has_boundary[sets.root(same[0].1 / 3) as usize] = true;
        }
    }
    (0..triangles.len() as u32)
        .map(|triangle| !has_boundary[sets.root(triangle) as usize])
        .collect()
}
