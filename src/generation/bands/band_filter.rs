//! Splits signals into the eight octave bands, all in phase.
//!
//! Audio side; wait-free, bounded by the block; allocates at construction only. Input: mono samples; output: eight lanes
//! per sample.
//!
//! A binary tree of fourth-order Linkwitz-Riley crossovers (\[LINKWITZ76\], \[LIPSHITZ86\]) at
//! [`EDGES_HZ`]: every crossover's low and high output are in phase and sum to a second-order allpass. Each band also
//! passes the allpass of every crossover outside its branch (\[DAPPOLITO84\]): all eight bands have the phase of the seven
//! allpasses together, and their sum is flat. Each allpass is as close to the root as possible, where several bands share it.
//!
//! The tree has two signals after its first level, four after its second and eight after its third. Four sources are
//! split together, which fills eight lanes at every level. tests/band_filter.rs bounds the rounding noise to 120 dB below
//! the signal.

use std::f64::consts::PI;

use crate::acoustics::BANDS;
use crate::acoustics::bands::EDGES_HZ;
use crate::simd::{F32x8, LaneSet};

use crate::generation::CHUNK;
use crate::generation::bands::crossover::{
    Level, Section, State, first_level, second_level, third_level,
};

/// Signals that are split together.
pub(crate) const SIGNALS: usize = 4;

/// The crossover of each band at the three levels of the tree, and whether the band is on its high side.
const TREE: [[(usize, bool); BANDS]; 3] = [
    [
        (3, false),
        (3, false),
        (3, false),
        (3, false),
        (3, true),
        (3, true),
        (3, true),
        (3, true),
    ],
    [
        (1, false),
        (1, false),
        (1, true),
        (1, true),
        (5, false),
        (5, false),
        (5, true),
        (5, true),
    ],
    [
        (0, false),
        (0, true),
        (2, false),
        (2, true),
        (4, false),
        (4, true),
        (6, false),
        (6, true),
    ],
];

/// The crossovers outside the branches of all bands below and above the root.
const FIRST_ALLPASSES: [[usize; 2]; 3] = [[4, 0], [5, 1], [6, 2]];

/// The other crossover outside the branch of each pair of bands: that of the neighbouring pair.
const SECOND_ALLPASSES: [usize; 4] = [2, 0, 6, 4];

/// Eight-band crossover of four signals.
///
/// ```
/// use foresound::generation::BandFilter;
/// use foresound::simd::F32x8;
///
/// let mut filter = BandFilter::new(44_100);
/// let (signal, mut bands) = ([1.0; 64], [[F32x8::ZERO; 64]; 4]);
/// let [a, b, c, d] = &mut bands;
/// filter.process([&signal; 4], [a, b, c, d]);
/// assert!(filter.is_sounding(0));
/// ```
#[derive(Debug, Clone)]
pub struct BandFilter {
    set: LaneSet,
    first: Level<3>,
    second: Level<1>,
    third: Section,
    first_states: [State; 5],
    second_states: [[State; 3]; 2],
    third_states: [[[State; 2]; 2]; 2],
    sounding: [bool; SIGNALS],
    /// A chunk of the four signals, low and high.
    halves: Vec<F32x8>,
    /// A chunk of two signals each, in quarters.
    quarters: [Vec<F32x8>; 2],
}

impl BandFilter {
    /// A filter at rest. Control side; allocates.
    ///
    /// Range: `rate_hz` above twice the highest of [`EDGES_HZ`]; [`crate::GeneratorSettings::check`] ensures it.
    pub fn new(rate_hz: u32) -> Self {
        Self::with(LaneSet::best(), rate_hz)
    }

    fn with(set: LaneSet, rate_hz: u32) -> Self {
        let rate_hz = f64::from(rate_hz);
        // Each lane's side of its crossover.
        let first_split = std::array::from_fn(|lane| TREE[0][lane % 2 * 4]);
        let second_split = std::array::from_fn(|lane| TREE[1][lane % 4 * 2]);
        let first_pass = |edges: [usize; 2]| {
            Section::new(
                rate_hz,
                &std::array::from_fn(|lane| (edges[lane % 2], false)),
            )
        };
        let second_pass = std::array::from_fn(|lane| (SECOND_ALLPASSES[lane % 4], false));
        Self {
            set,
            first: Level {
                split: Section::new(rate_hz, &first_split),
                allpasses: FIRST_ALLPASSES.map(first_pass),
            },
            second: Level {
                split: Section::new(rate_hz, &second_split),
                allpasses: [Section::new(rate_hz, &second_pass)],
            },
            third: Section::new(rate_hz, &TREE[2]),
            first_states: Default::default(),
            second_states: Default::default(),
            third_states: Default::default(),
            sounding: [false; SIGNALS],
            halves: vec![F32x8::ZERO; CHUNK],
            quarters: std::array::from_fn(|_| vec![F32x8::ZERO; CHUNK]),
        }
    }

    /// Whether the filter state of a signal (index modulo 4) is non-zero; at rest, silent input has silent output.
    pub fn is_sounding(&self, signal: usize) -> bool {
        self.sounding[signal % SIGNALS]
    }

    /// Clears the filter state of a signal (index modulo 4). Real-time: no allocation.
    pub fn reset(&mut self, signal: usize) {
        let signal = signal % SIGNALS;
        for state in &mut self.first_states {
            state.reset(2 * signal..2 * signal + 2);
        }
        let (pair, index) = (signal / 2, signal % 2);
        for state in &mut self.second_states[pair] {
            state.reset(4 * index..4 * index + 4);
        }
        self.third_states[pair][index] = Default::default();
        self.sounding[signal] = false;
    }

