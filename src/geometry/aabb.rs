//! Axis-aligned bounding boxes.

use glam::Vec3;

/// An axis-aligned bounding box. Empty if a minimum is above its maximum or not a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Aabb {
    /// The empty box.
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// The box of a triangle, `margin` larger on every side.
    pub fn of_triangle([a, b, c]: [Vec3; 3], margin: f32) -> Self {
        Self {
            min: a.min(b).min(c) - margin,
            max: a.max(b).max(c) + margin,
        }
    }

    /// The smallest box around both.
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// The smallest box around this one and a point.
    pub fn with_point(&self, point: Vec3) -> Self {
        self.union(&Self {
            min: point,
            max: point,
        })
    }

    /// Whether it contains no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    pub(super) fn centre(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    pub(super) fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// Half the surface area; 0 of an empty box.
    pub(crate) fn half_area(&self) -> f64 {
        let size = self.size().max(Vec3::ZERO).as_dvec3();
        size.x * (size.y + size.z) + size.y * size.z
    }
}
