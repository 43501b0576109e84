//! Energy envelope of the late reverb: decays that start at a few times, fitted to what arrives.
//!
//! Own. The generator's network can start a decay but not end one: the late reverb is a sum of the groups' decays that
//! start [`LATE_SEGMENT_STARTS`] after the straight line's arrival. Their energies are non-negative and fitted to the
//! arriving energy over time, by least squares of errors relative to the highest level from there on: early and late spans
//! count alike, and gaps in a noisy estimate no more than peaks. A slow start is a late one. The sum of the energies is that
//! of the arrivals, so early and late sound join without a gap.
//!
//! Decays of similar lengths can replace each other, and least squares alone gives all energy to one of them, another one for
//! a little noise; each sounds through lines of its own. The fit therefore multiplies from a start in which all have a share,
//! slow decays a larger one, and ends before it is exact (image space reconstruction, \[DAUBE86\]): the result is a smooth
//! function of the arrivals. The second group may be slower than the first, which has the slowest decay of the field: it starts with
//! little, since arrivals that fall by few decibels do not tell the two apart.
//!
//! In coupled rooms, and in rooms that are live in some directions only, the decay goes on changing after the end of the responses. The
//! arrivals there are those of the patches' energy (`long_responses`); as far as few rays carry the
//! source's, they have the course of energy that begins in the air (`EnergyCourse`).

use crate::acoustics::bands::exp_neg;
use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::energy_course::{EnergyCourse, LateBins};
use crate::propagation::diffuse::fit_spans::{LONG_SPANS, SPAN_ENDS, SPAN_OF_STEP, SPANS, STEPS};
use crate::propagation::diffuse::steady_tail::{Arriving, continued, steady};
use crate::propagation::late_group::{LATE_GROUPS, LateGroup};
use crate::propagation::path::{LATE_SEGMENTS, LateEnergy};
use crate::simd::{LaneSet, Lanes, kernel};

/// 60 dB in nepers of energy.
pub(crate) const NEPERS_OF_60_DB: f64 = 6.0 * std::f64::consts::LN_10;

/// Starts of each group's segments, in mean free times after the straight line's arrival.
///
/// The last ones are for energy that builds up slowly, as in a room behind another one: the first group has one in all scenes, the second one
/// where energy still arrives from other spaces late. The third group has none.
pub const LATE_SEGMENT_STARTS: [[f64; LATE_SEGMENTS]; LATE_GROUPS] = [
    [0.0, 1.0, 3.5, 9.5, 25.0],
    [0.0, 1.0, 3.5, 9.5, 45.0],
    [0.0, 1.0, 3.5, 9.5, 25.0],
];

/// Latest start in seconds: a source's delay line is as long.
const LATEST_S: f32 = 0.35;

/// Mean free time in time steps of the scene's responses, roughly.
pub(crate) const STEPS_PER_FREE_TIME: f32 = 1.6;

// Time steps are converted from numbers with a fraction to bytes, which saturate beyond them.
const _: () = assert!(STEPS < u8::MAX as usize);

/// Least number of spans.
const MIN_SPANS: usize = 6;

/// Level below the loudest span at which relative errors count less: 45 dB.
const FIT_RANGE: f32 = 3.2e-5;

/// Rounds of the fit: more follow noise, fewer miss slow starts. Each multiplies by the power 3/2 of what a plain one does, so they go as
/// far as 120 of those.
const ROUNDS: usize = 80;

/// Share of a group at the start of the fit relative to the next faster one. In a corridor, whose decay is no exponential, the
/// slow one is what is heard in the end.
const SLOWER_SHARE: f32 = 4.0;

/// Power of the ratio of its rate to the first group's that the second group's start is multiplied by, if it is slower. With its
/// full start it kept a fifth of the energy in closed rooms of one decay, and T30 was 6 to 16 % too long there.
const BEYOND_SLOWEST: i32 = 9;

