//! A voice: band gains, delay and ear signals of one path.
//!
//! Audio side; wait-free, bounded by the chunk; allocates nothing. Input: a source's delay line; output: ear signals.
//!
//! A voice mixes the eight bands once, at integer positions of the source's time, and keeps the last part of the mixture.
//! Both ears interpolate the mixture. A gain ramp is a function of the source's time: a change of gain reaches the far ear
//! later.

use crate::acoustics::BANDS;
use crate::simd::{F16x8, F32x8, LANE_INDICES, LaneSet, Lanes, Lanes16, kernel, prefetch};

use crate::generation::CHUNK;
use crate::generation::bands::air_filter::{AIR_DELAY, AirState};
use crate::generation::binaural::ear_ramps;
use crate::generation::binaural::ear_ramps::{EarPair, RampRate, SignalWindow};
use crate::generation::delay::delay_line::{DelayLine, PrefetchWindow, SEGMENT, TILE, Tile};
use crate::generation::delay::held;
use crate::generation::delay::held::{MIDDLE, STRETCH_TILES};
use crate::generation::delay::interpolation::{AHEAD, Intervals};
use crate::generation::ramp::{ChunkSpan, LinearRamp};
use crate::generation::render_context::SlotOwner;
use crate::generation::voices::frame_plan::VoiceRequest;

/// Largest change of a delay in frames per frame: a source that approaches at 114 m/s. Above it the path cross-fades. Determines [`MAX_FRESH`].
pub(crate) const MAX_DELAY_GROWTH: f64 = 0.5;

/// Most positions that a voice mixes in a chunk, with room for rounding and whole tiles.
pub(crate) const MAX_FRESH: usize = CHUNK + CHUNK / 2 + 3 * TILE;

// From a tile's start on.
const _: () = assert!(MAX_FRESH + TILE <= SEGMENT);

/// Bits of a voice index.
pub(crate) const INDEX_BITS: u32 = 16;

/// Change of a delay in frames, within a graphics frame, below which a path is at rest.
const RESTING: f64 = 1e-3;

/// State of one path.
#[derive(Debug, Clone, Default)]
pub(crate) struct Voice {
    /// Slot of the source.
    pub(crate) slot: usize,
    /// The owner of the slot.
    pub(crate) owner: Option<u32>,
    /// First position of the owner's signal.
    since: i64,
    /// Band gains from position `gain_end` on, and their growth per position before it.
    gain: F32x8,
    gain_growth: F32x8,
    gain_end: i64,
    /// Whether growing gains are held.
    holds_gains: bool,
    /// Next position to mix.
    next: i64,
    /// Path delay in frames.
    delay: LinearRamp,
    /// Path and ear delay in frames.
    ear_delays: [LinearRamp; 2],
    /// Ear delays in whole frames at the end of the ramp, and whether they are the same in all of it.
    whole_ears: Option<[u32; 2]>,
    keeps_whole_ears: bool,
    /// Whether the past of the signal that both ears share is known.
    has_past: bool,
    /// Rate of the weights' ramp.
    pub(crate) rate: RampRate,
    /// Groups of buses in use during the ramp and after it.
    pub(crate) groups: [usize; 2],
    /// Filter of the air above the bands; its delay is taken from the path delay.
    air: Option<AirState>,
    /// Whether the voice fades out, and the frames until its end.
    fading: bool,
    fade_left: u32,
}

/// Buffers of a voice.
#[derive(Debug)]
pub(crate) struct VoiceScratch<'a> {
    /// The voice's last mixed positions.
    pub(crate) history: &'a mut [f32],
    /// The last frames of the signal that both ears share.
    pub(crate) past: &'a mut [f32],
    /// The history, [`MAX_FRESH`] positions and the interpolator's slack.
    pub(crate) mixture: &'a mut [f32],
    /// [`MAX_FRESH`] positions and [`AIR_SCRATCH`](crate::generation::bands::air_filter::AIR_SCRATCH).
    pub(crate) unfiltered: &'a mut [f32],
    pub(crate) intervals: &'a mut Intervals,
    pub(crate) ears: &'a mut EarPair,
    /// Readings: 2 in binaural sound, otherwise 1.
    pub(crate) readings: usize,
    /// Input of the next voice.
    pub(crate) prefetch_window: PrefetchWindow<'a>,
}

impl Voice {
    /// A voice that starts from silence at its own delay.
    pub(crate) fn start(
        &mut self,
        slot: usize,
        owner: SlotOwner,
        request: &VoiceRequest,
        now: i64,
        ramp: u32,
    ) {
        let delay = filtered_delay(request);
        *self = Self {
            slot,
            owner: owner.bits,
            since: owner.since,
            next: last_position(now - 1, delay) + 1,
            delay: LinearRamp::at_rest(delay),
            ear_delays: ear_delays(request, 0.0).map(|ear| LinearRamp::at_rest(delay + ear)),
            whole_ears: request.whole_ears,
            keeps_whole_ears: request.whole_ears.is_some(),
            air: request.air.as_ref().map(AirState::new),
            ..Self::default()
        };
        let end = last_position(now - 1 + i64::from(ramp), delay);
        self.ramp_gain(request.gain, end);
    }

