//! [`Lanes`] in one AVX2 register.
//!
//! `unsafe` because methods of a trait cannot have target features. They are inlined into functions that have them: only
//! [`kernel!`](macro@crate::simd::kernel) uses this type, with the proof that the machine has AVX2, FMA and F16C.

use core::arch::x86_64::*;

use crate::simd::f16x8::MAX;
use crate::simd::{F16x8, F32x8, Lanes};

/// Eight lanes.
#[derive(Clone, Copy)]
pub(crate) struct Ymm(__m256);

macro_rules! avx2 {
    ($call:expr) => {
        // SAFETY: loads and stores take references to eight numbers and need no alignment; beyond that the intrinsics need
        // only AVX2, FMA and F16C, and values of this type exist only in kernels entered with the proof of all three.
        unsafe { $call }
    };
}

impl Lanes for Ymm {
    type Doubles = super::Ymm64;

    #[inline(always)]
    fn from_array(lanes: F32x8) -> Self {
        Self::load(&lanes.0)
    }

    #[inline(always)]
    fn to_array(self) -> F32x8 {
        let mut lanes = F32x8::ZERO;
        self.store(&mut lanes.0);
        lanes
    }

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(avx2!(_mm256_set1_ps(value)))
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(avx2!(_mm256_add_ps(self.0, other.0)))
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(avx2!(_mm256_sub_ps(self.0, other.0)))
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(avx2!(_mm256_mul_ps(self.0, other.0)))
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(avx2!(_mm256_fmadd_ps(self.0, factor.0, term.0)))
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Self(avx2!(_mm256_fnmadd_ps(self.0, factor.0, term.0)))
    }

    #[inline(always)]
    fn load(lanes: &[f32; 8]) -> Self {
        Self(avx2!(_mm256_loadu_ps(lanes.as_ptr())))
    }

    #[inline(always)]
    fn store(self, lanes: &mut [f32; 8]) {
        avx2!(_mm256_storeu_ps(lanes.as_mut_ptr(), self.0));
    }

    #[inline(always)]
    fn from_halves(halves: &F16x8) -> Self {
        let bits = avx2!(_mm_loadu_si128(halves.0.as_ptr().cast()));
        Self(avx2!(_mm256_cvtph_ps(bits)))
    }

    #[inline(always)]
    fn to_halves(self) -> F16x8 {
        let (low, high) = (Self::splat(-MAX), Self::splat(MAX));
        let limited = avx2!(_mm256_max_ps(self.0, low.0));
        let limited = avx2!(_mm256_min_ps(limited, high.0));
        let bits = avx2!(_mm256_cvtps_ph::<_MM_FROUND_TO_NEAREST_INT>(limited));
        let mut halves = F16x8::ZERO;
        avx2!(_mm_storeu_si128(halves.0.as_mut_ptr().cast(), bits));
        halves
    }

    #[inline(always)]
    fn twice_low(self) -> Self {
        let indices = avx2!(_mm256_setr_epi32(0, 0, 1, 1, 2, 2, 3, 3));
        Self(avx2!(_mm256_permutevar8x32_ps(self.0, indices)))
    }

    #[inline(always)]
    fn twice_high(self) -> Self {
        let indices = avx2!(_mm256_setr_epi32(4, 4, 5, 5, 6, 6, 7, 7));
        Self(avx2!(_mm256_permutevar8x32_ps(self.0, indices)))
    }

    #[inline(always)]
    fn transpose(rows: [Self; 8]) -> [Self; 8] {
        let [a, b, c, d, e, f, g, h] = rows;
        // Pairs of rows, then groups of four: each half of a register holds one column of four rows.
        let (ab, ab_high) = (low(a, b), high(a, b));
        let (cd, cd_high) = (low(c, d), high(c, d));
        let (ef, ef_high) = (low(e, f), high(e, f));
        let (gh, gh_high) = (low(g, h), high(g, h));
        let (left_0, right_0) = (first(ab, cd), first(ef, gh));
        let (left_1, right_1) = (second(ab, cd), second(ef, gh));
        let (left_2, right_2) = (first(ab_high, cd_high), first(ef_high, gh_high));
        let (left_3, right_3) = (second(ab_high, cd_high), second(ef_high, gh_high));
        [
            lower_halves(left_0, right_0),
            lower_halves(left_1, right_1),
            lower_halves(left_2, right_2),
            lower_halves(left_3, right_3),
            upper_halves(left_0, right_0),
            upper_halves(left_1, right_1),
            upper_halves(left_2, right_2),
            upper_halves(left_3, right_3),
        ]
    }
}

/// Names functions of two registers.
macro_rules! of_two {
    ($($name:ident $intrinsic:path;)*) => {
        $(
            #[inline(always)]
            fn $name(a: Ymm, b: Ymm) -> Ymm {
                Ymm(avx2!($intrinsic(a.0, b.0)))
            }
        )*
    };
}

of_two! {
    low _mm256_unpacklo_ps;
    high _mm256_unpackhi_ps;
    first _mm256_shuffle_ps::<0x44>;
    second _mm256_shuffle_ps::<0xEE>;
    lower_halves _mm256_permute2f128_ps::<0x20>;
    upper_halves _mm256_permute2f128_ps::<0x31>;
}
