//! [`Doubles`]: four `f64` in vector registers, and [`ComplexLanes`], complex numbers of them.
//!
//! Code generic over [`Doubles`] has to inline completely, and vector units round `a · b + c` once, as with
//! [`Lanes`](super::Lanes).

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
    /// `self · factor + term`.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `term − self · factor`.
    fn neg_mul_add(self, factor: Self, term: Self) -> Self;
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

/// The reference for vector units: one rounding for `a · b + c`.
#[cfg(test)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FusedF64x4([f64; 4]);

/// Implements [`Doubles`] for an array, with this function for `a · b + c`.
macro_rules! array_doubles {
    ($name:ident, $multiply_add:expr) => {
        impl $name {
            #[inline(always)]
            fn of_two(self, other: Self, operation: impl Fn(f64, f64) -> f64) -> Self {
                Self(std::array::from_fn(|i| operation(self.0[i], other.0[i])))
            }
        }

        impl Doubles for $name {
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
            fn mul_add(self, factor: Self, term: Self) -> Self {
                let one: fn(f64, f64, f64) -> f64 = $multiply_add;
                Self(std::array::from_fn(|i| {
                    one(self.0[i], factor.0[i], term.0[i])
                }))
            }

            #[inline(always)]
            fn neg_mul_add(self, factor: Self, term: Self) -> Self {
                Self(self.0.map(|value| -value)).mul_add(factor, term)
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
    };
}

array_doubles!(F64x4, |a, b, c| a * b + c);
#[cfg(test)]
array_doubles!(FusedF64x4, f64::mul_add);

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
            re: self.im.neg_mul_add(other.im, self.re.mul(other.re)),
            im: self.im.mul_add(other.re, self.re.mul(other.im)),
        }
    }

    /// The product with the other's conjugate.
    #[inline(always)]
    pub(crate) fn mul_conjugate(self, other: Self) -> Self {
        Self {
            re: self.im.mul_add(other.im, self.re.mul(other.re)),
            im: self.re.neg_mul_add(other.im, self.im.mul(other.re)),
        }
    }

    #[inline(always)]
    pub(crate) fn div(self, other: Self) -> Self {
        self.mul_conjugate(other)
            .scale(D::splat(1.0).div(other.square()))
    }

    /// Square of the absolute value.
    #[inline(always)]
    pub(crate) fn square(self) -> D {
        self.im.mul_add(self.im, self.re.mul(self.re))
    }

    /// The sum with a product.
    #[inline(always)]
    pub(crate) fn add_scaled(self, other: Self, factor: D) -> Self {
        Self {
            re: other.re.mul_add(factor, self.re),
            im: other.im.mul_add(factor, self.im),
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
            let fused = [a.mul_add(b, c), a.neg_mul_add(b, c)];
            for value in parts.chain([a.div(b), a.min(b), root, chosen]).chain(fused) {
                let mut stored = [0.0; 4];
                value.store(&mut stored);
                output.push(stored);
            }
            output.push([f64::from(u8::from(a.any_at_most(b))); 4]);
        }
    }

    #[test]
    fn vector_units_give_the_bits_of_the_reference() {
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
            let expected = results(LaneSet::Fused);
            for set in LaneSet::vector_units() {
                assert_eq!(results(set), expected, "{set:?}");
            }
            // The reference's operations are those of scalars.
            let [a, b, ..] = input;
            assert_eq!(expected[12], std::array::from_fn(|i| a[i] / b[i]));
            assert_eq!(expected[14], a.map(|a| a.max(0.0).sqrt()));
            let c = input[2];
            assert_eq!(
                expected[16],
                std::array::from_fn(|i| a[i].mul_add(b[i], c[i]))
            );
        }
    }
}
