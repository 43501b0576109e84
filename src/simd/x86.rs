//! Kernels of ray tracing for x86-64: SSE2 everywhere, AVX2 with FMA where [`Avx2::detect`] finds it.
//!
//! `unsafe` for two reasons: loads take pointers, and a function that carries a target feature must be entered from
//! one that does not ([`enter_sse2`], [`enter_avx2`]). Specification: [`super::tracing`]. Triangles give its bits; boxes
//! may be entered where it does not enter them, never the other way round. Kernels are generic over a
//! number for their caller, so that each has one caller and becomes part of it; of a shared one the compiler makes a call.

mod lanes;

pub(crate) use lanes::Ymm;

use core::arch::x86_64::*;

use super::tracing::{Corners, Planes, ShearRay, SlabRay};

/// Proof that the machine has AVX2 and FMA.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx2(());

impl Avx2 {
    /// The proof, if it holds.
    pub(crate) fn detect() -> Option<Self> {
        let found = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        found.then_some(Self(()))
    }
}

/// Calls a safe function that carries the feature `sse2`, which every x86-64 has.
macro_rules! enter_sse2 {
    ($function:ident($($argument:expr),*)) => {
        // SAFETY: the function is safe but for its feature, and SSE2 is part of x86-64.
        unsafe { $function($($argument),*) }
    };
}

/// Calls a safe function that carries the features `avx2,fma`, against the proof that the machine has them.
macro_rules! enter_avx2 {
    ($proof:expr => $function:ident($($argument:expr),*)) => {{
        let _: $crate::simd::x86::Avx2 = $proof;
        // SAFETY: the function is safe but for its features, and a proof exists only where detection found them.
        unsafe { $function($($argument),*) }
    }};
}

pub(crate) use {enter_avx2, enter_sse2};

#[inline]
#[target_feature(enable = "sse2")]
fn load4(lanes: &[f32; 4]) -> __m128 {
    // SAFETY: a reference to four f32; the load needs no alignment.
    unsafe { _mm_loadu_ps(lanes.as_ptr()) }
}

#[inline]
#[target_feature(enable = "sse2")]
fn store4(lanes: &mut [f32; 4], values: __m128) {
    // SAFETY: a unique reference to four f32; the store needs no alignment.
    unsafe { _mm_storeu_ps(lanes.as_mut_ptr(), values) }
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn load8(lanes: &[f32; 8]) -> __m256 {
    // SAFETY: a reference to eight f32; the load needs no alignment.
    unsafe { _mm256_loadu_ps(lanes.as_ptr()) }
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn store8(lanes: &mut [f32; 8], values: __m256) {
    // SAFETY: a unique reference to eight f32; the store needs no alignment.
    unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), values) }
}

/// A ray against four boxes at once.
#[derive(Clone, Copy)]
pub(crate) struct Slabs4<'a> {
    ray: &'a SlabRay,
    origin: [__m128; 3],
    near_scale: [__m128; 3],
    far_scale: [__m128; 3],
}

impl<'a> Slabs4<'a> {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn of<const CALLER: u8>(ray: &'a SlabRay) -> Self {
        let splat = |v: [f32; 3]| [_mm_set1_ps(v[0]), _mm_set1_ps(v[1]), _mm_set1_ps(v[2])];
        Self {
            ray,
            origin: splat(ray.origin),
            near_scale: splat(ray.near_scale),
            far_scale: splat(ray.far_scale),
        }
    }

    /// As [`SlabRay::enter`], to the bit.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<4>,
        t_max: f32,
        entries: &mut [f32; 4],
    ) -> u32 {
        let near = |axis: usize| {
            let plane = load4(&planes[self.ray.near_row(axis)]);
            _mm_mul_ps(_mm_sub_ps(plane, self.origin[axis]), self.near_scale[axis])
        };
        let far = |axis: usize| {
            let plane = load4(&planes[self.ray.far_row(axis)]);
            _mm_mul_ps(_mm_sub_ps(plane, self.origin[axis]), self.far_scale[axis])
        };
        // Of two zeros the second counts, so no entry is −0.
        let zero = _mm_setzero_ps();
        let entry = _mm_max_ps(_mm_max_ps(_mm_max_ps(near(0), near(1)), near(2)), zero);
        let exit = _mm_min_ps(
            _mm_min_ps(far(0), far(1)),
            _mm_min_ps(far(2), _mm_set1_ps(t_max)),
        );
        store4(entries, entry);
        _mm_movemask_ps(_mm_cmple_ps(entry, exit)) as u32
    }
}

/// A ray against eight boxes at once, fused ([`FUSED_SLACK`](super::tracing::FUSED_SLACK)).
#[derive(Clone, Copy)]
pub(crate) struct Slabs8<'a> {
    ray: &'a SlabRay,
    near_scale: [__m256; 3],
    near_offset: [__m256; 3],
    far_scale: [__m256; 3],
    far_offset: [__m256; 3],
}

