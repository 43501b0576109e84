//! One path's sound: band gains, delay and two ears.
//!
//! Audio side; wait-free, bounded by the chunk; allocates nothing. Takes a source's delay line, gives ear signals.
//!
//! A voice mixes the eight bands once, at whole positions of the source's time, and keeps the last stretch of the
//! mixture: both ears read it between its samples. Every position is mixed once, with the gain that holds there, so
//! that a change of gain reaches the far ear later, and a gain ramp is a function of the source's time.

use crate::acoustics::BANDS;
use crate::simd::F32x8;

use super::CHUNK;
use super::arrival::{self, Glide};
use super::delay_line::{DelayLine, TILE, Tile};
use super::interpolation::AHEAD;
use super::voice_set::Tenant;

/// Steepest growth of a delay that counts as motion, in frames a frame: 85 m/s. Beyond it the voice cross-fades.
/// Moves with [`MAX_FRESH`].
pub(super) const MAX_GLIDE: f64 = 0.25;

/// Most positions a voice mixes in a chunk, with room for rounding and whole tiles.
pub(super) const MAX_FRESH: usize = CHUNK + CHUNK / 4 + 3 * TILE;

/// State of one path.
#[derive(Debug, Clone, Default)]
pub(super) struct Voice {
    pub(super) id: u64,
    /// Slot of the source.
    pub(super) slot: usize,
    /// Which tenant of the slot.
    pub(super) tenant: Option<u32>,
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
    /// Whether the voice fades, and frames until it is done.
    fading: bool,
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

    /// Whether the voice has faded out.
    pub(super) fn is_over(&self) -> bool {
        self.fading && self.fade_left == 0
    }

    /// Orders voices by source, then by where in its past they read.
    pub(super) fn place(&self) -> (usize, i64) {
        (self.slot, self.next)
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
        self.fading = true;
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
    /// `tail` holds the last mixed positions, `mixture` is scratch for them and [`MAX_FRESH`] more.
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
        let fresh = (end + 1 - self.next).clamp(0, MAX_FRESH as i64) as usize;
        let start = self.next - tail.len() as i64;
        if line.is_silent_from(start) {
            tail.fill(0.0);
            self.next += fresh as i64;
            return false;
        }
        let reserve = tail.len();
        self.mix(line, reserve, fresh, mixture);
        mixture[..reserve].copy_from_slice(tail);
        self.next += fresh as i64;
        let signal = &mixture[..reserve + fresh];
        tail.copy_from_slice(&signal[fresh..]);
        arrival::read_ears(signal, start, now, &self.ear_delays, left, ears);
        true
    }

    /// Writes the bands in the voice's proportions, `fresh` positions from [`Self::next`] on, to `mixture` from place
    /// `reserve` on. Works in whole tiles and spoils up to seven places on either side.
    fn mix(&self, line: &DelayLine, reserve: usize, fresh: usize, mixture: &mut [f32]) {
        let (lane, parts) = line.tiles(self.next, fresh);
        let gains = self.gain.0.map(F32x8::splat);
        let growths = self.gain_growth.0.map(F32x8::splat);
        // Growths still to come at the first lane of the first tile.
        let mut to_come = self.gain_end - self.next + lane as i64;
        let places = mixture[reserve - lane..].chunks_exact_mut(TILE);
        for (tile, place) in parts.into_iter().flatten().zip(places) {
            let mut mixed = sum(tile, &gains);
            if to_come > 0 {
                let left = F32x8(LANES.map(|lane| (to_come as f32 - lane).max(0.0)));
                mixed = mixed - left * sum(tile, &growths);
            }
            mixed.store(place);
            to_come -= TILE as i64;
        }
        let foreign = (self.since - self.next).clamp(0, fresh as i64) as usize;
        mixture[reserve..reserve + foreign].fill(0.0);
    }
}

/// Lanes by number.
const LANES: [f32; TILE] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// The furthest position a path of this delay needs at time `now`.
fn reach(now: i64, delay: f64) -> i64 {
    ((now - AHEAD as i64) as f64 - delay).floor() as i64 + AHEAD as i64
}

#[inline(always)]
fn sum(tile: &Tile, gains: &[F32x8; BANDS]) -> F32x8 {
    ((tile[0] * gains[0] + tile[1] * gains[1]) + (tile[2] * gains[2] + tile[3] * gains[3]))
        + ((tile[4] * gains[4] + tile[5] * gains[5]) + (tile[6] * gains[6] + tile[7] * gains[7]))
}
