//! A feedback delay network: the late reverb of one group.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at construction only. Input: a chunk of each bus; output: the
//! signals of the plane waves.
//!
//! After \[JOT91\] with the scattering feedback matrix of \[SCHLECHT20\]: the lines are mixed, delayed by up to 5 ms, each by
//! its own time, and mixed again. A pulse thus leaves a line as hundreds, and the density of echoes does not wait for the
//! lines. Each line has a filter that takes `60 length / T60` dB at every band centre. The short delays are charged to all
//! lines with their mean.
//!
//! Lengths are distinct primes near evenly spread times: no two lines, and no two groups, share a period. A pulse enters all
//! lines at one distance from their beginnings, nearly that of the shortest: what is left of them is spread evenly from zero
//! on, and energy flows out at a constant rate at once. Before, it passes a matrix of its own after delays of up to 3 ms, one
//! pattern of delays and signs a bus. Nothing leaves the network before its response should begin; what is missing until the
//! short delays have passed leaves at the entry.
//!
//! Calibration (own): the lines keep their energy, and each emits its share once per length: `1 / mean length` of the energy
//! per second. A send with the gain `√(E · mean length) · 10^(−3 t / T60)`, t the delay of the send plus
//! [`Timing::nominal_s`], therefore has the energy `E · 10^(−6 t / T60)` per second at every time t after emission.

use crate::acoustics::BANDS;
use crate::extrapolation::LateGroup;
use crate::simd::{F32x8, LaneSet, kernel};

use crate::generation::CHUNK;
use crate::generation::ramp::LinearRamp;
use crate::generation::reverb::history::History;
use crate::generation::reverb::mixing::{LINES, Rows, Signs, hash, mix, mix_frame, sign};
use crate::generation::reverb::send_grid::MEAN_LATENESS_S;
use crate::generation::reverb::shelf_filter::{ShelfDesign, ShelfFilter};
use crate::generation::reverb::wave_shares::WaveShares;

/// Inputs of a network, each with its own pattern: what enters by different ones is uncorrelated.
pub(crate) const BUSES: usize = 8;

/// Shortest and longest line in seconds. A chunk is shorter at every sample rate.
const LENGTHS_S: [f64; 2] = [0.018, 0.080];

/// Shortest and longest delay of the scattering matrix in seconds.
const SCATTERING_S: [f64; 2] = [0.0003, 0.005];

/// Longest delay of a bus in seconds.
const SPREAD_S: f64 = 0.003;

/// Where pulses enter the lines, in seconds from their beginnings. A chunk is shorter at every sample rate.
const ENTRIES_S: [f64; 2] = [0.0162, 0.0178];

/// Least energy of a pulse at its entry into a line relative to the mean.
const LEAST_ENTRY: f64 = 0.03;

/// Longest T60 in seconds.
const LONGEST_T60_S: f32 = 1000.0;

/// T60 in seconds up to which a band is silent.
pub(crate) const SHORTEST_T60_S: f32 = 0.05;

/// Silence threshold of the amplitude: −180 dB re full scale.
const FLOOR: f32 = 1e-9;

/// Added and subtracted: values below about 1e-25 become zero before they become subnormal.
const SUBNORMAL_GUARD: f32 = 1e-18;

/// Frames whose sums are in registers while signals are added.
const PART: usize = 32;

const _: () = assert!(CHUNK.is_multiple_of(PART));

/// Times of a network in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timing {
    /// Mean time from one output of a line to the next.
    pub(crate) mean_length_s: f32,
    /// Delay before the lines less the part of the lines that is skipped.
    pub(crate) nominal_s: f32,
}

/// The delay of each bus on its way to each line, and its gain.
type Pattern = [(usize, f32); LINES];

/// Scratch of a chunk: the networks take turns.
#[derive(Debug)]
pub(crate) struct NetworkScratch {
    /// Of each line.
    rows: Box<Rows>,
    /// Of each wave.
    wave_rows: Box<Rows>,
}

impl NetworkScratch {
    /// Allocates.
    pub(crate) fn new() -> Self {
        let rows = || Box::new([[0.0; CHUNK]; LINES]);
        Self {
            rows: rows(),
            wave_rows: rows(),
        }
    }
}

