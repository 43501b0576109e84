//! One path's sound: band gains, delay and two ears.
//!
//! Audio side; wait-free, bounded by the chunk; allocates nothing. Takes a source's delay line, gives ear signals.
//!
//! A voice mixes the eight bands once, at whole positions of the source's time, and keeps the last stretch of the
//! mixture: both ears read it between its samples. Every position is mixed once, with the gain that holds there, so
//! that a change of gain reaches the far ear later, and a gain ramp is a function of the source's time.

use crate::acoustics::BANDS;
use crate::simd::{F32x8, LANE_INDICES, LaneSet, Lanes, Lanes16, kernel, prefetch};

use crate::generation::CHUNK;
use crate::generation::binaural::ear_ramps;
use crate::generation::binaural::ear_ramps::{EarPair, Glide, Moment, Motion, Stretch};
use crate::generation::delay::delay_line::{Ahead, DelayLine, TILE, Tile};
use crate::generation::delay::interpolation::{AHEAD, Intervals};
use crate::generation::render_context::Tenant;

/// Steepest growth of a delay that counts as motion, in frames a frame: 85 m/s. Beyond it the voice cross-fades.
/// Moves with [`MAX_FRESH`].
pub(crate) const MAX_GLIDE: f64 = 0.25;

/// Most positions a voice mixes in a chunk, with room for rounding and whole tiles.
pub(crate) const MAX_FRESH: usize = CHUNK + CHUNK / 4 + 3 * TILE;

/// Enough for the number of any voice.
pub(crate) const INDEX_BITS: u32 = 16;

/// State of one path.
#[derive(Debug, Clone, Default)]
pub(crate) struct Voice {
    /// Slot of the source.
    pub(crate) slot: usize,
    /// Which tenant of the slot.
    pub(crate) tenant: Option<u32>,
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
    /// How weights ramp.
    pub(crate) motion: Motion,
    /// Groups of buses in use, during the ramp and after it.
    pub(crate) groups: [usize; 2],
    /// Whether the voice fades, and frames until it is done.
    fading: bool,
    pub(crate) fade_left: u32,
}

/// What a frame asks of one voice.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Aim {
    pub(crate) gain: F32x8,
    /// Path delay in frames.
    pub(crate) delay: f64,
    /// Ear delays in frames, without the path's.
    pub(crate) ears: [f32; 2],
}

/// What a voice works on.
#[derive(Debug)]
pub(crate) struct Bench<'a> {
    /// Its own: the last mixed positions.
    pub(crate) tail: &'a mut [f32],
    /// Room for them, [`MAX_FRESH`] more and the interpolator's slack.
    pub(crate) mixture: &'a mut [f32],
    pub(crate) intervals: &'a mut Intervals,
    pub(crate) ears: &'a mut EarPair,
    /// What the next voice reads.
    pub(crate) ahead: Ahead<'a>,
}

