//! Kernels of ray tracing for x86-64: SSE2 everywhere, AVX2 with FMA where [`Avx2::detect`] finds it.
//!
//! `unsafe` for two reasons: loads take pointers, and a function that carries a target feature must be entered from
//! one that does not ([`enter_sse2`], [`enter_avx2`], [`enter_avx512`]). Specification: [`super::tracing`]. Triangles give
//! its bits; boxes may be entered where it does not enter them, never the other way round. Kernels are generic over a
//! number for their caller, so that each has one caller and becomes part of it; of a shared one the compiler makes a call.

mod lanes;
mod prefetch;
mod triangles;

pub(crate) use lanes::{Ymm, Zmm};
pub(crate) use prefetch::prefetch;
pub(crate) use triangles::Shear4;

use core::arch::x86_64::*;

use super::tracing::{Axes, BitEach, Child, Near, Planes, RawRay, Row, SMALLEST_COMPONENT};

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

/// Where a row of planes of `W` boxes begins, in bytes: numbers of rows would be multiplied for every node.
#[derive(Clone, Copy)]
struct Place<const W: usize>(usize);

impl<const W: usize> Place<W> {
    #[inline(always)]
    fn of(row: Row) -> Self {
        Self(row.number() * size_of::<[f32; W]>())
    }
}

/// A row of planes.
#[inline]
#[target_feature(enable = "sse2")]
fn row4(planes: &Planes<4>, row: Place<4>) -> __m128 {
    // SAFETY: a row's number is 5 at most, and there are six rows.
    let row = unsafe { planes.as_ptr().byte_add(row.0) };
    // SAFETY: a row is four f32; the load needs no alignment.
    unsafe { _mm_loadu_ps(row.cast::<f32>()) }
}

/// A row of planes.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn row8(planes: &Planes<8>, row: Place<8>) -> __m256 {
    // SAFETY: a row's number is 5 at most, and there are six rows.
    let row = unsafe { planes.as_ptr().byte_add(row.0) };
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

    /// The axes in turn, the longest the last.
    #[inline(always)]
    fn axes(&self) -> [usize; 3] {
        let [x, y, z] = Axes::ending_at(self.longest).numbers();
        [x % 4, y % 4, z % 4]
    }

    /// Whether the ray runs downwards along its longest axis.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn runs_down(&self) -> bool {
        _mm_movemask_ps(self.direction) >> self.longest & 1 == 1
    }

    /// Lanes as numbers.
    #[inline]
    #[target_feature(enable = "sse2")]
    fn lanes(values: __m128) -> [f32; 4] {
        let mut lanes = [0.0; 4];
        store4(&mut lanes, values);
        lanes
    }
}

/// How a ray runs through boxes, in coordinates of its longest axis ([`super::tracing::SlabRay`]).
struct Course {
    /// The rows it crosses first and last, of the shorter axes, then of the longest.
    rows: [Row; 6],
    /// Of the shorter axes.
    scale: [f32; 2],
    offset: [f32; 2],
    /// Where it starts, and how far it goes while the parameter grows by one.
    start: f32,
    pace: f32,
}

impl Course {
    /// Of a ray that runs downwards along its longest axis, or does not.
    #[inline]
    #[target_feature(enable = "sse2")]
    fn of<const CALLER: u8, const DOWN: bool>(ray: &Ready) -> Self {
        let [x, y, z] = ray.axes();
        let (origin, inverse) = (Ready::lanes(ray.origin), Ready::lanes(ray.inverse));
        let (start, pace) = (origin[z], Ready::lanes(ray.direction)[z]);
        let scale = [pace * inverse[x], pace * inverse[y]];
        let offset = [start - origin[x] * scale[0], start - origin[y] * scale[1]];
        let down = |axis: usize| inverse[axis].is_sign_negative();
        let axes = Axes::ending_at(ray.longest);
        let [x_row, y_row, z_row] = axes.first_rows([down(x), down(y), DOWN]);
        Self {
            rows: [
                x_row,
                x_row.opposite(),
                y_row,
                y_row.opposite(),
                z_row,
                z_row.opposite(),
            ],
            scale,
            offset,
            start,
            pace,
        }
    }

