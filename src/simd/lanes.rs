//! [`Lanes`]: eight `f32` in vector registers.
//!
//! Code generic over [`Lanes`] has to inline completely, or its registers are spilled: closures and functions of arrays
//! that take closures (`map`, `from_fn`) do not inline into a function with target features; loops and `inline(always)` do.
//!
//! Vector units compute `a · b + c` with one rounding. [`F32x8`] uses two, since one is slow without hardware support. So
//! AVX2 with FMA and NEON give the bits of the scalar reference `Fused` of the tests, and a machine without either stays
//! within the bound that each kernel states.

use super::F32x8;
use super::f16x8::{F16x8, decoded, encoded};
#[cfg(test)]
use crate::simd::doubles::FusedF64x4;
use crate::simd::doubles::{Doubles, F64x4};

/// Eight `f32` in registers. Methods instead of operators: the order of roundings is explicit where it is chosen.
pub(crate) trait Lanes: Copy {
    /// Four `f64` of the same instruction set.
    type Doubles: Doubles;

    /// From an array.
    fn from_array(lanes: F32x8) -> Self;
    /// To an array.
    fn to_array(self) -> F32x8;
    /// The same value in every lane.
    fn splat(value: f32) -> Self;
    /// Sum.
    fn add(self, other: Self) -> Self;
    /// Difference.
    fn sub(self, other: Self) -> Self;
    /// Product.
    fn mul(self, other: Self) -> Self;
    /// `self · factor + term`.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `term − self · factor`.
    fn neg_mul_add(self, factor: Self, term: Self) -> Self;
    /// Loads from memory.
    fn load(lanes: &[f32; 8]) -> Self;
    /// Stores to memory.
    fn store(self, lanes: &mut [f32; 8]);
    /// From half the memory.
    fn from_halves(halves: &F16x8) -> Self;
    /// To half the memory: rounded to the nearest, ties to even, and limited to [`MAX`](crate::simd::f16x8::MAX). Not for NaN.
    fn to_halves(self) -> F16x8;
    /// Lanes 0 to 3, each twice.
    fn twice_low(self) -> Self;
    /// Lanes 4 to 7, each twice.
    fn twice_high(self) -> Self;
    /// Lane i of row j becomes lane j of row i.
    fn transpose(rows: [Self; 8]) -> [Self; 8];

    /// Loads eight values of a slice from an index on; zeros if it has fewer.
    #[inline(always)]
    fn load_at(values: &[f32], index: usize) -> Self {
        if let Some(rest) = values.get(index..)
            && let Some(lanes) = rest.first_chunk()
        {
            Self::load(lanes)
        } else {
            Self::splat(0.0)
        }
    }

    /// Stores to eight elements of a slice from an index on; no effect if it has fewer.
    #[inline(always)]
    fn store_at(self, values: &mut [f32], index: usize) {
        if let Some(rest) = values.get_mut(index..)
            && let Some(lanes) = rest.first_chunk_mut()
        {
            self.store(lanes);
        }
    }

    /// Each lane in all lanes of a register of its own.
    #[inline(always)]
    fn splat_each(lanes: F32x8) -> [Self; 8] {
        let [a, b, c, d, e, f, g, h] = lanes.0;
        [
            Self::splat(a),
            Self::splat(b),
            Self::splat(c),
            Self::splat(d),
            Self::splat(e),
            Self::splat(f),
            Self::splat(g),
            Self::splat(h),
        ]
    }
}

