//! The diffuse tail: a feedback delay network in eight bands.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at birth only. Takes band samples of every source that sends,
//! gives eight line signals that arrive from the corners of a cube.
//!
//! After \[JOT91\]: delay lines of mutually prime length, an orthogonal feedback matrix (here Hadamard's), and in
//! each line the gain `10^(−3 length / T60)`. A sample of the lines is eight lanes, one a band, so that every band decays
//! at its own rate exactly and no absorbent filter has to be fitted.
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

use crate::acoustics::bands::amplitude_of_energy;
use crate::extrapolation::{FramePaths, LATE_STEPS};
use crate::simd::F32x8;

use super::delay_line::DelayLine;
use super::{BandCorrection, CHUNK};

/// Lines of the network. Moves with the butterflies and the directions.
pub(super) const LINES: usize = 8;

/// Lengths in seconds before they are made prime: a geometric series from 22 to 67 ms, slightly uneven.
const LENGTHS_S: [f64; LINES] = [
    0.0221, 0.0268, 0.0313, 0.0367, 0.0432, 0.0501, 0.0587, 0.0671,
];

/// Signs with which a send enters the lines; no row of the Hadamard matrix, which would put it all into one line.
const SIGNS: [f32; LINES] = [1.0, -1.0, 1.0, -1.0, -1.0, 1.0, 1.0, 1.0];

/// T60 up to this is silence, in seconds.
const SHORTEST_T60_S: f32 = 0.05;

/// Everything below this is nothing: −180 dB re a sample of one.
const FLOOR: f32 = 1e-9;

/// Added and taken away again to turn values below 1e-25 or so into zero before they become subnormal.
const SUBNORMAL_GUARD: f32 = 1e-18;

/// A send keeps its delay until it is wrong by more than this, in seconds: moving it costs a cross-fade.
const DELAY_TOLERANCE_S: f32 = 0.005;

/// Largest gain of a send, 60 dB.
const MAX_GAIN: f32 = 1000.0;

/// One reading position of a send with ramped gains.
#[derive(Debug, Clone, Copy, Default)]
struct Tap {
    delay: i64,
    gain: F32x8,
    growth: F32x8,
}

impl Tap {
    fn retarget(&mut self, gain: F32x8, left: u32, ramp: u32) {
        let present = self.gain - self.growth * F32x8::splat(left as f32);
        self.growth = (gain - present) * F32x8::splat(1.0 / ramp as f32);
        self.gain = gain;
    }

    fn is_silent(&self, left: u32) -> bool {
        self.gain == F32x8::ZERO && (left == 0 || self.growth == F32x8::ZERO)
    }
}

/// A source's send: where it reads, and where it read before.
#[derive(Debug, Clone, Copy, Default)]
struct Send {
    now: Tap,
    before: Tap,
}

/// The network.
#[derive(Debug)]
pub(super) struct LateReverb {
    rate_hz: f32,
    lengths: [usize; LINES],
    mean_length_s: f32,
    /// Lag of the renewals behind an even stream, in seconds.
    lag_s: f32,
    /// Rings of band samples, one a line.
    lines: [Vec<F32x8>; LINES],
    places: [usize; LINES],
    /// Feedback gains, ramped.
    gain: [F32x8; LINES],
    growth: [F32x8; LINES],
    sends: Vec<Send>,
    input: Vec<F32x8>,
    /// Frames for which nothing above [`FLOOR`] has entered the lines.
    quiet_frames: usize,
}

impl LateReverb {
    pub(super) fn new(rate_hz: u32, max_sources: usize) -> Self {
        let lengths = LENGTHS_S.map(|s| prime_from((s * f64::from(rate_hz)).round() as usize));
        let total: usize = lengths.iter().sum();
        let squares: usize = lengths.iter().map(|length| length * length).sum();
        let (mean, square) = (total as f32 / LINES as f32, squares as f32 / LINES as f32);
        Self {
            lag_s: (2.0 * mean * mean - square) / (2.0 * mean) / rate_hz as f32,
            rate_hz: rate_hz as f32,
            lengths,
            mean_length_s: total as f32 / LINES as f32 / rate_hz as f32,
            lines: lengths.map(|length| {
                let mut line = Vec::with_capacity(length);
                line.resize(length, F32x8::ZERO);
                line
            }),
            places: [0; LINES],
            gain: [F32x8::ZERO; LINES],
            growth: [F32x8::ZERO; LINES],
            sends: vec![Send::default(); max_sources * LATE_STEPS],
            input: vec![F32x8::ZERO; CHUNK],
            quiet_frames: usize::MAX / 2,
        }
    }

