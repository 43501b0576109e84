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

/// Least relative change of a patch's energies in [`DelaySums::balance`]: they stay positive.
const LEAST_MORE: f32 = -0.9;

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
    /// By how much the energy that is scattered of each patch's is less than its own rays found.
    missing: Vec<BandArray>,
}

impl DelaySums {
    pub(crate) fn new(patches: usize) -> Self {
        Self {
            patches,
            of_patches: vec![DelaySum::default(); SPANS * patches * patches],
            of_air: vec![DelaySum::default(); SPANS * patches],
            missing: vec![[0.0; BANDS]; patches],
        }
    }

    pub(crate) fn patches(&self) -> usize {
        self.patches
    }

    /// Adds energy that is heard of a patch, and that it radiates.
    pub(crate) fn add(&mut self, arrival: Arrival, leaving: &BandArray, scattered: &BandArray) {
        self.add_between(arrival, 1.0, leaving, scattered);
        self.add_of_air(arrival, leaving, scattered);
    }

    /// Adds energy that a patch scatters, and what the patch that it came from would scatter of the same ray backwards: both are
    /// estimates of one exchange. [`Self::balance`] has to follow.
    pub(crate) fn add_both_ways(
        &mut self,
        arrival: Arrival,
        scattered: &BandArray,
        backwards: &BandArray,
    ) {
        self.add_between(arrival, 0.5, scattered, scattered);
        self.add_of_air(arrival, scattered, scattered);
        for b in 0..BANDS {
            self.missing[arrival.from][b] += 0.5 * scattered[b];
        }
        let (from, to) = (arrival.to, arrival.from);
        let reversed = Arrival {
            from,
            to,
            ..arrival
        };
        self.add_between(reversed, 0.5, backwards, backwards);
        for b in 0..BANDS {
            self.missing[from][b] -= 0.5 * backwards[b];
        }
    }

    fn add_between(
        &mut self,
        arrival: Arrival,
        gain: f32,
        leaving: &BandArray,
        scattered: &BandArray,
    ) {
        let Arrival { from, to, .. } = arrival;
        let span = span_of(arrival.steps, from * self.patches + to);
        let own = &mut self.of_patches[(from * SPANS + span) * self.patches + to];
        own.add(arrival.steps, gain, leaving, scattered);
    }

    fn add_of_air(&mut self, arrival: Arrival, leaving: &BandArray, scattered: &BandArray) {
        let Arrival {
            to, steps, in_air, ..
        } = arrival;
        let own = &mut self.of_air[span_of(steps, to) * self.patches + to];
        own.add(steps, in_air, leaving, scattered);
    }

    /// Gives what each patch's energy leaves at all patches the level that its own rays found: the exchange takes and adds no energy.
    pub(crate) fn balance(&mut self) {
        let rows = self
            .of_patches
            .chunks_exact_mut((SPANS * self.patches).max(1));
        for (row, missing) in rows.zip(&mut self.missing) {
            let mut total = [0.0; BANDS];
            for sum in &*row {
                for b in 0..BANDS {
                    total[b] += sum.scattered[b];
                }
            }
            let more: BandArray = std::array::from_fn(|b| match total[b] > 0.0 {
                true => (missing[b] / total[b]).max(LEAST_MORE),
                false => 0.0,
            });
            for sum in row {
                for b in 0..BANDS {
                    let more = more[b] * sum.scattered[b];
                    sum.scattered[b] += more;
                    sum.leaving[b] += more;
                }
            }
            *missing = [0.0; BANDS];
        }
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

    /// A small patch and a large one of other scattering. Its own ray found that the first sends 0.02 to the second, and a ray of the second
    /// one that it sends nothing to the first: each direction gets the mean, and no patch's energy changes.
    #[test]
    fn an_exchange_has_the_rays_of_both_directions() {
        let mut sums = DelaySums::new(2);
        let steps = 4.0;
        let arrival = |from, to| Arrival {
            from,
            to,
            steps,
            in_air: 0.0,
        };
        let all = |energy: f32| [energy; BANDS];
        // Areas of 1 and 4, which scatter 0.5 and 0.2 of what arrives: of 0.1 of the first one's energy.
        sums.add_both_ways(arrival(0, 1), &all(0.1 * 0.2), &all(0.1 * 0.5 / 4.0));
        sums.add_both_ways(arrival(0, 0), &all(0.9 * 0.5), &all(0.9 * 0.5));
        sums.add_both_ways(arrival(1, 1), &all(0.2), &all(0.2));
        sums.balance();
        let sent = |from: usize, to: usize| -> f32 {
            let spans = (0..SPANS).map(|span| sums.of_span(from, span)[to]);
            let sums = spans.map(|sum| {
                assert_eq!(sum.leaving, sum.scattered);
                sum.scattered[3]
            });
            sums.sum()
        };
        let totals = [0, 1].map(|from| sent(from, 0) + sent(from, 1));
        assert!((totals[0] - 0.47).abs() < 1e-6 && (totals[1] - 0.2).abs() < 1e-6);
        let incident = [sent(0, 1) / 0.2, 4.0 * sent(1, 0) / 0.5];
        assert!(
            incident.iter().all(|e| (e / 0.05 - 1.0).abs() < 0.04),
            "{incident:?}"
        );
    }

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
