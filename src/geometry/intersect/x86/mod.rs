//! x86-64: one ray against eight boxes with AVX2 and FMA, and against four triangles.
//!
//! `unsafe` because loads and stores take pointers. Every function is generic over `CALLER`, an index of its caller: a
//! function with target features inlines reliably only if it has a single caller.

mod boxes;
mod triangles;

pub(crate) use boxes::{SlabRay8, nearer_first, pop_nearest, sort_keys};
pub(crate) use triangles::ShearRay4;

use core::arch::x86_64::*;

use super::{RawRay, RayRange, SMALLEST_COMPONENT};

#[inline]
#[target_feature(enable = "avx2,fma")]
fn load4(lanes: &[f32; 4]) -> __m128 {
    // SAFETY: a reference to four f32; the load needs no alignment.
    unsafe { _mm_loadu_ps(lanes.as_ptr()) }
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn store4(lanes: &mut [f32; 4], values: __m128) {
    // SAFETY: a unique reference to four f32; the store needs no alignment.
    unsafe { _mm_storeu_ps(lanes.as_mut_ptr(), values) }
}

/// A ray in the first three lanes of registers.
#[derive(Clone, Copy)]
pub(crate) struct RayVectors {
    origin: __m128,
    direction: __m128,
    /// Reciprocal of the direction.
    inverse: __m128,
    /// Axis of the largest direction component, the first of equals.
    longest: usize,
}

impl RayVectors {
    /// Loads a ray; none if it is out of range.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn new<const CALLER: u8>(ray: RawRay<'_>, range: RayRange) -> Option<Self> {
        let [ox, oy, oz] = *ray.origin;
        let [dx, dy, dz] = *ray.direction;
        let origin = _mm_setr_ps(ox, oy, oz, 0.0);
        let direction = _mm_setr_ps(dx, dy, dz, 0.0);
        let sign = _mm_set1_ps(-0.0);
        let size = _mm_andnot_ps(sign, direction);
        // False for a NaN.
        let in_range = _mm_and_ps(
            _mm_cmple_ps(_mm_andnot_ps(sign, origin), _mm_set1_ps(range.reach)),
            _mm_cmple_ps(size, _mm_set1_ps(RayRange::LONGEST)),
        );
        let two = _mm_max_ps(size, _mm_shuffle_ps::<0b01_00_11_10>(size, size));
        let largest = _mm_max_ps(two, _mm_shuffle_ps::<0b10_11_00_01>(two, two));
        if _mm_movemask_ps(in_range) & 7 != 7 || _mm_cvtss_f32(largest) < RayRange::SHORTEST {
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

    /// The first three lanes.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn lanes(values: __m128) -> [f32; 3] {
        let mut lanes = [0.0; 4];
        store4(&mut lanes, values);
        [lanes[0], lanes[1], lanes[2]]
    }
}
