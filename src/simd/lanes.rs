//! Eight lanes in the machine's own registers, and kernels that are written once for all of them.
//!
//! A kernel is generic over [`Lanes`]; what it calls has to become part of it, or lanes go through memory: closures and
//! functions of arrays that take them (`map`, `from_fn`) do not, loops and `inline(always)` do. [`kernel!`] makes of a
//! kernel one function an instruction set and a choice between them. Vector units multiply and add with one rounding, [`F32x8`] with two, since without hardware for it one rounding
//! is slow. So every machine with AVX2 and FMA, with AVX-512VL or with NEON gives the bits of the scalar specification
//! [`Fused`] of the tests, and what has none of them stays within the kernel's stated bound of it.

use super::F32x8;

/// `f32` in lanes, as many as `Memory` has. Methods are no operators so that the order of roundings is read where it is chosen.
pub(crate) trait Vector: Copy {
    /// The portable form.
    type Memory: Copy;
    /// Lanes of their portable form.
    fn of(lanes: Self::Memory) -> Self;
    /// The portable form.
    fn give(self) -> Self::Memory;
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
}

/// Eight `f32` in lanes.
pub(crate) trait Lanes: Vector<Memory = F32x8> {
    /// From memory.
    fn load(lanes: &[f32; 8]) -> Self;
    /// To memory.
    fn store(self, lanes: &mut [f32; 8]);
    /// Lanes 0 to 3, each twice.
    fn twice_low(self) -> Self;
    /// Lanes 4 to 7, each twice.
    fn twice_high(self) -> Self;
    /// Lane i of row j becomes lane j of row i.
    fn transpose(rows: [Self; 8]) -> [Self; 8];

    /// Eight values of a slice from a place on; zeros if it has not as many.
    #[inline(always)]
    fn load_at(values: &[f32], place: usize) -> Self {
        if let Some(rest) = values.get(place..)
            && let Some(lanes) = rest.first_chunk()
        {
            Self::load(lanes)
        } else {
            Self::splat(0.0)
        }
    }

    /// To eight places of a slice from one on; nowhere if it has not as many.
    #[inline(always)]
    fn store_at(self, values: &mut [f32], place: usize) {
        if let Some(rest) = values.get_mut(place..)
            && let Some(lanes) = rest.first_chunk_mut()
        {
            self.store(lanes);
        }
    }

    /// Each lane in a register of its own.
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

/// Sixteen lanes: two times eight, lower and upper, each of which gives the bits of [`Lanes`]. One register where the machine
/// has it.
pub(crate) trait Wide<L: Lanes>: Vector<Memory = [F32x8; 2]> {
    /// Two times eight.
    fn join(lower: L, upper: L) -> Self;
    /// Lower and upper.
    fn halves(self) -> [L; 2];
    /// From memory.
    fn load(lanes: &[f32; 16]) -> Self;
    /// To memory.
    fn store(self, lanes: &mut [f32; 16]);

    /// Lane numbers.
    #[inline(always)]
    fn numbers() -> Self {
        let lower = L::of(NUMBERS);
        Self::join(lower, lower.add(L::splat(8.0)))
    }
}

/// Sixteen lanes in two times eight.
#[derive(Clone, Copy)]
pub(crate) struct Halves<L>(L, L);

impl<L: Lanes> Vector for Halves<L> {
    type Memory = [F32x8; 2];

    #[inline(always)]
    fn of(lanes: [F32x8; 2]) -> Self {
        Self(L::of(lanes[0]), L::of(lanes[1]))
    }

    #[inline(always)]
    fn give(self) -> [F32x8; 2] {
        [self.0.give(), self.1.give()]
    }

    #[inline(always)]
    fn splat(value: f32) -> Self {
        let lanes = L::splat(value);
        Self(lanes, lanes)
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.add(other.0), self.1.add(other.1))
    }

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0.sub(other.0), self.1.sub(other.1))
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0.mul(other.0), self.1.mul(other.1))
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(
            self.0.mul_add(factor.0, term.0),
            self.1.mul_add(factor.1, term.1),
        )
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        Self(
            self.0.neg_mul_add(factor.0, term.0),
            self.1.neg_mul_add(factor.1, term.1),
        )
    }
}

impl<L: Lanes> Wide<L> for Halves<L> {
    #[inline(always)]
    fn join(lower: L, upper: L) -> Self {
        Self(lower, upper)
    }

    #[inline(always)]
    fn halves(self) -> [L; 2] {
        [self.0, self.1]
    }

