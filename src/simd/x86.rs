//! Kernels of ray tracing for x86-64: SSE2 everywhere, AVX2 with FMA where [`Avx2::detect`] finds it.
//!
//! `unsafe` for two reasons: loads take pointers, and a function that carries a target feature must be entered from
//! one that does not ([`enter_sse2`], [`enter_avx2`], [`enter_avx512`]). Specification: [`super::tracing`]. Triangles give
//! its bits; boxes may be entered where it does not enter them, never the other way round. Kernels are generic over a
//! number for their caller, so that each has one caller and becomes part of it; of a shared one the compiler makes a call.

mod lanes;
mod prefetch;

pub(crate) use lanes::{Ymm, Zmm};
pub(crate) use prefetch::prefetch;

use core::arch::x86_64::*;

use super::tracing::{
    Axes, BitEach, Child, Corners, FAR_WIDENING, Met, NEAR_NARROWING, Near, Planes, RawRay, Row,
    SMALLEST_COMPONENT, TriangleRay,
};

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

#[inline]
#[target_feature(enable = "avx2,fma")]
fn store8(lanes: &mut [f32; 8], values: __m256) {
    // SAFETY: a unique reference to eight f32; the store needs no alignment.
    unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), values) }
}

/// A row of planes.
#[inline]
#[target_feature(enable = "sse2")]
fn row4(planes: &Planes<4>, row: Row) -> __m128 {
    // SAFETY: a row's number is 5 at most, and there are six rows.
    let row = unsafe { planes.as_ptr().add(row.number()) };
    // SAFETY: a row is four f32; the load needs no alignment.
    unsafe { _mm_loadu_ps(row.cast::<f32>()) }
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