    /// Where a parameter is on the axis, and what no entry before it is beyond.
    #[inline(always)]
    fn limit(start: f32, pace: f32, t_max: f32) -> (f32, u32) {
        let way = t_max * pace;
        (start + way, Child::bound(way.abs()))
    }
}

/// A parameter, and where it is on a ray's longest axis, in all lanes.
#[derive(Clone, Copy)]
pub(crate) struct Limit<L> {
    t_max: __m128,
    place: L,
}

/// What comes later along a ray.
#[inline]
#[target_feature(enable = "sse2")]
fn later4<const DOWN: bool>(a: __m128, b: __m128) -> __m128 {
    if DOWN {
        _mm_min_ps(a, b)
    } else {
        _mm_max_ps(a, b)
    }
}

/// What comes sooner along a ray.
#[inline]
#[target_feature(enable = "sse2")]
fn sooner4<const DOWN: bool>(a: __m128, b: __m128) -> __m128 {
    if DOWN {
        _mm_max_ps(a, b)
    } else {
        _mm_min_ps(a, b)
    }
}

/// A ray against four boxes at once.
#[derive(Clone, Copy)]
pub(crate) struct Slabs4<const DOWN: bool> {
    /// Of the shorter axes the nearer and the farther, then those of the longest.
    rows: [Place<4>; 6],
    scale: [__m128; 2],
    offset: [__m128; 2],
    start: __m128,
    /// As [`Course`] has them.
    line: [f32; 2],
}

impl<const DOWN: bool> Slabs4<DOWN> {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn of<const CALLER: u8>(ray: &Ready) -> Self {
        let course = Course::of::<CALLER, DOWN>(ray);
        let [sx, sy] = course.scale;
        let [ox, oy] = course.offset;
        Self {
            rows: course.rows.map(Place::of),
            scale: [_mm_set1_ps(sx), _mm_set1_ps(sy)],
            offset: [_mm_set1_ps(ox), _mm_set1_ps(oy)],
            start: _mm_set1_ps(course.start),
            line: [course.start, course.pace],
        }
    }

    /// A parameter for lanes, and what no entry before it is beyond.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn limit<const CALLER: u8>(&self, t_max: f32) -> (Limit<__m128>, u32) {
        let [start, pace] = self.line;
        let (place, bound) = Course::limit(start, pace, t_max);
        let limit = Limit {
            t_max: _mm_set1_ps(t_max),
            place: _mm_set1_ps(place),
        };
        (limit, bound)
    }

    /// Where the ray enters each box, and which boxes it does enter.
    #[inline]
    #[target_feature(enable = "sse2")]
    fn spans(&self, planes: &Planes<4>, limit: __m128) -> (__m128, __m128) {
        let at = |k: usize, row: Place<4>| {
            let plane = row4(planes, row);
            _mm_add_ps(_mm_mul_ps(plane, self.scale[k]), self.offset[k])
        };
        let [x, far_x, y, far_y, z, far_z] = self.rows;
        let entry = later4::<DOWN>(
            later4::<DOWN>(at(0, x), at(1, y)),
            later4::<DOWN>(row4(planes, z), self.start),
        );
        let exit = sooner4::<DOWN>(
            sooner4::<DOWN>(at(0, far_x), at(1, far_y)),
            sooner4::<DOWN>(row4(planes, far_z), limit),
        );
        let entered = if DOWN {
            _mm_cmple_ps(exit, entry)
        } else {
            _mm_cmple_ps(entry, exit)
        };
        (entry, entered)
    }

    /// How far off the ray enters. No difference of equals is −0.
    #[inline]
    #[target_feature(enable = "sse2")]
    fn way(&self, entry: __m128) -> __m128 {
        if DOWN {
            _mm_sub_ps(self.start, entry)
        } else {
            _mm_sub_ps(entry, self.start)
        }
    }

    /// Which boxes the ray enters, and where.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<4>,
        limit: Limit<__m128>,
    ) -> (BitEach, Spans4) {
        let (entry, entered) = self.spans(planes, limit.place);
        let bits = _mm_movemask_ps(entered) as u32;
        (BitEach(bits), Spans4 { entry, entered })
    }

    /// Which boxes the ray enters, a bit each.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn entered<const CALLER: u8>(
        &self,
        planes: &Planes<4>,
        limit: Limit<__m128>,
    ) -> u32 {
        _mm_movemask_ps(self.spans(planes, limit.place).1) as u32
    }

    /// The two boxes that the ray enters, the nearer first.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn pair<const CALLER: u8>(&self, entered: BitEach, spans: Spans4) -> [Child; 2] {
        let mut ways = [0.0; 4];
        store4(&mut ways, self.way(spans.entry));
        entered.pair(&ways.map(f32::to_bits))
    }

    /// Keys of boxes, from which [`take4`] takes the nearest.
    #[inline]
    #[target_feature(enable = "sse2")]
    pub(crate) fn sort<const CALLER: u8>(&self, spans: Spans4) -> __m128 {
        keys4(self.way(spans.entry), spans.entered)
    }
}

