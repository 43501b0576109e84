//! Triangles of a mesh with their planes and neighbours.

use glam::DVec3;

use super::super::mesh::TriangleMesh;
use super::super::weld::sorted_edges;

/// No neighbour.
pub(super) const NONE: u32 = u32::MAX;

/// Least and greatest angle in degrees between neighbours on a rough surface. A lesser one is rounding; a greater one is a
/// corner.
const ROUGH_DEG: [f64; 2] = [0.1, 60.0];

/// Least cosine between neighbours of one surface, and between a triangle and its surface.
pub(super) const LEAST_COSINE: f64 = 0.5;

/// Most triangles at one edge that count as neighbours: bounds the time where thousands meet.
const MOST_AROUND: usize = 256;

/// All triangles of a mesh.
pub(super) struct Facets {
    pub(super) corners: Vec<[DVec3; 3]>,
    pub(super) normals: Vec<DVec3>,
    pub(super) areas_m2: Vec<f64>,
    /// `ring[3 t + e]` is the next triangle side along the same edge, cyclically.
    ring: Vec<u32>,
    /// Whether a triangle meets a neighbour at an angle within [`ROUGH_DEG`].
    pub(super) is_rough: Vec<bool>,
}

impl Facets {
    /// Triangles of a clean mesh, with coordinates relative to `centre`.
    pub(super) fn of(mesh: &TriangleMesh, centre: DVec3) -> Self {
        let count = mesh.triangles.len();
        let position = |v: u32| mesh.vertices[v as usize].as_dvec3() - centre;
        let corners: Vec<[DVec3; 3]> = mesh.triangles.iter().map(|t| t.map(position)).collect();
        let crosses = corners.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a));
        let (normals, areas_m2) = crosses
            .map(|cross| (cross.normalize_or_zero(), 0.5 * cross.length()))
            .unzip();
        let mut facets = Self {
            corners,
            normals,
            areas_m2,
            ring: vec![0; 3 * count],
            is_rough: vec![false; count],
        };
        let [least, most] = ROUGH_DEG.map(|angle| angle.to_radians().cos());
        for same in sorted_edges(&mesh.triangles).chunk_by(|a, b| a.0 == b.0) {
            for (i, &(_, side)) in same.iter().enumerate() {
                facets.ring[side as usize] = same[(i + 1) % same.len()].1;
            }
            if let [(_, a), (_, b)] = same {
                let (a, b) = ((a / 3) as usize, (b / 3) as usize);
                let cosine = facets.normals[a].dot(facets.normals[b]).abs();
                if cosine < least && cosine > most {
                    (facets.is_rough[a], facets.is_rough[b]) = (true, true);
                }
            }
        }
        facets
    }

    /// Whether no other triangle is at a side (`3 t + e`).
    pub(super) fn is_boundary(&self, side: u32) -> bool {
        self.ring[side as usize] == side
    }

    /// Another triangle at a side (`3 t + e`), or the same one at a boundary.
    pub(super) fn beside(&self, side: u32) -> u32 {
        self.ring[side as usize] / 3
    }

    pub(super) fn middle(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners[triangle as usize];
        (a + b + c) / 3.0
    }

    pub(super) fn len(&self) -> usize {
        self.corners.len()
    }

    /// Triangles with a common edge, at most [`MOST_AROUND`] at each.
    pub(super) fn neighbours(&self, triangle: u32) -> impl Iterator<Item = u32> + '_ {
        (3 * triangle..3 * triangle + 3).flat_map(move |side| {
            let mut other = self.ring[side as usize];
            let all = std::iter::from_fn(move || {
                let found = other;
                other = self.ring[other as usize];
                (found != side).then_some(found / 3)
            });
            all.take(MOST_AROUND)
        })
    }

    /// Cosine of the angle between two triangles, whatever their winding.
    pub(super) fn cosine(&self, a: u32, b: u32) -> f64 {
        self.normals[a as usize].dot(self.normals[b as usize]).abs()
    }
}
