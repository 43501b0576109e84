//! Energy that arrives at patches, summed by spans of its delay.
//!
//! Own. Each span has one delay, the mean of what is in it. In a flat room or a street most energy of a late span is specular
//! and arrives at many patches alike: with the same ends for all, it would come in bursts with gaps between them. So ends
//! differ from one pair of patches to the next.

use std::ops::Range;

use crate::acoustics::bands::exp_neg;
use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::energy_course::LONG_STEPS;
use crate::propagation::rays::directions::{mix, unit};

/// Ends of the spans in time steps before they are varied; the last span has none.
const SPAN_ENDS: [f32; SPANS - 1] = [
    1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 8.5, 10.5, 13.5, 17.0, 21.5, 27.0, 34.0, 43.0, 54.0, 68.0, 86.0,
    108.0, 136.0, 172.0, 216.0,
];
pub(crate) const SPANS: usize = 22;

/// Least factor of the varied ends, and their range: the ratio of two ends.
const VARIED: (f32, f32) = (0.88, 0.25);

/// Delay in time steps after which nothing is added: the end of the course of energy that begins in the air.
pub(crate) const LONGEST: f32 = LONG_STEPS as f32;

/// Factor of delays before they are compared with the ends of spans, different for each `number`.
pub(crate) fn varied((least, range): (f32, f32), number: usize) -> f32 {
    least + range * unit(mix(number as u64))
}

/// Energy at one patch in one span.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct DelaySum {
    /// Energy that leaves the patch and is heard, and that it radiates.
    pub(crate) leaving: BandArray,
    pub(crate) scattered: BandArray,
    /// Sums of delays in time steps times weights, and of weights.
    steps: f32,
    pub(crate) weight: f32,
}

impl DelaySum {
    fn add(&mut self, steps: f32, gain: f32, leaving: &BandArray, scattered: &BandArray) {
        let weight = gain * leaving.iter().sum::<f32>();
        self.steps += weight * steps;
        self.weight += weight;
        for b in 0..BANDS {
            self.leaving[b] += gain * leaving[b];
            self.scattered[b] += gain * scattered[b];
        }
    }

    /// Mean delay in time steps, if there is any energy.
    pub(crate) fn delay(&self) -> Option<f32> {
        (self.weight > 0.0).then(|| self.steps / self.weight)
    }
}

/// One ray's energy at a patch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arrival {
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// Delay in time steps.
    pub(crate) steps: f32,
    /// What the ray stands for among all that fly through the air.
    pub(crate) in_air: f32,
}

/// Sums of all patches.
#[derive(Debug, Clone, Default)]
pub(crate) struct DelaySums {
    patches: usize,
    /// Of energy that each patch radiates: `[(from × SPANS + span) × patches + to]`.
    of_patches: Vec<DelaySum>,
    /// Of energy that begins in the air, evenly and in all directions: `[span × patches + to]`.
    of_air: Vec<DelaySum>,
}

impl DelaySums {
    pub(crate) fn new(patches: usize) -> Self {
        Self {
            patches,
            of_patches: vec![DelaySum::default(); SPANS * patches * patches],
            of_air: vec![DelaySum::default(); SPANS * patches],
        }
    }

    pub(crate) fn patches(&self) -> usize {
        self.patches
    }

    /// Adds energy that is heard of a patch, and that it radiates.
    pub(crate) fn add(&mut self, arrival: Arrival, leaving: &BandArray, scattered: &BandArray) {
        let Arrival {
            from,
            to,
            steps,
            in_air,
        } = arrival;
        let span = span_of(steps, from * self.patches + to);
        let own = &mut self.of_patches[(from * SPANS + span) * self.patches + to];
        own.add(steps, 1.0, leaving, scattered);
        let span = span_of(steps, to);
        self.of_air[span * self.patches + to].add(steps, in_air, leaving, scattered);
    }

    /// Sums of one patch's energy and one span, by destination.
    pub(crate) fn of_span(&self, from: usize, span: usize) -> &[DelaySum] {
        &self.of_patches[(from * SPANS + span) * self.patches..][..self.patches]
    }

    /// Energy heard of a patch in a field that decays with `rates` in nepers of energy per time step.
    pub(crate) fn leaving(&self, patch: usize, rates: &BandArray) -> BandArray {
        let mut total = [0.0; BANDS];
        for sum in self.of_patches.iter().skip(patch).step_by(self.patches) {
            let Some(delay) = sum.delay() else { continue };
            let lost = exp_neg(&rates.map(|rate| rate * delay));
            for b in 0..BANDS {
                total[b] += sum.leaving[b] / lost[b];
            }
        }
        total
    }

    /// Time steps over which energy that begins in the air arrives evenly, the patch, and the energy.
    pub(crate) fn spread_of_air(&self) -> impl Iterator<Item = (Range<usize>, usize, &DelaySum)> {
        self.of_air.iter().enumerate().filter_map(|(index, sum)| {
            let (span, to) = (index / self.patches, index % self.patches);
            let (middle, half) = (sum.delay()?.round() as usize, half_width(span));
            Some((middle.saturating_sub(half)..middle + half + 1, to, sum))
        })
    }
}

/// Half of the length of a span in time steps, rounded down; the last one is as long as that before.
fn half_width(span: usize) -> usize {
    let end = SPAN_ENDS[span.min(SPANS - 2)];
    let start = match span.min(SPANS - 2) {
        0 => 0.0,
        span => SPAN_ENDS[span - 1],
    };
    (0.5 * (end - start)) as usize
}

/// Span of a delay in time steps.
fn span_of(steps: f32, number: usize) -> usize {
    let steps = steps * varied(VARIED, number);
    SPAN_ENDS.partition_point(|end| steps >= *end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::diffuse::fit_spans::STEPS;

    /// Energy that arrives evenly over time at all patches has no bursts: what is in a tenth of the time is within 1.5 dB of
    /// what came. With the same ends for all it was none in some and four times as much in others.
    #[test]
    fn energy_that_arrives_evenly_leaves_no_gaps() {
        let patches = 28;
        let mut sums = DelaySums::new(patches);
        for to in 0..patches {
            for part in 0..10 * LONGEST as u32 {
                let steps = 0.1 * part as f32;
                let arrival = Arrival {
                    from: 0,
                    to,
                    steps,
                    in_air: 1.0,
                };
                sums.add(arrival, &[0.1; BANDS], &[0.0; BANDS]);
            }
        }
        let mut tenths = [0.0; 10];
        for span in 0..SPANS {
            for sum in sums.of_span(0, span) {
                let tenth = sum.delay().map_or(0, |delay| delay as usize / (STEPS / 10));
                if let Some(tenth) = tenths.get_mut(tenth) {
                    *tenth += sum.leaving[0];
                }
            }
        }
        for (tenth, energy) in tenths.iter().enumerate() {
            let off_db = 10.0 * (energy / (patches * STEPS / 10) as f32).log10();
            assert!(off_db.abs() < 1.5, "tenth {tenth}: {off_db} dB");
        }
    }
}
