//! Decay rates of the late reverb's groups: a few that the whole scene shares.
//!
//! Own; after common slopes (\[GOTZ23\]). The first group has the decay of what is left late of the scene's energy, the last
//! one the decay within the deadest surroundings, by Eyring's formula. The second one lies between, near the first; where both
//! are alike, it is slower than they are, since energy that passes from room to room decays more slowly than in any of them.
//! Energies depend on the positions of sources and listener, decays do not: sound that is under way keeps its decay while they move.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::energy_course::BIN_STEPS;
use crate::propagation::diffuse::envelope::{DecayColumns, NEPERS_OF_60_DB, has_slower_last};
use crate::propagation::diffuse::fit_spans::DIRECTION_SPANS;
use crate::propagation::diffuse::late_states::MODES;
use crate::propagation::diffuse::long_responses::STATE_BINS;
use crate::propagation::diffuse::surface_samples::MAX_PATCHES;
use crate::propagation::late_group::LATE_GROUPS;

/// Range of reverberation times in seconds: shorter ones are inaudible with the generator's delay lines, longer ones are
/// numerical accidents.
const DECAY_RANGE_S: (f32, f32) = (0.07, 30.0);

/// Falls in dB of the energy over its course up to which the slow decay is [`PatchDecays::slowest`], and from which on it is fitted:
/// where energy falls by few decibels, a line through them follows its fluctuations.
const SLOWEST_UP_TO_DB: f32 = 10.0;
pub(crate) const FITTED_FROM_DB: f32 = 20.0;

/// Time steps at the start and end of the course that the fall is taken between.
const FALL_STEPS: usize = 10;

/// Shares of all energy that are still to come where the fit of the slow decay begins and ends: −10 and −40 dB.
const SLOW_FIT: [f64; 2] = [1e-1, 1e-4];

/// Ratio of the decay rates, in octaves, up to which they are one and from which on they are two.
const ONE_DECAY: f64 = 1.0;
const TWO_DECAYS: f64 = 2.0;

/// Rate of the second group relative to the only decay.
const SLOWER: f64 = 0.77;

/// Largest rate of the second group relative to the first one's. Most decays bend little by little: with the geometric mean of
/// the first and the last rate a courtyard with an archway had decays of 1.9, 0.2 and 0.07 s, and none for what is heard.
const MAX_SECOND_RATE: f64 = 1.5;

/// Ratios of the slow decay's rate to that where energy still arrives from other spaces up to which all energy is spread, and from which on
/// the second group is for such places: with none slower than the slow decay, T20 in the last one of three rooms in a row was 20 % short.
const SPREAD: f64 = 1.02;
const SPREADING: f64 = 1.08;

/// Rate of the second group there, relative to that of its energy, and the least relative to the slow one's: a sum of decays is not slower
/// than the slowest.
const BEYOND_LATE: f64 = 0.93;
const SLOWEST: f64 = 0.8;

/// The least one where the second group cannot start late, as a source's delay line is too short.
const SLOWEST_OF_EARLY: f64 = 0.7;

/// Rates of the second mode relative to the slow one from which on the second group has its rate, and up to which: slower ones are one decay
/// with the slow one, faster ones are of energy that is not yet even in one room.
const OWN_MODE_FROM: (f64, f64) = (1.15, 1.3);
const OWN_MODE_TO: (f64, f64) = (2.5, 3.0);

/// By how much the fastest group's rate is above that of the mode, relative to it, from which on they are two.
const DISTINCT: f64 = 0.2;

/// Largest rate of a mode that is told apart, relative to the slow one, and rounds in which it is found.
const FASTEST_MODE: f64 = 16.0;
const MODE_HALVINGS: usize = 30;

/// Least share of the energy after a reflection in local rates.
const MIN_KEPT: f32 = 1e-3;

/// Share of the patches that have no faster decay than the fastest group.
const FAST_QUANTILE: f32 = 0.95;

/// What becomes of the energy that a patch radiates, up to its first reflection.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FirstLegs {
    /// Mean length in metres, without rays that hit nothing.
    pub(crate) length_m: f32,
    /// Share of the rays that arrives at each patch.
    pub(crate) arriving: [f32; MAX_PATCHES],
    /// Share of the energy that the first reflection leaves.
    pub(crate) kept: BandArray,
}

impl Default for FirstLegs {
    fn default() -> Self {
        Self {
            length_m: 0.0,
            arriving: [0.0; MAX_PATCHES],
            kept: [0.0; BANDS],
        }
    }
}

