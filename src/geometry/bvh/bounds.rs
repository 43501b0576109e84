//! Axis-parallel boxes while a tree is built.

use glam::Vec3;

/// A box from one corner to the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) min: Vec3,
    pub(super) max: Vec3,
}

impl Bounds {
    pub(super) const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    pub(super) fn with_point(&self, point: Vec3) -> Self {
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }

    pub(super) fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    pub(super) fn centre(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    pub(super) fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// Half the surface; 0 of an empty box.
    pub(super) fn half_area(&self) -> f64 {
        let size = self.size().max(Vec3::ZERO).as_dvec3();
        size.x * (size.y + size.z) + size.y * size.z
    }
}
