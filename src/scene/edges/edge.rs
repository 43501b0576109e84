//! One diffracting edge: its line, its wedge, and the crossing of a path.

use std::f64::consts::PI;

use glam::DVec3;

use crate::acoustics::smoothstep;
use crate::binary::stored;
use crate::geometry::angle::{atan2, sin_cos};
use crate::geometry::bvh::NO_GROUP;

/// Shortest edge in metres, times [`Edge::length_scale`]: shorter ones cast no shadow below 1 kHz.
pub const LEAST_LENGTH_M: f64 = 0.3;

/// Least angle in degrees by which the air around an edge exceeds a half-turn.
pub const LEAST_TURN_DEG: f64 = 5.0;

/// Distance from an edge's line below which a point has no angle around it, in metres.
const ON_EDGE_M: f64 = 1e-4;

/// Relative rounding error of lengths: a hundred times that of a few sums and roots in `f64`.
const LENGTH_ROUNDING: f64 = 1e-13;

/// Angles this far outside the exterior wedge count as on the face, in radians: rounding.
const ON_FACE: f64 = 1e-6;

/// Length in metres, times [`Edge::length_scale`], by which a path over a free end may exceed the shortest path over the
/// edge's line. There its wave is 23 dB below that of a long edge at 250 Hz.
const MAX_BEYOND_M: f64 = 2.0;

/// A straight edge between two faces, or at the boundary of one. Lengths in metres in the scene's local coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Identity across commits: a hash of the faces' keys and the ends.
    pub key: u64,
    /// Start point.
    pub origin: DVec3,
    /// Unit vector along it.
    pub direction: DVec3,
    /// Length.
    pub length_m: f64,
    /// Unit vector from the edge into the first face.
    pub tangent: DVec3,
    /// Unit normal of the first face, on the air's side: [`Self::direction`] × [`Self::tangent`].
    pub normal: DVec3,
    /// Wedge index: angle of the exterior wedge in units of π, above 1; 2 at the boundary of a sheet.
    pub n: f64,
    /// Surfaces of its two faces; twice the same at a boundary edge.
    pub faces: [u32; 2],
    /// Whether its start and its other end are free. An edge that ends at a surface across it, such as a floor, goes on in
    /// that surface's image.
    pub free_ends: [bool; 2],
    /// Wavelengths in the scene's air relative to those in the default air (`Scene::length_scale`).
    pub length_scale: f64,
}

/// Edge of a stale index: no path crosses it.
pub(in crate::scene) const NO_EDGE: Edge = Edge {
    key: 0,
    origin: DVec3::NAN,
    direction: DVec3::Y,
    length_m: 0.0,
    tangent: DVec3::X,
    normal: DVec3::Z,
    n: 2.0,
    faces: [NO_GROUP; 2],
    free_ends: [false; 2],
    length_scale: 1.0,
};

/// The crossing of an edge by a diffracted path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeCrossing {
    /// Diffraction point in local coordinates: the crossing of the edge's line, or the end that it lies beyond.
    pub apex: DVec3,
    /// Angle of the incoming ray from the first face, radians.
    pub incoming: f64,
    /// Angle of the outgoing ray from the first face, radians.
    pub outgoing: f64,
    /// Length before the edge's line, metres.
    pub before_m: f64,
    /// Length after the edge's line, metres.
    pub after_m: f64,
    /// Sine of the angle between ray and edge, the same on both sides.
    pub sin_edge: f64,
    /// By how much the path over each end of the edge is longer, in metres: negative beyond the end, infinite at an end
    /// that is not free.
    pub excess_m: [f64; 2],
    /// Largest [`Self::beyond_m`].
    pub most_beyond_m: f64,
}

impl EdgeCrossing {
    /// Weight of a path by how far it lies beyond an end: 1 within, 0 at the limit.
    pub fn beyond_weight(&self) -> f64 {
        smoothstep(2.0 * (1.0 - self.beyond_m() / self.most_beyond_m))
    }

