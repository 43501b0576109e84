//! A ray against four boxes: SSE2. `unsafe` for loads.

use core::arch::x86_64::*;

use super::{Ready, splat4, store4};
use crate::simd::tracing::{BitEach, Child, Planes, Row};

/// A row of planes.
#[inline]
#[target_feature(enable = "sse2")]
fn row4(planes: &Planes<4>, row: Row) -> __m128 {
    // SAFETY: a row's number is 5 at most, and there are six rows.
    let row = unsafe { planes.as_ptr().add(row.number()) };
    // SAFETY: a row is four f32; the load needs no alignment.
    unsafe { _mm_loadu_ps(row.cast::<f32>()) }
}

/// A ray against four boxes at once.
#[derive(Clone, Copy)]
pub(crate) struct Slabs4 {
    near: [Row; 3],
    scale: [__m128; 3],
    offset: [__m128; 3],
}

impl Slabs4 {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn of<const CALLER: u8>(ray: &Ready) -> Self {
        let offset = _mm_xor_ps(_mm_mul_ps(ray.origin, ray.inverse), _mm_set1_ps(-0.0));
        let inverse = Ready::lanes(ray.inverse);
        Self {
            near: Row::near(inverse),
            scale: splat4(ray.inverse),
            offset: splat4(offset),
        }
    }

    /// Where the ray enters each box, and which boxes it does enter.
    #[inline]
    #[target_feature(enable = "sse2")]
    fn spans(&self, planes: &Planes<4>, t_max: f32) -> (__m128, __m128) {
        let near = |axis: usize| {
            let plane = row4(planes, self.near[axis]);
            _mm_add_ps(_mm_mul_ps(plane, self.scale[axis]), self.offset[axis])
        };
        let far = |axis: usize| {
            let plane = row4(planes, self.near[axis].opposite());
            _mm_add_ps(_mm_mul_ps(plane, self.scale[axis]), self.offset[axis])
        };
        // Of two zeros the second counts, so no entry is −0.
        let zero = _mm_setzero_ps();
        let entry = _mm_max_ps(_mm_max_ps(near(0), near(1)), _mm_max_ps(near(2), zero));
        let exit = _mm_min_ps(
            _mm_min_ps(far(0), far(1)),
            _mm_min_ps(far(2), _mm_set1_ps(t_max)),
        );
        (entry, _mm_cmple_ps(entry, exit))
    }

    /// Which boxes the ray enters, and where.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<4>,
        t_max: f32,
    ) -> (BitEach, Spans4) {
        let (entry, entered) = self.spans(planes, t_max);
        let bits = _mm_movemask_ps(entered) as u32;
        (BitEach(bits), Spans4 { entry, entered })
    }

    /// Which boxes the ray enters, a bit each.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn entered<const CALLER: u8>(&self, planes: &Planes<4>, t_max: f32) -> u32 {
        _mm_movemask_ps(self.spans(planes, t_max).1) as u32
    }
}

/// Where a ray enters four boxes, and all bits of those it does enter.
#[derive(Clone, Copy)]
pub(crate) struct Spans4 {
    entry: __m128,
    entered: __m128,
}

/// The two boxes that a ray enters, the nearer first.
#[inline]
#[target_feature(enable = "sse2")]
pub(crate) fn pair4<const CALLER: u8>(entered: BitEach, spans: Spans4) -> [Child; 2] {
    let mut entries = [0.0; 4];
    store4(&mut entries, spans.entry);
    entered.pair(&entries.map(f32::to_bits))
}

/// Smallest normal number: keys of boxes are that far up, so that minima never take one for zero.
const KEYS_FROM: i32 = 1 << 23;

/// Keys that are compared as `f32`: the bits of where a box is entered, the lane in the lowest two, and [`KEYS_FROM`].
/// The greatest number for boxes that are not; nothing near enough for lanes is entered that far out.
#[inline]
#[target_feature(enable = "sse2")]
pub(crate) fn sort4<const CALLER: u8>(spans: Spans4) -> __m128 {
    let lanes = _mm_castsi128_ps(_mm_setr_epi32(0, 1, 2, 3));
    let rounded = _mm_andnot_ps(_mm_castsi128_ps(_mm_set1_epi32(3)), spans.entry);
    let key = _mm_castps_si128(_mm_or_ps(rounded, lanes));
    let key = _mm_castsi128_ps(_mm_add_epi32(key, _mm_set1_epi32(KEYS_FROM)));
    let none = _mm_set1_ps(f32::MAX);
    _mm_or_ps(
        _mm_and_ps(spans.entered, key),
        _mm_andnot_ps(spans.entered, none),
    )
}

/// The nearest of four boxes, and the keys of the others.
#[inline]
#[target_feature(enable = "sse2")]
pub(crate) fn take4<const CALLER: u8>(keys: __m128) -> (Child, __m128) {
    let two = _mm_min_ps(keys, _mm_shuffle_ps::<0b01_00_11_10>(keys, keys));
    let least = _mm_min_ps(two, _mm_shuffle_ps::<0b10_11_00_01>(two, two));
    let gone = _mm_and_ps(_mm_cmpeq_ps(keys, least), _mm_set1_ps(f32::MAX));
    let entry = _mm_cvtsi128_si32(_mm_castps_si128(least)).wrapping_sub(KEYS_FROM) as u32;
    let lane = entry as usize % 4;
    (Child { lane, entry }, _mm_max_ps(keys, gone))
}