/// Where a ray enters four boxes, and all bits of those it does enter.
#[derive(Clone, Copy)]
pub(crate) struct Spans4 {
    entry: __m128,
    entered: __m128,
}

/// Smallest normal number: keys of boxes are that far up, so that minima never take one for zero.
const KEYS_FROM: i32 = 1 << 23;

/// Keys that are compared as `f32`: the bits of how far off a box is entered, the lane in the lowest two, and [`KEYS_FROM`].
/// The greatest number for boxes that are not; nothing near enough for lanes is entered that far out.
#[inline]
#[target_feature(enable = "sse2")]
fn keys4(way: __m128, entered: __m128) -> __m128 {
    let lanes = _mm_castsi128_ps(_mm_setr_epi32(0, 1, 2, 3));
    let rounded = _mm_andnot_ps(_mm_castsi128_ps(_mm_set1_epi32(3)), way);
    let key = _mm_castps_si128(_mm_or_ps(rounded, lanes));
    let key = _mm_castsi128_ps(_mm_add_epi32(key, _mm_set1_epi32(KEYS_FROM)));
    let none = _mm_set1_ps(f32::MAX);
    _mm_or_ps(_mm_and_ps(entered, key), _mm_andnot_ps(entered, none))
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

/// What comes later along a ray.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn later8<const DOWN: bool>(a: __m256, b: __m256) -> __m256 {
    if DOWN {
        _mm256_min_ps(a, b)
    } else {
        _mm256_max_ps(a, b)
    }
}

/// What comes sooner along a ray.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn sooner8<const DOWN: bool>(a: __m256, b: __m256) -> __m256 {
    if DOWN {
        _mm256_max_ps(a, b)
    } else {
        _mm256_min_ps(a, b)
    }
}

/// A ray against eight boxes at once, fused.
#[derive(Clone, Copy)]
pub(crate) struct Slabs8<const DOWN: bool> {
    /// Of the shorter axes the nearer and the farther, then those of the longest.
    rows: [Place<8>; 6],
    scale: [__m256; 2],
    offset: [__m256; 2],
    start: __m256,
    /// As [`Course`] has them.
    line: [f32; 2],
}

impl<const DOWN: bool> Slabs8<DOWN> {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn of<const CALLER: u8>(ray: &Ready) -> Self {
        let course = Course::of::<CALLER, DOWN>(ray);
        let [sx, sy] = course.scale;
        let [ox, oy] = course.offset;
        Self {
            rows: course.rows.map(Place::of),
            scale: [_mm256_set1_ps(sx), _mm256_set1_ps(sy)],
            offset: [_mm256_set1_ps(ox), _mm256_set1_ps(oy)],
            start: _mm256_set1_ps(course.start),
            line: [course.start, course.pace],
        }
    }

