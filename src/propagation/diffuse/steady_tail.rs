//! Steadying of late energy that few rays carry.
//!
//! Own. Where little is scattered, what a listener hears late of a source came along few of its rays, and which decay they seem to
//! have differs from one set of rays to the next. What arrives there of energy that begins in the air, evenly and in all
//! directions, follows from all rays of the scene's field ([`crate::propagation::diffuse::transport`]) and has the same decay after
//! some reflections, unless the source's surroundings are others. So what few rays carry in a span of time is drawn towards what is
//! expected, which has the course of the air's energy and the level of the source: all the more, the larger the variance of these rays is
//! beside the error of what is expected (shrinkage, \[EFRON75\]). That error follows from the energies themselves. What patches radiate
//! is known by the scene's own rays and stays: in another room than the source's it builds up while the air's energy decays.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::fit_spans::{LONG_SPANS, SPAN_ENDS, SPAN_OF_STEP, SPANS};

/// Least relative error of the expected energies, squared.
const MISMATCH: f32 = 0.15 * 0.15;

/// Share of what variances do not explain that is the error of the expected energies: the own ones may be as wrong.
const OF_EXPECTED: f32 = 0.5;

/// Most that one span and band say of this error, in either direction: one heavy ray does not decide.
const MOST_MISMATCH: f32 = 4.0;

/// How much more than earlier energies those after the responses are drawn towards the course of the air's: a share of a quarter there is
/// all of it. What few rays carry is specular, and patches do not know its directions.
const LATER_DRAWN: f32 = 4.0;

/// The first span that is steadied: most of what came before was also heard as discrete paths, which are not late energy.
const FIRST: usize = 6;

/// Spans before one whose variance counts for it. With one, late spans that few rays had met by chance stayed 5 to 10 dB
/// too low.
const BEFORE: usize = 5;

const _: () = assert!(BEFORE <= FIRST);

/// The span of half of the time at which each span begins: from there on energies give the level of the expected ones.
const HALF: [u8; SPANS] = {
    let (mut half, mut span) = ([0; SPANS], 1);
    while span < SPANS {
        half[span] = SPAN_OF_STEP[SPAN_ENDS[span - 1] / 2];
        span += 1;
    }
    half
};

/// Energy that arrives of a source in each span of the fit, on one scale with its variance.
pub(crate) struct Arriving<'a> {
    /// All of it.
    pub(crate) energy: &'a mut [BandArray],
    /// The part of it that few rays carry, and its variance. The rest is radiated by patches, by the scene's own rays.
    pub(crate) of_few: &'a [BandArray],
    pub(crate) variance: &'a [BandArray],
}

/// Draws the energy that few rays carry towards what the course of `of_air` asks for beside the rest. Its sum stays. Returns how much
/// the last span was drawn, from 0 to 1.
pub(crate) fn steady(arriving: Arriving<'_>, of_air: &[BandArray]) -> BandArray {
    let Arriving {
        energy,
        of_few,
        variance,
    } = arriving;
    let spans = energy.len();
    let [own_left, air_left] = [&*energy, of_air].map(left);
    let mut expected = [[0.0; BANDS]; SPANS];
    let mut relative = [[0.0f32; BANDS]; SPANS];
    for span in FIRST - 1..spans {
        let half = usize::from(HALF[span]);
        for b in 0..BANDS {
            let share = of_air[span][b] / air_left[half][b].max(f32::MIN_POSITIVE);
            // What patches radiate is certain to arrive: in another room it builds up while the air's energy decays.
            let radiated = energy[span][b] - of_few[span][b];
            expected[span][b] = (share * own_left[half][b]).max(radiated);
            let square = expected[span][b] * expected[span][b];
            relative[span][b] = match square > 0.0 {
                true => variance[span][b].min(f32::MAX) / square,
                // Where the air's energy does not arrive it says nothing.
                false => 0.0,
            };
        }
    }
    let relative = around(&relative[..spans]);
    let mismatch = mismatch(energy, &expected, &relative);
    let mut few = [[0.0; BANDS]; SPANS];
    let (mut before, mut after, mut drawn) = ([0.0; BANDS], [0.0; BANDS], [0.0; BANDS]);
    for span in FIRST..spans {
        for b in 0..BANDS {
            let share = match expected[span][b] > 0.0 {
                true => 1.0 - mismatch / (relative[span][b] + mismatch),
                false => 0.0,
            };
            drawn[b] = share;
            let own = of_few[span][b];
            few[span][b] = (own + share * (expected[span][b] - energy[span][b])).max(0.0);
            before[b] += own;
            after[b] += few[span][b];
        }
    }
    for span in FIRST..spans {
        for b in 0..BANDS {
            // Next to nothing is not scaled up.
            if after[b] > 1e-6 * before[b] {
                let steadied = few[span][b] * (before[b] / after[b]);
                let radiated = (energy[span][b] - of_few[span][b]).max(0.0);
                energy[span][b] = radiated + steadied;
            }
        }
    }
    drawn
}