    /// New decay times and sends. A send's start is kept within `max_delay` frames; `left` frames of the last ramp were still to come.
    pub(super) fn set_frame(
        &mut self,
        frame: &FramePaths,
        max_delay: i64,
        correction: &BandCorrection,
        left: u32,
        ramp: u32,
    ) {
        let t60_s = &frame.decay_time_s;
        for (line, &length) in self.lengths.iter().enumerate() {
            let mut wanted = F32x8::ZERO;
            for (gain, &t60_s) in wanted.0.iter_mut().zip(t60_s) {
                *gain = decay(length as f32 / self.rate_hz, t60_s);
            }
            let present = self.gain[line] - self.growth[line] * F32x8::splat(left as f32);
            self.growth[line] = (wanted - present) * F32x8::splat(1.0 / ramp as f32);
            self.gain[line] = wanted;
        }
        for (place, send) in self.sends.iter_mut().enumerate() {
            let (slot, step) = (place / LATE_STEPS, place % LATE_STEPS);
            send.before.retarget(F32x8::ZERO, left, ramp);
            let mut own = frame.late.iter().filter(|late| late.source.slot() == slot);
            let Some(wanted) = own.nth(step) else {
                send.now.retarget(F32x8::ZERO, left, ramp);
                continue;
            };
            let start_s = (wanted.start_s - self.lag_s).max(0.0);
            let delay = ((start_s * self.rate_hz) as i64).min(max_delay);
            let tolerance = (DELAY_TOLERANCE_S * self.rate_hz) as i64;
            if send.now.is_silent(left) {
                send.now.delay = delay;
            } else if (delay - send.now.delay).abs() > tolerance {
                // In whole steps from where it began: whoever hears of the way an update later moves to the same place.
                let steps = ((delay - send.now.delay) as f32 / tolerance as f32).round() as i64;
                let delay = (send.now.delay + steps * tolerance).clamp(0, max_delay);
                send.before = send.now;
                send.before.retarget(F32x8::ZERO, left, ramp);
                send.now = Tap {
                    delay,
                    ..Tap::default()
                };
            }
            let delay_s = send.now.delay as f32 / self.rate_hz;
            let amplitude = std::array::from_fn(|b| {
                let energy = amplitude_of_energy(wanted.energy_per_s[b] * self.mean_length_s);
                let gain = energy * decay(delay_s, t60_s[b]);
                if gain.is_finite() {
                    gain.min(MAX_GAIN)
                } else {
                    0.0
                }
            });
            send.now.retarget(correction.gains(&amplitude), left, ramp);
        }
    }

    /// Reads one source's send for a chunk of `frames` at time `now`. Call for every source before [`Self::process`].
    pub(super) fn collect(
        &mut self,
        slot: usize,
        line: &DelayLine,
        now: i64,
        left: u32,
        frames: usize,
    ) {
        let first = slot * LATE_STEPS;
        let Some(sends) = self.sends.get(first..first + LATE_STEPS) else {
            return;
        };
        for tap in sends.iter().flat_map(|send| [&send.now, &send.before]) {
            let position = now - tap.delay;
            if tap.is_silent(left) || line.is_silent_from(position) {
                continue;
            }
            let growth = if left > 0 { tap.growth } else { F32x8::ZERO };
            let mut gain = tap.gain - growth * F32x8::splat(left as f32);
            let input = &mut self.input;
            line.for_each_frame(position, frames, |i, value| {
                gain += growth;
                input[i] += value * gain;
            });
        }
    }

    /// Runs the network for a chunk and writes each line's signal from place `at` on; false, and nothing written, if all is silent.
    pub(super) fn process(
        &mut self,
        left: u32,
        lines: &mut [Vec<f32>; LINES],
        at: usize,
        frames: usize,
    ) -> bool {
        let input = &mut self.input[..frames];
        let has_input = input.iter().any(|value| *value != F32x8::ZERO);
        let longest = self.lengths[LINES - 1];
        if !has_input && self.quiet_frames > longest {
            return false;
        }
        let moving = left > 0;
        let mut gain = self.gain;
        if moving {
            for (gain, &growth) in gain.iter_mut().zip(&self.growth) {
                *gain = *gain - growth * F32x8::splat(left as f32);
            }
        }
        let entry = SIGNS.map(|sign| F32x8::splat(sign / (LINES as f32).sqrt()));
        let guard = F32x8::splat(SUBNORMAL_GUARD);
        let mut loudest = F32x8::ZERO;
        for (i, fed) in input.iter_mut().enumerate() {
            let mut values = [F32x8::ZERO; LINES];
            for line in 0..LINES {
                if moving {
                    gain[line] += self.growth[line];
                }
                values[line] = self.lines[line][self.places[line]] * gain[line];
                lines[line][at + i] = values[line].sum();
            }
            mix(&mut values);
            for line in 0..LINES {
                let value = values[line] + *fed * entry[line];
                let value = (value + guard) - guard;
                for (most, lane) in loudest.0.iter_mut().zip(value.0) {
                    *most = most.max(lane.abs());
                }
                let place = &mut self.places[line];
                self.lines[line][*place] = value;
                *place += 1;
                if *place == self.lengths[line] {
                    *place = 0;
                }
            }
            *fed = F32x8::ZERO;
        }
        if loudest.0.iter().any(|&lane| lane > FLOOR) {
            self.quiet_frames = 0;
        } else {
            self.quiet_frames += frames;
        }
        true
    }
}

