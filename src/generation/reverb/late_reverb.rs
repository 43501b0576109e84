//! The diffuse tail: a feedback delay network in eight bands.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at birth only. Takes band samples of every source that sends
//! ([`LateSends`]), gives eight line signals that arrive from the corners of a cube.
//!
//! After \[JOT91\]: delay lines of mutually prime length, an orthogonal feedback matrix (here Hadamard's), and in
//! each line the gain `10^(−3 length / T60)`. Every band has a network of its own, so that it decays at its own rate
//! exactly and no absorbent filter has to be fitted. No line is shorter than a chunk, so the frames of a chunk do not
//! depend on each other and are worked on eight at a time.
//!
//! Calibration (own): without absorption the lines keep the energy that is put in, spread evenly over their samples, and
//! each gives its own back once a length; so they give `1 / mean length` of it a second. Absorption takes from every
//! way of total length t the factor `10^(−3 t / T60)`, whatever lines it went through. A send with gain
//! `√(E · mean length) · 10^(−3 delay / T60)` and that delay therefore has the energy `E · 10^(−6 t / T60)` a second
//! at time t after emission.
//!
//! What comes out of a network that is fed at one moment is not even from the shortest line on: energy comes back in
//! renewals a line's length apart, and after many of them lags `(mean² − variance) / (2 mean)` of the lengths behind an
//! even stream that begins with the feed (\[COX62\] 4.2, the renewal function). A send is fed earlier by as much.

use std::ops::Range;

use crate::acoustics::BANDS;
use crate::extrapolation::FramePaths;
use crate::simd::{F32x8, LANE_INDICES, LaneSet, Lanes, kernel};

use crate::generation::binaural::ear_ramps::Moment;
use crate::generation::delay::delay_line::DelayLine;
use crate::generation::reverb::late_sends::{LateSends, Network};
use crate::generation::{BandCorrection, CHUNK};

/// Lines of the network. Moves with the butterflies and the directions.
pub(crate) const LINES: usize = 8;

/// Lengths in seconds before they are made prime: a geometric series from 22 to 67 ms, slightly uneven. The shortest
/// is longer than [`CHUNK`] at every sample rate.
const LENGTHS_S: [f64; LINES] = [
    0.0221, 0.0268, 0.0313, 0.0367, 0.0432, 0.0501, 0.0587, 0.0671,
];

/// Signs with which a send enters the lines; no row of the Hadamard matrix, which would put it all into one line.
const SIGNS: [f32; LINES] = [1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, 1.0];

/// One over the square root of the number of lines.
const NORM: f32 = 0.353_553_4;

/// T60 up to this is silence, in seconds.
const SHORTEST_T60_S: f32 = 0.05;

/// Everything below this is nothing: −180 dB re a sample of one.
const FLOOR: f32 = 1e-9;

/// Added and taken away again to turn values below 1e-25 or so into zero before they become subnormal.
const SUBNORMAL_GUARD: f32 = 1e-18;

/// A chunk of every line.
type Chunks = [[f32; CHUNK]; LINES];

/// The network.
#[derive(Debug)]
pub(crate) struct LateReverb {
    set: LaneSet,
    rate_hz: f32,
    lengths: [usize; LINES],
    /// Rings, one a line: band after band.
    lines: [Vec<f32>; LINES],
    places: [usize; LINES],
    /// Feedback gains, ramped.
    gain: [F32x8; LINES],
    growth: [F32x8; LINES],
    sends: LateSends,
    /// What one band's lines give in the chunk and then take.
    turning: Box<Chunks>,
    /// What the lines give in the chunk, summed over the bands.
    given: Box<Chunks>,
    /// Frames for which nothing above [`FLOOR`] has entered the lines.
    quiet_frames: usize,
}