    /// A parameter for lanes, and what no entry before it is beyond.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn limit<const CALLER: u8>(&self, t_max: f32) -> (Limit<__m256>, u32) {
        let [start, pace] = self.line;
        let (place, bound) = Course::limit(start, pace, t_max);
        let limit = Limit {
            t_max: _mm_set1_ps(t_max),
            place: _mm256_set1_ps(place),
        };
        (limit, bound)
    }

    /// Where the ray enters each box, and where it leaves it.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn spans(&self, planes: &Planes<8>, limit: __m256) -> (__m256, __m256) {
        let at = |k: usize, row: Place<8>| {
            _mm256_fmadd_ps(row8(planes, row), self.scale[k], self.offset[k])
        };
        let [x, far_x, y, far_y, z, far_z] = self.rows;
        let entry = later8::<DOWN>(
            later8::<DOWN>(at(0, x), at(1, y)),
            later8::<DOWN>(self.start, row8(planes, z)),
        );
        let exit = sooner8::<DOWN>(
            sooner8::<DOWN>(at(0, far_x), at(1, far_y)),
            sooner8::<DOWN>(limit, row8(planes, far_z)),
        );
        (entry, exit)
    }

    /// The lanes of boxes that the ray enters.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn bits((entry, exit): (__m256, __m256)) -> u32 {
        let entered = if DOWN {
            _mm256_cmp_ps::<_CMP_GE_OQ>(entry, exit)
        } else {
            _mm256_cmp_ps::<_CMP_LE_OQ>(entry, exit)
        };
        _mm256_movemask_ps(entered) as u32
    }

    /// How far off the ray enters. No difference of equals is −0.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn way(&self, entry: __m256) -> __m256 {
        if DOWN {
            _mm256_sub_ps(self.start, entry)
        } else {
            _mm256_sub_ps(entry, self.start)
        }
    }

    /// Which boxes the ray enters, and where.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<8>,
        limit: Limit<__m256>,
    ) -> (BitEach, Spans8) {
        let (entry, exit) = self.spans(planes, limit.place);
        (BitEach(Self::bits((entry, exit))), Spans8 { entry, exit })
    }

    /// Which boxes the ray enters, a bit each.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn entered<const CALLER: u8>(
        &self,
        planes: &Planes<8>,
        limit: Limit<__m256>,
    ) -> u32 {
        Self::bits(self.spans(planes, limit.place))
    }

    /// The two boxes that the ray enters, the nearer first.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn pair<const CALLER: u8>(&self, entered: BitEach, spans: Spans8) -> [Child; 2] {
        let mut ways = [0.0; 8];
        store8(&mut ways, self.way(spans.entry));
        entered.pair(&ways.map(f32::to_bits))
    }

    /// Keys of sixteen bits: the highest of how far off a box is entered but for the sign; the greatest for boxes that are
    /// not.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    pub(crate) fn sort<const CALLER: u8>(&self, spans: Spans8) -> __m128i {
        let missed = if DOWN {
            _mm256_cmp_ps::<_CMP_NGE_UQ>(spans.entry, spans.exit)
        } else {
            _mm256_cmp_ps::<_CMP_NLE_UQ>(spans.entry, spans.exit)
        };
        let keys = _mm256_castps_si256(_mm256_or_ps(self.way(spans.entry), missed));
        let keys = _mm256_srli_epi32::<15>(keys);
        // What is too large for sixteen bits becomes the greatest.
        _mm_packus_epi32(
            _mm256_castsi256_si128(keys),
            _mm256_extracti128_si256::<1>(keys),
        )
    }
}

/// Where a ray enters eight boxes and where it leaves them, sooner than that if it does not enter.
#[derive(Clone, Copy)]
pub(crate) struct Spans8 {
    entry: __m256,
    exit: __m256,
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
