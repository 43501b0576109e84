//! What patches send to each other, and how energy passes from patch to patch over time.
//!
//! Own. Energy that one patch sends to another within a span of delays is one [`Transport`] of their mean, in whole time steps.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::decay_fit::sum_of;
use crate::propagation::diffuse::delay_sums::{DelaySums, SPANS};
use crate::propagation::diffuse::energy_course::{LONG_STEPS, LateBins, add_to_bin};
use crate::propagation::diffuse::fit_spans::{DIRECTION_SPANS, STEPS};
use crate::propagation::diffuse::packed_energy::{PackedBands, pack};
use crate::simd::{LaneSet, kernel};

/// Share of a patch's radiated energy below which a transport is left out.
const NEGLIGIBLE: f32 = 1e-7;

/// Energy that one patch sends to another within a span of delays.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Transport {
    pub(crate) from: u16,
    pub(crate) to: u16,
    /// In time steps, at least 1.
    pub(crate) delay: u16,
    /// Energy that leaves the other patch, and the scattered part of it.
    pub(crate) leaving: BandArray,
    pub(crate) scattered: BandArray,
}

/// Transports of all spans by source.
pub(crate) fn collect(sums: &DelaySums, patches: usize) -> Vec<Transport> {
    let mut transports = Vec::new();
    for from in 0..patches {
        // Rounding errors of delays times weights are carried on: the mean delay is that of the sums, although no transport takes
        // less than one step.
        let mut rest = 0.0;
        for span in 0..SPANS {
            for (to, sum) in sums.of_span(from, span).iter().enumerate() {
                let Some(delay) = sum.delay() else { continue };
                if sum.leaving.iter().all(|energy| *energy < NEGLIGIBLE) {
                    continue;
                }
                let carried = (rest / sum.weight).clamp(-1.0, 1.0);
                let rounded = (delay + carried).round().max(1.0);
                rest += sum.weight * (delay - rounded);
                transports.push(Transport {
                    from: from as u16,
                    to: to as u16,
                    delay: rounded as u16,
                    leaving: sum.leaving,
                    scattered: sum.scattered,
                });
            }
        }
    }
    transports
}

/// Energy that begins in the air, evenly and in all directions, and leaves patches.
#[derive(Debug, Clone, Default)]
pub(crate) struct AirEnergy {
    /// All patches, in each of [`LONG_STEPS`].
    pub(crate) total: Vec<BandArray>,
    /// Each patch, in each time step of the responses: `[patch × STEPS + step]`.
    pub(crate) of_steps: Vec<PackedBands>,
    /// Each patch, in each late bin.
    pub(crate) late: Vec<LateBins>,
    /// Each patch, within the last of [`DIRECTION_SPANS`].
    pub(crate) last: Vec<BandArray>,
}

/// How energy that begins in the air passes from patch to patch.
pub(crate) fn course_of_air(sums: &DelaySums, transports: &[Transport]) -> AirEnergy {
    let patches = sums.patches();
    let mut leaving = vec![[0.0; BANDS]; LONG_STEPS * patches];
    let mut radiated = leaving.clone();
    for (steps, to, sum) in sums.spread_of_air() {
        let share = 1.0 / steps.len() as f32;
        for step in steps.start..steps.end.min(LONG_STEPS) {
            for b in 0..BANDS {
                leaving[step * patches + to][b] += share * sum.leaving[b];
                radiated[step * patches + to][b] += share * sum.scattered[b];
            }
        }
    }
    pass_on(
        LaneSet::best(),
        transports,
        patches,
        &mut leaving,
        &mut radiated,
    );
    let mut course = AirEnergy {
        total: leaving.chunks_exact(patches).map(sum_of).collect(),
        of_steps: Vec::with_capacity(patches * STEPS),
        late: vec![LateBins::default(); patches],
        last: Vec::with_capacity(patches),
    };
    let [.., last] = DIRECTION_SPANS;
    for (patch, late) in course.late.iter_mut().enumerate() {
        let of_steps: Vec<_> = leaving[patch..].iter().step_by(patches).copied().collect();
        course.of_steps.extend(of_steps[..STEPS].iter().map(pack));
        course.last.push(sum_of(&of_steps[last.clone()]));
        for (step, energy) in of_steps.iter().enumerate() {
            add_to_bin(late, step, energy);
        }
    }
    course
}

kernel! {
    /// Writes the energy that leaves patch `to` for a unit that each patch radiates: `[from × STEPS + step]`. No fused
    /// products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    pub(crate) fn respond<L>(transports: &[Transport], to: u16, response: &mut [BandArray]) {
        for transport in transports.iter().filter(|transport| transport.to == to) {
            let step = usize::from(transport.delay);
            if step < STEPS {
                let sum = &mut response[usize::from(transport.from) * STEPS + step];
                for b in 0..BANDS {
                    sum[b] += transport.leaving[b];
                }
            }
        }
        for step in 1..STEPS {
            for transport in transports {
                let delay = usize::from(transport.delay);
                if delay >= step {
                    continue;
                }
                let source = response[usize::from(transport.to) * STEPS + step - delay];
                let sum = &mut response[usize::from(transport.from) * STEPS + step];
                for b in 0..BANDS {
                    sum[b] += transport.scattered[b] * source[b];
                }
            }
        }
    }
}

kernel! {
    /// Adds what leaves patches, and what they radiate, of what was radiated before: `[step × patches + patch]`. No fused products: all
    /// machines give the same bits.
    fn pass_on<L>(
        transports: &[Transport],
        patches: usize,
        leaving: &mut [BandArray],
        radiated: &mut [BandArray],
    ) {
        for step in 0..leaving.len() / patches {
            for transport in transports {
                let to = (step + usize::from(transport.delay)) * patches;
                if to >= leaving.len() {
                    continue;
                }
                let to = to + usize::from(transport.to);
                let from = L::load(&radiated[step * patches + usize::from(transport.from)]);
                let sum = L::load(&leaving[to]).add(L::load(&transport.leaving).mul(from));
                sum.store(&mut leaving[to]);
                let sum = L::load(&radiated[to]).add(L::load(&transport.scattered).mul(from));
                sum.store(&mut radiated[to]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::diffuse::delay_sums::Arrival;

    /// Half of the energy arrives within less than a step. When errors were carried within a span alone, and none of delays below
    /// one step, the mean delay was 1.5 steps instead of 1.25 and rooms decayed too slowly.
    #[test]
    fn rounding_keeps_the_mean_delay() {
        let patches = 20;
        let mut sums = DelaySums::new(patches);
        for to in 0..patches {
            for steps in [0.5, 2.0] {
                let arrival = Arrival {
                    from: 0,
                    to,
                    steps,
                    in_air: 1.0,
                };
                sums.add(arrival, &[0.025; BANDS], &[0.025; BANDS]);
            }
        }
        let transports = collect(&sums, patches);
        let delays = transports.iter().map(|t| f32::from(t.delay));
        let mean = delays.sum::<f32>() / transports.len() as f32;
        assert!((mean - 1.25).abs() < 0.03, "{mean}");
    }
}
