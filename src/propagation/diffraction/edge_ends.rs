//! Where an edge of a path over two edges ends, for its own wave.
//!
//! Pure arithmetic, any thread, bounded.

use glam::DVec3;

use crate::scene::edges::{Edge, EdgeCrossing};

/// Cosine of the angle between edges that count as parallel.
pub(super) const PARALLEL: f64 = 0.999;

/// Largest width of a face between two edges whose waves arrive as one, in metres, times [`Edge::length_scale`]: a sixteenth
/// of the wavelength at 63 Hz, a wavelength at 1 kHz.
pub(super) const NARROW_M: f64 = 0.35;

/// A leg between edges of one face lies in it to this angle in radians: 2 mm of unevenness over 0.2 m.
pub(super) const IN_FACE: f64 = 1e-2;

/// Distance in metres beyond an edge's end where a wall that it ends at is looked for.
const BEHIND_END_M: f64 = 0.05;

/// An end of one of the edges, for its own wave.
#[derive(Clone, Copy)]
pub(super) struct OwnEnd {
    /// As [`EdgeCrossing::excess_m`].
    pub(super) excess_m: f64,
    /// Whether a wall that ends at the other edge is beyond it ([`is_at_wall`]).
    pub(super) is_at_wall: bool,
}

/// Ends of the first edge of a path of this length between two points. The path over an end crosses the other edge where that
/// is the shortest. At the wall of the other edge the end does not truncate: the other edge's wave has the wall's shadow.
pub(super) fn own_ends(
    [edge, other]: [&Edge; 2],
    crossing: &EdgeCrossing,
    [near, far]: [DVec3; 2],
    whole_m: f64,
) -> [OwnEnd; 2] {
    std::array::from_fn(|end| {
        let beyond_line_m = crossing.excess_m[end];
        let is_at_wall = is_at_wall(edge, end, other);
        let excess_m = match (edge.free_ends[end], is_at_wall) {
            (true, false) => {
                let point = edge.at([0.0, edge.length_m][end]);
                let across = other.at(other.apex_m(point, far));
                let over_end_m =
                    near.distance(point) + point.distance(across) + across.distance(far);
                (over_end_m - whole_m).max(0.0).copysign(beyond_line_m)
            }
            (true, true) if beyond_line_m < 0.0 => beyond_line_m,
            _ => f64::INFINITY,
        };
        OwnEnd {
            excess_m,
            is_at_wall,
        }
    })
}

/// Whether an edge ends at the wall that ends at another edge, like the jamb of a doorway at the lintel. The corner of a block
/// ends in the air above the block.
fn is_at_wall(edge: &Edge, end: usize, other: &Edge) -> bool {
    let point = edge.at([0.0, edge.length_m][end]);
    let along_m = (point - other.origin).dot(other.direction);
    let nearest = other.at(along_m.clamp(0.0, other.length_m));
    let is_near = point.distance(nearest) < NARROW_M * edge.length_scale;
    if !is_near || edge.direction.dot(other.direction).abs() > PARALLEL {
        return false;
    }
    let outward_m = [-BEHIND_END_M, BEHIND_END_M][end] * edge.length_scale;
    let far = other.n * std::f64::consts::PI;
    let angle = other.angle_of(point + outward_m * edge.direction);
    angle.is_none_or(|angle| angle < IN_FACE || far - angle < IN_FACE)
}
