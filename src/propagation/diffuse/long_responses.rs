//! What arrives at a listener of energy that patches radiate, after the end of their responses.
//!
//! Own. Energy that is spread over the patches ([`LateStates`]) arrives as if they had just radiated it: a response goes on as the sum of
//! others that began [`STATE_BINS`] later. Its level is that of the response where both are known. Energy that stays specular is not
//! radiated by Lambert's law: the same is done for energy that begins in the air, whose course is known for all times, and what it is off
//! by there is divided out.

use std::ops::Range;

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::energy_course::{BIN_STEPS, LONG_STEPS};
use crate::propagation::diffuse::fit_spans::STEPS;
use crate::propagation::diffuse::late_states::LateStates;
use crate::propagation::diffuse::surface_samples::MAX_PATCHES;
use crate::simd::{LaneSet, Lanes, kernel};

/// Energy in bins of time.
pub(crate) type LongResponse = [BandArray; LONG_BINS];
const LONG_BINS: usize = LONG_STEPS / BIN_STEPS;

/// Bins of the responses.
const BINS: usize = STEPS / BIN_STEPS;

/// Age in bins of late states.
pub(crate) const STATE_BINS: usize = 5;

/// Bins in which a response and its continuation are compared: neither is young there.
const COMPARED: Range<usize> = 6..BINS;

/// Fills what arrives of each patch's energy, from the responses `[patch × STEPS + step]` and what arrives of energy that begins in the
/// air.
pub(crate) fn continue_responses(
    states: &LateStates,
    responses: &[BandArray],
    of_air: &LongResponse,
    long: &mut Vec<LongResponse>,
) {
    long.clear();
    long.reserve(states.patches() + 1);
    long.extend(responses.chunks_exact(STEPS).map(bins_of));
    // The last one is of energy that begins in the air.
    long.push(*of_air);
    continue_bins(LaneSet::best(), states, of_air, long);
    long.truncate(states.patches());
}

kernel! {
    /// Continues the responses of patches, and of the air behind them. No fused products: all machines give the same bits.
    fn continue_bins<L>(states: &LateStates, of_air: &LongResponse, long: &mut [LongResponse]) {
        let mut gains = [[0.0; BANDS]; MAX_PATCHES + 1];
        let gains = &mut gains[..long.len()];
        for to in 0..states.patches() {
            let level = level::<L>(&long[to], STATE_BINS);
            let (of_patches, of_air) = states.at(to);
            for (gain, state) in gains.iter_mut().zip(of_patches) {
                add_times(gain, state, level);
            }
            add_times(&mut gains[states.patches()], of_air, level);
        }
        for (gain, response) in gains.iter_mut().zip(&*long) {
            let mut levels = [0.0; BANDS];
            level::<L>(response, 0).store(&mut levels);
            for b in 0..BANDS {
                // Next to nothing has no level to speak of.
                gain[b] = match gain[b] > f32::MIN_POSITIVE {
                    true => levels[b] / gain[b],
                    false => 0.0,
                };
            }
        }
        long[states.patches()] = [[0.0; BANDS]; LONG_BINS];
        for bin in BINS..LONG_BINS {
            for to in 0..states.patches() {
                let before = L::load(&long[to][bin - STATE_BINS]);
                let (of_patches, of_air) = states.at(to);
                for (response, state) in long.iter_mut().zip(of_patches) {
                    add_times(&mut response[bin], state, before);
                }
                add_times(&mut long[states.patches()][bin], of_air, before);
            }
            let air = long[states.patches()][bin];
            let air_gain = gains[states.patches()];
            let mut correction = [1.0; BANDS];
            for b in 0..BANDS {
                let continued = air_gain[b] * air[b];
                // Where the air's energy does not arrive it says nothing.
                if continued > f32::MIN_POSITIVE {
                    correction[b] = of_air[bin][b] / continued;
                }
            }
            let correction = L::load(&correction);
            for (response, gain) in long.iter_mut().zip(&*gains) {
                let response = &mut response[bin];
                L::load(response).mul(L::load(gain)).mul(correction).store(response);
            }
        }
    }
}

/// Adds an energy times a level.
#[inline(always)]
fn add_times<L: Lanes>(sum: &mut BandArray, energy: &BandArray, level: L) {
    L::load(sum).add(L::load(energy).mul(level)).store(sum);
}

/// Energy in the bins in which responses are compared, some bins earlier.
#[inline(always)]
fn level<L: Lanes>(response: &LongResponse, earlier: usize) -> L {
    let mut sum = L::splat(0.0);
    for energy in &response[COMPARED.start - earlier..COMPARED.end - earlier] {
        sum = sum.add(L::load(energy));
    }
    sum
}

