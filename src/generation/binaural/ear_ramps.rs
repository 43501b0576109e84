//! Ramps of one arrival at two ears: delays and bus weights from one graphics frame to the next.
//!
//! Audio side; wait-free; allocates nothing.

use crate::simd::{F32x8, LaneSet, kernel};

use crate::generation::CHUNK;
use crate::generation::binaural::filter_bank::{BATCH, Contribution, OutputBuses, Ramp};
use crate::generation::delay::interpolation;
use crate::generation::delay::interpolation::{AHEAD, Intervals, ReadRequest};
use crate::generation::panning::direction_table::DirectionTable;
use crate::generation::ramp::{ChunkSpan, LinearRamp};

/// Largest deviation of held weights from the exact ramp, relative to their root sum of squares over both ears: −60 dB.
const HELD_ERROR: f32 = 1e-3;

/// Rate of an arrival's weights within the present ramp, which tells for how many frames they are held. Weights that change with every
/// frame cost more than adding the arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) enum RampRate {
    #[default]
    Constant,
    Slow,
    Moderate,
    /// Not held.
    Fast,
}

/// Numbers of frames for which weights are held.
pub(crate) const HOLDS: usize = 3;

impl RampRate {
    /// Which of the [`HOLDS`] applies, with `left` frames of the ramp left.
    pub(crate) fn hold_index(self, left: u32) -> usize {
        match self {
            Self::Moderate if left > 0 => 1,
            Self::Fast if left > 0 => 2,
            _ => 0,
        }
    }

    /// Frames for which growing weights are held.
    fn hold(self) -> u32 {
        match self {
            Self::Constant | Self::Slow => 32,
            Self::Moderate => 8,
            Self::Fast => 1,
        }
    }

    fn ramp(self, left: u32) -> Option<Ramp> {
        let grows = self != Self::Constant && left > 0;
        let hold = self.hold();
        grows.then_some(Ramp { left, hold })
    }

    /// The slowest rate at which held weights are exact enough, for the sums of the squares of growths and weights.
    fn of(change: f32, size: f32) -> Self {
        let is_exact = |rate: &Self| {
            let furthest = 0.5 * (rate.hold() - 1) as f32;
            furthest * furthest * change <= HELD_ERROR * HELD_ERROR * size
        };
        if change == 0.0 {
            return Self::Constant;
        }
        let held = [Self::Slow, Self::Moderate].into_iter().find(is_exact);
        held.unwrap_or(Self::Fast)
    }
}

/// Bus weights of one arrival: groups of the left ear, then of the right, or of the only reading; targets and growth per
/// frame.
#[derive(Debug)]
pub(crate) struct Weights<'a> {
    pub(crate) target: &'a mut [F32x8],
    pub(crate) growth: &'a mut [F32x8],
}

impl Weights<'_> {
    pub(crate) fn rest_at(&mut self, target: &[F32x8]) {
        self.target.copy_from_slice(target);
        self.growth.fill(F32x8::ZERO);
    }

    /// Ramps to a new target; returns the rate.
    pub(crate) fn retarget(
        &mut self,
        set: LaneSet,
        target: &[F32x8],
        left: u32,
        ramp: u32,
    ) -> RampRate {
        let mut sums = [F32x8::ZERO; 2];
        let step = RampStep {
            left: left as f32,
            per_frame: 1.0 / ramp.max(1) as f32,
        };
        retarget_weights(set, self.target, self.growth, target, step, &mut sums);
        let [change, size] = sums;
        RampRate::of(change.sum(), size.sum())
    }

    pub(crate) fn stop(&mut self, left: u32) {
        let left = F32x8::splat(left as f32);
        for (held, growth) in self.target.iter_mut().zip(self.growth.iter_mut()) {
            *held = *held - *growth * left;
            *growth = F32x8::ZERO;
        }
    }
}

/// Frames left of a ramp, and the reciprocal length of the next one.
#[derive(Debug, Clone, Copy)]
struct RampStep {
    left: f32,
    per_frame: f32,
}

kernel! {
    /// Ramps weights to new targets; sums the squares of growths and of weights. Every operation is rounded: the result
    /// is bit-identical on all instruction sets.
    fn retarget_weights<L>(
        held: &mut [F32x8],
        growths: &mut [F32x8],
        next: &[F32x8],
        step: RampStep,
        sums: &mut [F32x8; 2],
    ) {
        let (left, per_frame) = (L::splat(step.left), L::splat(step.per_frame));
        let (mut change, mut size) = (L::splat(0.0), L::splat(0.0));
        for ((held, growth), &next) in held.iter_mut().zip(growths).zip(next) {
            let present = L::from_array(*held).sub(L::from_array(*growth).mul(left));
            let grows = L::from_array(next).sub(present).mul(per_frame);
            change = change.add(grows.mul(grows));
            size = size.add(L::from_array(next).mul(L::from_array(next)));
            (*held, *growth) = (next, grows.to_array());
        }
        *sums = [change.to_array(), size.to_array()];
    }
}

/// The part of an arrival's signal that both ears read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SignalWindow<'a> {
    /// [`Self::length`] valid samples and [`SLACK`](interpolation::SLACK) more.
    pub(crate) signal: &'a [f32],
    /// Valid samples.
    pub(crate) length: usize,
    /// Position of `signal[0]`.
    pub(crate) start: i64,
}

