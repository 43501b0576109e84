//! How open the legs of a path over one edge are.
//!
//! In the light no path over two edges continues a wave over one whose leg another edge hides: the whole wave would end there. So
//! it fades before. Own.

use glam::DVec3;

use crate::acoustics::smoothstep;
use crate::propagation::diffraction::near_list::nearest_point;
use crate::propagation::diffraction::two_edge_path::meet_at_corner;
use crate::scene::Scene;
use crate::scene::edges::Edge;

/// Amplitude factor of the wave over an edge, whose apex is given, between two ends: 0 where a neighbour of the edge or one of
/// `others` touches a leg, and 1 where paths from apex to end over each of them have detours of `hidden_m` or more.
pub(super) fn open_share(
    scene: &Scene,
    (edge, apex): (u32, DVec3),
    ends: [DVec3; 2],
    others: impl Iterator<Item = u32>,
    hidden_m: f64,
) -> f64 {
    let own = scene.edge(edge);
    let legs = ends.map(|end| Leg::between(apex, end, hidden_m));
    let others = scene.edge_neighbours(edge).chain(others);
    let mut least_m = hidden_m;
    for other in others.filter(|&other| other != edge) {
        let line = scene.edge_line(other);
        for leg in &legs {
            if leg.is_far_from(line) {
                continue;
            }
            let other = scene.edge(other);
            let detour_m = leg.detour_m(&other);
            // Edges that meet at a corner hide no leg of each other.
            if detour_m < least_m && !meet_at_corner([&own, &other]) {
                least_m = detour_m;
            }
        }
    }
    smoothstep(least_m / hidden_m)
}

/// A leg of a path over an edge.
struct Leg {
    apex: DVec3,
    end: DVec3,
    /// Squared distance of an edge's line in square metres beyond which the detour over it is too long.
    far_m2: f64,
}

impl Leg {
    fn between(apex: DVec3, end: DVec3, hidden_m: f64) -> Self {
        // The points of a longest detour are farthest from the leg at its middle.
        let far_m2 = 0.25 * hidden_m * (2.0 * apex.distance(end) + hidden_m);
        Self { apex, end, far_m2 }
    }

    /// Whether a line is too far for a detour that counts.
    fn is_far_from(&self, [origin, direction]: [DVec3; 2]) -> bool {
        let across = direction.cross(self.end - self.apex);
        let off = (origin - self.apex).dot(across);
        off * off > self.far_m2 * across.length_squared()
    }

    fn detour_m(&self, edge: &Edge) -> f64 {
        let at = nearest_point(edge, self.apex, self.end);
        self.apex.distance(at) + at.distance(self.end) - self.apex.distance(self.end)
    }
}
