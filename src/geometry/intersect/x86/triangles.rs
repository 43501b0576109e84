//! A ray against four triangles.

use core::arch::x86_64::*;

use super::{RayVectors, load4, store4};
use crate::geometry::intersect::{
    Axes, Corners, FAR_WIDENING, HitLanes, NEAR_NARROWING, RawRay, ScalarRay,
};

/// A ray against four triangles.
#[derive(Clone, Copy)]
pub(crate) struct ShearRay4<'a> {
    ray: RawRay<'a>,
    vectors: RayVectors,
    axes: [usize; 3],
    /// By permuted axis.
    origin: [__m128; 3],
    /// As in [`ShearRay`](crate::geometry::intersect::ShearRay), the last negated.
    shear: [__m128; 3],
}

impl<'a> ShearRay4<'a> {
    /// Precomputes the terms of a ray.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn new<const CALLER: u8>(ray: RawRay<'a>, vectors: &RayVectors) -> Self {
        let [x, y, z] = Axes::ending_at(vectors.longest).indices();
        let axes = [x.min(2), y.min(2), z.min(2)];
        let inverse = RayVectors::lanes(vectors.inverse)[axes[2]];
        let stretched = RayVectors::lanes(_mm_mul_ps(vectors.direction, _mm_set1_ps(inverse)));
        Self {
            ray,
            vectors: *vectors,
            axes,
            origin: [
                _mm_set1_ps(ray.origin[axes[0]]),
                _mm_set1_ps(ray.origin[axes[1]]),
                _mm_set1_ps(ray.origin[axes[2]]),
            ],
            shear: [
                _mm_set1_ps(stretched[axes[0]]),
                _mm_set1_ps(stretched[axes[1]]),
                _mm_set1_ps(-inverse),
            ],
        }
    }

    /// [`ScalarRay::intersect_four`], to the bit.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn intersect<const CALLER: u8>(
        &self,
        corners: &Corners,
        t_max: f32,
        at: &mut [f32; 4],
    ) -> HitLanes<1> {
        let [kx, ky, kz] = self.axes;
        let [sx, sy, sz] = self.shear;
        // All three negated: this keeps the signs of u, v and w and allows loads as operands.
        let sheared = |corner: &[[f32; 4]; 3]| {
            let z = _mm_sub_ps(self.origin[2], load4(&corner[kz]));
            let x = _mm_sub_ps(self.origin[0], load4(&corner[kx]));
            let y = _mm_sub_ps(self.origin[1], load4(&corner[ky]));
            let x = _mm_sub_ps(x, _mm_mul_ps(sx, z));
            let y = _mm_sub_ps(y, _mm_mul_ps(sy, z));
            (x, y, z)
        };
        let (ax, ay, az) = sheared(&corners[0]);
        let (bx, by, bz) = sheared(&corners[1]);
        let (cx, cy, cz) = sheared(&corners[2]);
        let u = _mm_sub_ps(_mm_mul_ps(cx, by), _mm_mul_ps(cy, bx));
        let v = _mm_sub_ps(_mm_mul_ps(ax, cy), _mm_mul_ps(ay, cx));
        let w = _mm_sub_ps(_mm_mul_ps(bx, ay), _mm_mul_ps(by, ax));
        let zero = _mm_setzero_ps();
        let least = _mm_min_ps(u, _mm_min_ps(v, w));
        let greatest = _mm_max_ps(u, _mm_max_ps(v, w));
        // False for a NaN.
        let inside = _mm_or_ps(_mm_cmple_ps(zero, least), _mm_cmple_ps(greatest, zero));
        let candidates = _mm_movemask_ps(inside) as u64;
        if candidates == 0 {
            return HitLanes(0);
        }
        let within = _mm_or_ps(_mm_cmplt_ps(zero, least), _mm_cmplt_ps(greatest, zero));
        let on_edge = candidates & !(_mm_movemask_ps(within) as u64);
        if on_edge != 0 {
            let RawRay {
                origin,
                direction,
                t_min,
                margin,
            } = self.ray;
            let limits = [t_min, margin];
            return Self::intersect_lanes(
                origin,
                direction,
                limits,
                corners,
                t_max,
                at,
                HitLanes(candidates),
            );
        }
        let determinant = _mm_add_ps(_mm_add_ps(u, v), w);
        let depth = _mm_add_ps(
            _mm_add_ps(_mm_mul_ps(u, az), _mm_mul_ps(v, bz)),
            _mm_mul_ps(w, cz),
        );
        let t = _mm_div_ps(_mm_mul_ps(depth, sz), determinant);
        let in_range = _mm_and_ps(
            _mm_cmpgt_ps(t, _mm_set1_ps(self.ray.t_min)),
            _mm_cmplt_ps(t, _mm_set1_ps(t_max)),
        );
        let hits = _mm_and_ps(within, in_range);
        if _mm_movemask_ps(hits) == 0 {
            return HitLanes(0);
        }
        let (near, far) = self.spans(corners);
        let t = _mm_max_ps(near, t);
        let in_box = _mm_and_ps(_mm_cmple_ps(near, far), _mm_cmple_ps(zero, far));
        let in_range = _mm_cmplt_ps(t, _mm_set1_ps(t_max));
        store4(at, t);
        HitLanes(_mm_movemask_ps(_mm_and_ps(hits, _mm_and_ps(in_box, in_range))) as u64)
    }

    /// Parameters at which the ray enters and leaves the box of each triangle.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn spans(&self, corners: &Corners) -> (__m128, __m128) {
        let [a, b, c] = corners;
        let margin = _mm_set1_ps(self.ray.margin);
        let inverse = RayVectors::lanes(self.vectors.inverse);
        let span = |axis: usize| {
            let (a, b, c) = (load4(&a[axis]), load4(&b[axis]), load4(&c[axis]));
            let lower = _mm_sub_ps(_mm_min_ps(_mm_min_ps(a, b), c), margin);
            let upper = _mm_add_ps(_mm_max_ps(_mm_max_ps(a, b), c), margin);
            let origin = _mm_set1_ps(self.ray.origin[axis]);
            let inverse = _mm_set1_ps(inverse[axis]);
            let first = _mm_mul_ps(_mm_sub_ps(lower, origin), inverse);
            let second = _mm_mul_ps(_mm_sub_ps(upper, origin), inverse);
            (_mm_min_ps(first, second), _mm_max_ps(first, second))
        };
        let ((nx, fx), (ny, fy), (nz, fz)) = (span(0), span(1), span(2));
        let near = _mm_max_ps(_mm_max_ps(nx, ny), nz);
        let far = _mm_min_ps(_mm_min_ps(fx, fy), fz);
        (
            _mm_mul_ps(near, _mm_set1_ps(NEAR_NARROWING)),
            _mm_mul_ps(far, _mm_set1_ps(FAR_WIDENING)),
        )
    }

    /// The scalar reference, for blocks with an edge function of zero. Takes the ray in parts: a reference to `self` would
    /// force it into memory.
    #[cold]
    #[inline(never)]
    fn intersect_lanes(
        origin: &[f32; 3],
        direction: &[f32; 3],
        [t_min, margin]: [f32; 2],
        corners: &Corners,
        t_max: f32,
        at: &mut [f32; 4],
        lanes: HitLanes<1>,
    ) -> HitLanes<1> {
        let ray = RawRay {
            origin,
            direction,
            t_min,
            margin,
        };
        ScalarRay::new(ray).intersect_lanes(corners, t_max, at, lanes)
    }
}
