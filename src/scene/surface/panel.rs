//! Panels: the connected pieces of a surface that are large enough for specular reflection.
//!
//! The backs of a row of seats are one surface in one plane, but each back is a small obstacle to a wave.

use super::super::mesh::TriangleMesh;

/// Whether each triangle belongs to a connected piece of its surface of at least `smallest_m2`; `roots` is of [`roots`].
pub(super) fn large_enough(mesh: &TriangleMesh, roots: &[u32], smallest_m2: f64) -> Vec<bool> {
    let mut area_m2 = vec![0.0; mesh.triangles.len()];
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|i| mesh.vertices[i as usize].as_dvec3());
        area_m2[roots[index] as usize] += 0.5 * (b - a).cross(c - a).length();
    }
    roots
        .iter()
        .map(|&root| area_m2[root as usize] >= smallest_m2)
        .collect()
}

/// The first triangle of each triangle's connected piece of its surface; `sides` are of [`sorted_edges`](super::super::weld::sorted_edges).
pub(super) fn roots(sides: &[(u64, u32)], triangle_surface: &[u32]) -> Vec<u32> {
    let mut pieces = DisjointSets::new(triangle_surface.len());
    let surface = |&(_, side): &(u64, u32)| triangle_surface[(side / 3) as usize];
    let mut meeting: Vec<(u32, u32)> = Vec::new();
    for same in sides.chunk_by(|a, b| a.0 == b.0) {
        // Sorted, because thousands of triangles may meet at one edge.
        meeting.clear();
        meeting.extend(same.iter().map(|side| (surface(side), side.1 / 3)));
        meeting.sort_unstable();
        for pair in meeting.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            pieces.union(pair[0].1, pair[1].1);
        }
    }
    (0..triangle_surface.len() as u32)
        .map(|index| pieces.root(index))
        .collect()
}

/// Union-find; the lowest index is the root.
pub(crate) struct DisjointSets {
    parents: Vec<u32>,
}

impl DisjointSets {
    /// `count` separate elements.
    pub(crate) fn new(count: usize) -> Self {
        Self {
            parents: (0..count as u32).collect(),
        }
    }

    /// The lowest index of the element's piece.
    pub(crate) fn root(&mut self, mut index: u32) -> u32 {
        while self.parents[index as usize] != index {
            let above = self.parents[self.parents[index as usize] as usize];
            self.parents[index as usize] = above;
            index = above;
        }
        index
    }

    /// Unites two pieces.
    pub(crate) fn union(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::weld::sorted_edges;
    use super::*;
    use glam::Vec3;

    #[test]
    fn separate_small_squares_are_no_panel_and_joined_ones_are() {
        let mut mesh = TriangleMesh::default();
        let mut square = |x: f32| {
            let first = mesh.vertices.len() as u32;
            for (dx, y) in [(0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)] {
                mesh.vertices.push(Vec3::new(x + dx, y, 0.0));
            }
            mesh.triangles.push([first, first + 1, first + 2]);
            mesh.triangles.push([first, first + 2, first + 3]);
        };
        square(0.0);
        square(1.0);
        let large_enough = |mesh: &TriangleMesh, surfaces: &[u32], smallest_m2| {
            large_enough(
                mesh,
                &roots(&sorted_edges(&mesh.triangles), surfaces),
                smallest_m2,
            )
        };
        assert_eq!(large_enough(&mesh, &[0; 4], 0.4), [false; 4]);
        // The same two squares with an edge in common.
        mesh.triangles[2..].copy_from_slice(&[[1, 5, 6], [1, 6, 2]]);
        assert_eq!(large_enough(&mesh, &[0; 4], 0.4), [true; 4]);
        // … and as two surfaces.
        assert_eq!(large_enough(&mesh, &[0, 0, 1, 1], 0.6), [false; 4]);
    }
}
