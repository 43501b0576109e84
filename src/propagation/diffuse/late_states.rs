//! Where energy is late in the responses of patches.
//!
//! Own. After some reflections, what becomes of energy depends on where it is and not on how it came there. Energy that has left a patch is in
//! the air for a leg: with what leaves patches late in a response, that gives how a unit that one patch radiates is then spread over all.
//! As a matrix, such a state leads from one to the next.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::rays::directions::{mix, unit};

/// Modes of [`LateStates::kept_by_modes`], and rounds in which one is found.
pub(crate) const MODES: usize = 2;
const MODE_ROUNDS: usize = 60;

/// Least overlap of a mode's distributions of energy that arrives and that leaves.
const LEAST_OVERLAP: f32 = 1e-3;

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

    /// Shares of energy that the slowest modes keep from one state to the next, the slowest one first. A mode is spread over the patches in a way that
    /// stays while it falls: found by power iteration, with those before taken away (deflation).
    pub(crate) fn kept_by_modes(&self) -> [BandArray; MODES] {
        let patches = self.patches();
        let mut kept = [[0.0; BANDS]; MODES];
        for band in 0..BANDS {
            let mut states: Vec<f32> = self.of_patches.iter().map(|state| state[band]).collect();
            for kept in &mut kept {
                let right = mode(patches, |to, from| states[to * patches + from]);
                let left = mode(patches, |to, from| states[from * patches + to]);
                let [(right, share), (left, _)] = [right, left];
                let both: f32 = right.iter().zip(&left).map(|(a, b)| a * b).sum();
                // Neither a complex pair nor next to nothing is a mode of its own.
                if !(share > 0.0 && both.abs() > LEAST_OVERLAP) {
                    break;
                }
                kept[band] = share;
                for (to, row) in states.chunks_exact_mut(patches).enumerate() {
                    for (state, left) in row.iter_mut().zip(&left) {
                        *state -= share * right[to] * left / both;
                    }
                }
            }
        }
        kept
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

/// The slowest mode of states, of length 1, and the share of energy that it keeps from one to the next.
fn mode(patches: usize, state: impl Fn(usize, usize) -> f32) -> (Vec<f32>, f32) {
    let length = 1.0 / (patches.max(1) as f32).sqrt();
    // Modes beyond the first have both signs.
    let mut now: Vec<f32> = (0..patches)
        .map(|patch| length * (1.0 + unit(mix(patch as u64))))
        .collect();
    let mut share = 0.0;
    for _ in 0..MODE_ROUNDS {
        let next =
            (0..patches).map(|to| (0..patches).map(|from| state(to, from) * now[from]).sum());
        let next: Vec<f32> = next.collect();
        let square: f32 = next.iter().map(|value| value * value).sum();
        if square <= f32::MIN_POSITIVE || square.is_nan() {
            return (now, 0.0);
        }
        let before: f32 = now.iter().map(|value| value * value).sum();
        share = next.iter().zip(&now).map(|(a, b)| a * b).sum::<f32>() / before;
        now = next.iter().map(|value| value / square.sqrt()).collect();
    }
    (now, share)
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

    /// Two rooms: energy in both falls by s + t, its difference by s - t.
    #[test]
    fn modes_of_two_rooms_are_their_sum_and_their_difference() {
        for (s, t) in [(0.4f32, 0.02f32), (0.3, 0.2), (0.5, 0.1)] {
            let [first, second] = rooms(2, s, t).kept_by_modes();
            assert!((first[2] / (s + t) - 1.0).abs() < 1e-3, "{first:?}");
            assert!((second[2] / (s - t) - 1.0).abs() < 1e-2, "{second:?}");
        }
        assert_eq!(rooms(2, 0.0, 0.0).kept_by_modes(), [[0.0; BANDS]; MODES]);
    }

    #[test]
    fn silence_has_no_growth() {
        assert_eq!(rooms(2, 0.0, 0.0).growth(&[0.25; 4]), [1.0; BANDS]);
        assert_eq!(LateStates::default().growth(&[]), [1.0; BANDS]);
    }
}
