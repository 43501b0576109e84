//! A ray and what it hits.

use glam::Vec3;

/// A ray over the open interval from [`Self::t_min`] to [`Self::t_max`], in multiples of the direction's length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start, in the tree's coordinates.
    pub origin: Vec3,
    /// Direction of any length but zero.
    pub direction: Vec3,
    /// Hits at or before this parameter do not count.
    pub t_min: f32,
    /// Hits at or beyond this parameter do not count.
    pub t_max: f32,
}

impl Ray {
    /// From a point without end.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_min: 0.0,
            t_max: f32::INFINITY,
        }
    }

    /// The open segment between two points: the parameter runs from 0 to 1.
    pub fn between(from: Vec3, to: Vec3) -> Self {
        Self {
            origin: from,
            direction: to - from,
            t_min: 0.0,
            t_max: 1.0,
        }
    }

    /// The point at a parameter.
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}

/// Where a ray met a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Parameter along the ray.
    pub t: f32,
    /// Index of the triangle, as the tree was built from.
    pub triangle: u32,
    /// The triangle's group, as the tree was built with.
    pub group: u32,
}
