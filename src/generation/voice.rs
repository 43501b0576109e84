//! One path's sound: band gains, delay and two ears.
//!
//! Audio side; wait-free, bounded by the chunk; allocates nothing. Takes a source's delay line, gives ear signals.
//!
//! A voice mixes the eight bands once, at whole positions of the source's time, and keeps the last stretch of the
//! mixture: both ears read it between its samples. Every position is mixed once, with the gain that holds there, so
//! that a change of gain reaches the far ear later, and a gain ramp is a function of the source's time.

use crate::simd::F32x8;

use super::CHUNK;
use super::arrival::{self, Glide};
use super::delay_line::{DelayLine, MAX_READ};
use super::interpolation::AHEAD;
use super::voice_set::Tenant;

/// Steepest growth of a delay that counts as motion, in frames a frame: 85 m/s. Beyond it the voice cross-fades.
/// Moves with [`MAX_READ`].
pub(super) const MAX_GLIDE: f64 = 0.25;

/// State of one path.
#[derive(Debug, Clone, Default)]
pub(super) struct Voice {
    pub(super) id: u64,
    /// Slot of the source.
    pub(super) slot: usize,
    /// Which tenant of the slot.
    pub(super) tenant: u32,
    /// Nothing before this position belongs to the tenant.
    since: i64,
    /// Band gains from position `gain_end` on, and their growth a position before it.
    gain: F32x8,
    gain_growth: F32x8,
    gain_end: i64,
    /// The next position to mix.
    next: i64,
    /// Path delay in frames.
    delay: Glide,
    /// Path and ear delay in frames.
    ear_delays: [Glide; 2],
    /// Whether weights ramp.
    pub(super) moving: bool,
    /// Groups of buses in use, during the ramp and after it.
    pub(super) groups: [usize; 2],
    /// Frames until a fading voice is done.
    pub(super) fade_left: u32,
}

/// What a frame asks of one voice.
#[derive(Debug, Clone, Copy)]
pub(super) struct Aim {
    pub(super) gain: F32x8,
    /// Path delay in frames.
    pub(super) delay: f64,
    /// Ear delays in frames, without the path's.
    pub(super) ears: [f32; 2],
}

impl Voice {
    /// A voice that starts from silence at its own delay.
    pub(super) fn start(
        &mut self,
        id: u64,
        slot: usize,
        tenant: Tenant,
        aim: &Aim,
        now: i64,
        ramp: u32,
    ) {
        let next = reach(now - 1, aim.delay) + 1;
        *self = Self {
            id,
            slot,
            tenant: tenant.bits,
            since: tenant.since,
            next,
            delay: Glide::at_rest(aim.delay),
            ear_delays: aim
                .ears
                .map(|ear| Glide::at_rest(aim.delay + f64::from(ear))),
            ..Self::default()
        };
        self.ramp_gain(aim.gain, reach(now - 1 + i64::from(ramp), aim.delay));
    }

    /// Whether the way to `delay` is motion rather than a jump.
    pub(super) fn can_glide_to(&self, delay: f64, left: u32, ramp: u32) -> bool {
        (delay - self.delay.value(left)).abs() <= MAX_GLIDE * f64::from(ramp)
    }

    /// Ramps to a new aim; `left` frames of the last ramp were still to come.
    pub(super) fn retarget(&mut self, aim: &Aim, now: i64, left: u32, ramp: u32) {
        self.delay.retarget(aim.delay, left, ramp);
        for (delay, ear) in self.ear_delays.iter_mut().zip(aim.ears) {
            delay.retarget(aim.delay + f64::from(ear), left, ramp);
        }
        self.ramp_gain(aim.gain, reach(now - 1 + i64::from(ramp), aim.delay));
    }

    /// Ramps to silence where it is. The far ear hears the end of the ramp `tail` frames later at most.
    pub(super) fn fade(&mut self, now: i64, left: u32, ramp: u32, tail: usize) {
        self.delay.stop(left);
        for delay in &mut self.ear_delays {
            delay.stop(left);
        }
        let end = reach(now - 1 + i64::from(ramp), self.delay.value(0));
        self.ramp_gain(F32x8::ZERO, end);
        self.moving = false;
        self.fade_left = ramp + tail as u32;
    }

