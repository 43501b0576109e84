//! Ramps of one arrival at two ears: delays and bus weights that move from one graphics frame's values to the next's.
//!
//! Audio side; wait-free; allocates nothing. Every ramped value is kept as target and growth a frame, and its present
//! value is `target − growth × frames left`: a render call may stop anywhere in a ramp, nothing drifts, and at the end
//! the value is the target bit for bit.

use crate::simd::{F32x8, LaneSet, kernel};

use crate::generation::CHUNK;
use crate::generation::binaural::filter_bank::{Binaural, Contribution, Ramp, TOGETHER};
use crate::generation::delay::interpolation;
use crate::generation::delay::interpolation::{AHEAD, Intervals, Reading};

/// A value that moves linearly to its target.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Glide {
    target: f64,
    growth: f64,
}

impl Glide {
    pub(crate) fn at_rest(value: f64) -> Self {
        Self {
            target: value,
            growth: 0.0,
        }
    }

    /// The value when `left` frames of the ramp are still to come.
    pub(crate) fn value(&self, left: u32) -> f64 {
        self.target - self.growth_now(left) * f64::from(left)
    }

    /// The growth a frame when `left` frames of the ramp are still to come.
    pub(crate) fn growth_now(&self, left: u32) -> f64 {
        if left > 0 { self.growth } else { 0.0 }
    }

    /// From the value it has with `left` frames to come to `target` within `ramp` frames.
    pub(crate) fn retarget(&mut self, target: f64, left: u32, ramp: u32) {
        self.growth = (target - self.value(left)) / f64::from(ramp);
        self.target = target;
    }

    pub(crate) fn stop(&mut self, left: u32) {
        *self = Self::at_rest(self.value(left));
    }
}

/// Frames for which weights are held that move slowly: an addition a weight and frame is as much work as adding the
/// arrival itself.
const HOLD: u32 = 8;

/// Largest difference of held weights from the line that they follow, as a share of their size (the root of the sum of
/// squares over both ears): −60 dB. What moves faster is worked out for every frame.
const HELD_ERROR: f32 = 1e-3;

/// How an arrival's weights move within the present ramp.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) enum Motion {
    #[default]
    Resting,
    /// So slowly that they may be held for [`HOLD`] frames.
    Slow,
    Fast,
}

impl Motion {
    fn ramp(self, left: u32) -> Option<Ramp> {
        let hold = match self {
            Self::Resting => return None,
            Self::Slow => HOLD,
            Self::Fast => 1,
        };
        (left > 0).then_some(Ramp { left, hold })
    }
}

/// Bus weights of one arrival: groups of the left ear, then of the right; targets and growth a frame.
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

    /// Returns how they move.
    pub(crate) fn retarget(
        &mut self,
        set: LaneSet,
        target: &[F32x8],
        left: u32,
        ramp: u32,
    ) -> Motion {
        let mut sums = [F32x8::ZERO; 2];
        let step = Step {
            left: left as f32,
            per_frame: 1.0 / ramp.max(1) as f32,
        };
        aim_at(set, self.target, self.growth, target, step, &mut sums);
        let [change, size] = sums;
        let (change, size) = (change.sum(), size.sum());
        const FURTHEST: f32 = 0.5 * (HOLD - 1) as f32;
        if change == 0.0 {
            Motion::Resting
        } else if FURTHEST * FURTHEST * change <= HELD_ERROR * HELD_ERROR * size {
            Motion::Slow
        } else {
            Motion::Fast
        }
    }

    pub(crate) fn stop(&mut self, left: u32) {
        let left = F32x8::splat(left as f32);
        for (held, growth) in self.target.iter_mut().zip(self.growth.iter_mut()) {
            *held = *held - *growth * left;
            *growth = F32x8::ZERO;
        }
    }
}

/// Frames to come of a ramp, and the share of the next one's change in each of its frames.
#[derive(Debug, Clone, Copy)]
struct Step {
    left: f32,
    per_frame: f32,
}

kernel! {
    /// Points weights to where they are wanted; sums the squares of growths and of weights. Every step is rounded, so that
    /// all instruction sets are alike.
    fn aim_at<L>(
        held: &mut [F32x8],
        growths: &mut [F32x8],
        wanted: &[F32x8],
        step: Step,
        sums: &mut [F32x8; 2],
    ) {
        let (left, per_frame) = (L::splat(step.left), L::splat(step.per_frame));
        let (mut change, mut size) = (L::splat(0.0), L::splat(0.0));
        for ((held, growth), &wanted) in held.iter_mut().zip(growths).zip(wanted) {
            let present = L::from_array(*held).sub(L::from_array(*growth).mul(left));
            let grows = L::from_array(wanted).sub(present).mul(per_frame);
            change = change.add(grows.mul(grows));
            size = size.add(L::from_array(wanted).mul(L::from_array(wanted)));
            (*held, *growth) = (wanted, grows.to_array());
        }
        *sums = [change.to_array(), size.to_array()];
    }
}

