//! Surfaces that combine with each edge in paths with reflection and diffraction.

use glam::DVec3;

use super::super::surface::Surface;
use super::edge::Edge;
use crate::binary::{are_below, stored};

/// Most surfaces kept for one edge.
pub const MOST_EDGE_MIRRORS: usize = 6;

/// Least distance in metres of an edge's middle from a mirror plane: a nearer edge lies in the plane.
const LEAST_DISTANCE_M: f64 = 0.01;

/// Added to squared distances, in m²: a surface next to the edge ranks like one a metre away.
const NEAR_M2: f64 = 1.0;

/// Mirror surfaces of an edge, largest solid angle first.
#[derive(Debug, Clone, Copy, Default)]
pub struct EdgeMirrors {
    surfaces: [u32; MOST_EDGE_MIRRORS],
    count: usize,
}

impl EdgeMirrors {
    /// Indices of the surfaces.
    pub fn as_slice(&self) -> &[u32] {
        &self.surfaces[..self.count]
    }
}

/// The best mirrors of an edge among surfaces in order of size.
pub(crate) fn choose<'a>(
    edge: &Edge,
    mirrors: impl Iterator<Item = (u32, &'a Surface)>,
) -> EdgeMirrors {
    let mut best = [(0.0, 0); MOST_EDGE_MIRRORS];
    let points = [0.1, 0.5, 0.9].map(|share| edge.at(share * edge.length_m));
    for (index, surface) in mirrors {
        let least = best[MOST_EDGE_MIRRORS - 1].0;
        // The apparent size is at most the area.
        if surface.area_m2 <= least {
            break;
        }
        let size = size(&points, surface);
        if size > least && !edge.faces.contains(&index) && !holds(surface, points[1]) {
            let rank_index = best.partition_point(|b| b.0 >= size);
            best[rank_index..].rotate_right(1);
            best[rank_index] = (size, index);
        }
    }
    EdgeMirrors {
        surfaces: best.map(|(_, index)| index),
        count: best.iter().take_while(|(size, _)| *size > 0.0).count(),
    }
}

/// The mirrors of all edges.
#[derive(Debug, Clone, Default)]
pub(super) struct EdgeMirrorLists {
    list: Vec<EdgeMirrors>,
}

impl EdgeMirrorLists {
    pub(super) fn build(edges: &[Edge], surfaces: &[Surface], mirrors: &[u32]) -> Self {
        let named = |&index: &u32| (index, &surfaces[index as usize]);
        let list = edges
            .iter()
            .map(|edge| choose(edge, mirrors.iter().map(named)));
        Self {
            list: list.collect(),
        }
    }

    pub(super) fn of(&self, edge: u32) -> EdgeMirrors {
        self.list[edge as usize]
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.list.as_slice())
    }
}

/// Whether a surface's plane contains an edge's middle.
fn holds(surface: &Surface, middle: DVec3) -> bool {
    surface.distance_m(middle).abs() < LEAST_DISTANCE_M
}

/// Apparent size of a surface from points of an edge: its area over the squared distance of its nearest part.
#[inline(always)]
fn size(points: &[DVec3; 3], surface: &Surface) -> f64 {
    let (low, high): (DVec3, DVec3) = (surface.bounds_min.into(), surface.bounds_max.into());
    let mut nearest = f64::INFINITY;
    for point in points {
        nearest = nearest.min(point.distance_squared(point.clamp(low, high)));
    }
    surface.area_m2 / (nearest + NEAR_M2)
}

stored!(EdgeMirrors {
    surfaces: [u32; MOST_EDGE_MIRRORS],
    count: usize,
});

stored!(EdgeMirrorLists { list: Vec<EdgeMirrors> });

impl EdgeMirrorLists {
    /// Whether lists that were loaded belong to so many edges and surfaces.
    pub(super) fn is_consistent(&self, edges: usize, surfaces: usize) -> bool {
        let is_good = |mirrors: &EdgeMirrors| {
            let listed = mirrors.surfaces.get(..mirrors.count);
            listed.is_some_and(|listed| are_below(listed, surfaces))
        };
        self.list.len() == edges && self.list.iter().all(is_good)
    }
}
