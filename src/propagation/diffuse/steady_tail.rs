//! Steadying of late energy that few rays carry.
//!
//! Own. Where little is scattered, what a listener hears late of a source came along few of its rays, and which decay they seem to
//! have differs from one set of rays to the next. What arrives there of energy that begins in the air, evenly and in all
//! directions, follows from all rays of the scene's field ([`crate::propagation::diffuse::transport`]) and has the same decay after
//! some reflections, unless the source's surroundings are others. So energies in spans of time are drawn towards the expected ones,
//! which have the course of those of the air and the level of the source: all the more, the larger the variance of the source's rays is
//! beside [`MISMATCH`] (shrinkage, \[EFRON75\]). In coupled rooms the late energy is scattered and has next to no variance, so it stays.

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::diffuse::fit_spans::{SPAN_ENDS, SPAN_OF_STEP, SPANS};

/// Relative error of the expected energies, squared.
const MISMATCH: f32 = 0.15 * 0.15;

/// The first span that is steadied: most of what came before was also heard as discrete paths, which are not late energy.
const FIRST: usize = 6;

/// Spans before one whose variance counts for it. With one, late spans that few rays had met by chance stayed 5 to 10 dB
/// too low.
const BEFORE: usize = 5;

const _: () = assert!(BEFORE <= FIRST);

/// The span of half of the time at which each span begins: from there on energies give the level of the expected ones.
pub(crate) const HALF: [u8; SPANS] = {
    let (mut half, mut span) = ([0; SPANS], 1);
    while span < SPANS {
        half[span] = SPAN_OF_STEP[SPAN_ENDS[span - 1] / 2];
        span += 1;
    }
    half
};

/// Draws energies with a variance towards those with the course of `of_air`. The energy of all that are drawn stays. Returns how much
/// the last span was drawn, from 0 to 1.
pub(crate) fn steady(
    energy: &mut [BandArray],
    variance: &[BandArray],
    of_air: &[BandArray],
) -> BandArray {
    let mut drawn = [0.0; BANDS];
    let spans = energy.len();
    let [own_left, air_left] = [&*energy, of_air].map(left);
    let mut expected = [[0.0; BANDS]; SPANS];
    let mut relative = [[0.0f32; BANDS]; SPANS];
    for span in FIRST - 1..spans {
        let half = usize::from(HALF[span]);
        for b in 0..BANDS {
            let share = of_air[span][b] / air_left[half][b].max(f32::MIN_POSITIVE);
            expected[span][b] = share * own_left[half][b];
            let square = expected[span][b] * expected[span][b];
            relative[span][b] = match square > 0.0 {
                true => variance[span][b].min(f32::MAX) / square,
                // Where the air's energy does not arrive it says nothing.
                false => 0.0,
            };
        }
    }
    let (mut before, mut after) = ([0.0; BANDS], [0.0; BANDS]);
    for span in FIRST..spans {
        // A span that no heavy ray has met has little energy and a small variance, by chance: that of others counts too.
        let first = (span - BEFORE).max(FIRST - 1);
        let around = &relative[first..spans.min(span + 2)];
        for b in 0..BANDS {
            let mean = around.iter().map(|relative| relative[b]).sum::<f32>() / around.len() as f32;
            let share = match expected[span][b] > 0.0 {
                true => 1.0 - MISMATCH / (mean + MISMATCH),
                false => 0.0,
            };
            drawn[b] = share;
            before[b] += energy[span][b];
            energy[span][b] += share * (expected[span][b] - energy[span][b]);
            after[b] += energy[span][b];
        }
    }
    for b in 0..BANDS {
        let scale = match after[b] > 0.0 {
            true => before[b] / after[b],
            false => 1.0,
        };
        for energy in energy.iter_mut().skip(FIRST) {
            energy[b] *= scale;
        }
    }
    drawn
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

    /// Every other span has four times the energy, carried by one ray. What is left is the ripple of the level, which counts from a
    /// span of much or of little energy on: in a sum that falls by 0.7 from span to span 1.88 and 1.52, a ratio of 1.24 or 0.15 of 4
    /// in logarithms; at the end, where the sum has six spans, 0.21.
    #[test]
    fn energy_that_few_rays_carry_has_the_course_of_the_airs() {
        let lumps = |span: usize| if span.is_multiple_of(2) { 1.6 } else { 0.4 };
        let (air, own) = (decay(0.7, |_| 3.0), decay(0.7, lumps));
        let variance = own.map(|energy| energy.map(|e| e * e));
        let mut steadied = own;
        steady(&mut steadied, &variance, &air);
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
        steady(&mut steadied, &variance, &air);
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
        steady(&mut steadied, &[[0.0; BANDS]; SPANS], &decay(0.9, |_| 1.0));
        for (after, before) in steadied.iter().zip(&own) {
            assert!((after[0] / before[0] - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn silence_stays_silent() {
        let nothing = [[0.0; BANDS]; SPANS];
        let mut energy = nothing;
        steady(&mut energy, &nothing, &nothing);
        assert_eq!(energy, nothing);
        // A source that is heard where the air's energy does not arrive.
        let mut energy = decay(0.5, |_| 1.0);
        let variance = decay(0.25, |_| 1.0);
        steady(&mut energy, &variance, &nothing);
        assert_eq!(energy, decay(0.5, |_| 1.0));
    }
}
