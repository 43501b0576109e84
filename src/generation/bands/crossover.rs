//! Second-order sections of the band filter, eight lanes at a time, and the three levels of the tree.
//!
//! Audio side; wait-free, bounded by the frames; allocates nothing.
//!
//! State-variable filters with trapezoidal integrators (\[ZAVALISHIN12\]): their rounding noise stays low for crossovers far
//! below the sample rate. Two low-pass or two high-pass sections in series are one side of a fourth-order Linkwitz-Riley
//! crossover; the sum of both sides has the phase of the allpass section.

use std::f64::consts::{PI, SQRT_2};

use crate::acoustics::bands::EDGES_HZ;
use crate::simd::{F32x8, Lanes, kernel};

/// States below this are set to zero between calls, before they become subnormal: −400 dB.
const STATE_FLOOR: f32 = 1e-20;

/// Crossover of each lane of a section, and whether the lane is on its high side.
pub(crate) type Edges = [(usize, bool); 8];

/// Coefficients of one second-order Butterworth section.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Section {
    /// `g / (1 + √2 g + g²)` with `g = tan(π f / rate)`.
    input: F32x8,
    /// `√2 + g`.
    damping: F32x8,
    /// `g`.
    integrator: F32x8,
    /// `2 g`.
    twice: F32x8,
    /// Factor of the high-pass part in the output: `1 / g` in high lanes, else 0.
    high: F32x8,
    /// Factor of the low-pass part in the output: 1 in low lanes, else 0.
    low: F32x8,
}

impl Section {
    pub(crate) fn new(rate_hz: f64, lanes: &Edges) -> Self {
        let mut section = Self {
            input: F32x8::ZERO,
            damping: F32x8::ZERO,
            integrator: F32x8::ZERO,
            twice: F32x8::ZERO,
            high: F32x8::ZERO,
            low: F32x8::ZERO,
        };
        for (lane, &(edge, takes_high)) in lanes.iter().enumerate() {
            let g = (PI * EDGES_HZ[edge] / rate_hz).tan();
            section.input.0[lane] = (g / (1.0 + SQRT_2 * g + g * g)) as f32;
            section.damping.0[lane] = (SQRT_2 + g) as f32;
            section.integrator.0[lane] = g as f32;
            section.twice.0[lane] = 2.0 * g as f32;
            section.high.0[lane] = if takes_high { (1.0 / g) as f32 } else { 0.0 };
            section.low.0[lane] = if takes_high { 0.0 } else { 1.0 };
        }
        section
    }
}

/// The two integrators of one section.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct State {
    band: F32x8,
    low: F32x8,
}

impl State {
    /// Zeroes decayed states; sets `active` for lanes with a non-zero state.
    pub(crate) fn flush_decayed(&mut self, active: &mut [bool; 8]) {
        for lane in 0..8 {
            for value in [&mut self.band.0[lane], &mut self.low.0[lane]] {
                if value.abs() < STATE_FLOOR {
                    *value = 0.0;
                } else {
                    active[lane] = true;
                }
            }
        }
    }

    /// Zeroes the states of some lanes.
    pub(crate) fn reset(&mut self, lanes: std::ops::Range<usize>) {
        self.band.0[lanes.clone()].fill(0.0);
        self.low.0[lanes].fill(0.0);
    }
}

/// [`State`] in registers.
#[derive(Clone, Copy)]
struct Running<L> {
    band: L,
    low: L,
}

impl<L: Lanes> Running<L> {
    #[inline(always)]
    fn of(state: &State) -> Self {
        Self {
            band: L::from_array(state.band),
            low: L::from_array(state.low),
        }
    }

    #[inline(always)]
    fn state(self) -> State {
        State {
            band: self.band.to_array(),
            low: self.low.to_array(),
        }
    }

    /// One step: returns the first integrator's input (the high-pass output times `g`), band-pass and low-pass output.
    ///
    /// Increments are doubled before the addition, which rounds a state once: the rounding errors of states accumulate.
    #[inline(always)]
    fn step(&mut self, section: &Section, input: L) -> (L, L, L) {
        let damped = L::from_array(section.damping).neg_mul_add(self.band, input.sub(self.low));
        let rise = damped.mul(L::from_array(section.input));
        let band = self.band.add(rise);
        let low = L::from_array(section.integrator).mul_add(band, self.low);
        self.band = L::splat(2.0).mul_add(rise, self.band);
        self.low = L::from_array(section.twice).mul_add(band, self.low);
        (rise, band, low)
    }