impl LateReverb {
    pub(crate) fn new(rate_hz: u32, max_sources: usize) -> Self {
        let lengths = LENGTHS_S.map(|s| prime_from((s * f64::from(rate_hz)).round() as usize));
        let total: usize = lengths.iter().sum();
        let squares: usize = lengths.iter().map(|length| length * length).sum();
        let (mean, square) = (total as f32 / LINES as f32, squares as f32 / LINES as f32);
        let rate_hz = rate_hz as f32;
        let network = Network {
            rate_hz,
            mean_length_s: mean / rate_hz,
            lag_s: (2.0 * mean * mean - square) / (2.0 * mean) / rate_hz,
        };
        Self {
            set: LaneSet::best(),
            rate_hz,
            lengths,
            lines: lengths.map(|length| {
                // Written rather than asked for as zeros: the pages are touched here and not in the first blocks.
                let mut line = Vec::with_capacity(BANDS * length);
                line.resize(BANDS * length, 0.0);
                line
            }),
            places: [0; LINES],
            gain: [F32x8::ZERO; LINES],
            growth: [F32x8::ZERO; LINES],
            sends: LateSends::new(network, max_sources),
            turning: Box::new([[0.0; CHUNK]; LINES]),
            given: Box::new([[0.0; CHUNK]; LINES]),
            quiet_frames: usize::MAX / 2,
        }
    }

    /// New decay times and sends. A send's start is kept within `max_delay` frames; `left` frames of the last ramp were still to come.
    pub(crate) fn set_frame(
        &mut self,
        frame: &FramePaths,
        max_delay: i64,
        correction: &BandCorrection,
        left: u32,
        ramp: u32,
    ) {
        for (line, &length) in self.lengths.iter().enumerate() {
            let mut wanted = F32x8::ZERO;
            for (gain, &t60_s) in wanted.0.iter_mut().zip(&frame.decay_time_s) {
                *gain = decay(length as f32 / self.rate_hz, t60_s);
            }
            let present = self.gain[line] - self.growth[line] * F32x8::splat(left as f32);
            self.growth[line] = (wanted - present) * F32x8::splat(1.0 / ramp as f32);
            self.gain[line] = wanted;
        }
        self.sends
            .set_frame(frame, max_delay, correction, left, ramp);
    }

    /// Reads one source's send for a chunk. Call for every source before [`Self::process`].
    pub(crate) fn collect(&mut self, slot: usize, line: &DelayLine, moment: Moment) {
        self.sends.collect(slot, line, moment);
    }

    /// Runs the network for a chunk and writes each line's signal from place `at` on; false, and nothing written, if all is silent.
    pub(crate) fn process(
        &mut self,
        left: u32,
        lines: &mut [Vec<f32>; LINES],
        at: usize,
        frames: usize,
    ) -> bool {
        let fed = (0..BANDS).any(|band| self.sends.band(band, frames).iter().any(|&v| v != 0.0));
        if !fed && self.quiet_frames > self.lengths[LINES - 1] {
            return false;
        }
        self.given.as_flattened_mut().fill(0.0);
        let mut is_quiet = true;
        for band in 0..BANDS {
            for (line, turning) in self.turning.iter_mut().enumerate() {
                let length = self.lengths[line];
                let ring = &self.lines[line][band * length..][..length];
                let (ahead, around) = ring_parts(self.places[line], length, frames);
                turning[..ahead.len()].copy_from_slice(&ring[ahead.clone()]);
                turning[ahead.len()..frames].copy_from_slice(&ring[around]);
            }
            let mut turn = Turn {
                gain: self.gain.map(|gain| gain.0[band]),
                growth: [0.0; LINES],
            };
            if left > 0 {
                turn.growth = self.growth.map(|growth| growth.0[band]);
                for (gain, growth) in turn.gain.iter_mut().zip(turn.growth) {
                    *gain -= growth * left as f32;
                }
            }
            let fed = self.sends.band(band, frames);
            circulate(self.set, &turn, fed, &mut self.turning, &mut self.given);
            for (line, turning) in self.turning.iter().enumerate() {
                is_quiet = is_quiet && turning[..frames].iter().all(|value| value.abs() <= FLOOR);
                let length = self.lengths[line];
                let ring = &mut self.lines[line][band * length..][..length];
                let (ahead, around) = ring_parts(self.places[line], length, frames);
                ring[ahead.clone()].copy_from_slice(&turning[..ahead.len()]);
                ring[around].copy_from_slice(&turning[ahead.len()..frames]);
            }
        }
        self.sends.clear();
        for (place, length) in self.places.iter_mut().zip(self.lengths) {
            *place = (*place + frames) % length;
        }
        for (line, given) in lines.iter_mut().zip(self.given.iter()) {
            line[at..at + frames].copy_from_slice(&given[..frames]);
        }
        if is_quiet {
            self.quiet_frames += frames;
        } else {
            self.quiet_frames = 0;
        }
        true
    }
}

