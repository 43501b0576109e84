//! A ray against eight boxes. `unsafe` for loads and stores.

use core::arch::x86_64::*;

use super::RayVectors;
use crate::geometry::intersect::{Child, LaneMask, PlaneRow, Planes};

#[inline]
#[target_feature(enable = "avx2,fma")]
fn store8(lanes: &mut [f32; 8], values: __m256) {
    // SAFETY: a unique reference to eight f32; the store needs no alignment.
    unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), values) }
}

/// Loads a row of planes.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn row8(planes: &Planes<8>, row: PlaneRow) -> __m256 {
    // SAFETY: a row index is at most 5, and there are six rows.
    let row = unsafe { planes.as_ptr().add(row.index()) };
    // SAFETY: a row is eight f32; the load needs no alignment.
    unsafe { _mm256_loadu_ps(row.cast::<f32>()) }
}

/// Broadcasts each of the first three lanes. Not by `map`, whose closure would have target features and not inline.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn splat8(values: __m128) -> [__m256; 3] {
    [
        _mm256_broadcastss_ps(values),
        _mm256_broadcastss_ps(_mm_shuffle_ps::<0b01_01_01_01>(values, values)),
        _mm256_broadcastss_ps(_mm_shuffle_ps::<0b10_10_10_10>(values, values)),
    ]
}

/// A ray against eight boxes; planes are crossed by fused multiply-add.
#[derive(Clone, Copy)]
pub(crate) struct SlabRay8 {
    near: [PlaneRow; 3],
    scale: [__m256; 3],
    offset: [__m256; 3],
}

impl SlabRay8 {
    /// Precomputes the terms of a ray.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn new<const CALLER: u8>(ray: &RayVectors) -> Self {
        let offset = _mm_xor_ps(_mm_mul_ps(ray.origin, ray.inverse), _mm_set1_ps(-0.0));
        let inverse = RayVectors::lanes(ray.inverse);
        Self {
            near: PlaneRow::near(inverse),
            scale: splat8(ray.inverse),
            offset: splat8(offset),
        }
    }

    /// Parameters at which the ray enters and leaves each box.
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
        // Of two zeros the second is the maximum: no entry is −0.
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

    /// The boxes that the ray enters, and their spans.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<8>,
        t_max: f32,
    ) -> (LaneMask, BoxSpans8) {
        let (entry, exit) = self.spans(planes, t_max);
        let bits = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(entry, exit)) as u32;
        (LaneMask(bits), BoxSpans8 { entry, exit })
    }

    /// The boxes that the ray enters, one bit a lane.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn entered<const CALLER: u8>(&self, planes: &Planes<8>, t_max: f32) -> u32 {
        let (entry, exit) = self.spans(planes, t_max);
        _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(entry, exit)) as u32
    }
}

/// Parameters at which a ray enters and leaves eight boxes; the exit is first where it misses.
#[derive(Clone, Copy)]
pub(crate) struct BoxSpans8 {
    entry: __m256,
    exit: __m256,
}

/// The two boxes that a ray enters, the nearer first.
#[inline]
#[target_feature(enable = "avx2,fma")]
pub(crate) fn nearer_first<const CALLER: u8>(entered: LaneMask, spans: BoxSpans8) -> [Child; 2] {
    let mut entries = [0.0; 8];
    store8(&mut entries, spans.entry);
    let mut bits = [0; 8];
    for lane in 0..8 {
        bits[lane] = entries[lane].to_bits();
    }
    entered.pair(&bits)
}

/// 16-bit distance keys: the upper bits of the entry without its sign; the maximum for a box that the ray misses.
#[inline]
#[target_feature(enable = "avx2,fma")]
pub(crate) fn sort_keys<const CALLER: u8>(spans: BoxSpans8) -> __m128i {
    let missed = _mm256_cmp_ps::<_CMP_NLE_UQ>(spans.entry, spans.exit);
    let keys = _mm256_castps_si256(_mm256_or_ps(spans.entry, missed));
    let keys = _mm256_srli_epi32::<15>(keys);
    // Saturates to the maximum.
    _mm_packus_epi32(
        _mm256_castsi256_si128(keys),
        _mm256_extracti128_si256::<1>(keys),
    )
}

/// Removes the nearest box from the keys.
#[inline]
#[target_feature(enable = "avx2,fma")]
pub(crate) fn pop_nearest<const CALLER: u8>(keys: __m128i) -> (Child, __m128i) {
    // The smallest key, and its lane above it.
    let least = _mm_minpos_epu16(keys);
    let lane = _mm_shuffle_epi8(least, _mm_set1_epi16(0x0302));
    let removed = _mm_cmpeq_epi16(lane, _mm_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7));
    let found = _mm_cvtsi128_si32(least) as u32;
    let child = Child {
        lane: (found >> 16) as usize % 8,
        entry: (found & 0xffff) << 15,
    };
    (child, _mm_or_si128(keys, removed))
}