    /// Splits each of `inputs` into `bands`, one lane per band, up to the shortest length of all.
    ///
    /// Real-time: no allocation, bounded by the length. Inputs must be finite.
    pub fn process(&mut self, inputs: [&[f32]; 4], bands: [&mut [F32x8]; 4]) {
        let longest = inputs.iter().map(|input| input.len()).min().unwrap_or(0);
        let count = bands.iter().map(|b| b.len()).fold(longest, usize::min);
        let [a, b, c, d] = bands;
        for start in (0..count).step_by(CHUNK) {
            let end = count.min(start + CHUNK);
            let frames = end - start;
            let halves = &mut self.halves[..frames];
            for (frame, at) in halves.iter_mut().zip(start..) {
                let [p, q, r, s] = [inputs[0][at], inputs[1][at], inputs[2][at], inputs[3][at]];
                *frame = F32x8([p, p, q, q, r, r, s, s]);
            }
            first_level(self.set, &self.first, &mut self.first_states, halves);
            let states = &mut self.second_states;
            second_level(self.set, &self.second, states, halves, &mut self.quarters);
            let [lower, upper] = &mut self.third_states;
            let [ab, cd] = &self.quarters;
            let (a, b) = (&mut a[start..end], &mut b[start..end]);
            third_level(self.set, &self.third, lower, &ab[..frames], a, b);
            let (c, d) = (&mut c[start..end], &mut d[start..end]);
            third_level(self.set, &self.third, upper, &cd[..frames], c, d);
        }
        self.flush_decayed();
    }

    fn flush_decayed(&mut self) {
        let mut first = [false; 8];
        for state in &mut self.first_states {
            state.flush_decayed(&mut first);
        }
        for pair in 0..2 {
            let mut second = [false; 8];
            for state in &mut self.second_states[pair] {
                state.flush_decayed(&mut second);
            }
            for index in 0..2 {
                let mut third = [false; 8];
                for state in &mut self.third_states[pair][index] {
                    state.flush_decayed(&mut third);
                }
                let signal = 2 * pair + index;
                self.sounding[signal] = first[2 * signal..2 * signal + 2].contains(&true)
                    || second[4 * index..4 * index + 4].contains(&true)
                    || third.contains(&true);
            }
        }
    }
}

/// Real, in-phase share of each band in the sum at one frequency: positive; the shares sum to one.
pub(crate) fn band_shares(rate_hz: f64, frequency_hz: f64) -> [f64; BANDS] {
    let mut shares = [1.0; BANDS];
    for lanes in &TREE {
        for (share, &(edge, takes_high)) in shares.iter_mut().zip(lanes) {
            let ratio = (PI * frequency_hz / rate_hz).tan() / (PI * EDGES_HZ[edge] / rate_hz).tan();
            let fourth = ratio.powi(4);
            *share *= if takes_high { fourth } else { 1.0 } / (1.0 + fourth);
        }
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(set: LaneSet, only: Option<usize>) -> [Vec<F32x8>; SIGNALS] {
        let inputs: [Vec<f32>; SIGNALS] = std::array::from_fn(|n| {
            (0..700)
                .map(|i| ((i * i + 31 * n * i) as f32 * 0.37).sin())
                .map(|v| {
                    if only.is_none_or(|only| only == n) {
                        v
                    } else {
                        0.0
                    }
                })
                .collect()
        });
        let mut bands: [Vec<F32x8>; SIGNALS] =
            std::array::from_fn(|_| vec![F32x8::ZERO; inputs[0].len()]);
        let mut filter = BandFilter::with(set, 44_100);
        let outputs = bands.each_mut().map(Vec::as_mut_slice);
        filter.process(inputs.each_ref().map(Vec::as_slice), outputs);
        for n in 0..SIGNALS {
            assert_eq!(filter.is_sounding(n), only.is_none_or(|only| only == n));
        }
        bands
    }

    #[test]
    fn signals_are_independent() {
        let together = split(LaneSet::best(), None);
        for n in 0..SIGNALS {
            assert_eq!(split(LaneSet::best(), Some(n))[n], together[n]);
        }
    }

    #[test]
    fn instruction_sets_agree() {
        let specified = split(LaneSet::Fused, None);
        for set in LaneSet::vector_units() {
            assert_eq!(split(set, None), specified, "{set:?}");
        }
        let portable = split(LaneSet::Portable, None);
        for (a, b) in portable.iter().flatten().zip(specified.iter().flatten()) {
            for (a, b) in a.0.iter().zip(b.0) {
                // Twice the rounding noise bound of tests/band_filter.rs, −120 dB, at a crest factor of five.
                assert!((a - b).abs() < 1e-5, "{a} {b}");
            }
        }
    }

    #[test]
    fn reset_clears_one_signal_only() {
        let mut filter = BandFilter::new(44_100);
        let (ones, mut bands) = ([1.0; 64], [[F32x8::ZERO; 64]; SIGNALS]);
        let [a, b, c, d] = &mut bands;
        filter.process([&ones; 4], [a, b, c, d]);
        filter.reset(1);
        let zeros = [0.0; 64];
        filter.process([&zeros; 4], [a, b, c, d]);
        assert!(bands[1].iter().all(|frame| *frame == F32x8::ZERO));
        for other in [0, 2, 3] {
            assert!(bands[other][0] != F32x8::ZERO);
            assert!(filter.is_sounding(other));
        }
        assert!(!filter.is_sounding(1));
    }
}
