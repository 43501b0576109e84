//! The late reverb: a feedback delay network in eight bands.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at construction only. Input: the sends ([`LateSends`]); output:
//! the signals of eight delay lines.
//!
//! After \[JOT91\]: delay lines of mutually prime length, an orthogonal feedback matrix (here Hadamard's), and in
//! each line the gain `10^(−3 length / T60)`. Every band has its own network and decays exactly at its own rate, without
//! fitted absorption filters. No line is shorter than a chunk: the frames of a chunk are independent and computed eight at
//! a time.
//!
//! Calibration (own): without absorption the lines keep their energy, spread evenly over the samples, and each line emits
//! its share once per length: `1 / mean length` of the energy per second. Absorption multiplies the amplitude by
//! `10^(−3 t / T60)` after a total length t, on any route through the lines. A send with gain
//! `√(E · mean length) · 10^(−3 delay / T60)` and that delay therefore has the energy `E · 10^(−6 t / T60)` per second
//! at time t after emission.
//!
//! The response to one impulse is not uniform at first: energy returns in renewals one line length apart. After many of
//! them it lags by `(mean² − variance) / (2 mean)` of the lengths behind a uniform flow that begins with the impulse
//! (\[COX62\] 4.2, the renewal function). Sends are advanced by this lag.

use std::ops::Range;

use crate::acoustics::BANDS;
use crate::extrapolation::FramePaths;
use crate::simd::{F32x8, LANE_INDICES, LaneSet, Lanes, kernel};

use crate::generation::delay::delay_line::DelayLine;
use crate::generation::ramp::{BandRamp, ChunkSpan};
use crate::generation::reverb::late_sends::{LateSends, Network, decay};
use crate::generation::{BandCorrection, CHUNK};

/// Lines of the network. The butterflies and the plane waves depend on this number.
pub(crate) const LINES: usize = 8;

/// Lengths in seconds before rounding to primes: a slightly perturbed geometric series from 22 to 67 ms. The shortest is
/// longer than [`CHUNK`] at every sample rate.
const LENGTHS_S: [f64; LINES] = [
    0.0221, 0.0268, 0.0313, 0.0367, 0.0432, 0.0501, 0.0587, 0.0671,
];

/// Input signs of the lines. Not a row of the Hadamard matrix, which would feed a single line.
const SIGNS: [f32; LINES] = [1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, 1.0];

/// One over the square root of the number of lines.
const NORM: f32 = 0.353_553_4;

/// Silence threshold of the amplitude: −180 dB re full scale.
const FLOOR: f32 = 1e-9;

/// Added and subtracted: values below about 1e-25 become zero before they become subnormal.
const SUBNORMAL_GUARD: f32 = 1e-18;

/// A chunk of every line.
type Chunks = [[f32; CHUNK]; LINES];

