//! Kernels of ray tracing for x86-64: SSE2 everywhere, AVX2 with FMA where [`Avx2::detect`] finds it.
//!
//! `unsafe` for two reasons: loads take pointers, and a function that carries a target feature must be entered from
//! one that does not ([`enter_sse2`], [`enter_avx2`], [`enter_avx512`]). Specification: [`super::tracing`]. Triangles give
//! its bits; boxes may be entered where it does not enter them, never the other way round. Kernels are generic over a
//! number for their caller, so that each has one caller and becomes part of it; of a shared one the compiler makes a call.

mod eight_boxes;
mod four_boxes;
mod lanes;
mod prefetch;
mod triangles;

pub(crate) use eight_boxes::{Slabs8, pair8, sort8, take8};
pub(crate) use four_boxes::{Slabs4, pair4, sort4, take4};
pub(crate) use lanes::{Ymm, Zmm};
pub(crate) use prefetch::prefetch;
pub(crate) use triangles::Shear4;

use core::arch::x86_64::*;

use super::tracing::{Near, RawRay, SMALLEST_COMPONENT};

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

/// Proof that the machine has AVX-512 for registers of eight lanes too, besides AVX2 and FMA.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx512(());

impl Avx512 {
    /// The proof, if it holds.
    pub(crate) fn detect() -> Option<Self> {
        let found = is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl");
        (found && Avx2::detect().is_some()).then_some(Self(()))
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

/// Calls a safe function that carries the features `avx2,fma,avx512f,avx512vl`, against the proof that the machine has them.
macro_rules! enter_avx512 {
    ($proof:expr => $function:ident($($argument:expr),*)) => {{
        let _: $crate::simd::x86::Avx512 = $proof;
        // SAFETY: the function is safe but for its features, and a proof exists only where detection found them.
        unsafe { $function($($argument),*) }
    }};
}

pub(crate) use {enter_avx2, enter_avx512, enter_sse2};

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

/// A ray in the first three lanes: where it starts and one over its direction.
#[derive(Clone, Copy)]
pub(crate) struct Ready {
    origin: __m128,
    direction: __m128,
    inverse: __m128,
    /// Axis of the largest component of the direction, the first of equals.
    longest: usize,
}

impl Ready {
    /// Of a ray that is near.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn of<const CALLER: u8>(ray: RawRay<'_>, near: Near) -> Option<Self> {
        let [ox, oy, oz] = *ray.origin;
        let [dx, dy, dz] = *ray.direction;
        let origin = _mm_setr_ps(ox, oy, oz, 0.0);
        let direction = _mm_setr_ps(dx, dy, dz, 0.0);
        let sign = _mm_set1_ps(-0.0);
        let size = _mm_andnot_ps(sign, direction);
        // Written so that numbers that are none are not near.
        let is_near = _mm_and_ps(
            _mm_cmple_ps(_mm_andnot_ps(sign, origin), _mm_set1_ps(near.reach)),
            _mm_cmple_ps(size, _mm_set1_ps(Near::LONGEST)),
        );
        let two = _mm_max_ps(size, _mm_shuffle_ps::<0b01_00_11_10>(size, size));
        let largest = _mm_max_ps(two, _mm_shuffle_ps::<0b10_11_00_01>(two, two));
        if _mm_movemask_ps(is_near) & 7 != 7 || _mm_cvtss_f32(largest) < Near::SHORTEST {
            return None;
        }
        let smallest = _mm_mul_ps(largest, _mm_set1_ps(SMALLEST_COMPONENT));
        let bounded = _mm_or_ps(_mm_max_ps(size, smallest), _mm_and_ps(sign, direction));
        let is_longest = _mm_movemask_ps(_mm_cmpeq_ps(size, largest)) as u32;
        Some(Self {
            origin,
            direction,
            inverse: _mm_div_ps(_mm_set1_ps(1.0), bounded),
            longest: is_longest.trailing_zeros() as usize,
        })
    }

    /// Lanes as numbers.
    #[inline]
    #[target_feature(enable = "sse2")]
    fn lanes(values: __m128) -> [f32; 3] {
        let mut lanes = [0.0; 4];
        store4(&mut lanes, values);
        [lanes[0], lanes[1], lanes[2]]
    }
}

/// Each of the first three lanes in all lanes. Not by `map`: it has no features, and a closure that has them becomes a
/// call in it.
#[inline]
#[target_feature(enable = "sse2")]
fn splat4(values: __m128) -> [__m128; 3] {
    [
        _mm_shuffle_ps::<0b00_00_00_00>(values, values),
        _mm_shuffle_ps::<0b01_01_01_01>(values, values),
        _mm_shuffle_ps::<0b10_10_10_10>(values, values),
    ]
}