const LAST_SEGMENT: usize = LATE_SEGMENTS - 1;

/// Share of the last segment at the start of the fit relative to the earlier ones of its group. With an equal one it took from
/// these in a dead room beside a live one too, where T20 was 12.5 % off instead of 9.7.
const LAST_SHARE: f32 = 0.05;

/// All groups have all segments but the last, the first two have all.
const COLUMNS: usize = LATE_GROUPS * LATE_SEGMENTS - 1;

/// Columns of the last segments.
const LAST: usize = LAST_SEGMENT;
const SLOWER_LAST: usize = LATE_SEGMENTS + LAST_SEGMENT;

/// Group and segment of a column of the fit.
const fn group_and_segment(column: usize) -> (usize, usize) {
    (column / LATE_SEGMENTS, column % LATE_SEGMENTS)
}

/// Start of a group's segment in time steps.
fn start_steps(group: usize, segment: usize) -> f32 {
    LATE_SEGMENT_STARTS[group][segment] as f32 * STEPS_PER_FREE_TIME
}

/// Whether the second group's last segment is within a source's delay line, for time steps in seconds.
pub(crate) fn has_slower_last(step_s: f32) -> bool {
    start_steps(1, LAST_SEGMENT) * step_s <= LATEST_S
}

/// The decays that arrivals are fitted by.
#[derive(Debug, Clone)]
pub(crate) struct DecayColumns {
    /// Energy in each span of every decay of unit energy.
    spans: [[BandArray; LONG_SPANS]; COLUMNS],
    /// Starts of the fit, relative to those of the last group.
    starts: [BandArray; COLUMNS],
    /// Whether the last segments of the first two groups have energy in any band.
    has_last: [bool; 2],
}

impl Default for DecayColumns {
    fn default() -> Self {
        Self {
            spans: [[[0.0; BANDS]; LONG_SPANS]; COLUMNS],
            starts: [[1.0; BANDS]; COLUMNS],
            has_last: [false; 2],
        }
    }
}

impl DecayColumns {
    /// For decay rates in nepers per second, time steps in seconds, the share of [`PatchDecays::growth`] that the second group is for, and
    /// whether that is the slow one.
    ///
    /// [`PatchDecays::growth`]: crate::propagation::diffuse::decay_fit::PatchDecays::growth
    pub(crate) fn new(
        rates: &[BandArray; LATE_GROUPS],
        spreading: &BandArray,
        is_second_slow: &[bool; BANDS],
        step_s: f32,
    ) -> Self {
        let mut columns = Self::default();
        for (number, start) in columns.starts.iter_mut().enumerate() {
            let (group, segment) = group_and_segment(number);
            *start = [SLOWER_SHARE.powi((LATE_GROUPS - 1 - group) as i32); BANDS];
            for b in 0..BANDS {
                let ratio = (rates[1][b] / rates[0][b]).min(1.0);
                // The second group is the slow one where the first one has a mode of its own.
                if is_second_slow[b] {
                    start[b] *= match (group, segment) {
                        (0, LAST_SEGMENT) => LAST_SHARE / SLOWER_SHARE,
                        (0, _) => 1.0 / SLOWER_SHARE,
                        (1, LAST_SEGMENT) => LAST_SHARE * SLOWER_SHARE,
                        (1, _) => SLOWER_SHARE,
                        _ => 1.0,
                    };
                    continue;
                }
                start[b] *= match (group, segment) {
                    (1, LAST_SEGMENT) => LAST_SHARE * spreading[b] * ratio.powi(BEYOND_SLOWEST),
                    (1, _) => ratio.powi(BEYOND_SLOWEST),
                    (0, LAST_SEGMENT) => LAST_SHARE,
                    _ => 1.0,
                };
            }
        }
        for (number, column) in columns.spans.iter_mut().enumerate() {
            let (group, segment) = group_and_segment(number);
            let rate = &rates[group];
            let start = start_steps(group, segment);
            let is_last = segment == LAST_SEGMENT;
            let left = |edge: f32| {
                let after_s = (edge - start).max(0.0) * step_s;
                exp_neg(&rate.map(|rate| rate * after_s))
            };
            let mut before = left(0.0);
            for (span, end) in column.iter_mut().zip(SPAN_ENDS) {
                // Energy at a time step is what arrives half a step around it.
                let after = left(end as f32 - 0.5);
                for b in 0..BANDS {
                    let is_asked_for = group == 0 || spreading[b] > 0.0;
                    let is_used = !is_last || start * step_s <= LATEST_S && is_asked_for;
                    span[b] = if is_used { before[b] - after[b] } else { 0.0 };
                }
                before = after;
            }
        }
        columns.has_last = [LAST, SLOWER_LAST].map(|last| {
            let energies = columns.spans[last].as_flattened();
            energies.iter().any(|energy| *energy > 0.0)
        });
        columns
    }
}