/// The network.
#[derive(Debug)]
pub(crate) struct LateReverb {
    set: LaneSet,
    rate_hz: f32,
    lengths: [usize; LINES],
    /// One ring per line and band, ordered by band.
    lines: [Vec<f32>; LINES],
    positions: [usize; LINES],
    /// Feedback gains, ramped.
    gain: [BandRamp; LINES],
    sends: LateSends,
    /// Output chunk of one band's lines, then their input chunk.
    recirculated: Box<Chunks>,
    /// The lines' output in the chunk, summed over the bands.
    output: Box<Chunks>,
    /// Frames since a value above [`FLOOR`] entered the lines.
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
                // Written, not allocated as zeros: the pages are touched here, not in the first blocks.
                let mut line = Vec::with_capacity(BANDS * length);
                line.resize(BANDS * length, 0.0);
                line
            }),
            positions: [0; LINES],
            gain: [BandRamp::default(); LINES],
            sends: LateSends::new(network, max_sources),
            recirculated: Box::new([[0.0; CHUNK]; LINES]),
            output: Box::new([[0.0; CHUNK]; LINES]),
            quiet_frames: usize::MAX / 2,
        }
    }

    /// Ramps to the decay times and sends of a frame, with delays of at most `max_delay` frames; `left` frames of the last
    /// ramp remain.
    pub(crate) fn set_frame(
        &mut self,
        frame: &FramePaths,
        max_delay: i64,
        correction: &BandCorrection,
        left: u32,
        ramp: u32,
    ) {
        for (line, &length) in self.lengths.iter().enumerate() {
            let mut target = F32x8::ZERO;
            for (gain, &t60_s) in target.0.iter_mut().zip(&frame.late_groups[0].decay_time_s) {
                *gain = decay(length as f32 / self.rate_hz, t60_s);
            }
            self.gain[line].retarget(target, left, ramp);
        }
        self.sends
            .set_frame(frame, max_delay, correction, left, ramp);
    }

    /// Adds one source's sends for a chunk. Call for every source before [`Self::process`].
    pub(crate) fn collect(&mut self, slot: usize, line: &DelayLine, chunk: ChunkSpan) {
        self.sends.collect(slot, line, chunk);
    }

    /// Runs the network for a chunk and writes each line's signal from index `at` on; returns false and writes nothing if
    /// the network is silent.
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
        self.output.as_flattened_mut().fill(0.0);
        let mut is_quiet = true;
        for band in 0..BANDS {
            for (line, recirculated) in self.recirculated.iter_mut().enumerate() {
                let length = self.lengths[line];
                let ring = &self.lines[line][band * length..][..length];
                let (ahead, around) = ring_parts(self.positions[line], length, frames);
                recirculated[..ahead.len()].copy_from_slice(&ring[ahead.clone()]);
                recirculated[ahead.len()..frames].copy_from_slice(&ring[around]);
            }
            let feedback = FeedbackGains {
                gain: self.gain.map(|gain| gain.value(left).0[band]),
                growth: self.gain.map(|gain| gain.growth_now(left).0[band]),
            };
            let fed = self.sends.band(band, frames);
            circulate(
                self.set,
                &feedback,
                fed,
                &mut self.recirculated,
                &mut self.output,
            );
            for (line, recirculated) in self.recirculated.iter().enumerate() {
                is_quiet = is_quiet
                    && recirculated[..frames]
                        .iter()
                        .all(|value| value.abs() <= FLOOR);
                let length = self.lengths[line];
                let ring = &mut self.lines[line][band * length..][..length];
                let (ahead, around) = ring_parts(self.positions[line], length, frames);
                ring[ahead.clone()].copy_from_slice(&recirculated[..ahead.len()]);
                ring[around].copy_from_slice(&recirculated[ahead.len()..frames]);
            }
        }
        self.sends.clear();
        for (position, length) in self.positions.iter_mut().zip(self.lengths) {
            *position = (*position + frames) % length;
        }
        for (line, output) in lines.iter_mut().zip(self.output.iter()) {
            line[at..at + frames].copy_from_slice(&output[..frames]);
        }
        if is_quiet {
            self.quiet_frames += frames;
        } else {
            self.quiet_frames = 0;
        }
        true
    }
}

/// The two ranges of `frames` frames from `position` on in a longer ring.
fn ring_parts(position: usize, length: usize, frames: usize) -> (Range<usize>, Range<usize>) {
    let ahead = frames.min(length - position);
    (position..position + ahead, 0..frames - ahead)
}

/// One band's feedback gains.
#[derive(Debug, Clone, Copy)]
struct FeedbackGains {
    /// Gain before the chunk's first frame.
    gain: [f32; LINES],
    /// Growth per frame.
    growth: [f32; LINES],
}

kernel! {
    /// Feedback of one band's chunk: replaces the output of the lines by their input and adds the output to `output`.
    ///
    /// Works on whole lanes and overwrites up to seven frames after the end of `fed`.
    fn circulate<L>(feedback: &FeedbackGains, fed: &[f32], lines: &mut Chunks, output: &mut Chunks) {
        let guard = L::splat(SUBNORMAL_GUARD);
        let norm = L::splat(NORM);
        let mut position = 0;
        while position < fed.len() {
            let rest = &fed[position..];
            let fed = if rest.len() < 8 {
                let mut few = F32x8::ZERO;
                few.0[..rest.len()].copy_from_slice(rest);
                L::from_array(few)
            } else {
                L::load_at(rest, 0)
            };
            let fed = fed.mul(norm);
            let grown = L::from_array(LANE_INDICES).add(L::splat(position as f32 + 1.0));
            let mut values = [L::splat(0.0); LINES];
            for line in 0..LINES {
                let gain = grown.mul_add(L::splat(feedback.growth[line]), L::splat(feedback.gain[line]));
                let value = L::load_at(&lines[line], position).mul(gain);
                L::load_at(&output[line], position)
                    .add(value)
                    .store_at(&mut output[line], position);
                values[line] = value;
            }
            mix(&mut values);
            for line in 0..LINES {
                let value = fed.mul_add(L::splat(SIGNS[line]), values[line]);
                value.add(guard).sub(guard).store_at(&mut lines[line], position);
            }
            position += 8;
        }
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