    #[inline(always)]
    fn split(&mut self, section: &Section, input: L) -> L {
        let (rise, _, low) = self.step(section, input);
        low.mul_add(
            L::from_array(section.low),
            rise.mul(L::from_array(section.high)),
        )
    }

    #[inline(always)]
    fn allpass(&mut self, section: &Section, input: L) -> L {
        let (_, band, _) = self.step(section, input);
        L::splat(2.0 * SQRT_2 as f32).neg_mul_add(band, input)
    }
}

/// A crossover and the allpasses after it.
#[derive(Debug, Clone)]
pub(crate) struct Level<const ALLPASSES: usize> {
    pub(crate) split: Section,
    pub(crate) allpasses: [Section; ALLPASSES],
}

kernel! {
    /// A crossover and three allpasses, in place.
    pub(crate) fn first_level<L>(level: &Level<3>, states: &mut [State; 5], frames: &mut [F32x8]) {
        let mut once = Running::<L>::of(&states[0]);
        let mut twice = Running::<L>::of(&states[1]);
        let mut a = Running::<L>::of(&states[2]);
        let mut b = Running::<L>::of(&states[3]);
        let mut c = Running::<L>::of(&states[4]);
        for frame in frames.iter_mut() {
            let value = once.split(&level.split, L::from_array(*frame));
            let value = twice.split(&level.split, value);
            let value = a.allpass(&level.allpasses[0], value);
            let value = b.allpass(&level.allpasses[1], value);
            *frame = c.allpass(&level.allpasses[2], value).to_array();
        }
        *states = [once.state(), twice.state(), a.state(), b.state(), c.state()];
    }
}

kernel! {
    /// A crossover and an allpass for the lower four lanes and for the upper four, each duplicated to eight.
    pub(crate) fn second_level<L>(
        level: &Level<1>,
        states: &mut [[State; 3]; 2],
        input: &[F32x8],
        output: &mut [Vec<F32x8>; 2],
    ) {
        let [lower, upper] = states;
        let mut lower_once = Running::<L>::of(&lower[0]);
        let mut lower_twice = Running::<L>::of(&lower[1]);
        let mut lower_pass = Running::<L>::of(&lower[2]);
        let mut upper_once = Running::<L>::of(&upper[0]);
        let mut upper_twice = Running::<L>::of(&upper[1]);
        let mut upper_pass = Running::<L>::of(&upper[2]);
        let [low_out, high_out] = output;
        for ((&frame, low_out), high_out) in input.iter().zip(low_out).zip(high_out) {
            let frame = L::from_array(frame);
            let low = lower_once.split(&level.split, frame.twice_low());
            let low = lower_twice.split(&level.split, low);
            *low_out = lower_pass.allpass(&level.allpasses[0], low).to_array();
            let high = upper_once.split(&level.split, frame.twice_high());
            let high = upper_twice.split(&level.split, high);
            *high_out = upper_pass.allpass(&level.allpasses[0], high).to_array();
        }
        *lower = [lower_once.state(), lower_twice.state(), lower_pass.state()];
        *upper = [upper_once.state(), upper_twice.state(), upper_pass.state()];
    }
}

kernel! {
    /// A crossover for the lower four lanes and for the upper four, each duplicated to eight.
    pub(crate) fn third_level<L>(
        split: &Section,
        states: &mut [[State; 2]; 2],
        input: &[F32x8],
        low_out: &mut [F32x8],
        high_out: &mut [F32x8],
    ) {
        let [lower, upper] = states;
        let mut lower_once = Running::<L>::of(&lower[0]);
        let mut lower_twice = Running::<L>::of(&lower[1]);
        let mut upper_once = Running::<L>::of(&upper[0]);
        let mut upper_twice = Running::<L>::of(&upper[1]);
        for ((&frame, low_out), high_out) in input.iter().zip(low_out).zip(high_out) {
            let frame = L::from_array(frame);
            let low = lower_once.split(split, frame.twice_low());
            *low_out = lower_twice.split(split, low).to_array();
            let high = upper_once.split(split, frame.twice_high());
            *high_out = upper_twice.split(split, high).to_array();
        }
        *lower = [lower_once.state(), lower_twice.state()];
        *upper = [upper_once.state(), upper_twice.state()];
    }
}