/// Energy in the bins of a response of [`STEPS`]; later ones are empty.
pub(crate) fn bins_of(response: &[BandArray]) -> LongResponse {
    let mut sums = [[0.0; BANDS]; LONG_BINS];
    for (sum, steps) in sums.iter_mut().zip(response.chunks(BIN_STEPS)) {
        for energy in steps {
            for b in 0..BANDS {
                sum[b] += energy[b];
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energies of two rooms of one patch each that lose `loss` nepers a time step and exchange energy at `rate`: what is in the room where
    /// it began, and in the other one.
    fn in_rooms(loss: f32, rate: f32, step: f32) -> [f32; 2] {
        let (all, difference) = ((-loss * step).exp(), (-(loss + 2.0 * rate) * step).exp());
        [0.5 * (all + difference), 0.5 * (all - difference)]
    }

    fn states(loss: f32, rate: f32) -> LateStates {
        let [own, other] = in_rooms(loss, rate, (STATE_BINS * BIN_STEPS) as f32);
        let of_patches = [own, other, other, own].map(|e| [e; BANDS]);
        LateStates::new(
            of_patches.into_iter(),
            &[[own + other; BANDS]; 2],
            &[1.0; 2],
        )
    }

    /// A listener in the first room. The second room's energy still builds up at the end of the responses.
    #[test]
    fn energy_from_another_room_goes_on_as_the_exchange_of_energy() {
        for (loss, rate) in [(0.01f32, 0.002f32), (0.03, 0.0005), (0.02, 0.02)] {
            let step = |room: usize| {
                move |step: usize| [in_rooms(loss, rate, step as f32 + 0.5)[room]; BANDS]
            };
            let responses: Vec<_> = (0..STEPS)
                .map(step(0))
                .chain((0..STEPS).map(step(1)))
                .collect();
            let bins = |of_step: &dyn Fn(usize) -> BandArray| -> LongResponse {
                std::array::from_fn(|bin| {
                    let steps = (BIN_STEPS * bin..BIN_STEPS * (bin + 1)).map(of_step);
                    [steps.map(|energy| energy[0]).sum(); BANDS]
                })
            };
            let of_air = bins(&|at| [step(0)(at)[0] + step(1)(at)[0]; BANDS]);
            let mut long = Vec::new();
            continue_responses(&states(loss, rate), &responses, &of_air, &mut long);
            for (room, found) in long.iter().enumerate() {
                let expected = bins(&step(room));
                for (bin, (found, expected)) in found.iter().zip(&expected).enumerate() {
                    let off_db = 10.0 * (found[2] / expected[2]).log10();
                    assert!(
                        off_db.abs() < 0.5,
                        "{loss}, {rate}: room {room}, bin {bin}: {off_db} dB"
                    );
                }
            }
        }
    }

    /// The air's energy decays more slowly than what patches radiate anew: its course corrects theirs.
    #[test]
    fn the_course_of_the_air_corrects_what_stays_specular() {
        let course = |step: usize| [1.0 / (10.0 + step as f32).powi(2); BANDS];
        let responses: Vec<_> = (0..STEPS)
            .map(course)
            .chain((0..STEPS).map(course))
            .collect();
        let of_air = std::array::from_fn(|bin| {
            let steps = (BIN_STEPS * bin..BIN_STEPS * (bin + 1)).map(course);
            [steps.map(|energy| 5.0 * energy[0]).sum(); BANDS]
        });
        let mut long = Vec::new();
        continue_responses(&states(0.03, 0.02), &responses, &of_air, &mut long);
        for (bin, (found, air)) in long[1].iter().zip(of_air).enumerate() {
            let off_db = 10.0 * (5.0 * found[0] / air[0]).log10();
            assert!(off_db.abs() < 0.1, "bin {bin}: {off_db} dB");
        }
    }

    #[test]
    fn silence_stays_silent() {
        let nothing = [[0.0; BANDS]; LONG_BINS];
        let mut long = Vec::new();
        continue_responses(
            &states(0.03, 0.02),
            &[[0.0; BANDS]; 2 * STEPS],
            &nothing,
            &mut long,
        );
        assert_eq!(long, [nothing; 2]);
    }

    /// Energies down to the smallest numbers, of all patches or of one: what arrives later is finite.
    #[test]
    fn next_to_nothing_stays_finite() {
        for level in [1.0, 1e-12, 1e-20, 1e-30, 1e-38, 1e-44] {
            for of_air in [1.0, level, 0.0] {
                let mut responses = [[level; BANDS]; 2 * STEPS];
                responses[STEPS..].fill([0.0; BANDS]);
                let mut long = Vec::new();
                let of_air = [[of_air; BANDS]; LONG_BINS];
                let state = [
                    [level, 0.0, 1.0, level].map(|e| [e; BANDS]),
                    [[level; BANDS]; 4],
                ];
                for state in state {
                    let states =
                        LateStates::new(state.into_iter(), &[[level; BANDS]; 2], &[1.0; 2]);
                    continue_responses(&states, &responses, &of_air, &mut long);
                    let all = long.as_flattened().as_flattened();
                    assert!(
                        all.iter().all(|energy| energy.is_finite()),
                        "{level}: {long:?}"
                    );
                    assert!(
                        states
                            .growth(&[0.5; 2])
                            .iter()
                            .all(|growth| growth.is_finite())
                    );
                }
            }
        }
    }
}
