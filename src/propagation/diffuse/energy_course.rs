//! The course of energy that begins in the air, evenly and in all directions.
//!
//! Own. It is known for three times as long as the responses of patches, because it is one course for each patch and not one for each
//! pair of them. What a source sends has the same course after fifty mean free times, unless it is still passing from room to room.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::fit_spans::{LONG_SPANS, SPAN_ENDS, STEPS};

/// Time steps of the course.
pub(crate) const LONG_STEPS: usize = 240;

/// Length in time steps of the bins in which late energy is known.
pub(crate) const BIN_STEPS: usize = 10;

/// Bins after the responses.
const BINS: usize = (LONG_STEPS - STEPS) / BIN_STEPS;

/// Energy in the last bin of the responses, of which later ones get what is delayed, and in each bin after them.
pub(crate) type LateBins = [BandArray; BINS + 1];

/// Times at which [`EnergyCourse`] is known: each time step of the responses, and the bins' ends.
const TIMES: usize = STEPS + BINS + 1;

/// What arrives at a listener.
#[derive(Debug, Clone)]
pub(crate) struct EnergyCourse {
    /// Energy from each time on.
    left: [BandArray; TIMES],
}

impl Default for EnergyCourse {
    fn default() -> Self {
        Self {
            left: [[0.0; BANDS]; TIMES],
        }
    }
}

impl EnergyCourse {
    /// Of energies in each time step of the responses and in each bin.
    pub(crate) fn set(&mut self, of_steps: &[BandArray; STEPS], of_bins: &LateBins) {
        let mut left = [0.0; BANDS];
        let backwards = of_bins[1..].iter().rev().chain(of_steps.iter().rev());
        self.left[TIMES - 1] = left;
        for (sum, energy) in self.left[..TIMES - 1].iter_mut().rev().zip(backwards) {
            for b in 0..BANDS {
                left[b] += energy[b];
            }
            *sum = left;
        }
    }

    /// Energy in each span of the fit, which begins at a time step, and number of spans that end within the course.
    pub(crate) fn spans_from(&self, start: f32) -> ([BandArray; LONG_SPANS], usize) {
        let start = start.clamp(0.0, LONG_STEPS as f32);
        let mut before = self.left_at(start);
        let spans = SPAN_ENDS.map(|end| {
            let after = self.left_at(start + end as f32);
            let energy = std::array::from_fn(|b| (before[b] - after[b]).max(0.0));
            before = after;
            energy
        });
        let is_within = |end: &&usize| start + **end as f32 <= LONG_STEPS as f32;
        (spans, SPAN_ENDS.iter().filter(is_within).count())
    }

    /// Energy from a time step on; even between the times at which it is known.
    fn left_at(&self, step: f32) -> BandArray {
        let time = match step < STEPS as f32 {
            true => step,
            false => STEPS as f32 + (step - STEPS as f32) / BIN_STEPS as f32,
        };
        let whole = (time as usize).min(TIMES - 2);
        let rest = (time - whole as f32).min(1.0);
        let [now, later] = [self.left[whole], self.left[whole + 1]];
        std::array::from_fn(|b| now[b] + rest * (later[b] - now[b]))
    }
}

/// Adds energy in a time step to that of its bin.
pub(crate) fn add_to_bin(bins: &mut LateBins, step: usize, energy: &BandArray) {
    let after = step.checked_sub(STEPS - BIN_STEPS);
    let Some(bin) = after.and_then(|after| bins.get_mut(after / BIN_STEPS)) else {
        return;
    };
    for b in 0..BANDS {
        bin[b] += energy[b];
    }
}

/// Adds what arrives of energy that leaves a patch, times a gain, `delay` time steps later; longer delays count as one bin.
pub(crate) fn add_bins(sums: &mut LateBins, leaving: &LateBins, gain: &BandArray, delay: f32) {
    let share = (delay / BIN_STEPS as f32).clamp(0.0, 1.0);
    let mut before = [0.0; BANDS];
    for (sum, leaving) in sums.iter_mut().zip(leaving) {
        for b in 0..BANDS {
            sum[b] += gain[b] * (leaving[b] + share * (before[b] - leaving[b]));
        }
        before = *leaving;
    }
}

/// Adds a response in bins, of all time steps, times a gain, `delay` time steps later.
#[inline(always)]
pub(crate) fn add_response(
    sums: &mut LateBins,
    response: &[BandArray],
    gain: &BandArray,
    delay: f32,
) {
    let delay = (delay / BIN_STEPS as f32).clamp(0.0, STEPS as f32);
    let whole = delay as usize;
    let rest = delay - whole as f32;
    for (bin, sum) in sums.iter_mut().enumerate().skip(1) {
        let at = bin + STEPS / BIN_STEPS - 1;
        let Some(now) = at.checked_sub(whole) else {
            continue;
        };
        let before = match now {
            0 => [0.0; BANDS],
            now => response[now - 1],
        };
        for b in 0..BANDS {
            sum[b] += gain[b] * (response[now][b] + rest * (before[b] - response[now][b]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energy of a decay by `rate` nepers a time step between two times.
    fn decayed(rate: f32, [from, to]: [f32; 2]) -> f32 {
        (-rate * from).exp() - (-rate * to).exp()
    }

    fn bins(rate: f32) -> LateBins {
        std::array::from_fn(|bin| {
            let end = (STEPS + BIN_STEPS * bin) as f32;
            [decayed(rate, [end - BIN_STEPS as f32, end]); BANDS]
        })
    }

    /// An even decay of 6 or 20 dB in the responses, from several starts on: the energy in each span is that of the decay.
    #[test]
    fn spans_of_a_decay_have_its_energy() {
        for rate in [0.0173f32, 0.0576] {
            let of_steps = std::array::from_fn(|step| {
                let step = step as f32;
                [decayed(rate, [step, step + 1.0]); BANDS]
            });
            let mut course = EnergyCourse::default();
            course.set(&of_steps, &bins(rate));
            for start in [0.0f32, 0.3, 7.5, 40.0, 95.0] {
                let (spans, within) = course.spans_from(start);
                let mut begin = start;
                for (energy, end) in spans.iter().zip(SPAN_ENDS).take(within) {
                    let end = start + end as f32;
                    assert!(end <= LONG_STEPS as f32);
                    let off_db = 10.0 * (energy[3] / decayed(rate, [begin, end])).log10();
                    assert!(off_db.abs() < 1.0, "{rate}, {start}: to {end} {off_db} dB");
                    begin = end;
                }
            }
            assert_eq!(course.spans_from(0.0).1, LONG_SPANS);
        }
    }

    /// A delay of eight steps at 10 dB in the responses.
    #[test]
    fn bins_that_are_delayed_keep_the_course() {
        let rate = 0.0288f32;
        let mut sums = LateBins::default();
        add_bins(&mut sums, &bins(rate), &[2.0; BANDS], 8.0);
        for (found, leaving) in sums.iter().zip(bins(rate)).skip(1) {
            let off_db = 10.0 * (found[0] / leaving[0] / 2.0 / (8.0 * rate).exp()).log10();
            assert!(off_db.abs() < 0.3, "{off_db} dB");
        }
    }

    #[test]
    fn time_steps_are_in_their_bins() {
        let mut bins = LateBins::default();
        for step in 0..LONG_STEPS + 10 {
            add_to_bin(&mut bins, step, &[1.0; BANDS]);
        }
        assert!(bins.iter().all(|bin| bin[0] == BIN_STEPS as f32));
    }
}