    #[inline(always)]
    fn load(lanes: &[f32; 16]) -> Self {
        Self(L::load_at(lanes, 0), L::load_at(lanes, 8))
    }

    #[inline(always)]
    fn store(self, lanes: &mut [f32; 16]) {
        self.0.store_at(lanes, 0);
        self.1.store_at(lanes, 8);
    }
}

/// Lane numbers.
pub(crate) const NUMBERS: F32x8 = F32x8([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);

/// What [`kernel!`] chooses from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum LaneSet {
    /// [`F32x8`].
    #[cfg_attr(
        all(target_arch = "aarch64", not(test)),
        expect(dead_code, reason = "aarch64 always has NEON")
    )]
    Portable,
    /// AVX2 with FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2(super::x86::Avx2),
    /// The same lanes with the instructions of AVX-512VL: twice the registers, and a value from memory in every lane without
    /// an instruction of its own.
    #[cfg(target_arch = "x86_64")]
    Avx512(super::x86::Avx512),
    /// NEON.
    #[cfg(target_arch = "aarch64")]
    Neon,
    /// The specification of the vector units.
    #[cfg(test)]
    Fused,
}

impl LaneSet {
    /// The best that the machine has.
    pub(crate) fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(proof) = super::x86::Avx512::detect() {
            return Self::Avx512(proof);
        } else if let Some(proof) = super::x86::Avx2::detect() {
            return Self::Avx2(proof);
        }
        #[cfg(target_arch = "aarch64")]
        return Self::Neon;
        #[cfg(not(target_arch = "aarch64"))]
        Self::Portable
    }

    /// Whether [`Wide`] lanes are one register.
    pub(crate) fn has_wide(self) -> bool {
        #[cfg(target_arch = "x86_64")]
        return matches!(self, Self::Avx512(_));
        #[cfg(not(target_arch = "x86_64"))]
        false
    }

    /// All vector units that the machine has, which give the bits of [`Self::Fused`].
    #[cfg(test)]
    pub(crate) fn vector_units() -> Vec<Self> {
        let mut all = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            all.extend(super::x86::Avx2::detect().map(Self::Avx2));
            all.extend(super::x86::Avx512::detect().map(Self::Avx512));
        }
        #[cfg(target_arch = "aarch64")]
        all.push(Self::Neon);
        all
    }
}