/// Reads a chunk of the signals of both ears, or of the first alone, from one arrival's signal.
///
/// Ear delays are total delays from the source in frames. Ears have [`SLACK`](interpolation::SLACK) more samples, which
/// are overwritten.
pub(crate) fn read_ears(
    set: LaneSet,
    window: &SignalWindow,
    chunk: ChunkSpan,
    delays: &[LinearRamp],
    intervals: &mut Intervals,
    ears: &mut EarPair,
) {
    let reading = |delay: &LinearRamp| read_request(window, chunk, delay, 0);
    let [left_ear, right_ear] = ears;
    let outs = [left_ear.as_mut_slice(), right_ear.as_mut_slice()];
    match delays {
        [left, right] => {
            let readings = [reading(left), reading(right)];
            interpolation::read(set, window.signal, &readings, intervals, outs);
        }
        [only, ..] => {
            let [out, _] = outs;
            interpolation::read(set, window.signal, &[reading(only)], intervals, [out]);
        }
        [] => {}
    }
}

/// Reads a chunk of one signal at one delay, and as many frames before it, as if the ramp had begun earlier. The output has
/// [`SLACK`](interpolation::SLACK) more samples, which are overwritten.
pub(crate) fn read_once(
    set: LaneSet,
    window: &SignalWindow,
    chunk: ChunkSpan,
    (delay, earlier): (&LinearRamp, usize),
    intervals: &mut Intervals,
    out: &mut [f32],
) {
    let request = read_request(window, chunk, delay, earlier);
    interpolation::read(set, window.signal, &[request], intervals, [out]);
}

fn read_request(
    window: &SignalWindow,
    chunk: ChunkSpan,
    delay: &LinearRamp,
    earlier: usize,
) -> ReadRequest {
    let ChunkSpan { now, left, frames } = chunk;
    let growth = delay.growth_now(left);
    let first = delay.value(left) + growth;
    let first = (now - AHEAD as i64 - window.start) as f64 - first;
    ReadRequest {
        position: first - earlier as f64 * (1.0 - growth),
        growth,
        count: frames + earlier,
        length: window.length,
    }
}

/// Both ear signals of one arrival: a chunk and the interpolator's slack.
pub(crate) type EarPair = [Vec<f32>; 2];

/// Frames of an arrival's past ear signal: the longest ear delay in whole frames.
pub(crate) fn past_frames(table: &DirectionTable) -> usize {
    (table.max_delay().ceil() as usize + 1).next_multiple_of(8)
}

/// Frames of history of an arrival's signal: the longest ear delay at the fastest growth, the interpolator and rounding.
pub(crate) fn history_frames(table: &DirectionTable) -> usize {
    ((1.5 * table.max_delay()).ceil() as usize + 20)
        .max(CHUNK / 4 + 16)
        .next_multiple_of(8)
}

/// Buffers of one batch of arrivals, with room for `past` frames before the chunk.
pub(crate) fn ear_pairs(past: usize) -> [EarPair; BATCH] {
    let length = past + CHUNK + interpolation::SLACK;
    std::array::from_fn(|_| std::array::from_fn(|_| vec![0.0; length]))
}

/// One arrival, read at both ears, or once.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arrival<'a> {
    /// The ears' signals, at least as long as the chunk.
    pub(crate) ears: [&'a [f32]; 2],
    pub(crate) target: &'a [F32x8],
    pub(crate) growth: &'a [F32x8],
    pub(crate) rate: RampRate,
}

impl<'a> Arrival<'a> {
    /// The ear's signal, its weights, and their growth within a ramp.
    fn of_ear(
        &self,
        ear: usize,
        groups: usize,
        chunk: ChunkSpan,
    ) -> (&'a [f32], &'a [F32x8], Option<&'a [F32x8]>) {
        let moving = self.rate != RampRate::Constant && chunk.left > 0;
        let target = &self.target[ear * groups..][..groups];
        let growth = &self.growth[ear * groups..][..groups];
        let signal = &self.ears[ear][..chunk.frames];
        (signal, target, moving.then_some(growth))
    }
}

/// Adds a batch of arrivals to the first `groups` groups of the buses; an arrival has `held` groups a reading. The fastest
/// arrival determines the rate for all.
pub(crate) fn add(
    buses: &mut OutputBuses,
    arrivals: &[Option<Arrival>; BATCH],
    [groups, held]: [usize; 2],
    chunk: ChunkSpan,
) {
    let ChunkSpan { left, frames, .. } = chunk;
    let rate = arrivals.iter().flatten().map(|a| a.rate).max();
    let ramp = rate.unwrap_or_default().ramp(left);
    for ear in 0..buses.ears() {
        for group in 0..groups {
            let mut contributions = [Contribution::silence(frames); BATCH];
            for (one, arrival) in contributions.iter_mut().zip(arrivals) {
                let Some(arrival) = arrival else { continue };
                let (signal, target, growth) = arrival.of_ear(ear, held, chunk);
                one.signal = signal;
                one.target = target[group];
                one.growth = growth.map_or(one.growth, |growth| growth[group]);
            }
            buses.add(ear, group, &contributions, ramp);
        }
    }
}

#[cfg(test)]
#[path = "ear_ramps_tests.rs"]
mod tests;
