//! [`Doubles`] in two NEON registers.
//!
//! `unsafe` because the intrinsics have the target feature `neon`, which methods of a trait cannot have; every aarch64 has it.

use core::arch::aarch64::*;

use crate::simd::Doubles;

/// Four lanes in two registers of two.
#[derive(Clone, Copy)]
pub(crate) struct TwoPairs(float64x2_t, float64x2_t);

macro_rules! neon {
    ($call:expr) => {
        // SAFETY: loads and stores stay within references to four f64 and need no more alignment than theirs; beyond
        // that the intrinsics need only NEON, which is part of aarch64 as Rust targets it.
        unsafe { $call }
    };
}

/// Names methods of two values.
macro_rules! of_two {
    ($($name:ident $intrinsic:path;)*) => {
        $(
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(
                    neon!($intrinsic(self.0, other.0)),
                    neon!($intrinsic(self.1, other.1)),
                )
            }
        )*
    };
}

impl Doubles for TwoPairs {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        let pair = neon!(vdupq_n_f64(value));
        Self(pair, pair)
    }

    #[inline(always)]
    fn load(lanes: &[f64; 4]) -> Self {
        Self(
            neon!(vld1q_f64(lanes.as_ptr())),
            neon!(vld1q_f64(lanes[2..].as_ptr())),
        )
    }

    #[inline(always)]
    fn store(self, lanes: &mut [f64; 4]) {
        neon!(vst1q_f64(lanes.as_mut_ptr(), self.0));
        neon!(vst1q_f64(lanes[2..].as_mut_ptr(), self.1));
    }

    of_two! {
        add vaddq_f64;
        sub vsubq_f64;
        mul vmulq_f64;
        div vdivq_f64;
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(
            neon!(vfmaq_f64(term.0, self.0, factor.0)),
            neon!(vfmaq_f64(term.1, self.1, factor.1)),
        )
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Self(
            neon!(vfmsq_f64(term.0, self.0, factor.0)),
            neon!(vfmsq_f64(term.1, self.1, factor.1)),
        )
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        let masks = [
            neon!(vcgtq_f64(self.0, other.0)),
            neon!(vcgtq_f64(self.1, other.1)),
        ];
        Self(
            neon!(vbslq_f64(masks[0], self.0, other.0)),
            neon!(vbslq_f64(masks[1], self.1, other.1)),
        )
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        let masks = [
            neon!(vcltq_f64(self.0, other.0)),
            neon!(vcltq_f64(self.1, other.1)),
        ];
        Self(
            neon!(vbslq_f64(masks[0], self.0, other.0)),
            neon!(vbslq_f64(masks[1], self.1, other.1)),
        )
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(neon!(vsqrtq_f64(self.0)), neon!(vsqrtq_f64(self.1)))
    }

    #[inline(always)]
    fn select_at_most(self, other: Self, yes: Self, no: Self) -> Self {
        let masks = [
            neon!(vcleq_f64(self.0, other.0)),
            neon!(vcleq_f64(self.1, other.1)),
        ];
        Self(
            neon!(vbslq_f64(masks[0], yes.0, no.0)),
            neon!(vbslq_f64(masks[1], yes.1, no.1)),
        )
    }

    #[inline(always)]
    fn any_at_most(self, other: Self) -> bool {
        let first = neon!(vcleq_f64(self.0, other.0));
        let second = neon!(vcleq_f64(self.1, other.1));
        let either = neon!(vorrq_u64(first, second));
        neon!(vmaxvq_u32(vreinterpretq_u32_u64(either))) != 0
    }
}
