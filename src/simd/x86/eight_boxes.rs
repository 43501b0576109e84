//! A ray against eight boxes: AVX2 and FMA. `unsafe` for loads and stores.

use core::arch::x86_64::*;

use super::{Ready, splat4};
use crate::simd::tracing::{BitEach, Child, Planes, Row};

#[inline]
#[target_feature(enable = "avx2,fma")]
fn store8(lanes: &mut [f32; 8], values: __m256) {
    // SAFETY: a unique reference to eight f32; the store needs no alignment.
    unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), values) }
}

/// A row of planes.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn row8(planes: &Planes<8>, row: Row) -> __m256 {
    // SAFETY: a row's number is 5 at most, and there are six rows.
    let row = unsafe { planes.as_ptr().add(row.number()) };
    // SAFETY: a row is eight f32; the load needs no alignment.
    unsafe { _mm256_loadu_ps(row.cast::<f32>()) }
}

/// The same in eight lanes.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn splat8(values: __m128) -> [__m256; 3] {
    let [x, y, z] = splat4(values);
    [
        _mm256_broadcastss_ps(x),
        _mm256_broadcastss_ps(y),
        _mm256_broadcastss_ps(z),
    ]
}

/// A ray against eight boxes at once, fused.
#[derive(Clone, Copy)]
pub(crate) struct Slabs8 {
    near: [Row; 3],
    scale: [__m256; 3],
    offset: [__m256; 3],
}

impl Slabs8 {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn of<const CALLER: u8>(ray: &Ready) -> Self {
        let offset = _mm_xor_ps(_mm_mul_ps(ray.origin, ray.inverse), _mm_set1_ps(-0.0));
        let inverse = Ready::lanes(ray.inverse);
        Self {
            near: Row::near(inverse),
            scale: splat8(ray.inverse),
            offset: splat8(offset),
        }
    }

    /// Where the ray enters each box, and where it leaves it.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn spans(&self, planes: &Planes<8>, t_max: f32) -> (__m256, __m256) {
        let near = |axis: usize| {
            let plane = row8(planes, self.near[axis]);
            _mm256_fmadd_ps(plane, self.scale[axis], self.offset[axis])
        };
        let far = |axis: usize| {
            let plane = row8(planes, self.near[axis].opposite());
            _mm256_fmadd_ps(plane, self.scale[axis], self.offset[axis])
        };
        // Of two zeros the second counts, so no entry is −0.
        let zero = _mm256_setzero_ps();
        let entry = _mm256_max_ps(
            _mm256_max_ps(near(0), near(1)),
            _mm256_max_ps(near(2), zero),
        );
        let exit = _mm256_min_ps(
            _mm256_min_ps(far(0), far(1)),
            _mm256_min_ps(far(2), _mm256_set1_ps(t_max)),
        );
        (entry, exit)
    }

    /// Which boxes the ray enters, and where.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<8>,
        t_max: f32,
    ) -> (BitEach, Spans8) {
        let (entry, exit) = self.spans(planes, t_max);
        let bits = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(entry, exit)) as u32;
        (BitEach(bits), Spans8 { entry, exit })
    }

    /// Which boxes the ray enters, a bit each.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn entered<const CALLER: u8>(&self, planes: &Planes<8>, t_max: f32) -> u32 {
        let (entry, exit) = self.spans(planes, t_max);
        _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(entry, exit)) as u32
    }
}

/// Where a ray enters eight boxes and where it leaves them, before that if it does not enter.
#[derive(Clone, Copy)]
pub(crate) struct Spans8 {
    entry: __m256,
    exit: __m256,
}

/// The two boxes that a ray enters, the nearer first.
#[inline]
#[target_feature(enable = "avx2,fma")]
pub(crate) fn pair8<const CALLER: u8>(entered: BitEach, spans: Spans8) -> [Child; 2] {
    let mut entries = [0.0; 8];
    store8(&mut entries, spans.entry);
    entered.pair(&entries.map(f32::to_bits))
}

/// Keys of sixteen bits: the highest of where a box is entered but for the sign; the greatest for boxes that are not.
#[inline]
#[target_feature(enable = "avx2,fma")]
pub(crate) fn sort8<const CALLER: u8>(spans: Spans8) -> __m128i {
    let missed = _mm256_cmp_ps::<_CMP_NLE_UQ>(spans.entry, spans.exit);
    let keys = _mm256_castps_si256(_mm256_or_ps(spans.entry, missed));
    let keys = _mm256_srli_epi32::<15>(keys);
    // What is too large for sixteen bits becomes the greatest.
    _mm_packus_epi32(
        _mm256_castsi256_si128(keys),
        _mm256_extracti128_si256::<1>(keys),
    )
}

/// The nearest of eight boxes, and the keys of the others.
#[inline]
#[target_feature(enable = "avx2,fma")]
pub(crate) fn take8<const CALLER: u8>(keys: __m128i) -> (Child, __m128i) {
    // The least key, its lane above it.
    let least = _mm_minpos_epu16(keys);
    let lane = _mm_shuffle_epi8(least, _mm_set1_epi16(0x0302));
    let gone = _mm_cmpeq_epi16(lane, _mm_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7));
    let found = _mm_cvtsi128_si32(least) as u32;
    let child = Child {
        lane: (found >> 16) as usize % 8,
        entry: (found & 0xffff) << 15,
    };
    (child, _mm_or_si128(keys, gone))
}