    /// Counts rendered frames of a fade-out.
    pub(crate) fn advance_fade(&mut self, frames: usize) {
        self.fade_left = self.fade_left.saturating_sub(frames as u32);
    }

    /// Whether the voice has faded out.
    pub(crate) fn is_over(&self) -> bool {
        self.fading && self.fade_left == 0
    }

    /// Prefetches the voice.
    pub(crate) fn prefetch(&self) {
        prefetch(&self.slot);
        prefetch(&self.gain);
        prefetch(&self.gain_growth);
        prefetch(&self.delay);
        prefetch(&self.ear_delays[1]);
    }

    /// Key that sorts voices by source, then by reading position; the last [`INDEX_BITS`] bits are zero. Eight bits of slots
    /// and forty of positions, which wrap after half a year; wrapping affects only the order.
    pub(crate) fn sort_key(&self) -> u64 {
        const POSITIONS: i64 = 1 << 40;
        let position = (self.next + POSITIONS / 2).rem_euclid(POSITIONS) as u64;
        ((self.slot as u64) << 40 | position) << INDEX_BITS
    }

    /// Whether a change to a request is motion, not a jump, and needs no other filter.
    pub(crate) fn can_ramp_to(&self, request: &VoiceRequest, left: u32, ramp: u32) -> bool {
        let change = filtered_delay(request) - self.delay.value(left);
        request.air.is_some() == self.air.is_some()
            && change.abs() <= MAX_DELAY_GROWTH * f64::from(ramp)
    }

    /// Ramps to new values; `left` frames of the last ramp remain.
    pub(crate) fn retarget(&mut self, request: &VoiceRequest, now: i64, left: u32, ramp: u32) {
        let path_delay = filtered_delay(request);
        if let (Some(state), Some(taps)) = (&mut self.air, &request.air) {
            let is_resting = (path_delay - self.delay.value(left)).abs() < RESTING;
            state.taps = if is_resting {
                taps.resting
            } else {
                taps.moving
            };
        }
        self.delay.retarget(path_delay, left, ramp);
        let ears = ear_delays(request, self.delay.growth_now(ramp));
        for (delay, ear) in self.ear_delays.iter_mut().zip(ears) {
            delay.retarget(path_delay + ear, left, ramp);
        }
        self.keeps_whole_ears =
            request.whole_ears.is_some() && request.whole_ears == self.whole_ears;
        self.has_past &= self.keeps_whole_ears;
        self.whole_ears = request.whole_ears;
        let end = last_position(now - 1 + i64::from(ramp), path_delay);
        self.ramp_gain(request.gain, end);
    }

    /// Ramps to silence at constant delay. The end of the ramp reaches the far ear at most `history` frames later.
    pub(crate) fn fade(&mut self, now: i64, left: u32, ramp: u32, history: usize) {
        self.delay.stop(left);
        for delay in &mut self.ear_delays {
            delay.stop(left);
        }
        let end = last_position(now - 1 + i64::from(ramp), self.delay.value(0));
        self.ramp_gain(F32x8::ZERO, end);
        self.rate = RampRate::Constant;
        self.fading = true;
        let filter = self.air.map_or(0, |_| 2 * AIR_DELAY);
        self.fade_left = ramp + (history + filter) as u32;
    }

    fn ramp_gain(&mut self, gain: F32x8, end: i64) {
        let last = self.next - 1;
        let present =
            self.gain - self.gain_growth * F32x8::splat((self.gain_end - last).max(0) as f32);
        self.gain_end = end.max(last + 1);
        let positions = (self.gain_end - last) as f32;
        self.gain_growth = (gain - present) * F32x8::splat(1.0 / positions);
        self.gain = gain;
        self.holds_gains = held::is_exact(&self.gain_growth, &gain);
    }

