//! [`Doubles`] in one AVX2 register.
//!
//! `unsafe` because methods of a trait cannot have target features. They are inlined into functions that have them: only
//! [`kernel!`](macro@crate::simd::kernel) uses this type, with the proof that the machine has AVX2 and FMA.

use core::arch::x86_64::*;

use crate::simd::Doubles;

/// Four lanes.
#[derive(Clone, Copy)]
pub(crate) struct Ymm64(__m256d);

macro_rules! avx2 {
    ($call:expr) => {
        // SAFETY: loads and stores take references to four f64 and need no alignment; beyond that the intrinsics need
        // only AVX2 and FMA, and values of this type exist only in kernels entered with the proof of it.
        unsafe { $call }
    };
}

/// Names methods of two registers.
macro_rules! of_two {
    ($($name:ident $intrinsic:path;)*) => {
        $(
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(avx2!($intrinsic(self.0, other.0)))
            }
        )*
    };
}

impl Doubles for Ymm64 {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(avx2!(_mm256_set1_pd(value)))
    }

    #[inline(always)]
    fn load(lanes: &[f64; 4]) -> Self {
        Self(avx2!(_mm256_loadu_pd(lanes.as_ptr())))
    }

    #[inline(always)]
    fn store(self, lanes: &mut [f64; 4]) {
        avx2!(_mm256_storeu_pd(lanes.as_mut_ptr(), self.0));
    }

    of_two! {
        add _mm256_add_pd;
        sub _mm256_sub_pd;
        mul _mm256_mul_pd;
        div _mm256_div_pd;
        max _mm256_max_pd;
        min _mm256_min_pd;
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(avx2!(_mm256_fmadd_pd(self.0, factor.0, term.0)))
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Self(avx2!(_mm256_fnmadd_pd(self.0, factor.0, term.0)))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(avx2!(_mm256_sqrt_pd(self.0)))
    }

    #[inline(always)]
    fn select_at_most(self, other: Self, yes: Self, no: Self) -> Self {
        let mask = avx2!(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0));
        Self(avx2!(_mm256_blendv_pd(no.0, yes.0, mask)))
    }

    #[inline(always)]
    fn any_at_most(self, other: Self) -> bool {
        let mask = avx2!(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0));
        avx2!(_mm256_movemask_pd(mask)) != 0
    }
}