/// Arriving energy per time step after the straight line.
#[derive(Debug, Clone)]
pub(crate) struct ArrivalHistogram {
    step_s: f32,
    /// Arrival of the straight line: delays count from here.
    nearest_s: f32,
    pub(crate) energy: [BandArray; STEPS],
    /// Energy in each bin after the responses; these and the bins count from emission.
    pub(crate) late: LateBins,
    /// Variance of the energy in each span of the fit, as far as few rays carry it.
    variance: [BandArray; SPANS],
    /// The part of the energy in each span that few rays carry.
    of_few: [BandArray; SPANS],
}

impl ArrivalHistogram {
    pub(crate) fn new(step_s: f32, nearest_s: f32) -> Self {
        Self {
            step_s,
            nearest_s,
            energy: [[0.0; BANDS]; STEPS],
            late: LateBins::default(),
            variance: [[0.0; BANDS]; SPANS],
            of_few: [[0.0; BANDS]; SPANS],
        }
    }

    /// Arrival of the straight line in time steps after emission.
    #[inline]
    pub(crate) fn nearest_steps(&self) -> f32 {
        self.nearest_s / self.step_s
    }

    /// Time step before a delay, and the share of the one after it.
    #[inline(always)]
    fn step_of(&self, delay_s: f32) -> (usize, f32) {
        let at = ((delay_s - self.nearest_s) / self.step_s).clamp(0.0, STEPS as f32);
        // Few instructions convert to a small number, many to a large one.
        let whole = at as u8;
        (whole.into(), at - f32::from(whole))
    }

    /// Adds an arrival, divided between two time steps. Infinite ones are left out: a source at an infinite distance is silent.
    #[inline(always)]
    pub(crate) fn add(&mut self, delay_s: f32, energy: &BandArray) {
        self.add_at(self.step_of(delay_s), energy);
    }

    /// Adds an arrival at a time step and a share of the one after it.
    #[inline(always)]
    fn add_at(&mut self, (whole, rest): (usize, f32), energy: &BandArray) {
        if !energy.iter().all(|e| e.is_finite()) {
            return;
        }
        for (step, share) in [(whole, 1.0 - rest), (whole + 1, rest)] {
            if let Some(sum) = self.energy.get_mut(step) {
                for b in 0..BANDS {
                    sum[b] += share * energy[b];
                }
            }
        }
    }

    /// Adds an arrival of a relative variance.
    #[inline(always)]
    pub(crate) fn add_of_few(&mut self, delay_s: f32, energy: &BandArray, variance: f32) {
        let (whole, rest) = self.step_of(delay_s);
        self.add_at((whole, rest), energy);
        for (step, share) in [(whole, 1.0 - rest), (whole + 1, rest)] {
            // The sum is a continuous function of the delay.
            if let Some(span) = SPAN_OF_STEP.get(step) {
                let span = usize::from(*span);
                for b in 0..BANDS {
                    self.variance[span][b] += share * variance * energy[b] * energy[b];
                    self.of_few[span][b] += share * energy[b];
                }
            }
        }
    }