/// The stretch of an arrival's signal that both ears are read from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stretch<'a> {
    /// With [`SLACK`](interpolation::SLACK) samples more than count.
    pub(crate) signal: &'a [f32],
    /// Samples that count.
    pub(crate) length: usize,
    /// Position of `signal[0]`.
    pub(crate) start: i64,
}

/// The chunk that is being rendered.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment {
    /// Time of its first frame.
    pub(crate) now: i64,
    /// Frames of the ramp still to come before it.
    pub(crate) left: u32,
    /// Its frames, at most [`CHUNK`].
    pub(crate) frames: usize,
}

/// Reads a chunk of both ears' signals out of one arrival's signal.
///
/// Ear delays are whole delays from the source in frames. Ears have [`SLACK`](interpolation::SLACK) more samples, which
/// are spoiled.
pub(crate) fn read_ears(
    set: LaneSet,
    stretch: &Stretch,
    moment: Moment,
    delays: &[Glide; 2],
    intervals: &mut Intervals,
    ears: &mut EarPair,
) {
    let Moment { now, left, frames } = moment;
    let reading = |delay: &Glide| {
        let glide = delay.growth_now(left);
        let first = delay.value(left) + glide;
        Reading {
            position: (now - AHEAD as i64 - stretch.start) as f64 - first,
            glide,
            count: frames,
            length: stretch.length,
        }
    };
    let readings = [reading(&delays[0]), reading(&delays[1])];
    let [left_ear, right_ear] = ears;
    let outs = [left_ear.as_mut_slice(), right_ear.as_mut_slice()];
    interpolation::read(set, stretch.signal, &readings, intervals, outs);
}

/// Two ears of one arrival's signal, a chunk and the interpolator's slack.
pub(crate) type EarPair = [Vec<f32>; 2];

/// Room for as many arrivals as are added to the buses at once.
pub(crate) fn ear_pairs() -> [EarPair; TOGETHER] {
    std::array::from_fn(|_| std::array::from_fn(|_| vec![0.0; CHUNK + interpolation::SLACK]))
}

/// One arrival ready to be added to the buses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ready<'a> {
    pub(crate) ears: &'a EarPair,
    pub(crate) target: &'a [F32x8],
    pub(crate) growth: &'a [F32x8],
    pub(crate) motion: Motion,
}

impl<'a> Ready<'a> {
    /// The ear's signal, its weights, and their growth if they grow.
    fn of_ear(&self, ear: usize, moment: Moment) -> (&'a [f32], &'a [F32x8], Option<&'a [F32x8]>) {
        let groups = self.target.len() / 2;
        let moving = self.motion != Motion::Resting && moment.left > 0;
        let target = &self.target[ear * groups..][..groups];
        let growth = &self.growth[ear * groups..][..groups];
        let signal = &self.ears[ear][..moment.frames];
        (signal, target, moving.then_some(growth))
    }
}

/// Adds arrivals to the first `groups` groups of the buses. Of those whose weights move some way all should move that
/// way: the slow ones are worked out as often as the fastest.
pub(crate) fn add(
    binaural: &mut Binaural,
    arrivals: &[Option<Ready>; TOGETHER],
    groups: usize,
    moment: Moment,
) {
    let Moment { left, frames, .. } = moment;
    let motion = arrivals.iter().flatten().map(|a| a.motion).max();
    let ramp = motion.unwrap_or_default().ramp(left);
    for ear in 0..2 {
        for group in 0..groups {
            let mut contributions = [Contribution::silence(frames); TOGETHER];
            for (one, arrival) in contributions.iter_mut().zip(arrivals) {
                let Some(ready) = arrival else { continue };
                let (signal, target, growth) = ready.of_ear(ear, moment);
                one.signal = signal;
                one.target = target[group];
                one.growth = growth.map_or(one.growth, |growth| growth[group]);
            }
            binaural.add(ear, group, &contributions, ramp);
        }
    }
}

#[cfg(test)]
#[path = "ear_ramps_tests.rs"]
mod tests;
