//! A ray against four triangles at once, with SSE2.
//!
//! `unsafe` because loads take pointers. Specification: [`crate::simd::tracing`], whose bits these are.

use core::arch::x86_64::*;

use super::{Limit, Ready, store4};
use crate::simd::tracing::{Corners, FAR_WIDENING, Met, NEAR_NARROWING, RawRay, TriangleRay};

/// Where rows of four begin, in bytes, of axes of which the longest is the last; once more for no axis, so that two bits are
/// a place. In memory, since registers are few in the walk.
static ROWS: [[usize; 3]; 4] = [[16, 32, 0], [32, 0, 16], [0, 16, 32], [0, 16, 32]];

/// A ray against four triangles at once.
#[derive(Clone, Copy)]
pub(crate) struct Shear4<'a> {
    ray: RawRay<'a>,
    ready: Ready,
    /// Where the axes' rows of four begin in a corner, in bytes.
    rows: &'static [usize; 3],
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
        let [x, y, z] = ready.axes();
        let origin = Ready::lanes(ready.origin);
        let direction = Ready::lanes(ready.direction);
        let inverse = Ready::lanes(ready.inverse)[z];
        Self {
            ray,
            ready: *ready,
            rows: &ROWS[ready.longest % 4],
            origin: [
                _mm_set1_ps(origin[x]),
                _mm_set1_ps(origin[y]),
                _mm_set1_ps(origin[z]),
            ],
            shear: [
                _mm_set1_ps(direction[x] * inverse),
                _mm_set1_ps(direction[y] * inverse),
                _mm_set1_ps(-inverse),
            ],
        }
    }

    /// A coordinate of a corner, by the axis that stands for it.
    #[inline]
    #[target_feature(enable = "sse2")]
    fn along(&self, corner: &[[f32; 4]; 3], k: usize) -> __m128 {
        // SAFETY: a corner's three rows begin at these places.
        let row = unsafe { corner.as_ptr().byte_add(self.rows[k]) };
        // SAFETY: a row is four f32; the load needs no alignment.
        unsafe { _mm_loadu_ps(row.cast::<f32>()) }
    }

    /// As [`TriangleRay::meet_four`], to the bit.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn meet<const CALLER: u8, L>(
        &self,
        corners: &Corners,
        limit: Limit<L>,
        at: &mut [f32; 4],
    ) -> Met<1> {
        let before = limit.t_max;
        let [sx, sy, sz] = self.shear;
        // All three turned about, which changes no sign of u, v and w and lets loads be operands.
        let sheared = |corner: &[[f32; 4]; 3]| {
            let z = _mm_sub_ps(self.origin[2], self.along(corner, 2));
            let x = _mm_sub_ps(self.origin[0], self.along(corner, 0));
            let y = _mm_sub_ps(self.origin[1], self.along(corner, 1));
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
        // Of two signs the product is negative. Nothing, or less than there are numbers for, may be an edge. Written so that
        // numbers that are none are outside.
        let signs = _mm_mul_ps(least, most);
        let inside = _mm_cmple_ps(zero, signs);
        let may_meet = _mm_movemask_ps(inside) as u64;
        if may_meet == 0 {
            return Met(0);
        }
        let within = _mm_cmplt_ps(zero, signs);
        let on_edge = may_meet & !(_mm_movemask_ps(within) as u64);
        if on_edge != 0 {
            let RawRay {
                origin,
                direction,
                t_min,
                margin,
            } = self.ray;
            return Self::meet_again(
                origin,
                direction,
                t_min,
                margin,
                corners,
                _mm_cvtss_f32(before),
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
            _mm_cmplt_ps(t, before),
        );
        let met = _mm_and_ps(within, in_time);
        if _mm_movemask_ps(met) == 0 {
            return Met(0);
        }
        let (near, far) = self.spans(corners);
        let t = _mm_max_ps(near, t);
        let in_box = _mm_and_ps(_mm_cmple_ps(near, far), _mm_cmple_ps(zero, far));
        let in_time = _mm_cmplt_ps(t, before);
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
        let span = |k: usize| {
            let (a, b, c) = (self.along(a, k), self.along(b, k), self.along(c, k));
            let lower = _mm_sub_ps(_mm_min_ps(_mm_min_ps(a, b), c), margin);
            let upper = _mm_add_ps(_mm_max_ps(_mm_max_ps(a, b), c), margin);
            let origin = self.origin[k];
            let inverse = _mm_set1_ps(inverse[self.rows[k] / 16 % 4]);
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
    #[expect(clippy::too_many_arguments, reason = "a ray's parts by themselves")]
    fn meet_again(
        origin: &[f32; 3],
        direction: &[f32; 3],
        t_min: f32,
        margin: f32,
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