/// A network.
#[derive(Debug)]
pub(crate) struct Network {
    set: LaneSet,
    rate_hz: f32,
    timing: Timing,
    patterns: Box<[Pattern; BUSES]>,
    buses: History,
    /// Frames since each bus was last audible.
    quiet_buses: [usize; BUSES],
    entry_signs: Signs,
    /// Frames from each entry to the line's end, and the gain.
    entries: [(usize, f32); LINES],
    lengths: [usize; LINES],
    /// Index `t` modulo the length is what is read at time `t`.
    lines: [Vec<f32>; LINES],
    absorption: ShelfFilter,
    signs: [Signs; 2],
    scattering: History,
    scattering_delays: [usize; LINES],
    /// Signs of the waves: in the sum of all waves the lines have nearly equal parts.
    wave_signs: [f32; LINES],
    direction: ShelfFilter,
    /// Gain of the waves' parts that leave at the entry, without absorption, and with that of the present decay times.
    at_entry: f32,
    absorbed_at_entry: LinearRamp,
    /// Audio frames since the start.
    now: usize,
    /// Frames since a value above [`FLOOR`] was in the lines.
    quiet_frames: usize,
}

impl Network {
    /// The network of a group.
    pub(crate) fn new(rate_hz: u32, group: usize, groups: usize) -> Self {
        let rate = f64::from(rate_hz);
        let frames = |seconds: f64| (seconds * rate).round() as usize;
        let seed = 16 * group as u64;
        let lengths = lengths(rate, group, groups);
        let scattering_delays = spread(SCATTERING_S, seed).map(frames);
        let scattering = scattering_delays.iter().sum::<usize>() as f64 / LINES as f64;
        let mean = lengths.iter().sum::<usize>() as f64 / LINES as f64 + scattering;
        let spots = spread(ENTRIES_S, seed + 1).map(frames);
        let left: [usize; LINES] = std::array::from_fn(|line| lengths[line] - spots[line]);
        // In the steady state, what is left of the lines is distributed as the share of longer lines.
        let shares = left.map(|left| {
            let longer = |length: &&usize| **length as f64 + scattering > left as f64;
            let share = lengths.iter().filter(longer).count() as f64 / LINES as f64;
            share.max(LEAST_ENTRY)
        });
        let missing = (0.5 * SPREAD_S + f64::from(MEAN_LATENESS_S)) * rate + scattering;
        let sum: f64 = shares.iter().sum();
        let entries = std::array::from_fn(|line| {
            let gain = (shares[line] * LINES as f64 / sum).sqrt() as f32;
            (left[line], gain * sign(hash(seed + 2) ^ line as u64))
        });
        let part = (1.0 / LINES as f64).sqrt() as f32;
        let patterns = std::array::from_fn(|bus| {
            let seed = seed + 3 + 64 * (bus as u64 + 1);
            let delays = spread([0.0, SPREAD_S], seed).map(frames);
            std::array::from_fn(|line| (delays[line], part * sign(hash(seed) ^ line as u64)))
        });
        let signs = [Signs::new(seed + 4), Signs::new(seed + 5)];
        let entered_s = 0.5 * (ENTRIES_S[0] + ENTRIES_S[1]);
        Self {
            set: LaneSet::best(),
            rate_hz: rate_hz as f32,
            timing: Timing {
                mean_length_s: (mean / rate) as f32,
                nominal_s: (0.5 * SPREAD_S - entered_s) as f32,
            },
            patterns: Box::new(patterns),
            buses: History::new(BUSES, frames(SPREAD_S) + 1),
            quiet_buses: [usize::MAX / 2; BUSES],
            entry_signs: Signs::new(seed + 6),
            entries,
            lengths,
            lines: lengths.map(|length| {
                // Written, not allocated as zeros: the pages are touched here, not in the first blocks.
                let mut line = Vec::with_capacity(length);
                line.resize(length, 0.0);
                line
            }),
            absorption: ShelfFilter::new(),
            wave_signs: balanced_signs(),
            signs,
            scattering: History::new(LINES, frames(SCATTERING_S[1]) + 1),
            scattering_delays,
            direction: ShelfFilter::new(),
            at_entry: (missing / mean).sqrt() as f32,
            absorbed_at_entry: LinearRamp::at_rest((missing / mean).sqrt()),
            now: 0,
            quiet_frames: usize::MAX / 2,
        }
    }