/// What the decays follow from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PatchDecays<'a> {
    /// Length of a time step in seconds.
    pub(crate) step_s: f32,
    /// Speed of sound in metres per second.
    pub(crate) speed_m_s: f32,
    /// Share of the scene's surface of each patch.
    pub(crate) share: &'a [f32],
    /// Energy that leaves all patches in each of [`LONG_STEPS`], of energy that begins in the air, as that of sources does.
    ///
    /// [`LONG_STEPS`]: crate::propagation::diffuse::energy_course::LONG_STEPS
    pub(crate) total: &'a [BandArray],
    /// The slowest decay in nepers of energy per time step: used where `total` falls by less than [`FITTED_FROM_DB`].
    pub(crate) slowest: &'a BandArray,
    pub(crate) first_legs: &'a [FirstLegs],
    /// How much more slowly energy falls from one late state to the next where it still arrives from other spaces.
    pub(crate) growth: &'a BandArray,
    /// Shares of energy that the slowest modes keep from one late state to the next.
    pub(crate) kept_by_modes: &'a [BandArray; MODES],
}

/// Decays that the whole scene shares.
#[derive(Debug, Clone, Default)]
pub(crate) struct CommonDecays {
    /// Reverberation time in seconds per group and band.
    pub(crate) times_s: [BandArray; LATE_GROUPS],
    /// Columns of the fit of a source's energies.
    pub(crate) columns: DecayColumns,
}

impl CommonDecays {
    /// From the energy of a field over time, and what its patches' rays meet.
    pub(crate) fn of(field: &PatchDecays<'_>) -> Self {
        let (rates, spreading, is_second_slow) = rates_of(field.total, &local_rates(field), field);
        Self {
            times_s: rates
                .map(|rates| rates.map(|rate| (NEPERS_OF_60_DB / f64::from(rate)) as f32)),
            columns: DecayColumns::new(&rates, &spreading, &is_second_slow, field.step_s),
        }
    }
}

/// Decay rate in nepers of energy per second around each patch: Eyring's, for what the patches that it sees lose from one
/// reflection to the next (\[KUTTRUFF\]).
fn local_rates(field: &PatchDecays<'_>) -> Vec<BandArray> {
    let legs = field.first_legs;
    let around = |from: &FirstLegs| {
        let (mut kept, mut length_m, mut weight) = ([0.0; BANDS], 0.0, 1e-6);
        for (legs, arriving) in legs.iter().zip(from.arriving) {
            weight += arriving;
            length_m += arriving * legs.length_m;
            for b in 0..BANDS {
                kept[b] += arriving * legs.kept[b];
            }
        }
        let time_s = (length_m / weight).max(1e-3) / field.speed_m_s;
        kept.map(|kept| -(kept / weight).clamp(MIN_KEPT, 1.0).ln() / time_s)
    };
    legs.iter().map(around).collect()
}

/// Decay rates of the groups in nepers of energy per second, from the energy of the whole scene and the rates around its
/// patches; to which share the second group is for energy that still arrives from other spaces, and whether it is the slow one.
fn rates_of(
    total: &[BandArray],
    local: &[BandArray],
    field: &PatchDecays<'_>,
) -> ([BandArray; LATE_GROUPS], BandArray, [bool; BANDS]) {
    let per_s = 1.0 / f64::from(field.step_s);
    let range = DECAY_RANGE_S;
    let (least, most) = (
        NEPERS_OF_60_DB / f64::from(range.1),
        NEPERS_OF_60_DB / f64::from(range.0),
    );
    let mut rates = [[0.0; BANDS]; LATE_GROUPS];
    let mut spreading = [0.0; BANDS];
    let mut is_second_slow = [false; BANDS];
    let weights = weights_of_patches(field);
    let slowest_rate = match has_slower_last(field.step_s) {
        true => SLOWEST,
        false => SLOWEST_OF_EARLY,
    };
    for b in 0..BANDS {
        let fitted = slow_slope(total, b).map_or(most, |slope| slope * per_s);
        let slowest = f64::from(field.slowest[b]) * per_s;
        let slow = slowest + fitted_share(fall_db(total)[b]) * (fitted - slowest);
        let slow = slow.clamp(least, most);
        let fast = quantile(local, &weights, b, FAST_QUANTILE);
        let ratio = (fast / slow).max(2.0);
        let share = ((ratio.log2() - ONE_DECAY) / (TWO_DECAYS - ONE_DECAY)).clamp(0.0, 1.0);
        let other = (SLOWER.powf(1.0 - share) * ratio.powf(0.5 * share)).min(MAX_SECOND_RATE);
        let late = slower_of_growth(field.growth[b], slow / per_s);
        let slower = (late * BEYOND_LATE).max(slowest_rate).min(other);
        let share = (1.0 / late.max(slowest_rate) - SPREAD) / (SPREADING - SPREAD);
        let share = share.clamp(0.0, 1.0);
        spreading[b] = share as f32;
        let other = other.powf(1.0 - share) * slower.powf(share);
        let kept = field.kept_by_modes.map(|kept| f64::from(kept[b]));
        let mode = second_mode(kept, slow / per_s);
        let share = share_of_mode(mode, ratio);
        let other = other.powf(1.0 - share) * mode.powf(share);
        // Only the second group starts late enough for energy that builds up between two such rooms.
        is_second_slow[b] = share >= 0.5 && spreading[b] > 0.0;
        let of_groups = match is_second_slow[b] {
            true => [slow * other, slow, slow * ratio],
            false => [slow, slow * other, slow * ratio],
        };
        for (rates, rate) in rates.iter_mut().zip(of_groups) {
            rates[b] = rate.clamp(least, most) as f32;
        }
    }
    (rates, spreading, is_second_slow)
}

