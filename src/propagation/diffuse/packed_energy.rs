//! Energies of eight bands in sixteen bits each: half of their memory.
//!
//! Own. An energy has no sign. The sixteen bits after it are the exponent and eight bits of the mantissa, rounded: the relative error is
//! at most 2⁻⁹, 0.0085 dB. A sum of such energies with gains that are not negative has no larger one.

use crate::acoustics::{BANDS, BandArray};
use crate::simd::Lanes;

/// Bits of an `f32` that are left out below the others.
const DROPPED_BITS: u32 = 15;

/// Energies of eight bands, packed.
pub(crate) type PackedBands = [u16; BANDS];

/// Packs energies. Negative ones become 0.
pub(crate) fn pack(energy: &BandArray) -> PackedBands {
    let half = 1 << (DROPPED_BITS - 1);
    energy.map(|value| ((value.max(0.0).to_bits() + half) >> DROPPED_BITS) as u16)
}

/// Energies of eight bands that can be loaded into lanes.
pub(crate) trait Energies {
    /// The energies, a band in each lane.
    fn lanes<L: Lanes>(&self) -> L;
}

impl Energies for BandArray {
    #[inline(always)]
    fn lanes<L: Lanes>(&self) -> L {
        L::load(self)
    }
}

impl Energies for PackedBands {
    #[inline(always)]
    fn lanes<L: Lanes>(&self) -> L {
        let mut energy = [0.0; BANDS];
        for b in 0..BANDS {
            energy[b] = f32::from_bits(u32::from(self[b]) << DROPPED_BITS);
        }
        L::load(&energy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::rays::directions::{mix, unit};
    use crate::simd::F32x8;

    fn unpack(packed: &PackedBands) -> BandArray {
        packed.lanes::<F32x8>().0
    }

    #[test]
    fn packed_energies_are_within_a_hundredth_of_a_decibel() {
        for seed in 0..10_000 {
            // From the smallest normal number to the largest that does not round to infinity.
            let energy = std::array::from_fn(|b| {
                let random = unit(mix(8 * seed + b as u64));
                2.0f32.powf(-126.0 + 253.9 * random)
            });
            for (found, expected) in unpack(&pack(&energy)).iter().zip(energy) {
                let error = (f64::from(*found) / f64::from(expected) - 1.0).abs();
                assert!(error <= 1.0 / 512.0, "{expected}: {error}");
            }
        }
    }

    #[test]
    fn silence_stays_silence() {
        assert_eq!(unpack(&pack(&[0.0; BANDS])), [0.0; BANDS]);
        assert_eq!(unpack(&pack(&[-0.0; BANDS])), [0.0; BANDS]);
    }
}