impl<'a> Slabs8<'a> {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn of<const CALLER: u8>(ray: &'a SlabRay) -> Self {
        let fused = ray.fused();
        let splat = |v: [f32; 3]| {
            [
                _mm256_set1_ps(v[0]),
                _mm256_set1_ps(v[1]),
                _mm256_set1_ps(v[2]),
            ]
        };
        Self {
            ray,
            near_scale: splat(fused.near_scale),
            near_offset: splat(fused.near_offset),
            far_scale: splat(fused.far_scale),
            far_offset: splat(fused.far_offset),
        }
    }

    /// As [`SlabRay::enter`], but for boxes that the ray misses by a rounding, which it may enter here.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<8>,
        t_max: f32,
        entries: &mut [f32; 8],
    ) -> u32 {
        let near = |axis: usize| {
            let plane = load8(&planes[self.ray.near_row(axis)]);
            _mm256_fmadd_ps(plane, self.near_scale[axis], self.near_offset[axis])
        };
        let far = |axis: usize| {
            let plane = load8(&planes[self.ray.far_row(axis)]);
            _mm256_fmadd_ps(plane, self.far_scale[axis], self.far_offset[axis])
        };
        // Of two zeros the second counts, so no entry is −0.
        let zero = _mm256_setzero_ps();
        let nearest = _mm256_max_ps(_mm256_max_ps(near(0), near(1)), near(2));
        let entry = _mm256_max_ps(nearest, zero);
        let exit = _mm256_min_ps(
            _mm256_min_ps(far(0), far(1)),
            _mm256_min_ps(far(2), _mm256_set1_ps(t_max)),
        );
        store8(entries, entry);
        _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(entry, exit)) as u32
    }
}

/// A ray against four triangles at once.
#[derive(Clone, Copy)]
pub(crate) struct Shear4<'a> {
    ray: &'a ShearRay,
    /// Axes again, known to be three.
    axis: [usize; 3],
    origin: [__m128; 3],
    shear: [__m128; 3],
    t_min: __m128,
}

impl<'a> Shear4<'a> {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn of<const CALLER: u8>(ray: &'a ShearRay) -> Self {
        let [x, y, z] = ray.axis;
        let axis = [x.min(2), y.min(2), z.min(2)];
        let origin = [
            ray.origin[axis[0]],
            ray.origin[axis[1]],
            ray.origin[axis[2]],
        ];
        let splat = |v: [f32; 3]| [_mm_set1_ps(v[0]), _mm_set1_ps(v[1]), _mm_set1_ps(v[2])];
        Self {
            ray,
            axis,
            origin: splat(origin),
            shear: splat(ray.shear),
            t_min: _mm_set1_ps(ray.t_min),
        }
    }

    /// As [`ShearRay::meet_four`], to the bit.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn meet<const CALLER: u8>(
        &self,
        corners: &Corners,
        t_max: f32,
        at: &mut [f32; 4],
    ) -> u32 {
        let [kx, ky, kz] = self.axis;
        let [sx, sy, sz] = self.shear;
        let sheared = |corner: &[[f32; 4]; 3]| {
            let z = _mm_sub_ps(load4(&corner[kz]), self.origin[2]);
            let x = _mm_sub_ps(load4(&corner[kx]), self.origin[0]);
            let y = _mm_sub_ps(load4(&corner[ky]), self.origin[1]);
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
        let outside = _mm_and_ps(_mm_cmplt_ps(least, zero), _mm_cmpgt_ps(most, zero));
        if _mm_movemask_ps(outside) == 0b1111 {
            return 0;
        }
        let on_edge = _mm_or_ps(
            _mm_cmpeq_ps(u, zero),
            _mm_or_ps(_mm_cmpeq_ps(v, zero), _mm_cmpeq_ps(w, zero)),
        );
        let again = _mm_movemask_ps(_mm_andnot_ps(outside, on_edge)) as u32;
        let determinant = _mm_add_ps(_mm_add_ps(u, v), w);
        let depth = _mm_add_ps(
            _mm_add_ps(
                _mm_mul_ps(u, _mm_mul_ps(sz, az)),
                _mm_mul_ps(v, _mm_mul_ps(sz, bz)),
            ),
            _mm_mul_ps(w, _mm_mul_ps(sz, cz)),
        );
        let t = _mm_div_ps(depth, determinant);
        let within = _mm_and_ps(
            _mm_cmpgt_ps(t, self.t_min),
            _mm_cmple_ps(t, _mm_set1_ps(t_max)),
        );
        let inside = _mm_andnot_ps(outside, within);
        let met = _mm_andnot_ps(_mm_cmpeq_ps(determinant, zero), inside);
        store4(at, t);
        let met = _mm_movemask_ps(met) as u32;
        if again == 0 {
            return met;
        }
        self.ray.meet_again(corners, t_max, at, met, again)
    }
}