/// Decay rate that `growth` from one late state to the next means, relative to a `rate` in nepers of energy per time step.
fn slower_of_growth(growth: f32, rate: f64) -> f64 {
    let nepers = (STATE_BINS * BIN_STEPS) as f64 * rate;
    1.0 - f64::from(growth).ln() / nepers
}

/// Decay rate of the second mode relative to that of the first, a `rate` in nepers of energy per time step, for what both keep from one late
/// state to the next. A state has the energy of the responses' last span.
fn second_mode([first, second]: [f64; MODES], rate: f64) -> f64 {
    let [.., span] = DIRECTION_SPANS;
    let in_span = |rate: f64| {
        let left = |step: usize| (-rate * step as f64).exp();
        (left(span.start) - left(span.end)) / rate
    };
    let wanted = second / first.max(f64::MIN_POSITIVE) * in_span(rate);
    let (mut low, mut high) = (1.0, FASTEST_MODE);
    for _ in 0..MODE_HALVINGS {
        let middle = 0.5 * (low + high);
        match in_span(middle * rate) > wanted {
            true => low = middle,
            false => high = middle,
        }
    }
    low
}

/// Weight of the second mode in the second group's rate, 0 to 1. Its rate and that of the fastest group are relative to the slow one.
fn share_of_mode(mode: f64, fastest: f64) -> f64 {
    let rises = (mode - OWN_MODE_FROM.0) / (OWN_MODE_FROM.1 - OWN_MODE_FROM.0);
    let falls = (OWN_MODE_TO.1 - mode) / (OWN_MODE_TO.1 - OWN_MODE_TO.0);
    let distinct = fastest / mode - 1.0;
    rises.min(falls).min(distinct / DISTINCT).clamp(0.0, 1.0)
}

/// Fall in dB from the first time steps to the last ones.
pub(crate) fn fall_db(total: &[BandArray]) -> BandArray {
    // Nothing arrives at time 0.
    let spans = [1..1 + FALL_STEPS, total.len() - FALL_STEPS..total.len()];
    let [first, last] = spans.map(|steps| sum_of(&total[steps]));
    std::array::from_fn(|b| {
        let ratio = first[b] / last[b].max(f32::MIN_POSITIVE);
        10.0 * ratio.max(f32::MIN_POSITIVE).log10()
    })
}

/// Energy of some time steps.
pub(crate) fn sum_of(energies: &[BandArray]) -> BandArray {
    let mut sum = [0.0; BANDS];
    for energy in energies {
        for b in 0..BANDS {
            sum[b] += energy[b];
        }
    }
    sum
}

/// Weight of the fit, at a fall in dB.
fn fitted_share(fall_db: f32) -> f64 {
    let share = (fall_db - SLOWEST_UP_TO_DB) / (FITTED_FROM_DB - SLOWEST_UP_TO_DB);
    f64::from(share.clamp(0.0, 1.0))
}

/// Shares of the surface, times the squared shares of the rays that arrive anywhere. The outer walls of a house have the fastest decay of
/// all, and next to nothing of it is heard.
fn weights_of_patches(field: &PatchDecays<'_>) -> Vec<f32> {
    let patches = field.share.iter().zip(field.first_legs);
    patches
        .map(|(share, legs)| share * legs.arriving.iter().sum::<f32>().powi(2))
        .collect()
}

/// Value below which `wanted` of the patches' weights lie.
fn quantile(values: &[BandArray], weights: &[f32], band: usize, wanted: f32) -> f64 {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a][band].total_cmp(&values[*b][band]));
    let wanted = wanted * weights.iter().sum::<f32>();
    let mut sum = 0.0;
    let reaches = |index: &&usize| {
        sum += weights[**index];
        sum >= wanted
    };
    let found = order.iter().find(reaches).or(order.last());
    found.map_or(0.0, |index| f64::from(values[*index][band]))
}