    /// The arrivals of the patches' energy, in time steps after emission.
    fn course(&self) -> EnergyCourse {
        let mut of_steps = [[0.0; BANDS]; STEPS];
        let first = (self.nearest_steps().round() as usize).min(STEPS);
        of_steps[first..].copy_from_slice(&self.energy[..STEPS - first]);
        let mut course = EnergyCourse::default();
        course.set(&of_steps, &self.late);
        course
    }

    /// Fits decays to the arrivals; `weight` is the sum of their weights, `of_air` what arrives of energy that begins in the air.
    /// Returns the shares of the groups in the energy of each span.
    pub(crate) fn fit(
        &self,
        columns: &DecayColumns,
        of_air: &EnergyCourse,
        weight: f32,
        late: &mut LateEnergy,
    ) -> GroupShares {
        // Responses end `STEPS` after emission.
        let valid = STEPS.saturating_sub((self.nearest_s / self.step_s) as usize);
        let known = SPAN_ENDS.iter().filter(|end| **end <= valid).count();
        let known = known.clamp(MIN_SPANS, SPANS);
        let mut energy = [[0.0; BANDS]; LONG_SPANS];
        let mut first = 0;
        for (sum, end) in energy.iter_mut().zip(SPAN_ENDS).take(known) {
            for step in &self.energy[first..end] {
                for b in 0..BANDS {
                    sum[b] += step[b];
                }
            }
            first = end;
        }
        let (air, within) = of_air.spans_from(self.nearest_steps());
        let arriving = Arriving {
            energy: &mut energy[..known],
            of_few: &self.of_few,
            variance: &self.variance,
        };
        let drawn = steady(arriving, &air[..known]);
        let own = self.course().spans_from(self.nearest_steps()).0;
        let spans = continued(&mut energy, known, within, [&own, &air], &drawn);
        let mut weights = [[1.0; BANDS]; LONG_SPANS];
        for sum in energy.as_flattened_mut() {
            *sum /= weight;
        }
        let mut fitted = [[0.0; BANDS]; COLUMNS];
        fit(
            LaneSet::best(),
            &energy[..spans],
            known,
            &mut weights,
            columns,
            &mut fitted,
        );
        late.energy = [[[0.0; BANDS]; LATE_SEGMENTS]; LATE_GROUPS];
        for (number, energy) in fitted.iter().enumerate() {
            let (group, segment) = group_and_segment(number);
            late.energy[group][segment] = *energy;
        }
        GroupShares::of(columns, &fitted)
    }
}

/// Shares of the groups in the energy of each span of the fit.
#[derive(Debug, Clone)]
pub(crate) struct GroupShares([[BandArray; LATE_GROUPS]; SPANS]);

impl GroupShares {
    fn of(columns: &DecayColumns, fitted: &[BandArray; COLUMNS]) -> Self {
        let mut shares = [[[0.0; BANDS]; LATE_GROUPS]; SPANS];
        divide(LaneSet::best(), &columns.spans, fitted, &mut shares);
        Self(shares)
    }

    /// The shares at a time step after the straight line's arrival.
    #[inline(always)]
    pub(crate) fn at(&self, step: f32) -> &[BandArray; LATE_GROUPS] {
        let step = usize::from(step as u8).min(STEPS - 1);
        &self.0[usize::from(SPAN_OF_STEP[step])]
    }
}

