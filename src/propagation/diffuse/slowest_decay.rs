//! The slowest decay of a scene: the one that is left when all others have gone, without waiting for it.
//!
//! Own; after the modal decomposition of acoustic radiance transfer (\[SCERBO24\]). Energy that decays everywhere with one rate r is e^(−rt)
//! times a distribution over the patches. What a patch radiates has come from others, each a delay d ago, when there was
//! e^(rd) times as much. So the matrix of the transports, each times e^(rd), leaves the distribution as it is: its largest
//! eigenvalue is 1. A balance of energies does not depend on how evenly they arrive; a line through few decibels does.

use crate::acoustics::bands::exp_neg;
use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::decay_fit::FITTED_FROM_DB;
use crate::propagation::diffuse::delay_sums::{DelaySums, SPANS};
use crate::propagation::diffuse::fit_spans::STEPS;

/// Newton's steps to the rate: a rate of 20 dB in the responses is found within a thousandth.
const NEWTON_STEPS: usize = 6;

/// Generations of scattering in a step.
const GENERATIONS: usize = 8;

/// Fastest rate that is asked for, in nepers of energy per time step.
const MOST: f32 = FITTED_FROM_DB * std::f32::consts::LN_10 / 10.0 / STEPS as f32;

/// Nepers of energy per time step of the slowest decay, at most [`MOST`].
pub(crate) fn slowest_decay(sums: &DelaySums) -> BandArray {
    let patches = sums.patches();
    let mut rates = [0.0f32; BANDS];
    let mut energies = vec![[1.0f32; BANDS]; patches];
    let mut gains = vec![[0.0f32; BANDS]; patches * patches];
    let mut delayed = gains.clone();
    for _ in 0..NEWTON_STEPS {
        gains.fill([0.0; BANDS]);
        delayed.fill([0.0; BANDS]);
        for from in 0..patches {
            for span in 0..SPANS {
                for (to, sum) in sums.of_span(from, span).iter().enumerate() {
                    let Some(delay) = sum.delay() else { continue };
                    let lost = exp_neg(&rates.map(|rate| rate * delay));
                    let index = from * patches + to;
                    for b in 0..BANDS {
                        let gain = sum.scattered[b] / lost[b];
                        gains[index][b] += gain;
                        delayed[index][b] += gain * delay;
                    }
                }
            }
        }
        let (mut growth, mut delay) = ([0.0; BANDS], [0.0; BANDS]);
        for _ in 0..GENERATIONS {
            let next = times(&gains, &energies);
            let [before, after] = [&energies, &next].map(|e| total(e));
            let waited = total(&times(&delayed, &energies));
            for b in 0..BANDS {
                growth[b] = after[b] / before[b].max(f32::MIN_POSITIVE);
                delay[b] = waited[b] / after[b].max(f32::MIN_POSITIVE);
            }
            energies = next;
            let scale = after.map(|after| 1.0 / after.max(f32::MIN_POSITIVE));
            for energy in &mut energies {
                for b in 0..BANDS {
                    energy[b] *= scale[b];
                }
            }
        }
        for b in 0..BANDS {
            let growth = growth[b].max(f32::MIN_POSITIVE).ln();
            let step = growth / delay[b].max(1.0);
            rates[b] = (rates[b] - step).clamp(0.0, MOST);
        }
    }
    rates
}

/// Energy of the next generation at each patch: gains `[from × patches + to]` times energies.
fn times(gains: &[BandArray], energies: &[BandArray]) -> Vec<BandArray> {
    let mut next = vec![[0.0; BANDS]; energies.len()];
    for (gains, energy) in gains.chunks_exact(energies.len()).zip(energies) {
        for (next, gain) in next.iter_mut().zip(gains) {
            for b in 0..BANDS {
                next[b] += gain[b] * energy[b];
            }
        }
    }
    next
}

fn total(energies: &[BandArray]) -> BandArray {
    let sum = |total: BandArray, energy: &BandArray| std::array::from_fn(|b| total[b] + energy[b]);
    energies.iter().fold([0.0; BANDS], sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::diffuse::delay_sums::Arrival;

    const PATCHES: usize = 6;

    /// Patches of two rooms, each of which sends all others in its own room a share of its energy, some of it at once and the
    /// rest in one burst `burst` steps later; the first room also sends `to_other` to the second one.
    fn rooms(kept: [f32; 2], burst: f32, to_other: f32) -> DelaySums {
        let mut sums = DelaySums::new(PATCHES);
        for from in 0..PATCHES {
            for to in 0..PATCHES {
                let half = PATCHES / 2;
                let share = match (from / half, to / half) {
                    (0, 1) => to_other,
                    (1, 0) => 0.0,
                    (room, _) => kept[room],
                };
                let energy = [0.5 * share / half as f32; BANDS];
                for steps in [2.0, burst] {
                    let arrival = Arrival {
                        from,
                        to,
                        steps,
                        in_air: 1.0,
                    };
                    sums.add(arrival, &energy, &energy);
                }
            }
        }
        sums
    }

    /// Rate r at which `kept` (e^(2r) + e^(burst r)) / 2 is 1.
    fn exact(kept: f64, burst: f64) -> f64 {
        let growth = |rate: f64| 0.5 * kept * ((2.0 * rate).exp() + (burst * rate).exp());
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match growth(middle) < 1.0 {
                true => low = middle,
                false => high = middle,
            }
        }
        low
    }

    /// Rates up to that of 20 dB in the responses, also of energy that comes in bursts: those of a balance of energies.
    #[test]
    fn the_rate_is_that_of_the_energy_balance() {
        for (kept, burst) in [(0.999, 10.0), (0.9, 10.0), (0.9, 60.0), (0.3, 60.0)] {
            let found = slowest_decay(&rooms([kept; 2], burst, 0.0))[3];
            let expected = exact(f64::from(kept), f64::from(burst)) as f32;
            assert!(expected < MOST, "{expected}");
            let off = found / expected - 1.0;
            assert!(off.abs() < 1e-3, "{kept}, {burst}: {found}, {expected}");
        }
    }

    #[test]
    fn the_slowest_of_two_rooms_is_found_from_either() {
        for kept in [[0.9, 0.5], [0.5, 0.9]] {
            let found = slowest_decay(&rooms(kept, 40.0, 0.1))[0];
            let off = found / exact(0.9, 40.0) as f32 - 1.0;
            assert!(off.abs() < 1e-2, "{kept:?}: {found}");
        }
    }

    #[test]
    fn faster_decays_are_the_fastest_that_is_asked_for() {
        assert_eq!(slowest_decay(&rooms([0.01; 2], 4.0, 0.0)), [MOST; BANDS]);
        assert_eq!(slowest_decay(&rooms([0.0; 2], 4.0, 0.0)), [MOST; BANDS]);
    }
}
