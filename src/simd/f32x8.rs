//! [`F32x8`]: eight `f32` in an array.

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub};

/// Eight `f32` lanes, aligned to 32 bytes. The operators work lane by lane, with one rounding each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(32))]
pub struct F32x8(pub [f32; 8]);

impl F32x8 {
    /// All lanes zero.
    pub const ZERO: Self = Self([0.0; 8]);

    /// The same value in every lane.
    #[inline(always)]
    pub fn splat(value: f32) -> Self {
        Self([value; 8])
    }

    /// Loads the first eight values of a slice.
    ///
    /// # Panics
    /// If the slice has fewer than eight values.
    #[inline(always)]
    pub fn load(values: &[f32]) -> Self {
        let mut lanes = [0.0; 8];
        lanes.copy_from_slice(&values[..8]);
        Self(lanes)
    }

    /// Stores the lanes to the first eight elements of a slice.
    ///
    /// # Panics
    /// If the slice has fewer than eight elements.
    #[inline(always)]
    pub fn store(self, values: &mut [f32]) {
        values[..8].copy_from_slice(&self.0);
    }

    /// Sum of the lanes, in the fixed order ((0+4)+(2+6)) + ((1+5)+(3+7)).
    #[inline(always)]
    pub fn sum(self) -> f32 {
        let l = self.0;
        ((l[0] + l[4]) + (l[2] + l[6])) + ((l[1] + l[5]) + (l[3] + l[7]))
    }

    /// 2 to the power of each lane, which is within ±126; the relative error is below 4e-7.
    #[inline(always)]
    pub(crate) fn exp2(self) -> Self {
        // The sum has the nearest whole number in its lowest bits.
        let shift = Self::splat(12_582_912.0);
        let shifted = self + shift;
        let rest = (self - (shifted - shift)) * Self::splat(std::f32::consts::LN_2);
        let series = [720.0, 120.0, 24.0, 6.0, 2.0, 1.0, 1.0f32];
        let mut sum = Self::ZERO;
        for factorial in series {
            sum = sum * rest + Self::splat(1.0 / factorial);
        }
        let mut lanes = [0.0; 8];
        for i in 0..8 {
            let whole = (shifted.0[i].to_bits() << 23).wrapping_add(1.0f32.to_bits());
            lanes[i] = sum.0[i] * f32::from_bits(whole);
        }
        Self(lanes)
    }
}

macro_rules! lanewise {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for F32x8 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let mut lanes = [0.0; 8];
                for i in 0..8 {
                    lanes[i] = self.0[i] $op other.0[i];
                }
                Self(lanes)
            }
        }
    };
}

lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);
lanewise!(Div, div, /);

impl AddAssign for F32x8 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl MulAssign for F32x8 {
    #[inline(always)]
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_compute_what_scalars_compute() {
        let a = F32x8([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
        let b = F32x8::splat(0.5);
        assert_eq!((a * b).0[7], 4.0);
        assert_eq!((a - b).0[0], 0.5);
        assert_eq!(a.sum(), 36.0);
        assert_eq!((a / b).0[2], 6.0);
        let mut out = [0.0; 9];
        F32x8::load(&a.0).store(&mut out[1..]);
        assert_eq!(out[8], 8.0);
    }
    #[test]
    fn exp2_is_the_power_of_two() {
        for n in -10_000..10_000 {
            let exponent = 0.0031 * n as f32;
            let (found, exact) = (
                F32x8::splat(exponent).exp2().0[3],
                f64::from(exponent).exp2(),
            );
            assert!(
                (f64::from(found) / exact - 1.0).abs() < 4e-7,
                "{exponent}: {found} {exact}"
            );
        }
    }
}