kernel! {
    /// Shares of the groups in the energy of each span. No fused products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn divide<L>(
        columns: &[[BandArray; LONG_SPANS]; COLUMNS],
        fitted: &[BandArray; COLUMNS],
        shares: &mut [[BandArray; LATE_GROUPS]; SPANS],
    ) {
        for (span, shares) in shares.iter_mut().enumerate() {
            let mut total = [f32::MIN_POSITIVE; BANDS];
            for number in 0..COLUMNS {
                let share = &mut shares[group_and_segment(number).0];
                for b in 0..BANDS {
                    let energy = columns[number][span][b] * fitted[number][b];
                    share[b] += energy;
                    total[b] += energy;
                }
            }
            for share in shares {
                for b in 0..BANDS {
                    share[b] /= total[b];
                }
            }
        }
    }
}

/// Time steps of a span.
fn steps_of(span: usize) -> f32 {
    let first = if span == 0 { 0 } else { SPAN_ENDS[span - 1] };
    (SPAN_ENDS[span] - first) as f32
}

kernel! {
    /// Non-negative least squares of relative errors times `weights`, which become those of absolute errors; the result is scaled to
    /// the energy of the first `known` spans. No fused products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn fit<L>(
        energy: &[BandArray],
        known: usize,
        weights: &mut [BandArray; LONG_SPANS],
        decays: &DecayColumns,
        fitted: &mut [BandArray; COLUMNS],
    ) {
        let columns = &decays.spans;
        let mut loudest = [f32::MIN_POSITIVE; BANDS];
        for span in energy {
            for b in 0..BANDS {
                loudest[b] = if span[b] > loudest[b] { span[b] } else { loudest[b] };
            }
        }
        // Columns over the energies, and their products.
        let mut highest = [0.0f32; BANDS];
        for span in (0..energy.len()).rev() {
            let steps = steps_of(span);
            for b in 0..BANDS {
                let level = energy[span][b] / steps;
                highest[b] = if level > highest[b] { level } else { highest[b] };
                weights[span][b] *= loudest[b] / (highest[b] * steps + FIT_RANGE * loudest[b]);
            }
        }
        let mut shares = [[0.0; BANDS]; LONG_SPANS];
        for (share, sum) in shares.iter_mut().zip(energy) {
            for b in 0..BANDS {
                share[b] = sum[b] / loudest[b];
            }
        }
        let weighted = (&weights[..energy.len()], &shares[..energy.len()]);
        match decays.has_last {
            [_, true] => multiply::<L, COLUMNS>(weighted, decays, fitted),
            [true, false] => multiply::<L, { COLUMNS - 1 }>(weighted, decays, fitted),
            [false, false] => multiply::<L, { COLUMNS - 2 }>(weighted, decays, fitted),
        }
        let (mut model, mut total) = ([0.0f32; BANDS], [0.0f32; BANDS]);
        for (span, energy) in energy.iter().enumerate().take(known) {
            for b in 0..BANDS {
                total[b] += energy[b];
                for p in 0..COLUMNS {
                    model[b] += columns[p][span][b] * fitted[p][b];
                }
            }
        }
        for column in fitted.iter_mut() {
            for b in 0..BANDS {
                let scale = if model[b] > 0.0 { total[b] / model[b] } else { 0.0 };
                column[b] *= scale;
            }
        }
    }
}

/// Number `index` of the columns that are fitted: all, or all but the last segments'. Without energy these would have none of the
/// arrivals, and their products are zeros.
#[inline(always)]
fn column_of<const COUNT: usize>(index: usize) -> usize {
    let without_last = COUNT + 2 <= COLUMNS && index >= LAST;
    let column = index + usize::from(without_last);
    column + usize::from(COUNT < COLUMNS && column >= SLOWER_LAST)
}