    /// The stretch of the delay line that a chunk of `frames` frames mixes next at constant delay, without the part that
    /// the voice rendered before it reads.
    pub(crate) fn prefetch_window<'a>(
        &self,
        lines: &'a [DelayLine],
        frames: usize,
        before: Option<&Self>,
    ) -> PrefetchWindow<'a> {
        let is_read = |before: &&Self| before.slot == self.slot && before.next <= self.next;
        let end = self.next + frames as i64;
        let from = before.filter(is_read).map_or(self.next, |before| {
            self.next.max(before.next + frames as i64)
        });
        match lines.get(self.slot) {
            Some(line) if from < end => line.prefetch_window(from, (end - from) as usize),
            _ => PrefetchWindow::default(),
        }
    }

    /// Renders a chunk of both ears and returns true; with silent input advances and returns false.
    pub(crate) fn render(
        &mut self,
        set: LaneSet,
        line: &DelayLine,
        chunk: ChunkSpan,
        scratch: VoiceScratch<'_>,
    ) -> bool {
        let VoiceScratch {
            history,
            past,
            mixture,
            unfiltered,
            intervals,
            ears,
            readings,
            mut prefetch_window,
        } = scratch;
        let ChunkSpan { now, left, frames } = chunk;
        let growth = self.delay.growth_now(left);
        let last_delay = self.delay.value(left) + growth * frames as f64;
        let end = last_position(now + frames as i64 - 1, last_delay);
        let fresh = (end + 1 - self.next).clamp(0, MAX_FRESH as i64) as usize;
        let start = self.next - history.len() as i64;
        prefetch_window.fetch_quarter();
        if line.is_silent_from(start) {
            history.fill(0.0);
            self.has_past = false;
            if let Some(air) = &mut self.air {
                air.clear();
            }
            self.next += fresh as i64;
            return false;
        }
        let reserve = history.len();
        self.mix(set, line, reserve, fresh, mixture);
        if let Some(air) = &mut self.air {
            air.filter(set, &mut mixture[reserve..reserve + fresh], unfiltered);
        }
        prefetch_window.fetch_quarter();
        mixture[..reserve].copy_from_slice(history);
        self.next += fresh as i64;
        history.copy_from_slice(&mixture[fresh..fresh + reserve]);
        prefetch_window.fetch_quarter();
        let window = SignalWindow {
            signal: mixture,
            length: reserve + fresh,
            start,
        };
        if self.shared_ears().is_some() {
            self.read_shared(set, &window, chunk, past, intervals, ears);
        } else {
            let delays = &self.ear_delays[..readings];
            ear_ramps::read_ears(set, &window, chunk, delays, intervals, ears);
        }
        prefetch_window.fetch_quarter();
        true
    }

    /// Ear delays in whole frames if both ears share one signal.
    pub(crate) fn shared_ears(&self) -> Option<[u32; 2]> {
        self.whole_ears.filter(|_| self.keeps_whole_ears)
    }

    /// Reads a chunk of the signal that both ears share, after its past, into the first buffer. Without a known past it is read as
    /// if the present ramp had begun earlier.
    fn read_shared(
        &mut self,
        set: LaneSet,
        window: &SignalWindow,
        chunk: ChunkSpan,
        past: &mut [f32],
        intervals: &mut Intervals,
        ears: &mut EarPair,
    ) {
        let signal = &mut ears[0];
        let earlier = if self.has_past { 0 } else { past.len() };
        let known = past.len() - earlier;
        signal[..known].copy_from_slice(&past[..known]);
        let out = &mut signal[known..];
        ear_ramps::read_once(set, window, chunk, (&self.delay, earlier), intervals, out);
        past.copy_from_slice(&signal[chunk.frames..][..past.len()]);
        self.has_past = true;
    }

    /// Mixes `fresh` positions from [`Self::next`] on into `mixture` from index `reserve` on. Works in whole tiles and
    /// overwrites up to seven samples on either side.
    fn mix(
        &self,
        set: LaneSet,
        line: &DelayLine,
        reserve: usize,
        fresh: usize,
        mixture: &mut [f32],
    ) {
        let (lane, parts) = line.tiles(self.next, fresh);
        let mut offset = reserve - lane;
        let mut gains = RampedGains {
            gain: self.gain,
            growth: self.gain_growth,
            to_come: self.gain_end - self.next + lane as i64,
        };
        let mut position = self.next - lane as i64;
        for tiles in parts.into_iter().filter(|tiles| !tiles.is_empty()) {
            let frames = (tiles.len() * TILE) as i64;
            let end = offset + frames as usize;
            let mixed = &mut mixture[offset..end];
            if self.holds_gains && gains.to_come > 0 {
                mix_held(set, tiles, &gains, held::tiles_passed(position), mixed);
            } else {
                mix(set, tiles, &gains, mixed);
            }
            gains.to_come -= frames;
            position += frames;
            offset = end;
        }
        let other_owner = (self.since - self.next).clamp(0, fresh as i64) as usize;
        mixture[reserve..reserve + other_owner].fill(0.0);
    }
}

/// Delays of the ears after the path's. A shared signal reaches an ear as it was so many frames ago, when the path's delay was
/// less by its growth since.
fn ear_delays(request: &VoiceRequest, growth: f64) -> [f64; 2] {
    match request.whole_ears {
        Some(frames) => frames.map(|frames| f64::from(frames) * (1.0 - growth)),
        None => request.ears.map(f64::from),
    }
}

