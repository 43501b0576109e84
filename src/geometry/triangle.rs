//! Watertight ray-triangle intersection: the reference for every tree.
//!
//! Source: \[WOOP13\], literal: the ray is sheared onto +z, so two triangles with a common edge compute the same edge
//! function up to its sign, and no ray passes between them. An edge function that is exactly zero is computed again in
//! `f64`. Both faces count.
//!
//! Own addition: a triangle counts only where the ray is inside the triangle's bounding box, enlarged by [`box_margin`],
//! and not before it enters that box. Bounds of boxes are monotone under rounding: the ray enters every enclosing box no
//! later. So no tree of any width and instruction set can lose a hit or find another.

use glam::Vec3;

use super::intersect::{Corners, RawRay, ScalarRay};
use super::ray::Ray;

/// Margin of bounding boxes around triangles in a scene whose coordinates are at most `extent`, in the same unit: 2⁻²⁰ of
/// it. The shear moves a corner by at most ten half units in the last place of twice the extent, which is 2⁻²⁰·⁷
/// (\[WOOP13\], Section 4).
pub fn box_margin(extent: f32) -> f32 {
    extent * (1.0 / (1u32 << 20) as f32)
}

/// A ray with the precomputed terms for boxes and triangles.
///
/// ```
/// use foresound::geometry::Ray;
/// use foresound::geometry::triangle::{PreparedRay, box_margin};
/// use glam::Vec3;
///
/// let triangle = [Vec3::Z, Vec3::X + Vec3::Z, Vec3::Y + Vec3::Z];
/// let ray = Ray::new(Vec3::new(0.2, 0.2, 0.0), Vec3::Z);
/// let prepared = PreparedRay::new(&ray, box_margin(1.0)).expect("a direction");
/// assert_eq!(prepared.intersect(&triangle), Some(1.0));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct PreparedRay {
    pub(super) ray: ScalarRay,
    pub(super) t_max: f32,
}

impl PreparedRay {
    /// Prepares a ray; none if it has no direction, a NaN, an infinite coordinate or an empty interval. Parameters below
    /// zero never count. `margin` is [`box_margin`] of the scene.
    #[inline]
    pub fn new(ray: &Ray, margin: f32) -> Option<Self> {
        // False if any number is a NaN.
        let is_ray = ray.direction.is_finite()
            && ray.origin.is_finite()
            && ray.direction != Vec3::ZERO
            && at_least_zero(ray.t_min) < ray.t_max;
        is_ray.then(|| Self {
            ray: ScalarRay::new(raw(ray, margin)),
            t_max: ray.t_max,
        })
    }

    /// Parameter of the intersection with a triangle, if it is strictly between `t_min` and `t_max`.
    pub fn intersect(&self, corners: &[Vec3; 3]) -> Option<f32> {
        let mut lanes: Corners = [[[0.0; 4]; 3]; 3];
        for (rows, corner) in lanes.iter_mut().zip(corners) {
            for (row, value) in rows.iter_mut().zip(corner.to_array()) {
                row[0] = value;
            }
        }
        self.ray.intersect(&lanes, 0, self.t_max)
    }
}

/// A ray as arrays.
#[inline(always)]
pub(super) fn raw(ray: &Ray, margin: f32) -> RawRay<'_> {
    RawRay {
        origin: ray.origin.as_ref(),
        direction: ray.direction.as_ref(),
        t_min: at_least_zero(ray.t_min),
        margin,
    }
}

#[inline(always)]
fn at_least_zero(t: f32) -> f32 {
    if t < 0.0 { 0.0 } else { t }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn intersect(origin: Vec3, t_min: f32, t_max: f32) -> Option<f32> {
        let corners = [
            Vec3::new(0.0, 0.0, 2.0),
            Vec3::new(1.0, 0.0, 2.0),
            Vec3::new(0.0, 1.0, 2.0),
        ];
        let ray = Ray {
            t_min,
            t_max,
            ..Ray::new(origin, Vec3::Z)
        };
        PreparedRay::new(&ray, box_margin(2.0))?.intersect(&corners)
    }

    #[test]
    fn a_ray_intersects_a_triangle_between_its_bounds() {
        let origin = Vec3::new(0.2, 0.2, 0.0);
        assert_eq!(intersect(origin, 0.0, 10.0), Some(2.0));
        assert_eq!(intersect(origin, 0.0, 2.0), None);
        assert_eq!(intersect(origin, 2.0, 10.0), None);
        assert_eq!(intersect(Vec3::new(0.9, 0.9, 0.0), 0.0, 10.0), None);
    }
}
