//! [`Lanes`] in two NEON registers.
//!
//! `unsafe` because the intrinsics have the target feature `neon`, which methods of a trait cannot have; every aarch64 has it.

use core::arch::aarch64::*;

use crate::simd::f16x8::MAX;
use crate::simd::{F16x8, F32x8, Lanes};

/// Eight lanes in two registers of four.
#[derive(Clone, Copy)]
pub(crate) struct TwoQuads(float32x4_t, float32x4_t);

macro_rules! neon {
    ($call:expr) => {
        // SAFETY: loads and stores stay within references to eight numbers and need no more alignment than theirs; beyond
        // that the intrinsics need only NEON, which is part of aarch64 as Rust targets it.
        unsafe { $call }
    };
}

/// Four rows of four, transposed.
#[inline(always)]
fn transpose4(a: float32x4_t, b: float32x4_t, c: float32x4_t, d: float32x4_t) -> [float32x4_t; 4] {
    let even = (
        pairs(neon!(vtrn1q_f32(a, b))),
        pairs(neon!(vtrn1q_f32(c, d))),
    );
    let odd = (
        pairs(neon!(vtrn2q_f32(a, b))),
        pairs(neon!(vtrn2q_f32(c, d))),
    );
    [
        lanes(neon!(vtrn1q_f64(even.0, even.1))),
        lanes(neon!(vtrn1q_f64(odd.0, odd.1))),
        lanes(neon!(vtrn2q_f64(even.0, even.1))),
        lanes(neon!(vtrn2q_f64(odd.0, odd.1))),
    ]
}

#[inline(always)]
fn pairs(lanes: float32x4_t) -> float64x2_t {
    neon!(vreinterpretq_f64_f32(lanes))
}

#[inline(always)]
fn lanes(pairs: float64x2_t) -> float32x4_t {
    neon!(vreinterpretq_f32_f64(pairs))
}

impl Lanes for TwoQuads {
    type Doubles = super::TwoPairs;

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
        let four = neon!(vdupq_n_f32(value));
        Self(four, four)
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(
            neon!(vaddq_f32(self.0, other.0)),
            neon!(vaddq_f32(self.1, other.1)),
        )
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(
            neon!(vsubq_f32(self.0, other.0)),
            neon!(vsubq_f32(self.1, other.1)),
        )
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(
            neon!(vmulq_f32(self.0, other.0)),
            neon!(vmulq_f32(self.1, other.1)),
        )
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(
            neon!(vfmaq_f32(term.0, self.0, factor.0)),
            neon!(vfmaq_f32(term.1, self.1, factor.1)),
        )
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Self(
            neon!(vfmsq_f32(term.0, self.0, factor.0)),
            neon!(vfmsq_f32(term.1, self.1, factor.1)),
        )
    }

    #[inline(always)]
    fn load(lanes: &[f32; 8]) -> Self {
        Self(
            neon!(vld1q_f32(lanes.as_ptr())),
            neon!(vld1q_f32(lanes[4..].as_ptr())),
        )
    }

    #[inline(always)]
    fn store(self, lanes: &mut [f32; 8]) {
        neon!(vst1q_f32(lanes.as_mut_ptr(), self.0));
        neon!(vst1q_f32(lanes[4..].as_mut_ptr(), self.1));
    }

    #[inline(always)]
    fn from_halves(halves: &F16x8) -> Self {
        let bits = neon!(vld1q_u16(halves.0.as_ptr()));
        let halves = neon!(vreinterpretq_f16_u16(bits));
        let lower = neon!(vget_low_f16(halves));
        Self(neon!(vcvt_f32_f16(lower)), neon!(vcvt_high_f32_f16(halves)))
    }

    #[inline(always)]
    fn to_halves(self) -> F16x8 {
        let (low, high) = (Self::splat(-MAX), Self::splat(MAX));
        let lower = neon!(vmaxq_f32(self.0, low.0));
        let upper = neon!(vmaxq_f32(self.1, low.1));
        let lower = neon!(vminq_f32(lower, high.0));
        let upper = neon!(vminq_f32(upper, high.1));
        let lower = neon!(vcvt_f16_f32(lower));
        let bits = neon!(vcvt_high_f16_f32(lower, upper));
        let bits = neon!(vreinterpretq_u16_f16(bits));
        let mut halves = F16x8::ZERO;
        neon!(vst1q_u16(halves.0.as_mut_ptr(), bits));
        halves
    }

    #[inline(always)]
    fn twice_low(self) -> Self {
        Self(
            neon!(vzip1q_f32(self.0, self.0)),
            neon!(vzip2q_f32(self.0, self.0)),
        )
    }

    #[inline(always)]
    fn twice_high(self) -> Self {
        Self(
            neon!(vzip1q_f32(self.1, self.1)),
            neon!(vzip2q_f32(self.1, self.1)),
        )
    }

    #[inline(always)]
    fn transpose(rows: [Self; 8]) -> [Self; 8] {
        let [a, b, c, d, e, f, g, h] = rows;
        let [p, q, r, t] = transpose4(a.0, b.0, c.0, d.0);
        let [i, j, k, l] = transpose4(e.0, f.0, g.0, h.0);
        let [u, v, w, x] = transpose4(a.1, b.1, c.1, d.1);
        let [m, n, o, s] = transpose4(e.1, f.1, g.1, h.1);
        [
            Self(p, i),
            Self(q, j),
            Self(r, k),
            Self(t, l),
            Self(u, m),
            Self(v, n),
            Self(w, o),
            Self(x, s),
        ]
    }
}