/// The rounds of the fit of `COUNT` columns, for spans of given weights and shares of the loudest one.
#[inline(always)]
fn multiply<L: Lanes, const COUNT: usize>(
    (weights, shares): (&[BandArray], &[BandArray]),
    decays: &DecayColumns,
    result: &mut [BandArray; COLUMNS],
) {
    let columns = &decays.spans;
    let mut products = [[[0.0f32; BANDS]; COUNT]; COUNT];
    let mut targets = [[0.0f32; BANDS]; COUNT];
    for p in 0..COUNT {
        let column = &columns[column_of::<COUNT>(p)];
        let mut weighted = [[0.0f32; BANDS]; LONG_SPANS];
        for (span, (weight, share)) in weights.iter().zip(shares).enumerate() {
            for b in 0..BANDS {
                weighted[span][b] = column[span][b] * weight[b];
                targets[p][b] += weighted[span][b] * share[b] * weight[b];
            }
        }
        for q in 0..=p {
            let column = &columns[column_of::<COUNT>(q)];
            let mut sum = [0.0f32; BANDS];
            for (span, weight) in weights.iter().enumerate() {
                for b in 0..BANDS {
                    sum[b] += weighted[span][b] * column[span][b] * weight[b];
                }
            }
            products[p][q] = sum;
            products[q][p] = sum;
        }
    }
    let mut fitted = [[0.0f32; BANDS]; COUNT];
    for p in 0..COUNT {
        let start = &decays.starts[column_of::<COUNT>(p)];
        for b in 0..BANDS {
            let mut sum = f32::MIN_POSITIVE;
            for q in 0..COUNT {
                sum += products[p][q][b];
            }
            fitted[p][b] = start[b] * targets[p][b] / sum;
        }
    }
    for _ in 0..ROUNDS {
        let mut before = [L::splat(0.0); COUNT];
        for q in 0..COUNT {
            before[q] = L::load(&fitted[q]);
        }
        for p in 0..COUNT {
            let mut sum = L::splat(f32::MIN_POSITIVE);
            for q in 0..COUNT {
                sum = sum.add(L::load(&products[p][q]).mul(before[q]));
            }
            let mut model = [0.0; BANDS];
            sum.store(&mut model);
            for b in 0..BANDS {
                let factor = targets[p][b] / model[b];
                fitted[p][b] *= factor * factor.sqrt();
            }
        }
    }
    for (p, fitted) in fitted.iter().enumerate() {
        result[column_of::<COUNT>(p)] = *fitted;
    }
}

/// One start of the late reverb's decay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LateSegment {
    /// Index of the decay among the groups.
    pub group: u8,
    /// Seconds from emission.
    pub start_s: f32,
    /// Energy per second added to the envelope by this start, extrapolated back to emission, in 1/s.
    pub energy_per_s: BandArray,
}

/// The late energy of one source as starts of decays of the groups, group by group in the order of the starts, without silent ones
/// at a group's end. Real-time safe.
pub fn late_segments(
    late: &LateEnergy,
    groups: &[LateGroup; LATE_GROUPS],
) -> impl Iterator<Item = LateSegment> {
    let (late, groups) = (*late, *groups);
    let is_heard = move |&(group, segment): &(usize, usize)| {
        let from_here = late.energy[group][segment..].as_flattened();
        from_here.iter().any(|energy| *energy > 0.0)
    };
    let heard = (0..COLUMNS).map(group_and_segment).filter(is_heard);
    heard.map(move |(group, segment)| {
        let after = LATE_SEGMENT_STARTS[group][segment] * f64::from(late.mean_free_time_s);
        let start_s = f64::from(late.start_s) + after;
        let energy = &late.energy[group][segment];
        let decay_time_s = &groups[group].decay_time_s;
        let energy_per_s = std::array::from_fn(|b| {
            let rate = NEPERS_OF_60_DB / f64::from(decay_time_s[b]).max(1e-3);
            let at_emission = f64::from(energy[b]) * rate * (rate * start_s).exp();
            at_emission.clamp(0.0, MAX_ENERGY_PER_S) as f32
        });
        LateSegment {
            group: group as u8,
            start_s: start_s as f32,
            energy_per_s,
        }
    })
}

/// Bound for finite single precision, far above audible decays.
const MAX_ENERGY_PER_S: f64 = 1e30;

#[cfg(test)]
#[path = "envelope_tests.rs"]
mod tests;