/// Fall per time step of the energy that is still to come (Schroeder's integral) within [`SLOW_FIT`] of all of it. In the open few rays carry
/// what is left late: their energy goes up and down from step to step, and that which is to come does not.
fn slow_slope(energy: &[BandArray], band: usize) -> Option<f64> {
    let mut to_come: Vec<f64> = energy.iter().map(|e| f64::from(e[band])).collect();
    let mut sum = energy_after(&to_come);
    for energy in to_come.iter_mut().rev() {
        sum += *energy;
        *energy = sum;
    }
    let all = *to_come.first()?;
    let [from, to] = SLOW_FIT.map(|share| {
        let below = to_come.iter().position(|energy| *energy < share * all);
        below.unwrap_or(to_come.len())
    });
    fall_of(&to_come[from..to])
}

/// Energy that arrives after a course that goes on from its last quarter as its second half falls.
fn energy_after(course: &[f64]) -> f64 {
    let Some(line_fall) = fall_of(&course[course.len() / 2..]) else {
        return 0.0;
    };
    // Where the course falls by less, the slow decay is not fitted.
    let least = f64::from(FITTED_FROM_DB) * NEPERS_OF_60_DB / 60.0 / course.len() as f64;
    let quarter = &course[course.len() - course.len() / 4..];
    let nepers = line_fall.max(least) * quarter.len() as f64;
    quarter.iter().sum::<f64>() / nepers.exp_m1()
}

/// Fall of a least-squares line through the logarithm in nepers per time step.
fn fall_of(energy: &[f64]) -> Option<f64> {
    let (mut n, mut t, mut tt, mut y, mut ty) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (step, energy) in energy.iter().enumerate() {
        if *energy > 0.0 {
            let (at, nepers) = (step as f64, energy.ln());
            n += 1.0;
            t += at;
            tt += at * at;
            y += nepers;
            ty += at * nepers;
        }
    }
    (n > 2.0).then(|| ((t * y - n * ty) / (n * tt - t * t)).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(levels: impl Iterator<Item = f32>) -> Vec<BandArray> {
        levels.map(|level| [level; BANDS]).collect()
    }

    /// Also where the course ends 20 dB below its start, and where it ends in silence.
    #[test]
    fn the_slow_decay_of_one_decay_is_its_own() {
        for fall in [0.02, 0.05, 0.2] {
            let course = course((0..240).map(|step| (-fall * step as f32).exp()));
            let found = slow_slope(&course, 2).expect("a decay") as f32;
            assert!((found / fall - 1.0).abs() < 1e-3, "{fall}: {found}");
        }
    }

    /// From −20 dB on every tenth step has an echo with the energy of ten, and the last one is louder than the one before: no sign of
    /// energy that grows.
    #[test]
    fn a_loud_last_echo_is_no_growing_energy() {
        let fall = 0.05f32;
        let level = |step: usize| (-fall * step as f32).exp();
        let course = course((0..240).map(|step| match step {
            0..100 => level(step),
            100..150 if step % 10 == 0 => 10.0 * level(step),
            150 => 20.0 * level(140),
            _ => 0.0,
        }));
        let found = slow_slope(&course, 2).expect("a decay") as f32;
        assert!((0.9..1.1).contains(&(found / fall)), "{found}");
    }

    #[test]
    fn the_second_mode_has_the_rate_of_what_it_keeps() {
        let [.., span] = DIRECTION_SPANS;
        let rate = 0.01;
        // Energy in the span by the midpoint rule.
        let energy = |rate: f64| -> f64 {
            let steps = (1000 * span.start..1000 * span.end).map(|n| (n as f64 + 0.5) / 1000.0);
            steps.map(|step| (-rate * step).exp()).sum()
        };
        for ratio in [1.1, 1.7, 3.0] {
            let kept = [0.4, 0.4 * energy(ratio * rate) / energy(rate)];
            let found = second_mode(kept, rate);
            assert!((found / ratio - 1.0).abs() < 1e-4, "{found} {ratio}");
        }
        assert!(second_mode([0.4, 0.0], rate) > 0.99 * FASTEST_MODE);
    }

    #[test]
    fn only_a_distinct_mode_is_a_group() {
        assert_eq!(share_of_mode(1.08, 5.0), 0.0, "one decay with the slow one");
        assert_eq!(share_of_mode(1.8, 5.0), 1.0);
        assert_eq!(share_of_mode(3.2, 9.0), 0.0, "not yet even in one room");
        assert_eq!(share_of_mode(1.8, 1.8), 0.0, "the fastest group's");
    }
}