/// Lane indices.
pub(crate) const LANE_INDICES: F32x8 = F32x8([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);

/// Sixteen `f32`: the lower eight and the upper eight.
#[derive(Clone, Copy)]
pub(crate) struct Lanes16<L>(pub(crate) L, pub(crate) L);

/// The methods of [`Lanes`] on both halves.
impl<L: Lanes> Lanes16<L> {
    #[inline(always)]
    pub(crate) fn splat(value: f32) -> Self {
        let lanes = L::splat(value);
        Self(lanes, lanes)
    }

    /// Lane indices.
    #[inline(always)]
    pub(crate) fn indices() -> Self {
        let lower = L::from_array(LANE_INDICES);
        Self(lower, lower.add(L::splat(8.0)))
    }

    #[inline(always)]
    pub(crate) fn add(self, other: Self) -> Self {
        Self(self.0.add(other.0), self.1.add(other.1))
    }

    #[inline(always)]
    pub(crate) fn mul(self, other: Self) -> Self {
        Self(self.0.mul(other.0), self.1.mul(other.1))
    }

    #[inline(always)]
    pub(crate) fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(
            self.0.mul_add(factor.0, term.0),
            self.1.mul_add(factor.1, term.1),
        )
    }

    #[inline(always)]
    pub(crate) fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Self(
            self.0.neg_mul_add(factor.0, term.0),
            self.1.neg_mul_add(factor.1, term.1),
        )
    }

    #[inline(always)]
    pub(crate) fn load(lanes: &[f32; 16]) -> Self {
        Self(L::load_at(lanes, 0), L::load_at(lanes, 8))
    }

    #[inline(always)]
    pub(crate) fn store(self, lanes: &mut [f32; 16]) {
        self.0.store_at(lanes, 0);
        self.1.store_at(lanes, 8);
    }
}

/// [`Lanes`] in an array; `$multiply_add` computes `a · b + c` with one or two roundings.
macro_rules! array_lanes {
    ($name:ty, $doubles:ty, $wrap:expr, $multiply_add:expr) => {
        impl Lanes for $name {
            type Doubles = $doubles;

            #[inline(always)]
            fn from_array(lanes: F32x8) -> Self {
                $wrap(lanes.0)
            }

            #[inline(always)]
            fn to_array(self) -> F32x8 {
                F32x8(self.0)
            }

            #[inline(always)]
            fn splat(value: f32) -> Self {
                $wrap([value; 8])
            }

            #[inline(always)]
            fn add(self, other: Self) -> Self {
                $wrap(std::array::from_fn(|i| self.0[i] + other.0[i]))
            }

            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                $wrap(std::array::from_fn(|i| self.0[i] - other.0[i]))
            }

            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                $wrap(std::array::from_fn(|i| self.0[i] * other.0[i]))
            }

            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                let one: fn(f32, f32, f32) -> f32 = $multiply_add;
                $wrap(std::array::from_fn(|i| {
                    one(self.0[i], factor.0[i], term.0[i])
                }))
            }

            #[inline(always)]
            fn neg_mul_add(self, factor: Self, term: Self) -> Self {
                let one: fn(f32, f32, f32) -> f32 = $multiply_add;
                $wrap(std::array::from_fn(|i| {
                    one(-self.0[i], factor.0[i], term.0[i])
                }))
            }

            #[inline(always)]
            fn load(lanes: &[f32; 8]) -> Self {
                $wrap(*lanes)
            }

            #[inline(always)]
            fn store(self, lanes: &mut [f32; 8]) {
                *lanes = self.0;
            }

            #[inline(always)]
            fn from_halves(halves: &F16x8) -> Self {
                $wrap(std::array::from_fn(|i| decoded(halves.0[i])))
            }

            #[inline(always)]
            fn to_halves(self) -> F16x8 {
                F16x8(std::array::from_fn(|i| encoded(self.0[i])))
            }

            #[inline(always)]
            fn twice_low(self) -> Self {
                $wrap(std::array::from_fn(|i| self.0[i / 2]))
            }

            #[inline(always)]
            fn twice_high(self) -> Self {
                $wrap(std::array::from_fn(|i| self.0[4 + i / 2]))
            }

            #[inline(always)]
            fn transpose(rows: [Self; 8]) -> [Self; 8] {
                std::array::from_fn(|i| $wrap(std::array::from_fn(|j| rows[j].0[i])))
            }
        }
    };
}

array_lanes!(F32x8, F64x4, F32x8, |a, b, c| a * b + c);

/// The reference for vector units: one rounding for `a · b + c`.
#[cfg(test)]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fused([f32; 8]);

#[cfg(test)]
array_lanes!(Fused, FusedF64x4, Fused, f32::mul_add);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_beyond_the_end_are_zero_and_stores_there_have_no_effect() {
        let mut values = [1.0; 10];
        assert_eq!(F32x8::load_at(&values, 3), F32x8::ZERO);
        F32x8::splat(2.0).store_at(&mut values, 3);
        assert_eq!(values, [1.0; 10]);
        F32x8::splat(2.0).store_at(&mut values, 2);
        assert_eq!(F32x8::load_at(&values, 1).0[..2], [1.0, 2.0]);
    }
}