/// Path delay in frames without that of the air's filter. A path shorter than the filter is late by the rest: what it would
/// read is not written yet.
fn filtered_delay(request: &VoiceRequest) -> f64 {
    let filter = request.air.map_or(0.0, |_| AIR_DELAY as f64);
    (request.delay - filter).max(0.0)
}

/// Last position that a path with this delay reads at time `now`.
fn last_position(now: i64, delay: f64) -> i64 {
    ((now - AHEAD as i64) as f64 - delay).floor() as i64 + AHEAD as i64
}

/// Band gains and their ramp.
#[derive(Debug, Clone, Copy)]
struct RampedGains {
    /// Gains from the end of the ramp on.
    gain: F32x8,
    /// Growth per position.
    growth: F32x8,
    /// Positions left at the first one.
    to_come: i64,
}

kernel! {
    /// Mixes the bands of tiles with gains that are held; `passed` tiles of the first stretch come before them.
    fn mix_held<L>(tiles: &[Tile], gains: &RampedGains, passed: usize, mixture: &mut [f32]) {
        let mut tiles = tiles;
        let mut mixed = mixture.as_chunks_mut::<TILE>().0.iter_mut();
        let mut passed = passed;
        let mut to_come = gains.to_come as f32 + (passed * TILE) as f32;
        while !tiles.is_empty() {
            let (now, later) = tiles.split_at((STRETCH_TILES - passed).min(tiles.len()));
            let left = L::splat((to_come - MIDDLE).max(0.0));
            let growth = L::from_array(gains.growth);
            let held = growth.neg_mul_add(left, L::from_array(gains.gain));
            let held = paired_lanes::<L>(held.to_array());
            for (tile, mixed) in now.iter().zip(&mut mixed) {
                sum::<L>(tile, &held).store(mixed);
            }
            to_come -= (STRETCH_TILES * TILE) as f32;
            passed = 0;
            tiles = later;
        }
    }
}

kernel! {
    /// Mixes the bands of tiles with their gains.
    fn mix<L>(tiles: &[Tile], gains: &RampedGains, mixture: &mut [f32]) {
        let to_come = gains.to_come.clamp(0, (tiles.len() * TILE) as i64) as usize;
        let (moving, resting) = tiles.split_at(to_come / TILE);
        let (ramped, rested) = mixture.split_at_mut(moving.len() * TILE);
        let all = paired_lanes::<L>(gains.gain);
        let growths = paired_lanes::<L>(gains.growth);
        let mut left = L::splat(gains.to_come as f32).sub(L::from_array(LANE_INDICES));
        for (tile, mixed) in moving.iter().zip(ramped.as_chunks_mut::<TILE>().0) {
            left.neg_mul_add(sum(tile, &growths), sum(tile, &all)).store(mixed);
            left = left.sub(L::splat(TILE as f32));
        }
        let mut rested = rested.as_chunks_mut::<TILE>().0.iter_mut();
        let mut resting = resting.iter();
        if !to_come.is_multiple_of(TILE)
            && let (Some(tile), Some(mixed)) = (resting.next(), rested.next())
        {
            // The gains are constant after the ramp's end.
            let left = L::from_array(not_negative(left.to_array()));
            left.neg_mul_add(sum(tile, &growths), sum(tile, &all)).store(mixed);
        }
        for (tile, mixed) in resting.zip(rested) {
            sum::<L>(tile, &all).store(mixed);
        }
    }
}

/// Each band's value in eight lanes, next to that of its neighbour in a tile.
#[inline(always)]
fn paired_lanes<L: Lanes>(bands: F32x8) -> [Lanes16<L>; BANDS / 2] {
    let [a, b, c, d, e, f, g, h] = L::splat_each(bands);
    [Lanes16(a, e), Lanes16(b, f), Lanes16(c, g), Lanes16(d, h)]
}

fn not_negative(lanes: F32x8) -> F32x8 {
    F32x8(lanes.0.map(|lane| lane.max(0.0)))
}

#[inline(always)]
fn sum<L: Lanes>(tile: &Tile, gains: &[Lanes16<L>; BANDS / 2]) -> L {
    let pairs = tile.as_chunks().0;
    let of = |pair: &[F16x8; 2]| Lanes16(L::from_halves(&pair[0]), L::from_halves(&pair[1]));
    let mut sums = of(&pairs[0]).mul(gains[0]);
    for pair in 1..BANDS / 2 {
        sums = of(&pairs[pair]).mul_add(gains[pair], sums);
    }
    sums.0.add(sums.1)
}

#[cfg(test)]
#[path = "voice_tests.rs"]
mod tests;