    fn ramp_gain(&mut self, gain: F32x8, end: i64) {
        let last = self.next - 1;
        let present =
            self.gain - self.gain_growth * F32x8::splat((self.gain_end - last).max(0) as f32);
        self.gain_end = end.max(last + 1);
        let positions = (self.gain_end - last) as f32;
        self.gain_growth = (gain - present) * F32x8::splat(1.0 / positions);
        self.gain = gain;
    }

    /// Renders as many frames as `ears` have and returns true, or only moves on and returns false if there is nothing
    /// to hear.
    ///
    /// `tail` holds the last mixed positions, `mixture` is scratch for them and [`MAX_READ`] more.
    pub(super) fn render(
        &mut self,
        line: &DelayLine,
        now: i64,
        left: u32,
        tail: &mut [f32],
        mixture: &mut [f32],
        ears: [&mut [f32]; 2],
    ) -> bool {
        let frames = ears[0].len().min(CHUNK);
        let growth = self.delay.growth_now(left);
        let last_delay = self.delay.value(left) + growth * frames as f64;
        let end = reach(now + frames as i64 - 1, last_delay);
        let fresh = (end + 1 - self.next).clamp(0, MAX_READ as i64) as usize;
        let start = self.next - tail.len() as i64;
        if line.is_silent_from(start) {
            tail.fill(0.0);
            self.next += fresh as i64;
            return false;
        }
        let (past, present) = mixture.split_at_mut(tail.len());
        past.copy_from_slice(tail);
        self.mix(line, &mut present[..fresh]);
        self.next += fresh as i64;
        let signal = &mixture[..tail.len() + fresh];
        tail.copy_from_slice(&signal[fresh..]);
        arrival::read_ears(signal, start, now, &self.ear_delays, left, ears);
        true
    }

    /// The bands in the voice's proportions from [`Self::next`] on.
    fn mix(&self, line: &DelayLine, out: &mut [f32]) {
        let count = out.len();
        let foreign = (self.since - self.next).clamp(0, count as i64) as usize;
        let ramped = (self.gain_end - self.next).clamp(foreign as i64, count as i64) as usize;
        let bands = line.bands(self.next, count);
        let (before, steady) = out.split_at_mut(ramped);
        let (foreign_part, rising) = before.split_at_mut(foreign);
        foreign_part.fill(0.0);
        let to_come = (self.gain_end - self.next) as f32 - foreign as f32;
        mix_rising(
            bands.map(|band| &band[foreign..ramped]),
            &self.gain.0,
            &self.gain_growth.0,
            to_come,
            rising,
        );
        mix_steady(bands.map(|band| &band[ramped..]), &self.gain.0, steady);
    }
}

/// The furthest position a path of this delay needs at time `now`.
fn reach(now: i64, delay: f64) -> i64 {
    ((now - AHEAD as i64) as f64 - delay).floor() as i64 + AHEAD as i64
}

fn mix_steady(bands: [&[f32]; 8], gain: &[f32; 8], out: &mut [f32]) {
    let count = out.len();
    let [a, b, c, d, e, f, g, h] = bands.map(|band| &band[..count]);
    for i in 0..count {
        out[i] = ((gain[0] * a[i] + gain[1] * b[i]) + (gain[2] * c[i] + gain[3] * d[i]))
            + ((gain[4] * e[i] + gain[5] * f[i]) + (gain[6] * g[i] + gain[7] * h[i]));
    }
}

/// With gains that lie `to_come` growths below their target at the first sample.
fn mix_rising(
    bands: [&[f32]; 8],
    gain: &[f32; 8],
    growth: &[f32; 8],
    to_come: f32,
    out: &mut [f32],
) {
    let count = out.len();
    let [a, b, c, d, e, f, g, h] = bands.map(|band| &band[..count]);
    for i in 0..count {
        let target = ((gain[0] * a[i] + gain[1] * b[i]) + (gain[2] * c[i] + gain[3] * d[i]))
            + ((gain[4] * e[i] + gain[5] * f[i]) + (gain[6] * g[i] + gain[7] * h[i]));
        let change = ((growth[0] * a[i] + growth[1] * b[i])
            + (growth[2] * c[i] + growth[3] * d[i]))
            + ((growth[4] * e[i] + growth[5] * f[i]) + (growth[6] * g[i] + growth[7] * h[i]));
        out[i] = target - (to_come - i as i32 as f32) * change;
    }
}
