//! Where surfaces end: the edges of each, and how far a point of it is from them.

use glam::DVec3;

use super::edge::Edge;

/// The edges of every surface of a mesh, by number.
#[derive(Debug, Clone, Default)]
pub(super) struct Rims {
    edges: Vec<u32>,
    /// Where each surface's edges begin; one more closes the list.
    first: Vec<u32>,
}

impl Rims {
    pub(super) fn build(edges: &[Edge], surfaces: usize) -> Self {
        let mut ends: Vec<(u32, u32)> = Vec::with_capacity(2 * edges.len());
        for (number, edge) in (0..).zip(edges) {
            let [a, b] = edge.faces;
            ends.push((a, number));
            if a != b {
                ends.push((b, number));
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
        Self {
            edges: ends.into_iter().map(|(_, edge)| edge).collect(),
            first,
        }
    }

    fn of(&self, surface: u32) -> &[u32] {
        let bound = |place: u32| self.first.get(place as usize).map(|&first| first as usize);
        match (bound(surface), bound(surface.saturating_add(1))) {
            (Some(first), Some(end)) => &self.edges[first..end],
            _ => &[],
        }
    }

    /// Distance in metres from a point to the nearest edge of a surface, if that is below `within_m`.
    pub(super) fn distance_m(
        &self,
        edges: &[Edge],
        surface: u32,
        point: DVec3,
        within_m: f64,
    ) -> Option<f64> {
        let mut nearest = within_m * within_m;
        for &number in self.of(surface) {
            let edge = &edges[number as usize];
            let out = point - edge.origin;
            let along = out.dot(edge.direction);
            let beyond = along - along.clamp(0.0, edge.length_m);
            let across = out.length_squared() - along * along;
            nearest = nearest.min(across.max(0.0) + beyond * beyond);
        }
        (nearest < within_m * within_m).then(|| nearest.sqrt())
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.edges.as_slice()) + size_of_val(self.first.as_slice())
    }
}
