//! An end of many paths over one edge: what depends on it alone is computed once.

use glam::DVec3;

use super::edge::{Edge, EdgeCrossing, apex_m};

/// A point and its position around an edge.
#[derive(Debug, Clone, Copy)]
pub struct EdgeEnd {
    point: DVec3,
    /// Position along the edge's line and distance from it, in metres.
    along_and_across_m: (f64, f64),
    /// See [`Edge::angle_of`].
    angle: Option<f64>,
}

impl EdgeEnd {
    /// Of a point in local coordinates.
    pub fn of(edge: &Edge, point: DVec3) -> Self {
        Self {
            point,
            along_and_across_m: edge.along_and_across_m(point),
            angle: edge.angle_of(point),
        }
    }

    /// Whether paths over the edge begin or end there: not on the edge and inside the wedge.
    #[inline]
    pub fn is_outside(&self) -> bool {
        self.angle.is_some()
    }

    /// [`Edge::apex_m`] of the shortest path from here.
    #[inline]
    pub fn apex_m(&self, to: &Self) -> f64 {
        apex_m(self.along_and_across_m, to.along_and_across_m)
    }

    /// Length in metres of the shortest path from here over the edge's line.
    #[inline]
    pub fn line_length_m(&self, to: &Self) -> f64 {
        let ((a, near), (b, far)) = (self.along_and_across_m, to.along_and_across_m);
        let (along, across) = (b - a, near + far);
        (along * along + across * across).sqrt()
    }

    /// [`Edge::crossing`] of the shortest path from here; the edge is the one that both are ends for.
    pub fn crossing(&self, edge: &Edge, to: &Self) -> Option<EdgeCrossing> {
        let along = self.apex_m(to);
        let apex = edge.at(edge.clamped(along)?);
        edge.crossing_at(
            along,
            apex,
            [self.point, to.point],
            [self.angle?, to.angle?],
        )
    }
}