/// Pressure left after `time_s`; zero for decay times that are too short, negative or not a number.
fn decay(time_s: f32, t60_s: f32) -> f32 {
    if t60_s > SHORTEST_T60_S {
        10f32.powf(-3.0 * time_s / t60_s)
    } else {
        0.0
    }
}

/// Hadamard's matrix of order eight, normalised: three rounds of butterflies.
#[inline(always)]
fn mix(values: &mut [F32x8; LINES]) {
    for span in [1, 2, 4] {
        for start in 0..LINES {
            if start & span == 0 {
                let (a, b) = (values[start], values[start + span]);
                values[start] = a + b;
                values[start + span] = a - b;
            }
        }
    }
    let norm = F32x8::splat(1.0 / (LINES as f32).sqrt());
    for value in values {
        *value *= norm;
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
mod tests {
    use super::*;
    use crate::extrapolation::LateSend;

    const RATE_HZ: u32 = 44_100;
    const ENERGY_PER_S: f32 = 0.4;
    const START_S: f32 = 0.08;

    /// Energy a frame, summed over the lines, after an impulse in one band at time 0, with that band's decay time.
    fn response(band: usize, t60_s: f32, other_t60_s: f32, seconds: f32) -> Vec<f64> {
        let mut reverb = LateReverb::new(RATE_HZ, 1);
        let mut line = DelayLine::new(RATE_HZ as usize);
        let mut decay_time_s = [other_t60_s; 8];
        decay_time_s[band] = t60_s;
        let frame = FramePaths {
            late: vec![LateSend {
                source: Default::default(),
                energy_per_s: [ENERGY_PER_S; 8],
                start_s: START_S,
            }],
            decay_time_s,
            ..FramePaths::default()
        };
        // The correction mixes bands of unequal gain; the law is about one band's gain, so it is left out.
        let correction = BandCorrection::none();
        reverb.set_frame(&frame, i64::from(RATE_HZ), &correction, 0, 1);
        let mut impulse = [F32x8::ZERO; CHUNK];
        impulse[0].0[band] = 1.0;
        let mut signals: [Vec<f32>; LINES] = std::array::from_fn(|_| vec![0.0; CHUNK]);
        let mut energy = Vec::new();
        let mut now = 0;
        while energy.len() < (seconds * RATE_HZ as f32) as usize {
            line.write(
                now,
                if now == 0 {
                    &impulse
                } else {
                    &[F32x8::ZERO; CHUNK]
                },
            );
            reverb.collect(0, &line, now, 0, CHUNK);
            if !reverb.process(0, &mut signals, 0, CHUNK) {
                signals.iter_mut().for_each(|signal| signal.fill(0.0));
            }
            energy.extend((0..CHUNK).map(|i| {
                signals
                    .iter()
                    .map(|signal| f64::from(signal[i]).powi(2))
                    .sum::<f64>()
            }));
            now += CHUNK as i64;
        }
        energy
    }

    /// Energy still to come (\[SCHROEDER65\]).
    fn still_to_come(energy: &[f64]) -> Vec<f64> {
        let mut sum = 0.0;
        let mut curve: Vec<f64> = energy
            .iter()
            .rev()
            .map(|e| {
                sum += e;
                sum
            })
            .collect();
        curve.reverse();
        curve
    }

    /// Decay time from a straight line through the decay curve between −5 and −45 dB.
    fn decay_time_s(curve: &[f64]) -> f64 {
        let points: Vec<(f64, f64)> = curve
            .iter()
            .enumerate()
            .map(|(i, e)| (i as f64 / f64::from(RATE_HZ), 10.0 * (e / curve[0]).log10()))
            .filter(|(_, db)| (-45.0..-5.0).contains(db))
            .collect();
        let n = points.len() as f64;
        let (mean_t, mean_db) = points
            .iter()
            .fold((0.0, 0.0), |(t, d), p| (t + p.0 / n, d + p.1 / n));
        let (above, below) = points.iter().fold((0.0, 0.0), |(above, below), p| {
            let t = p.0 - mean_t;
            (above + t * (p.1 - mean_db), below + t * t)
        });
        -60.0 * below / above
    }

    #[test]
    fn every_band_decays_at_its_own_rate_from_its_own_level() {
        for (band, t60_s) in [(0, 4.0), (1, 2.0), (3, 1.0), (5, 0.6), (7, 0.3)] {
            let curve = still_to_come(&response(band, t60_s, 1.1, 1.3 * t60_s + 0.3));
            let measured_s = decay_time_s(&curve);
            let start = (START_S * RATE_HZ as f32) as usize;
            // E T / (6 ln 10) 10^(−6 start / T) is still to come when the tail starts.
            let expected = f64::from(ENERGY_PER_S) * f64::from(t60_s) / 13.815_510_558
                * 10f64.powf(-6.0 * f64::from(START_S / t60_s));
            let level_db = 10.0 * (curve[start] / expected).log10();
            let later = start + RATE_HZ as usize / 10;
            let later_db =
                10.0 * (curve[later] / expected * 10f64.powf(0.6 / f64::from(t60_s))).log10();
            println!("{t60_s} s: measured {measured_s:.4} s, {level_db:.2} dB, {later_db:.2} dB");
            assert!((measured_s / f64::from(t60_s) - 1.0).abs() < 0.03);
            assert!(level_db.abs() < 0.5 && later_db.abs() < 0.5);
        }
    }

    #[test]
    fn feedback_never_adds_energy() {
        let mut values: [F32x8; LINES] =
            std::array::from_fn(|i| F32x8(std::array::from_fn(|b| ((i * 8 + b) as f32).sin())));
        let energy = |values: &[F32x8; LINES]| {
            values
                .iter()
                .flat_map(|v| v.0)
                .map(|v| f64::from(v).powi(2))
                .sum::<f64>()
        };
        let before = energy(&values);
        mix(&mut values);
        // Twenty-five roundings of relative size 6e-8.
        assert!((energy(&values) / before - 1.0).abs() < 2e-6);
    }

    #[test]
    fn a_start_that_is_told_less_often_moves_to_the_same_places() {
        let moved = |every: u32| {
            let mut reverb = LateReverb::new(RATE_HZ, 1);
            for frame in 0..=387u32 {
                let told = frame - frame % every;
                let frame = FramePaths {
                    late: vec![LateSend {
                        source: Default::default(),
                        energy_per_s: [ENERGY_PER_S; 8],
                        start_s: START_S + 1e-4 * told as f32,
                    }],
                    decay_time_s: [1.0; 8],
                    ..FramePaths::default()
                };
                let correction = BandCorrection::none();
                reverb.set_frame(&frame, i64::from(RATE_HZ), &correction, 0, 1);
            }
            reverb.sends[0].now.delay
        };
        let often = moved(1);
        assert!(moved(400) < often);
        for every in [2, 5, 13] {
            assert_eq!(moved(every), often, "{every}");
        }
    }

    #[test]
    fn nonsense_decay_times_are_silence() {
        for t60_s in [0.0, -1.0, 0.05, f32::NAN] {
            assert!(
                response(2, t60_s, 1.0, 0.4).iter().all(|&e| e == 0.0),
                "{t60_s}"
            );
        }
    }

    #[test]
    fn endless_decay_stays_bounded() {
        let energy = response(2, f32::INFINITY, 1.0, 4.0);
        let (early, late) = (
            energy[8820..52_920].iter().sum::<f64>(),
            energy[energy.len() - 44_100..].iter().sum::<f64>(),
        );
        assert!((late / early - 1.0).abs() < 0.1);
    }

    #[test]
    fn spent_tail_costs_nothing() {
        let mut reverb = LateReverb::new(RATE_HZ, 1);
        let mut signals: [Vec<f32>; LINES] = std::array::from_fn(|_| vec![0.0; CHUNK]);
        assert!(!reverb.process(0, &mut signals, 0, CHUNK));
    }

    #[test]
    fn line_lengths_share_no_factor() {
        for rate_hz in [16_000, 44_100, 48_000] {
            let lengths = LateReverb::new(rate_hz, 1).lengths;
            for (i, a) in lengths.iter().enumerate() {
                assert!(lengths[i + 1..].iter().all(|b| b % a != 0 && a != b));
            }
        }
    }
}
