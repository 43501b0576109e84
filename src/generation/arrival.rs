//! Ramps of one arrival at two ears: delays and bus weights that move from one graphics frame's values to the next's.
//!
//! Audio side; wait-free; allocates nothing. Every ramped value is kept as target and growth a frame, and its present
//! value is `target − growth × frames left`: a render call may stop anywhere in a ramp, nothing drifts, and at the end
//! the value is the target bit for bit.

use crate::simd::F32x8;

use super::binaural::{Binaural, Contribution};
use super::interpolation::{self, AHEAD};

/// A value that moves linearly to its target.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Glide {
    target: f64,
    growth: f64,
}

impl Glide {
    pub(super) fn at_rest(value: f64) -> Self {
        Self {
            target: value,
            growth: 0.0,
        }
    }

    /// The value when `left` frames of the ramp are still to come.
    pub(super) fn value(&self, left: u32) -> f64 {
        self.target - self.growth_now(left) * f64::from(left)
    }

    /// The growth a frame when `left` frames of the ramp are still to come.
    pub(super) fn growth_now(&self, left: u32) -> f64 {
        if left > 0 { self.growth } else { 0.0 }
    }

    /// From the value it has with `left` frames to come to `target` within `ramp` frames.
    pub(super) fn retarget(&mut self, target: f64, left: u32, ramp: u32) {
        self.growth = (target - self.value(left)) / f64::from(ramp);
        self.target = target;
    }

    pub(super) fn stop(&mut self, left: u32) {
        *self = Self::at_rest(self.value(left));
    }
}

/// Bus weights of one arrival: groups of the left ear, then of the right; targets and growth a frame.
#[derive(Debug)]
pub(super) struct Weights<'a> {
    pub(super) target: &'a mut [F32x8],
    pub(super) growth: &'a mut [F32x8],
}

impl Weights<'_> {
    pub(super) fn rest_at(&mut self, target: &[F32x8]) {
        self.target.copy_from_slice(target);
        self.growth.fill(F32x8::ZERO);
    }

    /// Returns whether anything moves.
    pub(super) fn retarget(&mut self, target: &[F32x8], left: u32, ramp: u32) -> bool {
        let (left, per_frame) = (
            F32x8::splat(left as f32),
            F32x8::splat(1.0 / ramp.max(1) as f32),
        );
        let mut moving = false;
        for ((held, growth), &wanted) in self
            .target
            .iter_mut()
            .zip(self.growth.iter_mut())
            .zip(target)
        {
            let present = *held - *growth * left;
            *growth = (wanted - present) * per_frame;
            *held = wanted;
            moving |= *growth != F32x8::ZERO;
        }
        moving
    }

    pub(super) fn stop(&mut self, left: u32) {
        let left = F32x8::splat(left as f32);
        for (held, growth) in self.target.iter_mut().zip(self.growth.iter_mut()) {
            *held = *held - *growth * left;
            *growth = F32x8::ZERO;
        }
    }
}

/// Reads both ears' signals out of one arrival's signal.
///
/// `signal[0]` lies at position `start`; ear delays are whole delays from the source in frames; the first frame of
/// `ears` is at time `now`.
pub(super) fn read_ears(
    signal: &[f32],
    start: i64,
    now: i64,
    delays: &[Glide; 2],
    left: u32,
    ears: [&mut [f32]; 2],
) {
    for (delay, out) in delays.iter().zip(ears) {
        let growth = delay.growth_now(left);
        let first = delay.value(left) + growth;
        let position = (now - AHEAD as i64 - start) as f64 - first;
        interpolation::read(signal, position, growth, out);
    }
}

/// One arrival ready to be added to the buses.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ready<'a> {
    pub(super) ears: [&'a [f32]; 2],
    pub(super) target: &'a [F32x8],
    pub(super) growth: &'a [F32x8],
    pub(super) moving: bool,
    /// Groups of the buses that take part.
    pub(super) groups: usize,
}

impl Ready<'_> {
    fn contribution(&self, ear: usize, group: usize, left: u32) -> Contribution<'_> {
        let place = ear * self.target.len() / 2 + group;
        let growth = self.growth[place];
        let moving = self.moving && left > 0;
        Contribution {
            signal: self.ears[ear],
            weights: if moving {
                self.target[place] - growth * F32x8::splat(left as f32)
            } else {
                self.target[place]
            },
            step: if moving { growth } else { F32x8::ZERO },
        }
    }
}

/// Adds one arrival, or two of the same number of groups, to the buses.
pub(super) fn add(binaural: &mut Binaural, a: &Ready, b: Option<&Ready>, left: u32) {
    let moving = left > 0 && (a.moving || b.is_some_and(|b| b.moving));
    for ear in 0..2 {
        for group in 0..a.groups {
            let first = a.contribution(ear, group, left);
            match b {
                Some(b) => {
                    let second = b.contribution(ear, group, left);
                    binaural.add_two(ear, group, &first, &second, moving);
                }
                None => binaural.add(ear, group, &first, moving),
            }
        }
    }
}
