//! Connected parts of a mesh without boundary edges: solids and rooms.
//!
//! Control side.

use glam::Vec3;

use super::surface::panel::DisjointSets;
use super::weld::sorted_edges;

/// Depth in metres to which other parts may reach out of a room's shell, such as furniture that is sunk into the floor.
const SUNK_M: f32 = 0.1;

/// Whether each triangle belongs to a connected part of the mesh without boundary edges.
pub(super) fn closed_parts(triangles: &[[u32; 3]]) -> Vec<bool> {
    let mut has_boundary = vec![false; triangles.len()];
    let parts = parts(triangles, |part| has_boundary[part as usize] = true);
    parts
        .iter()
        .map(|part| !has_boundary[*part as usize])
        .collect()
}

/// Whether each triangle belongs to a room's shell: a closed part that encloses all others, of which there is at least one.
pub(super) fn room_shell(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Vec<bool> {
    let mut has_boundary = vec![false; triangles.len()];
    let parts = parts(triangles, |part| has_boundary[part as usize] = true);
    let nothing = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    let mut bounds = vec![nothing; triangles.len()];
    let mut all = nothing;
    for (triangle, part) in triangles.iter().zip(&parts) {
        for vertex in triangle.map(|v| vertices[v as usize]) {
            for [low, high] in [&mut bounds[*part as usize], &mut all] {
                (*low, *high) = (low.min(vertex), high.max(vertex));
            }
        }
    }
    let is_shell = |part: u32| {
        let [low, high] = bounds[part as usize];
        let encloses = (low - SUNK_M).cmple(all[0]).all() && (high + SUNK_M).cmpge(all[1]).all();
        encloses && !has_boundary[part as usize]
    };
    let has_others = parts.iter().any(|part| *part != parts[0]);
    parts
        .iter()
        .map(|&part| has_others && is_shell(part))
        .collect()
}

/// The connected part of each triangle, named by one of its triangles; reports parts with a boundary edge.
fn parts(triangles: &[[u32; 3]], mut has_boundary: impl FnMut(u32)) -> Vec<u32> {
    let sides = sorted_edges(triangles);
    let mut sets = DisjointSets::new(triangles.len());
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        for (_, side) in &same[1..] {
            sets.union(same[0].1 / 3, side / 3);
        }
    }
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        if same.len() == 1 {
            has_boundary(sets.root(same[0].1 / 3));
        }
    }
    (0..triangles.len() as u32)
        .map(|triangle| sets.root(triangle))
        .collect()
}
