//! Watertight ray-triangle intersection: the specification of every tree's answers.
//!
//! Source: \[WOOP13\], literal: the ray is sheared onto +z, so two triangles that share an edge compute the same edge
//! function up to its sign, and a ray cannot slip between them. Where an edge function is exactly zero it is computed
//! again in `f64`. Both faces count.
//!
//! Own addition: a triangle counts only where the ray is in the triangle's own box, widened by [`box_margin`], and not
//! before it enters. Bounds of boxes are monotone under rounding, so a box around that box is entered no later, and no
//! tree, of whatever width and instruction set, can lose a hit or find another.

use glam::Vec3;

use super::ray::Ray;
use crate::simd::tracing::{Corners, RawRay, TriangleRay};

/// How far boxes stand off their triangles in a scene whose coordinates are `extent` at most: 2⁻²⁰ of it. The shear
/// moves a corner by at most ten half units in the last place of twice the extent, which is 2⁻²⁰·⁷ (\[WOOP13\], Section 4).
pub fn box_margin(extent: f32) -> f32 {
    extent * (1.0 / (1u32 << 20) as f32)
}

/// A ray made ready for boxes and triangles.
#[derive(Debug, Clone, Copy)]
pub struct PreparedRay {
    pub(super) ray: TriangleRay,
    pub(super) t_max: f32,
}

impl PreparedRay {
    /// Of a ray that can hit something: nothing of a ray without direction, with numbers that are none, or with an
    /// empty interval. Parameters below zero never count. `margin` is [`box_margin`] of the scene.
    #[inline]
    pub fn of(ray: &Ray, margin: f32) -> Option<Self> {
        // Written so that a NaN anywhere fails.
        let is_ray = ray.direction.is_finite()
            && ray.origin.is_finite()
            && ray.direction != Vec3::ZERO
            && at_least_zero(ray.t_min) < ray.t_max;
        is_ray.then(|| Self {
            ray: TriangleRay::of(raw(ray, margin)),
            t_max: ray.t_max,
        })
    }

    /// Parameter of the intersection with a triangle, if it lies strictly between the ray's bounds.
    pub fn meet(&self, corners: &[Vec3; 3]) -> Option<f32> {
        let mut lanes: Corners = [[[0.0; 4]; 3]; 3];
        for (rows, corner) in lanes.iter_mut().zip(corners) {
            for (row, value) in rows.iter_mut().zip(corner.to_array()) {
                row[0] = value;
            }
        }
        self.ray.meet(&lanes, 0, self.t_max)
    }
}

/// A ray for `simd`.
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

    fn meet(origin: Vec3, t_min: f32, t_max: f32) -> Option<f32> {
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
        PreparedRay::of(&ray, box_margin(2.0))?.meet(&corners)
    }

    #[test]
    fn a_ray_meets_a_triangle_where_it_should() {
        let origin = Vec3::new(0.2, 0.2, 0.0);
        assert_eq!(meet(origin, 0.0, 10.0), Some(2.0));
        assert_eq!(meet(origin, 0.0, 2.0), None);
        assert_eq!(meet(origin, 2.0, 10.0), None);
        assert_eq!(meet(Vec3::new(0.9, 0.9, 0.0), 0.0, 10.0), None);
    }
}