    /// Length in metres of the path through [`Self::apex`].
    pub fn length_m(&self) -> f64 {
        self.before_m + self.after_m + self.beyond_m()
    }

    /// Length by which paths are ranked, in metres: weaker the farther they lie beyond an end, and different for edges that
    /// meet there.
    pub fn rank_m(&self) -> f64 {
        self.length_m() + self.beyond_m()
    }

    /// By how much it exceeds the path over the edge's line, in metres: 0 within the ends.
    pub fn beyond_m(&self) -> f64 {
        self.excess_m
            .into_iter()
            .fold(0.0, |most, excess| most.max(-excess))
    }
}

impl Edge {
    /// The point at a distance from the edge's beginning.
    #[inline]
    pub fn at(&self, along_m: f64) -> DVec3 {
        self.origin + self.direction * along_m
    }

    /// Position of a point along the edge, in metres from its origin, and its distance from the edge's line.
    #[inline]
    pub(crate) fn along_and_across_m(&self, point: DVec3) -> (f64, f64) {
        let out = point - self.origin;
        let along = out.dot(self.direction);
        (along, (out - along * self.direction).length())
    }

    /// Position along the edge, in metres from its origin, of the shortest path between two points: the straight line after
    /// rotating both half-planes into one.
    pub fn apex_m(&self, from: DVec3, to: DVec3) -> f64 {
        apex_m(self.along_and_across_m(from), self.along_and_across_m(to))
    }

    /// [`EdgeCrossing::rank_m`] of the shortest path between two points over the edge, if it is not above `most_m` and
    /// [`Self::crossing`] exists: without its angles, since most are too long.
    pub fn crossing_rank_m(&self, from: DVec3, to: DVec3, most_m: f64) -> Option<f64> {
        let ((a, near), (b, far)) = (self.along_and_across_m(from), self.along_and_across_m(to));
        let (along_m, across_m) = (b - a, near + far);
        // Lower bound except for rounding.
        let least_m2 = along_m * along_m + across_m * across_m;
        if least_m2 * (1.0 - 2.0 * LENGTH_ROUNDING) > most_m * most_m {
            return None;
        }
        let along = apex_m((a, near), (b, far));
        let apex = self.at(self.clamped(along)?);
        let length_m = from.distance(apex) + apex.distance(to);
        let beyond_m = match (0.0..=self.length_m).contains(&along) {
            true => 0.0,
            false => length_m - least_m2.sqrt(),
        };
        let rank_m = length_m + beyond_m;
        let is_near = beyond_m < self.most_beyond_m() && rank_m <= most_m;
        (is_near && self.is_outside(from) && self.is_outside(to)).then_some(rank_m)
    }

    /// Lower bound of the length of a path between two points over the edge's line, with a margin for rounding.
    pub fn min_path_length_m(&self, from: DVec3, to: DVec3) -> f64 {
        let ((a, near), (b, far)) = (self.along_and_across_m(from), self.along_and_across_m(to));
        let (along, across) = (b - a, near + far);
        (along * along + across * across).sqrt() * (1.0 - LENGTH_ROUNDING)
    }

    /// Distance in metres of a point from the edge's line.
    #[inline]
    pub fn line_distance_m(&self, point: DVec3) -> f64 {
        self.along_and_across_m(point).1
    }

    /// Whether a point has an angle around the edge ([`Self::angle_of`]), mostly without computing it.
    #[inline]
    pub fn is_outside(&self, point: DVec3) -> bool {
        let out = point - self.origin;
        let (x, y) = (out.dot(self.tangent), out.dot(self.normal));
        // In front of the first face, or beside a sheet: all points except those on the line.
        let is_open = y >= 0.0 || self.n == 2.0;
        (is_open && x.abs().max(y.abs()) > ON_EDGE_M) || self.angle_of(point).is_some()
    }