    pub(crate) fn timing(&self) -> Timing {
        self.timing
    }

    /// Whether nothing is left in it.
    pub(crate) fn is_silent(&self) -> bool {
        let longest = self.lengths.iter().max().copied().unwrap_or(0);
        self.quiet_frames > longest + CHUNK + (SCATTERING_S[1] * f64::from(self.rate_hz)) as usize
    }

    /// Ramps to a group's decay times and directions; `left` frames of the last ramp remain.
    pub(crate) fn set_frame(
        &mut self,
        group: &LateGroup,
        design: &ShelfDesign,
        shares: &WaveShares,
        left: u32,
        ramp: u32,
    ) {
        let scattering = self.scattering_delays.iter().sum::<usize>() as f32 / LINES as f32;
        let seconds = self
            .lengths
            .map(|length| (length as f32 + scattering) / self.rate_hz);
        let loss = seconds.map(|seconds| {
            let level = |t60_s: f32| -60.0 * seconds / t60_s.clamp(SHORTEST_T60_S, LONGEST_T60_S);
            std::array::from_fn::<f32, BANDS, _>(|b| level(group.decay_time_s[b]))
        });
        let least = seconds.map(|seconds| -60.0 * seconds / LONGEST_T60_S);
        self.absorption
            .retarget(design, &loss, Some(&least), left, ramp);
        // Sends make up for the absorption of what is skipped of the lines. Here no line follows: the mean of the bands has to do.
        let losses = group
            .decay_time_s
            .map(|t60_s| 1.0 / t60_s.max(SHORTEST_T60_S));
        let loss = losses.iter().sum::<f32>() / BANDS as f32;
        let gain = self.at_entry * 10f32.powf(3.0 * self.timing.nominal_s * loss);
        self.absorbed_at_entry.retarget(gain.into(), left, ramp);
        let levels = shares.levels_db(group);
        self.direction.retarget(design, &levels, None, left, ramp);
    }

    /// Goes on ramping to the decay times and directions of the last [`Self::set_frame`]; `left` frames of the last ramp remain.
    pub(crate) fn keep_decay(&mut self, left: u32, ramp: u32) {
        self.absorption.keep_levels(left, ramp);
        self.direction.keep_levels(left, ramp);
        let gain = self.absorbed_at_entry.target();
        self.absorbed_at_entry.retarget(gain, left, ramp);
    }

    /// Sets the present chunk of a bus.
    pub(crate) fn feed(&mut self, bus: usize, input: &[f32]) {
        self.buses.present(bus)[..input.len()].copy_from_slice(input);
        if input.iter().any(|value| *value != 0.0) {
            self.quiet_buses[bus] = 0;
        } else {
            self.quiet_buses[bus] = self.quiet_buses[bus].saturating_add(input.len());
        }
    }

