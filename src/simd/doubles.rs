//! [`Doubles`]: four `f64` in vector registers, and [`ComplexLanes`], complex numbers of them.
//!
//! No operation is fused: every machine gives the bits of the portable lanes. Code generic over [`Doubles`] has to inline
//! completely, as that over [`Lanes`](super::Lanes).

/// Four `f64` in registers. Methods instead of operators: the order of roundings is explicit where it is chosen.
pub(crate) trait Doubles: Copy {
    /// The same value in every lane.
    fn splat(value: f64) -> Self;
    /// Loads from memory.
    fn load(lanes: &[f64; 4]) -> Self;
    /// Stores to memory.
    fn store(self, lanes: &mut [f64; 4]);
    /// Sum.
    fn add(self, other: Self) -> Self;
    /// Difference.
    fn sub(self, other: Self) -> Self;
    /// Product.
    fn mul(self, other: Self) -> Self;
    /// Quotient.
    fn div(self, other: Self) -> Self;
    /// The greater one; the other lane where either is no number or both are equal.
    fn max(self, other: Self) -> Self;
    /// The smaller one; the other lane where either is no number or both are equal.
    fn min(self, other: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// `yes` where this lane is at most the other's, otherwise `no`.
    fn select_at_most(self, other: Self, yes: Self, no: Self) -> Self;
    /// Whether any lane is at most the other's.
    fn any_at_most(self, other: Self) -> bool;
}

/// [`Doubles`] in an array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct F64x4(pub(crate) [f64; 4]);

impl F64x4 {
    #[inline(always)]
    fn of_two(self, other: Self, operation: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| operation(self.0[i], other.0[i])))
    }
}

impl Doubles for F64x4 {
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; 4])
    }

    #[inline(always)]
    fn load(lanes: &[f64; 4]) -> Self {
        Self(*lanes)
    }

    #[inline(always)]
    fn store(self, lanes: &mut [f64; 4]) {
        *lanes = self.0;
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.of_two(other, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.of_two(other, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.of_two(other, |a, b| a * b)
    }

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.of_two(other, |a, b| a / b)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.of_two(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.of_two(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn select_at_most(self, other: Self, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|i| {
            if self.0[i] <= other.0[i] {
                yes.0[i]
            } else {
                no.0[i]
            }
        }))
    }

    #[inline(always)]
    fn any_at_most(self, other: Self) -> bool {
        self.0.iter().zip(other.0).any(|(a, b)| *a <= b)
    }
}

/// Complex numbers in lanes.
#[derive(Clone, Copy)]
pub(crate) struct ComplexLanes<D> {
    pub(crate) re: D,
    pub(crate) im: D,
}

impl<D: Doubles> ComplexLanes<D> {
    #[inline(always)]
    pub(crate) fn splat(re: f64, im: f64) -> Self {
        Self {
            re: D::splat(re),
            im: D::splat(im),
        }
    }

    #[inline(always)]
    pub(crate) fn add(self, other: Self) -> Self {
        Self {
            re: self.re.add(other.re),
            im: self.im.add(other.im),
        }
    }

    #[inline(always)]
    pub(crate) fn sub(self, other: Self) -> Self {
        Self {
            re: self.re.sub(other.re),
            im: self.im.sub(other.im),
        }
    }

    #[inline(always)]
    pub(crate) fn mul(self, other: Self) -> Self {
        Self {
            re: self.re.mul(other.re).sub(self.im.mul(other.im)),
            im: self.re.mul(other.im).add(self.im.mul(other.re)),
        }
    }

    /// The product with the other's conjugate.
    #[inline(always)]
    pub(crate) fn mul_conjugate(self, other: Self) -> Self {
        Self {
            re: self.re.mul(other.re).add(self.im.mul(other.im)),
            im: self.im.mul(other.re).sub(self.re.mul(other.im)),
        }
    }

    #[inline(always)]
    pub(crate) fn div(self, other: Self) -> Self {
        let size = other.re.mul(other.re).add(other.im.mul(other.im));
        let turned = self.mul_conjugate(other);
        Self {
            re: turned.re.div(size),
            im: turned.im.div(size),
        }
    }

    #[inline(always)]
    pub(crate) fn scale(self, factor: D) -> Self {
        Self {
            re: self.re.mul(factor),
            im: self.im.mul(factor),
        }
    }

    /// `yes` where a value is at most a bound, otherwise `no`.
    #[inline(always)]
    pub(crate) fn select_at_most(value: D, bound: D, yes: Self, no: Self) -> Self {
        Self {
            re: value.select_at_most(bound, yes.re, no.re),
            im: value.select_at_most(bound, yes.im, no.im),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{LaneSet, kernel};

    kernel! {
        /// Every operation once.
        fn everything<L>(input: &[[f64; 4]; 4], output: &mut Vec<[f64; 4]>) {
            let [a, b, c, d] = [0, 1, 2, 3].map(|row| L::Doubles::load(&input[row]));
            let (x, y) = (ComplexLanes { re: a, im: b }, ComplexLanes { re: c, im: d });
            let complex = [x.add(y), x.sub(y), x.mul(y), x.mul_conjugate(y), x.div(y), x.scale(d)];
            let root = a.max(L::Doubles::splat(0.0)).sqrt();
            let chosen = a.select_at_most(b, c, d);
            let parts = complex.into_iter().flat_map(|value| [value.re, value.im]);
            for value in parts.chain([a.div(b), a.min(b), root, chosen]) {
                let mut stored = [0.0; 4];
                value.store(&mut stored);
                output.push(stored);
            }
            output.push([f64::from(u8::from(a.any_at_most(b))); 4]);
        }
    }

    #[test]
    fn vector_units_give_the_bits_of_portable_lanes() {
        let mut state = 7u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        for _ in 0..1000 {
            let input: [[f64; 4]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| draw()));
            let results = |set: LaneSet| {
                let mut output = Vec::new();
                everything(set, &input, &mut output);
                output
            };
            let expected = results(LaneSet::Portable);
            for set in LaneSet::vector_units() {
                assert_eq!(results(set), expected, "{set:?}");
            }
            // The portable lanes are the scalar operations.
            let [a, b, ..] = input;
            assert_eq!(expected[12], std::array::from_fn(|i| a[i] / b[i]));
            assert_eq!(expected[14], a.map(|a| a.max(0.0).sqrt()));
        }
    }
}
