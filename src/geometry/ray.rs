//! [`Ray`] and [`Hit`].

use glam::Vec3;

/// A ray over the open interval from [`Self::t_min`] to [`Self::t_max`]. The parameter counts lengths of the direction.
///
/// ```
/// use foresound::geometry::Ray;
/// use glam::Vec3;
///
/// let ray = Ray::new(Vec3::ZERO, 2.0 * Vec3::X);
/// assert_eq!(ray.at(1.5), 3.0 * Vec3::X);
/// let segment = Ray::between(Vec3::X, 5.0 * Vec3::X);
/// assert_eq!(segment.at(0.5), 3.0 * Vec3::X);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Origin, in the tree's coordinates, in metres.
    pub origin: Vec3,
    /// Direction, of any length but zero.
    pub direction: Vec3,
    /// Hits at or before this parameter do not count.
    pub t_min: f32,
    /// Hits at or beyond this parameter do not count.
    pub t_max: f32,
}

impl Ray {
    /// The half-line from a point.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self {
            origin,
            direction,
            t_min: 0.0,
            t_max: f32::INFINITY,
        }
    }

    /// The open segment between two points; the parameter runs from 0 to 1.
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

/// An intersection of a ray with a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Parameter along the ray, in lengths of its direction.
    pub t: f32,
    /// Index of the triangle in the list that the tree was built from.
    pub triangle: u32,
    /// The triangle's group.
    pub group: u32,
}
