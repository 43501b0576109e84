//! Watertight ray-triangle intersection: the specification of every tree's answers.
//!
//! Source: [WOOP13], literal: the ray is sheared onto +z, so two triangles that share an edge compute the same edge
//! function up to its sign, and a ray cannot slip between them. Where an edge function is exactly zero it is computed
//! again in `f64`. Both faces count.
//!
//! Own addition: a triangle counts only where the ray is in the triangle's own box, widened by [`box_margin`], and not
//! before it enters. Bounds of boxes are monotone under rounding, so a box around that box is entered no later, and no
//! tree, of whatever width and instruction set, can lose a hit or find another.

use glam::Vec3;

use super::ray::Ray;
use crate::simd::tracing::{Corners, Planes, ShearRay, SlabRay};

/// 1 + 2 γ(3) rounded up, γ(n) = n ε / (1 − n ε) with ε half a unit in the last place ([IZE13]).
const FAR_WIDENING: f32 = 1.000_000_5;

/// Its counterpart for near planes.
const NEAR_NARROWING: f32 = 0.999_999_5;

/// Smallest direction component that boxes see, as a share of the largest: 2⁻⁴⁰. What it moves a ray by is far less
/// than [`box_margin`].
const SMALLEST_COMPONENT: f32 = 1.0 / (1u64 << 40) as f32;

/// How far boxes stand off their triangles in a scene whose coordinates are `extent` at most: 2⁻²⁰ of it. The shear
/// moves a corner by at most ten half units in the last place of twice the extent, which is 2⁻²⁰·⁷ ([WOOP13], Section 4).
pub fn box_margin(extent: f32) -> f32 {
    extent * (1.0 / (1u32 << 20) as f32)
}

/// A ray made ready for boxes and triangles.
#[derive(Debug, Clone, Copy)]
pub struct PreparedRay {
    pub(super) slabs: SlabRay,
    pub(super) shear: ShearRay,
    pub(super) t_max: f32,
}

impl PreparedRay {
    /// Of a ray that can hit something: nothing of a ray without direction, with numbers that are none, or with an
    /// empty interval. Parameters below zero never count.
    #[inline]
    pub fn of(ray: &Ray) -> Option<Self> {
        let t_min = if ray.t_min < 0.0 { 0.0 } else { ray.t_min };
        let d = ray.direction;
        let largest = d.abs().max_element();
        // Written so that a NaN anywhere fails.
        let is_ray = d.is_finite() && ray.origin.is_finite() && largest > 0.0 && t_min < ray.t_max;
        if !is_ray {
            return None;
        }
        let smallest = (largest * SMALLEST_COMPONENT).max(f32::MIN_POSITIVE);
        let inverse = Vec3::ONE / (d.abs().max(Vec3::splat(smallest)).copysign(d));
        Some(Self {
            slabs: SlabRay {
                origin: ray.origin.to_array(),
                near_scale: (inverse * NEAR_NARROWING).to_array(),
                far_scale: (inverse * FAR_WIDENING).to_array(),
                down: d.to_array().map(f32::is_sign_negative),
            },
            shear: shear_onto_z(ray, t_min),
            t_max: ray.t_max,
        })
    }

    /// Parameter of the intersection with a triangle, if it lies strictly between the ray's bounds. `margin` is
    /// [`box_margin`] of the scene.
    pub fn meet(&self, corners: &[Vec3; 3], margin: f32) -> Option<f32> {
        let lanes: Corners = corners.map(|corner| corner.to_array().map(|value| [value; 4]));
        let t = self.shear.meet(&lanes, 0, self.t_max)?;
        self.confirm(corners, margin, t)
    }

    /// The second half of [`Self::meet`]: from where the shear puts the hit to where it counts.
    #[inline]
    pub(super) fn confirm(&self, corners: &[Vec3; 3], margin: f32, t: f32) -> Option<f32> {
        let [a, b, c] = *corners;
        let min = a.min(b).min(c) - margin;
        let max = a.max(b).max(c) + margin;
        let planes: Planes<1> = [[min.x], [min.y], [min.z], [max.x], [max.y], [max.z]];
        let (near, far) = self.slabs.span(&planes, 0);
        let t = if near > t { near } else { t };
        (near <= far && far >= 0.0 && t < self.t_max).then_some(t)
    }
}

fn shear_onto_z(ray: &Ray, t_min: f32) -> ShearRay {
    let d = ray.direction;
    let size = d.abs();
    let z = if size.x > size.y {
        if size.x > size.z { 0 } else { 2 }
    } else if size.y > size.z {
        1
    } else {
        2
    };
    let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
    if d[z] < 0.0 {
        std::mem::swap(&mut x, &mut y);
    }
    ShearRay {
        origin: ray.origin.to_array(),
        axis: [x, y, z],
        shear: [d[x] / d[z], d[y] / d[z], 1.0 / d[z]],
        t_min,
    }
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
        PreparedRay::of(&ray)?.meet(&corners, box_margin(2.0))
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
