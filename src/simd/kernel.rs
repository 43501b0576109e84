//! [`LaneSet`]: the instruction sets for [`Lanes`](super::Lanes), and [`kernel!`]: one function compiled for each of them.

/// An instruction set that [`kernel!`] selects at run time.
#[derive(Debug, Clone, Copy)]
pub(crate) enum LaneSet {
    /// [`F32x8`](super::F32x8), compiled for the target's baseline.
    #[cfg_attr(
        all(target_arch = "aarch64", not(test)),
        expect(dead_code, reason = "aarch64 always has NEON")
    )]
    Portable,
    /// AVX2 with FMA and F16C.
    #[cfg(target_arch = "x86_64")]
    Avx2(super::x86::Avx2),
    /// NEON.
    #[cfg(target_arch = "aarch64")]
    Neon,
    /// The scalar reference for vector units.
    #[cfg(test)]
    Fused,
}

impl LaneSet {
    /// The fastest instruction set of this machine.
    pub(crate) fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(proof) = super::x86::Avx2::detect() {
            return Self::Avx2(proof);
        }
        #[cfg(target_arch = "aarch64")]
        return Self::Neon;
        #[cfg(not(target_arch = "aarch64"))]
        Self::Portable
    }

    /// The vector unit of this machine, which gives the bits of [`Self::Fused`]; empty if it has none.
    #[cfg(test)]
    pub(crate) fn vector_units() -> Vec<Self> {
        let best = Self::best();
        let is_vector_unit = !matches!(best, Self::Portable);
        is_vector_unit.then_some(best).into_iter().collect()
    }
}

/// Makes of a function over [`Lanes`](super::Lanes) one that takes a [`LaneSet`] first and selects the instruction set.
macro_rules! kernel {
    (
        $(#[$meta:meta])*
        $vis:vis fn $name:ident<$lanes:ident>($($argument:ident: $type:ty),* $(,)?) $body:block
    ) => {
        $(#[$meta])*
        $vis fn $name(set: $crate::simd::LaneSet, $($argument: $type),*) {
            #[inline(always)]
            fn generic<$lanes: $crate::simd::Lanes>($($argument: $type),*) $body
            match set {
                $crate::simd::LaneSet::Portable => generic::<$crate::simd::F32x8>($($argument),*),
                #[cfg(target_arch = "x86_64")]
                $crate::simd::LaneSet::Avx2(proof) => {
                    #[target_feature(enable = "avx2,fma,f16c")]
                    fn avx2($($argument: $type),*) {
                        generic::<$crate::simd::x86::Ymm>($($argument),*);
                    }
                    $crate::simd::x86::enter_avx2!(proof => avx2($($argument),*));
                }
                #[cfg(target_arch = "aarch64")]
                $crate::simd::LaneSet::Neon => {
                    generic::<$crate::simd::neon::TwoQuads>($($argument),*);
                }
                #[cfg(test)]
                $crate::simd::LaneSet::Fused => generic::<$crate::simd::lanes::Fused>($($argument),*),
            }
        }
    };
}

pub(crate) use kernel;

#[cfg(test)]
mod tests {
    use super::super::{F32x8, Lanes16};
    use super::*;

    kernel! {
        /// Every operation once.
        fn everything<L>(input: &[F32x8; 8], output: &mut Vec<F32x8>) {
            let rows = input.map(L::from_array);
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
            output.extend(results.map(L::to_array));
            output.extend(L::transpose(rows).map(L::to_array));
        }
    }

    kernel! {
        /// Every operation on sixteen lanes once.
        fn everything_16<L>(input: &[[f32; 16]; 3], output: &mut Vec<[f32; 16]>) {
            let [a, b, c] = [&input[0], &input[1], &input[2]].map(Lanes16::<L>::load);
            let results = [
                Lanes16::splat(input[0][5]),
                Lanes16::indices(),
                a.add(b),
                a.mul(b),
                a.mul_add(b, c),
                a.neg_mul_add(b, c),
            ];
            for result in results {
                let mut stored = [0.0; 16];
                result.store(&mut stored);
                output.push(stored);
            }
        }
    }

    #[test]
    fn vector_units_give_the_bits_of_the_reference() {
        let mut state = 7u32;
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        for _ in 0..1000 {
            let input: [F32x8; 8] = std::array::from_fn(|_| F32x8(std::array::from_fn(|_| draw())));
            let input_16: [[f32; 16]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| draw()));
            let results = |set: LaneSet| {
                let (mut eight, mut sixteen) = (Vec::new(), Vec::new());
                everything(set, &input, &mut eight);
                everything_16(set, &input_16, &mut sixteen);
                let sixteen = sixteen.into_iter().flatten();
                let all = eight.iter().flat_map(|lanes| lanes.0).chain(sixteen);
                all.collect::<Vec<f32>>()
            };
            let expected = results(LaneSet::Fused);
            for set in LaneSet::vector_units() {
                assert_eq!(results(set), expected, "{set:?}");
            }
            for (a, b) in results(LaneSet::Portable).iter().zip(&expected) {
                // A product below one is rounded before it is added.
                assert!((a - b).abs() <= f32::EPSILON, "{a} {b}");
            }
        }
    }
}