/// Mean relative variances around each span. One that no heavy ray has met has little energy and a small variance, by chance: that of
/// others counts too.
fn around(relative: &[BandArray]) -> [BandArray; SPANS] {
    let mut means = [[0.0; BANDS]; SPANS];
    for span in FIRST..relative.len() {
        let first = (span - BEFORE).max(FIRST - 1);
        let around = &relative[first..relative.len().min(span + 2)];
        for b in 0..BANDS {
            let sum: f32 = around.iter().map(|relative| relative[b]).sum();
            means[span][b] = sum / around.len() as f32;
        }
    }
    means
}

/// Relative error of the expected energies, squared: what the variances of the own ones do not explain, in the mean of spans and bands
/// (empirical Bayes, \[EFRON75\]), at least [`MISMATCH`].
fn mismatch(
    energy: &[BandArray],
    expected: &[BandArray; SPANS],
    relative: &[BandArray; SPANS],
) -> f32 {
    let (mut sum, mut count) = (0.0, 0.0f32);
    for span in FIRST..energy.len() {
        for b in 0..BANDS {
            if expected[span][b] > 0.0 {
                let off = energy[span][b] / expected[span][b] - 1.0;
                let unexplained = off * off - relative[span][b];
                sum += unexplained.clamp(-MOST_MISMATCH, MOST_MISMATCH);
                count += 1.0;
            }
        }
    }
    MISMATCH.max(OF_EXPECTED * sum / count.max(1.0))
}

/// Continues the first `known` energies in spans of time up to `within`, with their own course, as far as they were `drawn` with that of
/// the air's. Returns the number of spans: `known` where nothing arrives later.
pub(crate) fn continued(
    energy: &mut [BandArray; LONG_SPANS],
    known: usize,
    within: usize,
    [own, of_air]: [&[BandArray; LONG_SPANS]; 2],
    drawn: &BandArray,
) -> usize {
    let is_heard = |span: &BandArray| span.iter().any(|energy| *energy > 0.0);
    if within <= known || !own[known..within].iter().any(is_heard) {
        return known;
    }
    let half = usize::from(HALF[known - 1]);
    let level = |spans: &[BandArray; LONG_SPANS]| {
        let mut sum = [0.0f32; BANDS];
        for span in &spans[half..known] {
            for b in 0..BANDS {
                sum[b] += span[b];
            }
        }
        sum
    };
    let [level, own_level, air_level] = [&*energy, own, of_air].map(level);
    for span in known..within {
        for b in 0..BANDS {
            let drawn = (LATER_DRAWN * drawn[b]).min(1.0);
            let own_ratio = ratio(own[span][b], own_level[b]);
            let of_air = ratio(of_air[span][b], air_level[b]);
            let continued = level[b] * (own_ratio + drawn * (of_air - own_ratio));
            // What patches radiate arrives in any case.
            energy[span][b] = continued.max(own[span][b]);
        }
    }
    within
}

/// Energy relative to a level; none where that is next to nothing.
fn ratio(energy: f32, level: f32) -> f32 {
    match level > f32::MIN_POSITIVE {
        true => energy / level,
        false => 0.0,
    }
}