/// Makes a function over [`Lanes`], and over [`Wide`] of them if it names a second type, one that takes a [`LaneSet`] first.
macro_rules! kernel {
    (
        $(#[$meta:meta])*
        $vis:vis fn $name:ident<$lanes:ident>($($argument:ident: $type:ty),* $(,)?) $body:block
    ) => {
        $crate::simd::kernel! {
            $(#[$meta])*
            $vis fn $name<$lanes, _Wide>($($argument: $type),*) $body
        }
    };
    (
        $(#[$meta:meta])*
        $vis:vis fn $name:ident<$lanes:ident, $wide:ident>($($argument:ident: $type:ty),* $(,)?) $body:block
    ) => {
        $(#[$meta])*
        $vis fn $name(set: $crate::simd::LaneSet, $($argument: $type),*) {
            #[inline(always)]
            fn generic<$lanes, $wide>($($argument: $type),*)
            where
                $lanes: $crate::simd::Lanes,
                $wide: $crate::simd::Wide<$lanes>,
            $body
            use $crate::simd::lanes::Halves;
            match set {
                $crate::simd::LaneSet::Portable => {
                    use $crate::simd::F32x8 as Eight;
                    generic::<Eight, Halves<Eight>>($($argument),*);
                }
                #[cfg(target_arch = "x86_64")]
                $crate::simd::LaneSet::Avx2(proof) => {
                    #[target_feature(enable = "avx2,fma")]
                    fn wide($($argument: $type),*) {
                        use $crate::simd::x86::Ymm;
                        generic::<Ymm, Halves<Ymm>>($($argument),*);
                    }
                    $crate::simd::x86::enter_avx2!(proof => wide($($argument),*));
                }
                #[cfg(target_arch = "x86_64")]
                $crate::simd::LaneSet::Avx512(proof) => {
                    #[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
                    fn wider($($argument: $type),*) {
                        use $crate::simd::x86::{Ymm, Zmm};
                        generic::<Ymm, Zmm>($($argument),*);
                    }
                    $crate::simd::x86::enter_avx512!(proof => wider($($argument),*));
                }
                #[cfg(target_arch = "aarch64")]
                $crate::simd::LaneSet::Neon => {
                    use $crate::simd::neon::TwoQuads;
                    generic::<TwoQuads, Halves<TwoQuads>>($($argument),*);
                }
                #[cfg(test)]
                $crate::simd::LaneSet::Fused => {
                    use $crate::simd::lanes::Fused;
                    generic::<Fused, Halves<Fused>>($($argument),*);
                }
            }
        }
    };
}

pub(crate) use kernel;

/// Lanes as an array: `$multiply_add` says how often `a · b + c` is rounded.
macro_rules! array_lanes {
    ($name:ty, $wrap:expr, $multiply_add:expr) => {
        impl Vector for $name {
            type Memory = F32x8;

            #[inline(always)]
            fn of(lanes: F32x8) -> Self {
                $wrap(lanes.0)
            }

            #[inline(always)]
            fn give(self) -> F32x8 {
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
        }

        impl Lanes for $name {
            #[inline(always)]
            fn load(lanes: &[f32; 8]) -> Self {
                $wrap(*lanes)
            }

            #[inline(always)]
            fn store(self, lanes: &mut [f32; 8]) {
                *lanes = self.0;
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

array_lanes!(F32x8, F32x8, |a, b, c| a * b + c);

/// The specification of the vector units: one rounding for `a · b + c`.
#[cfg(test)]
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fused([f32; 8]);

#[cfg(test)]
array_lanes!(Fused, Fused, f32::mul_add);

#[cfg(test)]
mod tests {
    use super::*;

    kernel! {
        /// Every operation once.
        fn everything<L>(input: &[F32x8; 8], output: &mut Vec<F32x8>) {
            let rows = input.map(L::of);
            let [a, b, c] = [rows[0], rows[1], rows[2]];
            let results = [
                L::splat(input[3].0[5]),
                a.add(b),
                a.sub(b),
                a.mul(b),
                a.mul_add(b, c),
                a.neg_mul_add(b, c),
                a.twice_low(),
                a.twice_high(),
            ];
            output.extend(results.map(L::give));
            output.extend(L::transpose(rows).map(L::give));
        }
    }

    kernel! {
        /// Every operation of sixteen lanes once.
        fn everything_wide<L, W>(input: &[F32x8; 8], output: &mut Vec<F32x8>) {
            let [a, b, c] = [[0, 1], [2, 3], [4, 5]].map(|[i, j]| W::of([input[i], input[j]]));
            let mut loaded = [0.0; 16];
            loaded[..8].copy_from_slice(&input[6].0);
            loaded[8..].copy_from_slice(&input[7].0);
            let mut stored = [0.0; 16];
            W::load(&loaded).add(a).store(&mut stored);
            let [lower, upper] = a.mul(c).halves();
            let results = [
                W::splat(input[3].0[5]),
                W::numbers(),
                W::join(L::of(input[7]), L::of(input[0])),
                W::join(upper, lower),
                a.add(b),
                a.sub(b),
                a.mul(b),
                a.mul_add(b, c),
                a.neg_mul_add(b, c),
            ];
            output.extend(results.map(W::give).as_flattened());
            output.extend(stored.chunks(8).map(F32x8::load));
        }
    }

    #[test]
    fn vector_unit_does_what_its_specification_says() {
        let mut state = 7u32;
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        for _ in 0..1000 {
            let input: [F32x8; 8] = std::array::from_fn(|_| F32x8(std::array::from_fn(|_| draw())));
            let (mut specified, mut portable) = (Vec::new(), Vec::new());
            everything(LaneSet::Fused, &input, &mut specified);
            everything(LaneSet::Portable, &input, &mut portable);
            everything_wide(LaneSet::Fused, &input, &mut specified);
            everything_wide(LaneSet::Portable, &input, &mut portable);
            for set in LaneSet::vector_units() {
                let mut found = Vec::new();
                everything(set, &input, &mut found);
                everything_wide(set, &input, &mut found);
                assert_eq!(found, specified, "{set:?}");
            }
            for (a, b) in portable.iter().zip(&specified) {
                for (a, b) in a.0.iter().zip(b.0) {
                    // A product below one that is rounded before it is added.
                    assert!((a - b).abs() <= f32::EPSILON, "{a} {b}");
                }
            }
        }
    }

    #[test]
    fn places_beyond_the_end_are_zero_and_stay() {
        let mut values = [1.0; 10];
        assert_eq!(F32x8::load_at(&values, 3), F32x8::ZERO);
        F32x8::splat(2.0).store_at(&mut values, 3);
        assert_eq!(values, [1.0; 10]);
        F32x8::splat(2.0).store_at(&mut values, 2);
        assert_eq!(F32x8::load_at(&values, 1).0[..2], [1.0, 2.0]);
    }
}