    /// Runs a chunk after [`Self::feed`] of every bus and adds the waves' signals to `waves`; `left` frames of the ramp
    /// remain. Returns false and adds nothing if the network is silent.
    pub(crate) fn process(
        &mut self,
        left: u32,
        frames: usize,
        scratch: &mut NetworkScratch,
        waves: &mut Rows,
    ) -> bool {
        let past = (SPREAD_S * f64::from(self.rate_hz)) as usize + CHUNK;
        let is_fed = self.quiet_buses.iter().any(|quiet| *quiet < past);
        if !is_fed && self.is_silent() {
            self.now += frames;
            self.buses.advance(frames);
            return false;
        }
        if is_fed {
            self.enter(past, left, frames, scratch);
        }
        self.buses.advance(frames);
        let NetworkScratch { rows, wave_rows } = scratch;
        for ((row, line), length) in rows.iter_mut().zip(&self.lines).zip(self.lengths) {
            let (ahead, around) = ring_parts(self.now % length, length, frames);
            row[..ahead.len()].copy_from_slice(&line[ahead.clone()]);
            row[ahead.len()..frames].copy_from_slice(&line[around]);
        }
        self.absorption.process(rows, left, frames);
        mix(self.set, &self.signs[0], frames, rows);
        for (line, row) in rows.iter_mut().enumerate() {
            self.scattering.present(line)[..frames].copy_from_slice(&row[..frames]);
            let delayed = self.scattering.delayed(line, self.scattering_delays[line]);
            row[..frames].copy_from_slice(&delayed[..frames]);
        }
        self.scattering.advance(frames);
        mix(self.set, &self.signs[1], frames, rows);
        let mut is_quiet = !is_fed;
        for ((row, line), length) in rows.iter_mut().zip(&mut self.lines).zip(self.lengths) {
            for value in &mut row[..frames] {
                *value = (*value + SUBNORMAL_GUARD) - SUBNORMAL_GUARD;
            }
            is_quiet = is_quiet && row[..frames].iter().all(|value| value.abs() <= FLOOR);
            let (ahead, around) = ring_parts(self.now % length, length, frames);
            line[ahead.clone()].copy_from_slice(&row[..ahead.len()]);
            line[around].copy_from_slice(&row[ahead.len()..frames]);
        }
        for (wave, row) in wave_rows.iter_mut().zip(rows.iter()) {
            if !is_fed {
                wave[..frames].fill(0.0);
            }
            add_scaled(self.set, 1.0, &row[..frames], &mut wave[..frames]);
        }
        self.direction.process(wave_rows, left, frames);
        for ((wave, row), sign) in waves.iter_mut().zip(wave_rows.iter()).zip(self.wave_signs) {
            add_scaled(self.set, sign, &row[..frames], &mut wave[..frames]);
        }
        self.now += frames;
        if is_quiet {
            self.quiet_frames = self.quiet_frames.saturating_add(frames);
        } else {
            self.quiet_frames = 0;
        }
        true
    }

    /// Adds the buses to the lines, each at its entry; `left` frames of the ramp remain.
    fn enter(&mut self, past: usize, left: u32, frames: usize, scratch: &mut NetworkScratch) {
        let NetworkScratch { rows, wave_rows } = scratch;
        let [gain, growth] = [
            self.absorbed_at_entry.value(left),
            self.absorbed_at_entry.growth_now(left),
        ]
        .map(|value| value as f32);
        for (line, row) in rows.iter_mut().enumerate() {
            let mut inputs: [(&[f32], f32); BUSES] = [(&[], 0.0); BUSES];
            let mut fed = 0;
            for (bus, pattern) in self.patterns.iter().enumerate() {
                if self.quiet_buses[bus] < past {
                    let (delay, gain) = pattern[line];
                    inputs[fed] = (self.buses.delayed(bus, delay), gain);
                    fed += 1;
                }
            }
            add_buses(
                self.set,
                &inputs[..fed],
                &mut row[..frames.next_multiple_of(PART)],
            );
        }
        mix(self.set, &self.entry_signs, frames, rows);
        for (wave, row) in wave_rows.iter_mut().zip(rows.iter()) {
            wave[..frames].fill(0.0);
            if growth == 0.0 {
                add_scaled(self.set, gain, &row[..frames], &mut wave[..frames]);
            } else {
                for (number, (value, wave)) in (1u16..).zip(row[..frames].iter().zip(wave)) {
                    *wave = value * (gain + growth * f32::from(number));
                }
            }
        }
        for (line, row) in rows.iter().enumerate() {
            let ((left, gain), length) = (self.entries[line], self.lengths[line]);
            let (ahead, around) = ring_parts((self.now + left) % length, length, frames);
            let count = ahead.len();
            let line = &mut self.lines[line];
            add_scaled(self.set, gain, &row[..count], &mut line[ahead]);
            add_scaled(self.set, gain, &row[count..frames], &mut line[around]);
        }
    }
}