/// Energy from each span on.
fn left(energy: &[BandArray]) -> [BandArray; SPANS + 1] {
    let mut left = [[0.0; BANDS]; SPANS + 1];
    for (span, energy) in energy.iter().enumerate().rev() {
        for b in 0..BANDS {
            left[span][b] = left[span + 1][b] + energy[b];
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energies of a decay by a factor from one span to the next, times one of each span.
    fn decay(factor: f32, times: impl Fn(usize) -> f32) -> [BandArray; SPANS] {
        std::array::from_fn(|span| [factor.powi(span as i32) * times(span); BANDS])
    }

    /// Steadies energy of which few rays carry all.
    fn steady_few(energy: &mut [BandArray; SPANS], variance: &[BandArray], of_air: &[BandArray]) {
        let of_few = *energy;
        let arriving = Arriving {
            energy,
            of_few: &of_few,
            variance,
        };
        steady(arriving, of_air);
    }

    /// Every other span has four times the energy, carried by one ray. What is left is the ripple of the level, which counts from a
    /// span of much or of little energy on: in a sum that falls by 0.7 from span to span 1.88 and 1.52, a ratio of 1.24 or 0.15 of 4
    /// in logarithms; at the end, where the sum has six spans, 0.21.
    #[test]
    fn energy_that_few_rays_carry_has_the_course_of_the_airs() {
        let lumps = |span: usize| if span.is_multiple_of(2) { 1.6 } else { 0.4 };
        let (air, own) = (decay(0.7, |_| 3.0), decay(0.7, lumps));
        let variance = own.map(|energy| energy.map(|e| e * e));
        let mut steadied = own;
        steady_few(&mut steadied, &variance, &air);
        for span in FIRST..SPANS - 1 {
            let ratio = |energy: &[BandArray; SPANS]| energy[span + 1][3] / energy[span][3] / 0.7;
            let [off, before] = [&steadied, &own].map(|energy| ratio(energy).ln().abs());
            assert!(off < 0.25 * before, "{span}: {off} of {before}");
        }
        assert_eq!(steadied[..FIRST], own[..FIRST]);
        let [after, before] = [&steadied, &own].map(|energy| left(energy)[FIRST][3]);
        assert!((after / before - 1.0).abs() < 1e-5, "{after}, {before}");
    }

    /// No heavy ray arrives in the last three spans by chance. Those before say how uncertain that is.
    #[test]
    fn late_energy_that_is_missing_by_chance_is_expected() {
        let arrives = |span: usize| if span < SPANS - 3 { 1.0 } else { 0.1 };
        let (air, own) = (decay(0.7, |_| 3.0), decay(0.7, arrives));
        let mut variance = own.map(|energy| energy.map(|e| e * e));
        variance[SPANS - 3..].fill([0.0; BANDS]);
        let mut steadied = own;
        steady_few(&mut steadied, &variance, &air);
        let ratio = steadied[SPANS - 1][3] / steadied[FIRST][3];
        let off = ratio / 0.7f32.powi((SPANS - 1 - FIRST) as i32);
        // The level counts from half of the time on, in which this energy is missing.
        assert!(off > 0.3, "{off}");
    }

    /// Coupled rooms: what arrives is scattered and certain, and decays otherwise than the air's energy.
    #[test]
    fn energy_without_variance_stays() {
        let own = decay(0.5, |_| 1.0);
        let mut steadied = own;
        steady_few(&mut steadied, &[[0.0; BANDS]; SPANS], &decay(0.9, |_| 1.0));
        for (after, before) in steadied.iter().zip(&own) {
            assert!((after[0] / before[0] - 1.0).abs() < 1e-5);
        }
    }

    /// Another room than the source's: what patches radiate builds up, and one heavy ray has come early. The air's energy decays.
    #[test]
    fn what_patches_radiate_stays() {
        let radiated = decay(1.1, |_| 1.0);
        let mut of_few = [[0.0; BANDS]; SPANS];
        of_few[FIRST] = [20.0; BANDS];
        let variance = of_few.map(|energy| energy.map(|e| e * e));
        let mut steadied = radiated;
        for (sum, few) in steadied.iter_mut().zip(&of_few) {
            for b in 0..BANDS {
                sum[b] += few[b];
            }
        }
        let before = steadied;
        let arriving = Arriving {
            energy: &mut steadied,
            of_few: &of_few,
            variance: &variance,
        };
        steady(arriving, &decay(0.7, |_| 1.0));
        for (after, radiated) in steadied.iter().zip(&radiated) {
            assert!(after[2] >= 0.999 * radiated[2], "{after:?}, {radiated:?}");
        }
        let [after, before] = [&steadied, &before].map(|energy| left(energy)[0][2]);
        assert!((after / before - 1.0).abs() < 1e-5, "{after}, {before}");
    }

    /// All of the energy has another course than the air's, with a small variance in each span: what is expected is wrong. If its error
    /// were the least one, energies would be drawn by up to 0.185 in logarithms.
    #[test]
    fn what_is_expected_wrongly_counts_less() {
        let own = decay(0.5, |_| 1.0);
        let variance = own.map(|energy| energy.map(|e| 0.02 * e * e));
        let mut steadied = own;
        steady_few(&mut steadied, &variance, &decay(0.8, |_| 1.0));
        for span in FIRST..SPANS {
            let off = (steadied[span][1] / own[span][1]).ln().abs();
            assert!(off < 0.5 * 0.185, "{span}: {off}");
        }
    }

    /// Energies down to the smallest numbers, carried by few rays or by none, and of the air.
    #[test]
    fn next_to_nothing_stays_finite() {
        for level in [1e30, 1.0, 1e-20, 1e-38, 1e-44] {
            for air in [1e30, 1.0, 1e-38, 1e-44, 0.0] {
                for few in [0.0, 0.5, 1.0] {
                    let mut energy = decay(0.01, |_| level);
                    let of_few = energy.map(|energy| energy.map(|e| few * e));
                    let arriving = Arriving {
                        variance: &of_few.map(|energy| energy.map(|e| e * e)),
                        of_few: &of_few,
                        energy: &mut energy,
                    };
                    steady(arriving, &decay(0.9, |_| air));
                    let mut all = energy.as_flattened().iter();
                    let is_sound = |e: &f32| e.is_finite() && *e >= 0.0;
                    assert!(all.all(is_sound), "{level}, {air}, {few}: {energy:?}");
                }
            }
        }
    }

    #[test]
    fn silence_stays_silent() {
        let nothing = [[0.0; BANDS]; SPANS];
        let mut energy = nothing;
        steady_few(&mut energy, &nothing, &nothing);
        assert_eq!(energy, nothing);
        // A source that is heard where the air's energy does not arrive.
        let mut energy = decay(0.5, |_| 1.0);
        let variance = decay(0.25, |_| 1.0);
        steady_few(&mut energy, &variance, &nothing);
        assert_eq!(energy, decay(0.5, |_| 1.0));
    }
}