    /// Angle of a point around the edge from the first face, or none on the edge and inside the wedge.
    pub fn angle_of(&self, point: DVec3) -> Option<f64> {
        let out = point - self.origin;
        let (x, y) = (out.dot(self.tangent), out.dot(self.normal));
        // The root is needed only near the edge.
        if x.abs().max(y.abs()) <= ON_EDGE_M && x.hypot(y) <= ON_EDGE_M {
            return None;
        }
        let angle = atan2(y, x);
        let angle = if angle < -ON_FACE {
            angle + 2.0 * PI
        } else {
            angle.max(0.0)
        };
        let far = self.n * PI;
        if angle <= far + ON_FACE {
            return Some(angle.min(far));
        }
        // Just behind the first face, by rounding.
        (angle > 2.0 * PI - ON_FACE).then_some(0.0)
    }

    /// A position along the edge's line, or the free end that it lies beyond.
    pub fn clamped(&self, along_m: f64) -> Option<f64> {
        if (0.0..=self.length_m).contains(&along_m) {
            return Some(along_m);
        }
        let (end, end_m) = match along_m > 0.0 {
            true => (1, self.length_m),
            false => (0, 0.0),
        };
        self.free_ends[end].then_some(end_m)
    }

    /// The crossing of the shortest path between two points, if it lies within the ends of the edge or little beyond a free
    /// one and both points are in the exterior wedge.
    pub fn crossing(&self, from: DVec3, to: DVec3) -> Option<EdgeCrossing> {
        let along = self.apex_m(from, to);
        let apex = self.at(self.clamped(along)?);
        let angles = [self.angle_of(from)?, self.angle_of(to)?];
        self.crossing_at(along, apex, [from, to], angles)
    }

    /// The same for a known position along the edge's line, the apex there, and the angles of both points.
    #[inline]
    pub(super) fn crossing_at(
        &self,
        along: f64,
        apex: DVec3,
        [from, to]: [DVec3; 2],
        [incoming, outgoing]: [f64; 2],
    ) -> Option<EdgeCrossing> {
        let on_line = self.at(along);
        let (before_m, after_m) = (from.distance(on_line), on_line.distance(to));
        let cos_edge = (on_line - from).dot(self.direction) / before_m;
        let excess_m = [0, 1].map(|end| {
            let end_m = [0.0, self.length_m][end];
            if !self.free_ends[end] {
                return f64::INFINITY;
            }
            let point = self.at(end_m);
            let excess = from.distance(point) + point.distance(to) - before_m - after_m;
            excess
                .max(0.0)
                .copysign([along, self.length_m - along][end])
        });
        let crossing = EdgeCrossing {
            apex,
            incoming,
            outgoing,
            before_m,
            after_m,
            sin_edge: (1.0 - cos_edge * cos_edge).max(0.0).sqrt(),
            excess_m,
            most_beyond_m: self.most_beyond_m(),
        };
        (crossing.beyond_m() < crossing.most_beyond_m).then_some(crossing)
    }

    fn most_beyond_m(&self) -> f64 {
        MAX_BEYOND_M * self.length_scale
    }

    /// Closest points of two edges, each in metres from its start.
    pub(super) fn closest(&self, other: &Self) -> (f64, f64) {
        let (u, v, w) = (self.direction, other.direction, self.origin - other.origin);
        let (cosine, d, e) = (u.dot(v), u.dot(w), v.dot(w));
        let sine_squared = 1.0 - cosine * cosine;
        // Parallel edges: the middle of one.
        let s = if sine_squared > 1e-9 {
            (cosine * e - d) / sine_squared
        } else {
            0.5 * self.length_m
        };
        let t = (e + cosine * s.clamp(0.0, self.length_m)).clamp(0.0, other.length_m);
        ((cosine * t - d).clamp(0.0, self.length_m), t)
    }

    /// Least distance between two edges in metres.
    pub fn distance_m(&self, other: &Self) -> f64 {
        let (s, t) = self.closest(other);
        self.at(s).distance(other.at(t))
    }

