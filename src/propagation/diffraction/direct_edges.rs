//! Lists of the edges of a source's direct field.
//!
//! Small and copied with updates and frames. Any thread; allocates nothing. Own.

use crate::propagation::diffraction::edge_wave::{self, is_unoccluded, local_positions};
use crate::propagation::diffraction::fade_out;
use crate::propagation::diffraction::wedge_geometry::WedgeAngles;
use crate::propagation::endpoints::Endpoints;
use crate::scene::Scene;
use crate::scene::edges::MAX_DIFFRACTING_EDGES;

/// Most edges of one source's direct field. Of so many the quietest is silent (`ranked_list.rs`), unless another edge begins to hide
/// one of them.
pub const MAX_DIRECT_EDGES: usize = 8;

/// Edges of the direct field, shortest path first.
#[derive(Debug, Clone, Copy, Default)]
pub struct DirectEdges {
    edges: [u32; MAX_DIRECT_EDGES],
    count: usize,
}

impl DirectEdges {
    /// Indices of the edges.
    pub fn as_slice(&self) -> &[u32] {
        &self.edges[..self.count]
    }

    pub(super) fn push(&mut self, edge: u32) {
        self.edges[self.count] = edge;
        self.count += 1;
    }

    /// Adds an edge unless it is there or there is no room.
    pub(super) fn insert(&mut self, edge: u32) {
        if self.count < MAX_DIRECT_EDGES && !self.as_slice().contains(&edge) {
            self.push(edge);
        }
    }
}

/// Most edges of a list that are visible from both ends.
const MAX_SEEN_EDGES: usize = MAX_DIFFRACTING_EDGES;

/// The edges of a list that are visible from both ends, in its order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SeenEdges {
    edges: [u32; MAX_SEEN_EDGES],
    count: usize,
}

impl SeenEdges {
    pub(super) const NONE: Self = Self {
        edges: [0; MAX_SEEN_EDGES],
        count: 0,
    };

    /// Indices of the edges.
    pub fn as_slice(&self) -> &[u32] {
        &self.edges[..self.count]
    }

    pub(super) fn push(&mut self, edge: u32) {
        if let Some(free) = self.edges.get_mut(self.count) {
            *free = edge;
            self.count += 1;
        }
    }

    /// Whether these are the edges of another list that are visible from both ends now. Both ends lie in the exterior wedges of the
    /// listed edges ([`Scene::diffracting_edges_over`]). Adds the rays cast to `rays`.
    pub fn are_seen(
        &self,
        scene: &Scene,
        endpoints: &Endpoints,
        listed: impl Iterator<Item = (u32, f64)>,
        rays: &mut u64,
    ) -> bool {
        let mut seen = 0;
        for (edge, share) in listed {
            let is_old = self.as_slice().contains(&edge);
            let is_new = share > 0.0 && sees_edge(scene, endpoints, edge, rays);
            if is_new != is_old {
                return false;
            }
            seen += usize::from(is_new);
        }
        seen == self.count
    }
}

/// `WedgeAngles::sides` of the paths over edges, in their order. While they stay, waves change steadily with the positions of
/// source and listener.
pub fn boundary_sides(
    scene: &Scene,
    endpoints: &Endpoints,
    edges: &DirectEdges,
) -> [u32; MAX_DIRECT_EDGES] {
    let (from, to) = local_positions(scene, endpoints);
    let mut sides = [0; MAX_DIRECT_EDGES];
    for (sides, &edge) in sides.iter_mut().zip(edges.as_slice()) {
        let edge = &scene.edge(edge);
        let angles = WedgeAngles::between(edge, from, to);
        *sides = angles.map_or(0, |angles| angles.sides());
    }
    sides
}

/// Whether nothing occludes the path over an edge that `FirstOrderPath::over` would find, without its angles: both ends have to lie
/// in the edge's exterior wedge, as in a list of near edges.
fn sees_edge(scene: &Scene, endpoints: &Endpoints, edge: u32, rays: &mut u64) -> bool {
    let (from, to) = local_positions(scene, endpoints);
    let edge = scene.edge(edge);
    let Some(along_m) = edge.clamped(edge.apex_m(from, to)) else {
        return false;
    };
    let apex = edge.at(along_m);
    let detour_m = from.distance(apex) + apex.distance(to) - from.distance(to);
    let sight_point = edge_wave::sight_point(&edge, apex, edge.outward());
    let mut sees = |end| is_unoccluded(scene, end, sight_point, edge.faces, rays);
    fade_out(scene, detour_m) > 0.0 && sees(to) && sees(from)
}
