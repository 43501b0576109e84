//! Where energy is late in the responses of patches.
//!
//! Own. After some reflections, what becomes of energy depends on where it is and not on how it came there. Energy that has left a patch is in
//! the air for a leg: with what leaves patches late in a response, that gives how a unit that one patch radiates is then spread over all.
//! As a matrix, such a state leads from one to the next.

use crate::acoustics::{BANDS, BandArray};

/// Share of the pairs of patches between which energy falls more slowly than [`LateStates::growth`] says.
const SLOWER: f32 = 0.15;

/// Late states, in no particular unit.
#[derive(Debug, Clone, Default)]
pub(crate) struct LateStates {
    /// Energy in the air that has left patch `to`, for a unit that patch `from` radiates: `[to × patches + from]`.
    of_patches: Vec<BandArray>,
    /// Energy in the air that has left each patch, for energy that begins in the air.
    of_air: Vec<BandArray>,
}

impl LateStates {
    /// From the energy that leaves patches late in a response, `[to × patches + from]` and of energy that begins in the air, and the mean
    /// length in metres of each patch's rays.
    pub(crate) fn new(
        of_patches: impl Iterator<Item = BandArray>,
        of_air: &[BandArray],
        leg_m: &[f32],
    ) -> Self {
        let patches = leg_m.len();
        let in_air = |leaving: BandArray, to: usize| leaving.map(|energy| leg_m[to] * energy);
        let of_patches = of_patches.enumerate();
        Self {
            of_patches: of_patches
                .map(|(index, e)| in_air(e, index / patches))
                .collect(),
            of_air: of_air
                .iter()
                .enumerate()
                .map(|(to, e)| in_air(*e, to))
                .collect(),
        }
    }

    /// Number of patches.
    pub(crate) fn patches(&self) -> usize {
        self.of_air.len()
    }

    /// Energy at a patch for each radiating patch, and for energy that begins in the air.
    pub(crate) fn at(&self, to: usize) -> (&[BandArray], &BandArray) {
        let patches = self.patches();
        (
            &self.of_patches[to * patches..][..patches],
            &self.of_air[to],
        )
    }

    /// Energy in the third state over that in the second one, relative to that of all energy, for the pairs of patches where it falls
    /// most slowly: more than 1 where energy still arrives from other spaces then. `share` are the patches' shares of the surface.
    pub(crate) fn growth(&self, share: &[f32]) -> BandArray {
        let patches = self.patches();
        let second = self.times(&self.of_patches);
        let third = self.times(&second);
        let (mut before, mut after) = ([0.0f32; BANDS], [0.0f32; BANDS]);
        for to in 0..patches {
            let (row, of_air) = self.at(to);
            for b in 0..BANDS {
                before[b] += of_air[b];
                for (state, of_air) in row.iter().zip(&self.of_air) {
                    after[b] += state[b] * of_air[b];
                }
            }
        }
        let mut order = Vec::with_capacity(second.len());
        std::array::from_fn(|b| {
            let all = after[b] / before[b].max(f32::MIN_POSITIVE);
            order.clear();
            for (index, (second, third)) in second.iter().zip(&third).enumerate() {
                // Next to nothing has no growth to speak of.
                if second[b] * all > f32::MIN_POSITIVE {
                    let weight = share[index / patches] * share[index % patches];
                    order.push((third[b] / (second[b] * all), weight));
                }
            }
            order.sort_by(|(a, _), (c, _)| c.total_cmp(a));
            let mut sum = 0.0;
            let found = order.iter().find(|(_, weight)| {
                sum += weight;
                sum >= SLOWER
            });
            found.map_or(1.0, |(growth, _)| *growth)
        })
    }

    /// The states that follow others, `[to × patches + from]`.
    fn times(&self, states: &[BandArray]) -> Vec<BandArray> {
        let patches = self.patches();
        let mut next = vec![[0.0; BANDS]; states.len()];
        for (to, next) in next.chunks_exact_mut(patches.max(1)).enumerate() {
            for (via, gain) in self.at(to).0.iter().enumerate() {
                for (next, state) in next.iter_mut().zip(&states[via * patches..]) {
                    for b in 0..BANDS {
                        next[b] += gain[b] * state[b];
                    }
                }
            }
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rooms of two patches each with what stays in a room and what goes to the next one from state to state.
    fn rooms(count: usize, stays: f32, to_next: f32) -> LateStates {
        let patches = 2 * count;
        let gain = |index: usize| match (index / patches / 2).abs_diff(index % patches / 2) {
            0 => 0.5 * stays,
            1 => 0.5 * to_next,
            _ => 0.0,
        };
        let of_patches = (0..patches * patches).map(|index| [gain(index); BANDS]);
        LateStates::new(
            of_patches,
            &vec![[1.0; BANDS]; patches],
            &vec![1.0; patches],
        )
    }

    #[test]
    fn energy_of_one_room_falls_as_all_energy() {
        let growth = rooms(1, 0.3, 0.0).growth(&[0.5; 2]);
        assert!(growth.iter().all(|growth| (growth - 1.0).abs() < 1e-5));
    }

    /// Two rooms, by hand: between them the second state is 2 s t, the third 3 s² t + t³, and all energy falls by s + t.
    #[test]
    fn energy_that_still_arrives_falls_more_slowly() {
        let (s, t) = (0.4f32, 0.02f32);
        let growth = rooms(2, s, t).growth(&[0.25; 4]);
        let expected = (3.0 * s * s * t + t.powi(3)) / (2.0 * s * t) / (s + t);
        assert!((growth[0] / expected - 1.0).abs() < 1e-4, "{growth:?}");
        assert!(expected > 1.4);
    }

    #[test]
    fn silence_has_no_growth() {
        assert_eq!(rooms(2, 0.0, 0.0).growth(&[0.25; 4]), [1.0; BANDS]);
        assert_eq!(LateStates::default().growth(&[]), [1.0; BANDS]);
    }
}