    /// The face nearer to a direction at an angle around the edge.
    pub fn face_beside(&self, angle: f64) -> u32 {
        self.faces[usize::from(angle > 0.5 * self.n * PI)]
    }

    /// Unit vector from the edge into the first face (0) or the second one (1).
    pub fn face_tangent(&self, face: usize) -> DVec3 {
        match face {
            0 => self.tangent,
            _ => {
                let (sin, cos) = sin_cos(self.n * PI);
                self.tangent * cos + self.normal * sin
            }
        }
    }

    /// Unit normal of the first face (0) or the second one (1) on the air's side.
    pub fn face_normal(&self, face: usize) -> DVec3 {
        if face == 0 {
            return self.normal;
        }
        self.face_tangent(1).cross(self.direction)
    }

    /// Unit vector from the edge along the bisector of the exterior wedge.
    pub fn outward(&self) -> DVec3 {
        let (sin, cos) = sin_cos(0.5 * self.n * PI);
        self.tangent * cos + self.normal * sin
    }
}

/// Position along a line at which the shortest path between two points crosses it; each point has its position along the
/// line and its distance from it.
#[inline]
pub(super) fn apex_m((a, near): (f64, f64), (b, far): (f64, f64)) -> f64 {
    let both = near + far;
    if both > 0.0 {
        a + (b - a) * near / both
    } else {
        0.5 * (a + b)
    }
}

stored!(Edge {
    key: u64,
    origin: DVec3,
    direction: DVec3,
    length_m: f64,
    tangent: DVec3,
    normal: DVec3,
    n: f64,
    faces: [u32; 2],
    free_ends: [bool; 2],
    length_scale: f64,
});

#[cfg(test)]
mod tests {
    use super::*;

    fn corner() -> Edge {
        // Solid at x > 0, y < 0; the first face has the normal +y.
        Edge {
            key: 1,
            origin: DVec3::ZERO,
            direction: DVec3::NEG_Z,
            length_m: 4.0,
            tangent: DVec3::X,
            normal: DVec3::NEG_Z.cross(DVec3::X) * -1.0,
            n: 1.5,
            faces: [0, 1],
            free_ends: [false; 2],
            length_scale: 1.0,
        }
    }

    #[test]
    fn angles_run_through_the_air_only() {
        let edge = corner();
        assert_eq!(edge.angle_of(DVec3::new(2.0, 0.0, 0.0)), Some(0.0));
        assert_eq!(edge.angle_of(DVec3::new(2.0, -1e-9, 0.0)), Some(0.0));
        let far = edge.angle_of(DVec3::new(1e-9, -3.0, 1.0));
        assert!(far.is_some_and(|a| (a - 1.5 * PI).abs() < 1e-8));
        assert_eq!(edge.angle_of(DVec3::new(1.0, -1.0, 0.0)), None);
        assert_eq!(edge.angle_of(DVec3::new(0.0, 0.0, 9.0)), None);
        assert!(
            edge.outward()
                .distance(DVec3::new(-1.0, 1.0, 0.0).normalize())
                < 1e-12
        );
    }

    #[test]
    fn a_diffracted_path_keeps_its_angle_to_the_edge() {
        let edge = corner();
        let (from, to) = (DVec3::new(2.0, 1.0, -0.5), DVec3::new(-1.0, -3.0, -3.5));
        let crossing = edge.crossing(from, to).expect("within the ends");
        let cosine = |leg: DVec3| leg.normalize().dot(edge.direction);
        assert!((cosine(crossing.apex - from) - cosine(to - crossing.apex)).abs() < 1e-12);
        // No other point of the edge has a shorter path.
        for along in [0.1, 0.9, 2.0, 3.9] {
            let at = edge.at(along);
            assert!(from.distance(at) + at.distance(to) >= crossing.length_m() - 1e-12);
        }
        assert_eq!(edge.crossing(from, to + 40.0 * DVec3::NEG_Z), None);
    }
}
