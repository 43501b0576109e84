//! A ray against four triangles: SSE2.

use core::arch::x86_64::*;

use super::{Ready, load4, store4};
use crate::simd::tracing::{Axes, Corners, FAR_WIDENING, Met, NEAR_NARROWING, RawRay, TriangleRay};

/// A ray against four triangles at once.
#[derive(Clone, Copy)]
pub(crate) struct Shear4<'a> {
    ray: RawRay<'a>,
    ready: Ready,
    axes: [usize; 3],
    /// Permuted.
    origin: [__m128; 3],
    /// As [`TriangleRay`] has it, the last turned about.
    shear: [__m128; 3],
}

impl<'a> Shear4<'a> {
    /// Of a ray, raw and ready.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn of<const CALLER: u8>(ray: RawRay<'a>, ready: &Ready) -> Self {
        let [x, y, z] = Axes::ending_at(ready.longest).numbers();
        let axes = [x.min(2), y.min(2), z.min(2)];
        let inverse = Ready::lanes(ready.inverse)[axes[2]];
        let stretched = Ready::lanes(_mm_mul_ps(ready.direction, _mm_set1_ps(inverse)));
        Self {
            ray,
            ready: *ready,
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

    /// As [`TriangleRay::meet_four`], to the bit.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn meet<const CALLER: u8>(
        &self,
        corners: &Corners,
        before: f32,
        at: &mut [f32; 4],
    ) -> Met<1> {
        let [kx, ky, kz] = self.axes;
        let [sx, sy, sz] = self.shear;
        // All three turned about, which changes no sign of u, v and w and lets loads be operands.
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
        let most = _mm_max_ps(u, _mm_max_ps(v, w));
        // Written so that numbers that are none are outside.
        let inside = _mm_or_ps(_mm_cmple_ps(zero, least), _mm_cmple_ps(most, zero));
        let may_meet = _mm_movemask_ps(inside) as u64;
        if may_meet == 0 {
            return Met(0);
        }
        let within = _mm_or_ps(_mm_cmplt_ps(zero, least), _mm_cmplt_ps(most, zero));
        let on_edge = may_meet & !(_mm_movemask_ps(within) as u64);
        if on_edge != 0 {
            let RawRay {
                origin,
                direction,
                t_min,
                margin,
            } = self.ray;
            let limits = [t_min, margin];
            return Self::meet_again(
                origin,
                direction,
                limits,
                corners,
                before,
                at,
                Met(may_meet),
            );
        }
        let determinant = _mm_add_ps(_mm_add_ps(u, v), w);
        let depth = _mm_add_ps(
            _mm_add_ps(_mm_mul_ps(u, az), _mm_mul_ps(v, bz)),
            _mm_mul_ps(w, cz),
        );
        let t = _mm_div_ps(_mm_mul_ps(depth, sz), determinant);
        let in_time = _mm_and_ps(
            _mm_cmpgt_ps(t, _mm_set1_ps(self.ray.t_min)),
            _mm_cmplt_ps(t, _mm_set1_ps(before)),
        );
        let met = _mm_and_ps(within, in_time);
        if _mm_movemask_ps(met) == 0 {
            return Met(0);
        }
        let (near, far) = self.spans(corners);
        let t = _mm_max_ps(near, t);
        let in_box = _mm_and_ps(_mm_cmple_ps(near, far), _mm_cmple_ps(zero, far));
        let in_time = _mm_cmplt_ps(t, _mm_set1_ps(before));
        store4(at, t);
        Met(_mm_movemask_ps(_mm_and_ps(met, _mm_and_ps(in_box, in_time))) as u64)
    }

    /// Where the ray is in each triangle's own box.
    #[inline]
    #[target_feature(enable = "sse2")]
    fn spans(&self, corners: &Corners) -> (__m128, __m128) {
        let [a, b, c] = corners;
        let margin = _mm_set1_ps(self.ray.margin);
        let inverse = Ready::lanes(self.ready.inverse);
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

    /// For blocks of which an edge function is zero: the specification itself. Takes parts, so that none of the ray's need
    /// stand in memory for it.
    #[cold]
    #[inline(never)]
    fn meet_again(
        origin: &[f32; 3],
        direction: &[f32; 3],
        [t_min, margin]: [f32; 2],
        corners: &Corners,
        before: f32,
        at: &mut [f32; 4],
        lanes: Met<1>,
    ) -> Met<1> {
        let ray = RawRay {
            origin,
            direction,
            t_min,
            margin,
        };
        TriangleRay::of(ray).meet_again(corners, before, at, lanes)
    }
}