impl Voice {
    /// A voice that starts from silence at its own delay.
    pub(crate) fn start(&mut self, slot: usize, tenant: Tenant, aim: &Aim, now: i64, ramp: u32) {
        let next = reach(now - 1, aim.delay) + 1;
        *self = Self {
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
    pub(crate) fn is_over(&self) -> bool {
        self.fading && self.fade_left == 0
    }

    /// Asks for its memory.
    pub(crate) fn ask_for(&self) {
        prefetch(&self.slot);
        prefetch(&self.gain);
        prefetch(&self.gain_growth);
        prefetch(&self.delay);
        prefetch(&self.ear_delays[1]);
    }

    /// Orders voices by source, then by where in its past they read; its last [`INDEX_BITS`] bits are free. Eight bits of
    /// slots and forty of positions, which come round after half a year: all that hangs on it is an order.
    pub(crate) fn place(&self) -> u64 {
        const POSITIONS: i64 = 1 << 40;
        let position = (self.next + POSITIONS / 2).rem_euclid(POSITIONS) as u64;
        ((self.slot as u64) << 40 | position) << INDEX_BITS
    }

    /// Whether the way to `delay` is motion rather than a jump.
    pub(crate) fn can_glide_to(&self, delay: f64, left: u32, ramp: u32) -> bool {
        (delay - self.delay.value(left)).abs() <= MAX_GLIDE * f64::from(ramp)
    }

    /// Ramps to a new aim; `left` frames of the last ramp were still to come.
    pub(crate) fn retarget(&mut self, aim: &Aim, now: i64, left: u32, ramp: u32) {
        self.delay.retarget(aim.delay, left, ramp);
        for (delay, ear) in self.ear_delays.iter_mut().zip(aim.ears) {
            delay.retarget(aim.delay + f64::from(ear), left, ramp);
        }
        self.ramp_gain(aim.gain, reach(now - 1 + i64::from(ramp), aim.delay));
    }

    /// Ramps to silence where it is. The far ear hears the end of the ramp `tail` frames later at most.
    pub(crate) fn fade(&mut self, now: i64, left: u32, ramp: u32, tail: usize) {
        self.delay.stop(left);
        for delay in &mut self.ear_delays {
            delay.stop(left);
        }
        let end = reach(now - 1 + i64::from(ramp), self.delay.value(0));
        self.ramp_gain(F32x8::ZERO, end);
        self.motion = Motion::Resting;
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

    /// The stretch of its source's past that it mixes next for a chunk of so many frames, rest or motion left aside, and
    /// without what the voice before it reads.
    pub(crate) fn ahead<'a>(
        &self,
        lines: &'a [DelayLine],
        frames: usize,
        before: Option<&Self>,
    ) -> Ahead<'a> {
        let is_read = |before: &&Self| before.slot == self.slot && before.next <= self.next;
        let end = self.next + frames as i64;
        let from = before.filter(is_read).map_or(self.next, |before| {
            self.next.max(before.next + frames as i64)
        });
        match lines.get(self.slot) {
            Some(line) if from < end => line.ahead(from, (end - from) as usize),
            _ => Ahead::default(),
        }
    }

    /// Renders a chunk of both ears and returns true, or only moves on and returns false if there is nothing to hear.
    pub(crate) fn render(
        &mut self,
        set: LaneSet,
        line: &DelayLine,
        moment: Moment,
        bench: Bench<'_>,
    ) -> bool {
        let Bench {
            tail,
            mixture,
            intervals,
            ears,
            mut ahead,
        } = bench;
        let Moment { now, left, frames } = moment;
        let growth = self.delay.growth_now(left);
        let last_delay = self.delay.value(left) + growth * frames as f64;
        let end = reach(now + frames as i64 - 1, last_delay);
        let fresh = (end + 1 - self.next).clamp(0, MAX_FRESH as i64) as usize;
        let start = self.next - tail.len() as i64;
        ahead.fetch_quarter();
        if line.is_silent_from(start) {
            tail.fill(0.0);
            self.next += fresh as i64;
            return false;
        }
        let reserve = tail.len();
        self.mix(set, line, reserve, fresh, mixture);
        ahead.fetch_quarter();
        mixture[..reserve].copy_from_slice(tail);
        self.next += fresh as i64;
        tail.copy_from_slice(&mixture[fresh..fresh + reserve]);
        ahead.fetch_quarter();
        let stretch = Stretch {
            signal: mixture,
            length: reserve + fresh,
            start,
        };
        ear_ramps::read_ears(set, &stretch, moment, &self.ear_delays, intervals, ears);
        ahead.fetch_quarter();
        true
    }

    /// Writes the bands in the voice's proportions, `fresh` positions from [`Self::next`] on, to `mixture` from place
    /// `reserve` on. Works in whole tiles and spoils up to seven places on either side.
    fn mix(
        &self,
        set: LaneSet,
        line: &DelayLine,
        reserve: usize,
        fresh: usize,
        mixture: &mut [f32],
    ) {
        let (lane, parts) = line.tiles(self.next, fresh);
        let mut place = reserve - lane;
        let mut gains = Gains {
            gain: self.gain,
            growth: self.gain_growth,
            to_come: self.gain_end - self.next + lane as i64,
        };
        for tiles in parts.into_iter().filter(|tiles| !tiles.is_empty()) {
            let end = place + tiles.len() * TILE;
            mix(set, tiles, &gains, &mut mixture[place..end]);
            gains.to_come -= (tiles.len() * TILE) as i64;
            place = end;
        }
        let foreign = (self.since - self.next).clamp(0, fresh as i64) as usize;
        mixture[reserve..reserve + foreign].fill(0.0);
    }
}

/// The furthest position a path of this delay needs at time `now`.
fn reach(now: i64, delay: f64) -> i64 {
    ((now - AHEAD as i64) as f64 - delay).floor() as i64 + AHEAD as i64
}

/// Band gains on their way.
#[derive(Debug, Clone, Copy)]
struct Gains {
    /// At the end of the ramp and from then on.
    gain: F32x8,
    /// A position.
    growth: F32x8,
    /// Growths still to come at the first position.
    to_come: i64,
}

kernel! {
    /// Mixes the bands of tiles in the proportions of their gains.
    fn mix<L>(tiles: &[Tile], gains: &Gains, mixture: &mut [f32]) {
        let moving = gains.to_come.clamp(0, (tiles.len() * TILE) as i64) as usize;
        let (moving, resting) = tiles.split_at(moving.div_ceil(TILE));
        let (ramped, rested) = mixture.split_at_mut(moving.len() * TILE);
        let all = beside::<L>(gains.gain);
        if !moving.is_empty() {
            let growths = beside::<L>(gains.growth);
            let mut to_come = gains.to_come as f32;
            for (tile, mixed) in moving.iter().zip(ramped.as_chunks_mut::<TILE>().0) {
                let left = L::splat(to_come).sub(L::from_array(LANE_INDICES));
                // No ramp beyond its end.
                let left = if to_come < TILE as f32 {
                    L::from_array(not_negative(left.to_array()))
                } else {
                    left
                };
                left.neg_mul_add(sum(tile, &growths), sum(tile, &all))
                    .store(mixed);
                to_come -= TILE as f32;
            }
        }
        for (tile, mixed) in resting.iter().zip(rested.as_chunks_mut::<TILE>().0) {
            sum::<L>(tile, &all).store(mixed);
        }
    }
}

/// Every band's value in eight lanes, beside that of the band that lies beside it in a tile.
#[inline(always)]
fn beside<L: Lanes>(bands: F32x8) -> [Lanes16<L>; BANDS / 2] {
    let [a, b, c, d, e, f, g, h] = L::splat_each(bands);
    [Lanes16(a, e), Lanes16(b, f), Lanes16(c, g), Lanes16(d, h)]
}

fn not_negative(lanes: F32x8) -> F32x8 {
    F32x8(lanes.0.map(|lane| lane.max(0.0)))
}

#[inline(always)]
fn sum<L: Lanes>(tile: &Tile, gains: &[Lanes16<L>; BANDS / 2]) -> L {
    let pairs = tile.as_chunks().0;
    let of = |pair: [F32x8; 2]| Lanes16(L::from_array(pair[0]), L::from_array(pair[1]));
    let mut sums = of(pairs[0]).mul(gains[0]);
    for pair in 1..BANDS / 2 {
        sums = of(pairs[pair]).mul_add(gains[pair], sums);
    }
    sums.0.add(sums.1)
}

#[cfg(test)]
#[path = "voice_tests.rs"]
mod tests;