/// Prime numbers of frames, distinct over all groups.
fn lengths(rate: f64, group: usize, groups: usize) -> [usize; LINES] {
    let [shortest, longest] = LENGTHS_S.map(|seconds| seconds * rate);
    let mut taken = Vec::new();
    let mut own = [0; LINES];
    for each in 0..=group {
        for (line, length) in own.iter_mut().enumerate() {
            let share = (line as f64 + each as f64 / groups as f64) / LINES as f64;
            *length = prime_from((shortest + (longest - shortest) * share) as usize);
            while taken.contains(length) {
                *length = prime_from(*length + 1);
            }
            taken.push(*length);
        }
    }
    own
}

/// Times spread evenly over a range, one in each part, in random order.
fn spread(range_s: [f64; 2], seed: u64) -> [f64; LINES] {
    let mut order: [usize; LINES] = std::array::from_fn(|line| line);
    let random = |index: u64| hash(hash(seed) ^ index);
    order.sort_unstable_by_key(|line| random(*line as u64));
    let mut times = [0.0; LINES];
    for (part, line) in order.into_iter().enumerate() {
        let within = (random((LINES + line) as u64) >> 11) as f64 / (1u64 << 53) as f64;
        let share = (part as f64 + within) / LINES as f64;
        times[line] = range_s[0] + (range_s[1] - range_s[0]) * share;
    }
    times
}

/// Signs of the waves whose sum takes nearly equal parts of what is mixed.
fn balanced_signs() -> [f32; LINES] {
    let candidate =
        |seed: u64| -> [f32; LINES] { std::array::from_fn(|n| sign(hash(!seed) ^ n as u64)) };
    // The matrix is symmetric: parts of the sum are the mixture of the signs.
    let unevenness = |seed: &u64| {
        let parts = mix_frame(&candidate(*seed));
        parts.iter().map(|part| part.powi(4)).sum::<f32>()
    };
    let best = (0..256).min_by(|a, b| unevenness(a).total_cmp(&unevenness(b)));
    candidate(best.unwrap_or(0))
}

/// The two ranges of `frames` frames from `position` on in a longer ring.
fn ring_parts(
    position: usize,
    length: usize,
    frames: usize,
) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
    let ahead = frames.min(length - position);
    (position..position + ahead, 0..frames - ahead)
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

kernel! {
    /// Sums signals times their gains, in whole parts.
    fn add_buses<L>(inputs: &[(&[f32], f32)], output: &mut [f32]) {
        for (number, output) in output.as_chunks_mut::<PART>().0.iter_mut().enumerate() {
            let zero = L::splat(0.0);
            let (mut a, mut b, mut c, mut d) = (zero, zero, zero, zero);
            for (input, gain) in inputs {
                let Some(input) = input.as_chunks::<PART>().0.get(number) else {
                    continue;
                };
                let gain = L::splat(*gain);
                a = L::load_at(input, 0).mul_add(gain, a);
                b = L::load_at(input, 8).mul_add(gain, b);
                c = L::load_at(input, 16).mul_add(gain, c);
                d = L::load_at(input, 24).mul_add(gain, d);
            }
            a.store_at(output, 0);
            b.store_at(output, 8);
            c.store_at(output, 16);
            d.store_at(output, 24);
        }
    }
}

kernel! {
    /// Adds a signal times a gain.
    fn add_scaled<L>(gain: f32, input: &[f32], output: &mut [f32]) {
        let (inputs, rest) = input.as_chunks::<8>();
        let (outputs, rest_out) = output.as_chunks_mut::<8>();
        let lanes = L::splat(gain);
        for (input, output) in inputs.iter().zip(outputs) {
            L::load(input).mul_add(lanes, L::load(output)).store(output);
        }
        if rest.is_empty() {
            return;
        }
        let mut tail = F32x8::ZERO;
        let mut sums = F32x8::ZERO;
        tail.0[..rest.len()].copy_from_slice(rest);
        sums.0[..rest.len()].copy_from_slice(&rest_out[..rest.len()]);
        let sums = L::from_array(tail).mul_add(lanes, L::from_array(sums)).to_array();
        rest_out[..rest.len()].copy_from_slice(&sums.0[..rest.len()]);
    }
}

#[cfg(test)]
#[path = "network_tests.rs"]
mod tests;
