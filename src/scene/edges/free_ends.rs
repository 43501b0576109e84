//! Ends of edges: free, or closed by a surface across the edge.
//!
//! At a free end the diffracted wave ends. A surface that the edge ends at, such as the floor below a door's jamb, reflects
//! the wave of the edge, which together with its image is a longer edge.

use crate::geometry::{Bvh, Ray};
use crate::scene::edges::edge::Edge;
use crate::scene::edges::search_budget;

/// Distance in metres before and behind an end within which a surface closes it: solids are often sunk by some
/// centimetres.
const REACH_M: f64 = 0.03;

/// Distance of the test from the edge in metres, along the middle of the exterior wedge.
const CLEARANCE_M: f64 = 5e-3;

/// Rays of an edge.
const RAYS: f64 = 2.0;

/// Sets [`Edge::free_ends`]. Where the rays are too much work, all ends stay free.
pub(super) fn mark(edges: &mut [Edge], bvh: &Bvh) {
    if search_budget::pieces(edges.len(), RAYS, bvh.crossed_boxes()) == 0 {
        return;
    }
    for edge in edges {
        let beside = CLEARANCE_M * edge.outward();
        edge.free_ends = [0.0, edge.length_m].map(|end_m| {
            let [before, behind] = [-REACH_M, REACH_M].map(|m| edge.at(end_m + m) + beside);
            !bvh.any_hit(
                &Ray::between(before.as_vec3(), behind.as_vec3()),
                edge.faces,
            )
        });
    }
}
