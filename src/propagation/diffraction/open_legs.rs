//! How open the legs of a path over one edge are.
//!
//! In the light no path over two edges continues a wave over one whose leg another edge hides, and in the shadow only those paths
//! do that are among the shortest and loudest: the whole wave would end there. So it fades before. Own.

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
    others: &[u32],
    hidden_m: f64,
) -> f64 {
    let legs = ends.map(|end| Leg::between(apex, end, hidden_m));
    let others = scene.edge_neighbours(edge).chain(others.iter().copied());
    let mut least_m = hidden_m;
    for other in others.filter(|&other| other != edge) {
        let [origin, direction] = scene.edge_line(other);
        let moment = (origin - apex).cross(direction);
        for leg in &legs {
            if leg.is_far_from(direction, moment) {
                continue;
            }
            let other = scene.edge(other);
            let detour_m = leg.detour_m(&other);
            // Edges that meet at a corner hide no leg of each other.
            if detour_m < least_m && !meet_at_corner([&scene.edge(edge), &other]) {
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
    /// From the apex to the end.
    vector: DVec3,
    length_m: f64,
    /// Squared distance of an edge's line in square metres beyond which the detour over it is too long.
    far_m2: f64,
}

impl Leg {
    fn between(apex: DVec3, end: DVec3, hidden_m: f64) -> Self {
        let vector = end - apex;
        let length_m = vector.length();
        Self {
            apex,
            end,
            vector,
            length_m,
            // The points of a longest detour are farthest from the leg at its middle.
            far_m2: 0.25 * hidden_m * (2.0 * length_m + hidden_m),
        }
    }

    /// Whether a line is too far for a detour that counts. `moment` is the vector from the apex to a point of the line times its
    /// direction.
    #[inline]
    fn is_far_from(&self, direction: DVec3, moment: DVec3) -> bool {
        // The distance of two lines is the volume that their directions and a vector between them span, over the area of both
        // directions.
        let volume = moment.dot(self.vector);
        let along = direction.dot(self.vector);
        volume * volume > self.far_m2 * (self.length_m * self.length_m - along * along)
    }

    fn detour_m(&self, edge: &Edge) -> f64 {
        let at = nearest_point(edge, self.apex, self.end);
        self.apex.distance(at) + at.distance(self.end) - self.length_m
    }
}
