//! Boundary edges of each surface, and the distance of a point from them.

use glam::DVec3;

use crate::scene::edges::edge::Edge;

/// Line of an edge, stored by surface.
#[derive(Debug, Clone, Copy)]
struct BoundaryEdge {
    origin: DVec3,
    direction: DVec3,
    length_m: f64,
}

/// The edges of every surface of a mesh.
#[derive(Debug, Clone, Default)]
pub(crate) struct SurfaceBoundaries {
    boundaries: Vec<BoundaryEdge>,
    /// Start of each surface's edges, and the end of the list.
    first: Vec<u32>,
}

impl SurfaceBoundaries {
    pub(crate) fn build(edges: &[Edge], surfaces: usize) -> Self {
        let mut ends: Vec<(u32, u32)> = Vec::with_capacity(2 * edges.len());
        for (index, edge) in (0..).zip(edges) {
            let [a, b] = edge.faces;
            ends.push((a, index));
            if a != b {
                ends.push((b, index));
            }
        }
        ends.sort_unstable();
        let mut first = vec![0u32; surfaces + 1];
        for (surface, _) in &ends {
            first[*surface as usize + 1] += 1;
        }
        for surface in 0..surfaces {
            first[surface + 1] += first[surface];
        }
        let boundary = |(_, index): &(u32, u32)| {
            let edge = &edges[*index as usize];
            BoundaryEdge {
                origin: edge.origin,
                direction: edge.direction,
                length_m: edge.length_m,
            }
        };
        Self {
            boundaries: ends.iter().map(boundary).collect(),
            first,
        }
    }

    fn of(&self, surface: u32) -> &[BoundaryEdge] {
        let bound = |index: u32| self.first.get(index as usize).map(|&first| first as usize);
        match (bound(surface), bound(surface.saturating_add(1))) {
            (Some(first), Some(end)) => &self.boundaries[first..end],
            _ => &[],
        }
    }

    /// Distance in metres from a point to the nearest edge of a surface, if that is below `within_m`.
    pub(crate) fn distance_m(&self, surface: u32, point: DVec3, within_m: f64) -> Option<f64> {
        let mut nearest = within_m * within_m;
        for boundary in self.of(surface) {
            let out = point - boundary.origin;
            let along = out.dot(boundary.direction);
            let beyond = along - along.clamp(0.0, boundary.length_m);
            let across = out.length_squared() - along * along;
            nearest = nearest.min(across.max(0.0) + beyond * beyond);
        }
        (nearest < within_m * within_m).then(|| nearest.sqrt())
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.boundaries.as_slice()) + size_of_val(self.first.as_slice())
    }
}
