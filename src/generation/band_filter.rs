//! Splits one signal into the eight octave bands, all in phase.
//!
//! Audio side; wait-free, bounded by the block; allocates nothing. Takes mono samples, gives eight lanes a sample.
//!
//! A binary tree of fourth-order Linkwitz-Riley crossovers ([LINKWITZ76], [LIPSHITZ86]) at
//! [`EDGES_HZ`]: every crossover's low and high output are in phase and sum to a second-order allpass. Each band then
//! passes the allpass of every crossover it has not met ([DAPPOLITO84]), so all eight bands have the phase of the
//! seven allpasses together and their sum is flat. A lane is a band: ten sections in series do the whole tree, three
//! crossovers and four allpasses, where a chain of crossovers takes fourteen.
//!
//! Sections are state-variable filters with trapezoidal integrators ([ZAVALISHIN12]), which keep their rounding noise
//! low where the crossover is far below the sample rate; tests/band_filter.rs holds it 120 dB below the signal.

use std::f64::consts::{PI, SQRT_2};

use crate::acoustics::BANDS;
use crate::acoustics::bands::EDGES_HZ;
use crate::simd::F32x8;

/// State below this is set to zero between calls, before it decays into subnormal numbers. −400 dB.
const STATE_FLOOR: f32 = 1e-20;

/// Crossover sections in series: two a level of the tree.
const SPLITS: usize = 6;
/// Allpass sections in series.
const ALLPASSES: usize = 4;

/// Which crossover each lane meets at the three levels of the tree; the bit says whether it takes the high side.
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

/// The crossovers each lane does not meet, whose allpasses it passes instead.
const COMPENSATION: [[usize; BANDS]; ALLPASSES] = [
    [2, 2, 0, 0, 6, 6, 4, 4],
    [4, 4, 4, 4, 0, 0, 0, 0],
    [5, 5, 5, 5, 1, 1, 1, 1],
    [6, 6, 6, 6, 2, 2, 2, 2],
];

/// Coefficients of one second-order Butterworth section, eight lanes.
#[derive(Debug, Clone, Copy)]
struct Section {
    /// `g / (1 + √2 g + g²)` with `g = tan(π f / rate)`.
    input: F32x8,
    /// `√2 + g`.
    damping: F32x8,
    /// `g`.
    integrator: F32x8,
    /// Factor of the high-pass part in the output: `1 / g` in lanes that take it, else 0.
    high: F32x8,
    /// Factor of the low-pass part in the output: 1 in lanes that take it, else 0.
    low: F32x8,
}

impl Section {
    fn new(rate_hz: f64, lanes: &[(usize, bool); BANDS]) -> Self {
        let mut section = Self {
            input: F32x8::ZERO,
            damping: F32x8::ZERO,
            integrator: F32x8::ZERO,
            high: F32x8::ZERO,
            low: F32x8::ZERO,
        };
        for (lane, &(edge, takes_high)) in lanes.iter().enumerate() {
            let g = (PI * EDGES_HZ[edge] / rate_hz).tan();
            section.input.0[lane] = (g / (1.0 + SQRT_2 * g + g * g)) as f32;
            section.damping.0[lane] = (SQRT_2 + g) as f32;
            section.integrator.0[lane] = g as f32;
            section.high.0[lane] = if takes_high { (1.0 / g) as f32 } else { 0.0 };
            section.low.0[lane] = if takes_high { 0.0 } else { 1.0 };
        }
        section
    }
}

/// The two integrators of one section.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    band: F32x8,
    low: F32x8,
}

impl State {
    /// One step: gives the first integrator's input (the high-pass output times `g`), band-pass and low-pass output.
    #[inline(always)]
    fn step(&mut self, section: &Section, input: F32x8) -> (F32x8, F32x8, F32x8) {
        let rise = (input - self.low - section.damping * self.band) * section.input;
        let band = self.band + rise;
        let lift = section.integrator * band;
        let low = self.low + lift;
        // Doubled first, so that a state is rounded once a step: it is the states' rounding that accumulates.
        self.band += rise + rise;
        self.low += lift + lift;
        (rise, band, low)
    }

    #[inline(always)]
    fn split(&mut self, section: &Section, input: F32x8) -> F32x8 {
        let (rise, _, low) = self.step(section, input);
        rise * section.high + low * section.low
    }

    #[inline(always)]
    fn allpass(&mut self, section: &Section, input: F32x8) -> F32x8 {
        let (_, band, _) = self.step(section, input);
        input - F32x8::splat(2.0 * SQRT_2 as f32) * band
    }

    /// Zeroes what has decayed; says whether anything is left.
    fn settle(&mut self) -> bool {
        let mut left = false;
        for value in self.band.0.iter_mut().chain(self.low.0.iter_mut()) {
            if value.abs() < STATE_FLOOR {
                *value = 0.0;
            } else {
                left = true;
            }
        }
        left
    }
}

/// Eight-band crossover of one source.
#[derive(Debug, Clone)]
pub struct BandFilter {
    splits: [Section; 3],
    allpasses: [Section; ALLPASSES],
    split_states: [State; SPLITS],
    allpass_states: [State; ALLPASSES],
    sounding: bool,
}

impl BandFilter {
    /// A filter at rest.
    ///
    /// Range: `rate_hz` above twice the highest of [`EDGES_HZ`]; the generator's settings see to it.
    pub fn new(rate_hz: u32) -> Self {
        let rate_hz = f64::from(rate_hz);
        Self {
            splits: TREE.map(|lanes| Section::new(rate_hz, &lanes)),
            allpasses: COMPENSATION
                .map(|edges| Section::new(rate_hz, &edges.map(|edge| (edge, false)))),
            split_states: [State::default(); SPLITS],
            allpass_states: [State::default(); ALLPASSES],
            sounding: false,
        }
    }

    /// Whether the filter still rings; a filter at rest gives silence for silence.
    pub fn is_sounding(&self) -> bool {
        self.sounding
    }

    /// Puts the filter to rest.
    pub fn reset(&mut self) {
        self.split_states.fill(State::default());
        self.allpass_states.fill(State::default());
        self.sounding = false;
    }

    /// Splits `input` into `bands`, a lane a band, as far as the shorter of the two reaches.
    ///
    /// Real-time: no allocation, bounded by the length. The input has to be finite.
    pub fn process(&mut self, input: &[f32], bands: &mut [F32x8]) {
        let count = input.len().min(bands.len());
        let bands = &mut bands[..count];
        for (band, &sample) in bands.iter_mut().zip(input) {
            *band = F32x8::splat(sample);
        }
        for (states, section) in self.split_states.chunks_exact_mut(2).zip(&self.splits) {
            let [mut first, mut second] = [states[0], states[1]];
            for value in bands.iter_mut() {
                let once = first.split(section, *value);
                *value = second.split(section, once);
            }
            states[0] = first;
            states[1] = second;
        }
        for (states, sections) in self
            .allpass_states
            .chunks_exact_mut(2)
            .zip(self.allpasses.chunks_exact(2))
        {
            let [mut first, mut second] = [states[0], states[1]];
            for value in bands.iter_mut() {
                let once = first.allpass(&sections[0], *value);
                *value = second.allpass(&sections[1], once);
            }
            states[0] = first;
            states[1] = second;
        }
        self.sounding = false;
        for state in self.split_states.iter_mut().chain(&mut self.allpass_states) {
            self.sounding |= state.settle();
        }
    }
}

/// Real, in-phase share of each band in the whole at one frequency: positive, sums to one.
pub(super) fn band_shares(rate_hz: f64, frequency_hz: f64) -> [f64; BANDS] {
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
