//! [`F16x8`]: eight numbers in sixteen bits each, for what is stored and hardly computed with.
//!
//! IEEE 754 binary16: eleven bits of mantissa, so a value from 6.1e-5 on is off by at most 2⁻¹¹ of its amount and a smaller one
//! by at most 3e-8. All instruction sets round to the nearest, ties to even, and give the same bits, whatever they do with
//! subnormal numbers in arithmetic.

/// The largest value; larger ones are stored as this one.
pub(crate) const MAX: f32 = 65_504.0;

/// Eight binary16 lanes, aligned to 16 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C, align(16))]
pub(crate) struct F16x8(pub(crate) [u16; 8]);

impl F16x8 {
    /// All lanes zero.
    pub(crate) const ZERO: Self = Self([0; 8]);
}

/// Smallest amount with the full mantissa.
const LEAST_NORMAL: f32 = 6.103_515_6e-5;

/// The value of binary16 bits; infinities and NaN are beyond [`MAX`].
#[inline(always)]
pub(crate) fn decoded(bits: u16) -> f32 {
    const REBIAS: u32 = (127 - 15) << 23;
    let bits = u32::from(bits);
    let amount = (bits & 0x7FFF) << 13;
    // A subnormal number gets the exponent of the least normal one and its hidden bit, which is taken away again: no
    // operand is a subnormal f32, which a sound thread takes for zero.
    let is_subnormal = amount < 1 << 23;
    let value = f32::from_bits(amount + REBIAS + (u32::from(is_subnormal) << 23));
    let value = if is_subnormal {
        value - LEAST_NORMAL
    } else {
        value
    };
    f32::from_bits(value.to_bits() | (bits & 0x8000) << 16)
}

/// The binary16 bits of a number, limited to [`MAX`].
#[inline(always)]
pub(crate) fn encoded(value: f32) -> u16 {
    const REBIAS: u32 = (127 - 15) << 23;
    let amount = value.abs().min(MAX);
    let bits = if amount < LEAST_NORMAL {
        // The last bit of 0.5 is worth the last one of a subnormal number: the sum rounds.
        (amount + 0.5).to_bits() - 0.5f32.to_bits()
    } else {
        let bits = amount.to_bits() - REBIAS;
        (bits + 0xFFF + (bits >> 13 & 1)) >> 13
    };
    let sign = value.to_bits() >> 16 & 0x8000;
    (bits | sign) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{F32x8, LaneSet, kernel};

    kernel! {
        fn decode<L>(halves: &F16x8, lanes: &mut F32x8) {
            *lanes = L::from_halves(halves).to_array();
        }
    }

    kernel! {
        fn encode<L>(lanes: &F32x8, halves: &mut F16x8) {
            *halves = L::from_array(*lanes).to_halves();
        }
    }

    fn sets() -> impl Iterator<Item = LaneSet> {
        let scalar = [LaneSet::Portable, LaneSet::Fused];
        scalar.into_iter().chain(LaneSet::vector_units())
    }

    /// The same by sums of powers of two.
    fn exact(bits: u16) -> f64 {
        let (exponent, mantissa) = (i32::from(bits >> 10 & 31), f64::from(bits & 0x3FF));
        let amount = match exponent {
            0 => mantissa * 2f64.powi(-24),
            _ => (1024.0 + mantissa) * 2f64.powi(exponent - 25),
        };
        if bits & 0x8000 == 0 { amount } else { -amount }
    }

    #[test]
    fn every_number_is_read_as_it_was_written() {
        for bits in (0..=u16::MAX).filter(|bits| bits & 0x7C00 != 0x7C00) {
            let halves = F16x8([bits; 8]);
            for set in sets() {
                let (mut lanes, mut again) = (F32x8::ZERO, F16x8::ZERO);
                decode(set, &halves, &mut lanes);
                assert!(lanes.0.iter().all(|lane| f64::from(*lane) == exact(bits)));
                encode(set, &lanes, &mut again);
                assert_eq!(again, halves, "{set:?} {bits:x}");
            }
        }
    }

    #[test]
    fn all_instruction_sets_round_to_the_nearest_alike() {
        let mut state = 3u64;
        for round in 0..200_000u32 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            // All exponents from 2^-40 to 2^20, and every third number halfway between two.
            let exponent = 87 + (state >> 40) as u32 % 60;
            let mut bits = (state >> 33) as u32 & 0x807F_FFFF | exponent << 23;
            if round % 3 == 0 {
                bits = bits & !0x1FFF | 0x1000;
            }
            let value = f32::from_bits(bits);
            let lanes = F32x8::splat(value);
            let mut halves = F16x8::ZERO;
            for set in sets() {
                encode(set, &lanes, &mut halves);
                assert_eq!(halves.0, [encoded(value); 8], "{set:?} {value:e}");
            }
            let limited = f64::from(value.clamp(-MAX, MAX));
            let error = (exact(halves.0[0]) - limited).abs();
            assert!(
                error <= (limited.abs() / 2048.0).max(2f64.powi(-25)),
                "{value:e}"
            );
        }
    }
}