/// Where `frames` frames from `place` on lie in a ring that is longer: up to its end, and from its beginning.
fn ring_parts(place: usize, length: usize, frames: usize) -> (Range<usize>, Range<usize>) {
    let ahead = frames.min(length - place);
    (place..place + ahead, 0..frames - ahead)
}

/// One band's feedback gains.
#[derive(Debug, Clone, Copy)]
struct Turn {
    /// Before the chunk's first frame.
    gain: [f32; LINES],
    /// A frame.
    growth: [f32; LINES],
}

kernel! {
    /// Sends one band's chunk round: takes what comes out of the lines, leaves what goes in, adds what is heard.
    ///
    /// Works on whole lanes and spoils up to seven frames behind those of `fed`.
    fn circulate<L>(turn: &Turn, fed: &[f32], lines: &mut Chunks, given: &mut Chunks) {
        let guard = L::splat(SUBNORMAL_GUARD);
        let norm = L::splat(NORM);
        let mut place = 0;
        while place < fed.len() {
            let rest = &fed[place..];
            let fed = if rest.len() < 8 {
                let mut few = F32x8::ZERO;
                few.0[..rest.len()].copy_from_slice(rest);
                L::from_array(few)
            } else {
                L::load_at(rest, 0)
            };
            let fed = fed.mul(norm);
            let grown = L::from_array(LANE_INDICES).add(L::splat(place as f32 + 1.0));
            let mut values = [L::splat(0.0); LINES];
            for line in 0..LINES {
                let gain = grown.mul_add(L::splat(turn.growth[line]), L::splat(turn.gain[line]));
                let value = L::load_at(&lines[line], place).mul(gain);
                L::load_at(&given[line], place)
                    .add(value)
                    .store_at(&mut given[line], place);
                values[line] = value;
            }
            mix(&mut values);
            for line in 0..LINES {
                let value = fed.mul_add(L::splat(SIGNS[line]), values[line]);
                value.add(guard).sub(guard).store_at(&mut lines[line], place);
            }
            place += 8;
        }
    }
}

/// Pressure left after `time_s`; zero for decay times that are too short, negative or not a number.
pub(crate) fn decay(time_s: f32, t60_s: f32) -> f32 {
    if t60_s > SHORTEST_T60_S {
        10f32.powf(-3.0 * time_s / t60_s)
    } else {
        0.0
    }
}

/// Hadamard's matrix of order eight, normalised: three rounds of butterflies.
#[inline(always)]
fn mix<L: Lanes>(values: &mut [L; LINES]) {
    butterflies::<L, 1>(values);
    butterflies::<L, 2>(values);
    butterflies::<L, 4>(values);
    for line in 0..LINES {
        values[line] = values[line].mul(L::splat(NORM));
    }
}

#[inline(always)]
fn butterflies<L: Lanes, const SPAN: usize>(values: &mut [L; LINES]) {
    for line in 0..LINES {
        if line & SPAN == 0 {
            let (a, b) = (values[line], values[line + SPAN]);
            values[line] = a.add(b);
            values[line + SPAN] = a.sub(b);
        }
    }
}

/// The smallest prime from `n` on.
fn prime_from(n: usize) -> usize {
    let is_prime = |n: usize| {
        (2..)
            .take_while(|d| d * d <= n)
            .all(|d| !n.is_multiple_of(d))
    };
    (n.max(2)..).find(|&n| is_prime(n)).unwrap_or(n)
}

#[cfg(test)]
#[path = "late_reverb_tests.rs"]
mod tests;
