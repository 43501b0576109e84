//! The sends of all sources to the networks of the late reverb: sums of delayed bands with ramped gains.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at construction only. Input: delay lines; output: a chunk of each
//! bus of each network.
//!
//! A send reads at points of a time grid, one grid a source, and depends only on the graphics frame. Segments of a source and
//! neighbouring points of its grid go to different buses: their responses are uncorrelated. Audio frames are lanes, as in
//! the delay lines' tiles.

use std::f32::consts::LOG2_10;

use crate::acoustics::BANDS;
use crate::acoustics::bands::amplitude_of_energy;
use crate::extrapolation::{FramePaths, LATE_GROUPS, LATE_SEGMENTS, LateGroup, LateSend};
use crate::simd::{F32x8, LANE_INDICES, LaneSet, kernel};

use crate::generation::delay::delay_line::{DelayLine, TILE, Tile, band_index};
use crate::generation::delay::held;
use crate::generation::delay::held::{MIDDLE, STRETCH_TILES};
use crate::generation::ramp::{BandRamp, ChunkSpan};
use crate::generation::reverb::network::{BUSES, SHORTEST_T60_S, Timing};
use crate::generation::reverb::send_grid;
use crate::generation::{BandCorrection, CHUNK};

/// Read positions of a send: two for the cross-fade, two that fade out after a jump.
const TAPS: usize = 4;

/// Gain at which a fade may be truncated: −100 dB.
const INAUDIBLE: f32 = 1e-5;

/// Largest gain of a send, 60 dB.
const MAX_GAIN: f32 = 1000.0;

/// A chunk of one bus, with a tile of overwritten samples on either side.
type Row = [f32; CHUNK + 2 * TILE];

/// One read position of a send.
#[derive(Debug, Clone, Copy, Default)]
struct Tap {
    delay: i64,
    bus: usize,
    gain: BandRamp,
}

impl Tap {
    /// Whether truncation is inaudible. A fade that is restarted before its end approaches zero without reaching it.
    fn is_free(&self, left: u32) -> bool {
        let present = self.gain.value(left);
        self.gain.target == F32x8::ZERO && present.0.iter().all(|gain| gain.abs() <= INAUDIBLE)
    }
}

/// One segment of a source's late energy.
#[derive(Debug, Clone, Copy, Default)]
struct Send {
    taps: [Tap; TAPS],
}

impl Send {
    /// Ramps to these delays in frames, buses and gains. After two jumps within a ramp a third one is silent until a tap has
    /// faded out: a truncated fade would click.
    fn retarget(&mut self, targets: &[(i64, usize, F32x8); 2], left: u32, ramp: u32) {
        let mut is_target = [false; TAPS];
        for &(delay, bus, gain) in targets {
            if gain == F32x8::ZERO {
                continue;
            }
            let has = |tap: &Tap| tap.delay == delay && tap.bus == bus && !tap.gain.is_silent(left);
            let index = self.taps.iter().position(has).or_else(|| {
                let mut taps = self.taps.iter().zip(&is_target);
                let index = taps.position(|(tap, is_target)| !is_target && tap.is_free(left))?;
                self.taps[index] = Tap {
                    delay,
                    bus,
                    ..Tap::default()
                };
                Some(index)
            });
            let Some(index) = index else { continue };
            is_target[index] = true;
            self.taps[index].gain.retarget(gain, left, ramp);
        }
        for (tap, is_target) in self.taps.iter_mut().zip(is_target) {
            if !is_target {
                tap.gain.retarget(F32x8::ZERO, left, ramp);
            }
        }
    }
}

/// The networks that receive the sends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Receivers {
    pub(crate) rate_hz: f32,
    pub(crate) timings: [Timing; LATE_GROUPS],
}

/// All sends and their sums in the present chunk.
#[derive(Debug)]
pub(crate) struct LateSends {
    set: LaneSet,
    receivers: Receivers,
    /// Ordered by source, group and segment.
    sends: Vec<Send>,
    /// Segments that the present frame has, by source and group.
    counts: Vec<u8>,
    /// By group and bus.
    input: Box<[[Row; BUSES]; LATE_GROUPS]>,
}

impl LateSends {
    /// Delays of the first send in frames, and its gains.
    #[cfg(test)]
    pub(crate) fn first(&self) -> Vec<(i64, F32x8)> {
        let taps = self.sends[0].taps.iter();
        let audible = taps.filter(|tap| tap.gain.target != F32x8::ZERO);
        let mut first: Vec<_> = audible.map(|tap| (tap.delay, tap.gain.target)).collect();
        first.sort_by_key(|(delay, _)| *delay);
        first
    }

    pub(crate) fn new(receivers: Receivers, max_sources: usize) -> Self {
        Self {
            set: LaneSet::best(),
            receivers,
            sends: vec![Send::default(); max_sources * LATE_GROUPS * LATE_SEGMENTS],
            counts: vec![0; max_sources * LATE_GROUPS],
            input: Box::new([[[0.0; CHUNK + 2 * TILE]; BUSES]; LATE_GROUPS]),
        }
    }

    /// Ramps to the sends of a frame, with delays of at most `longest_s` by source slot; `left` frames of the last ramp remain.
    pub(crate) fn set_frame(
        &mut self,
        frame: &FramePaths,
        longest_s: &[f64],
        correction: &BandCorrection,
        left: u32,
        ramp: u32,
    ) {
        self.counts.fill(0);
        let decays = frame.late_groups.each_ref().map(GroupDecay::new);
        for segment in &frame.late {
            let group = usize::from(segment.group);
            let index = segment.source.slot() * LATE_GROUPS + group;
            let Some(count) = self.counts.get_mut(index).filter(|_| group < LATE_GROUPS) else {
                continue;
            };
            let step = usize::from(*count);
            if step >= LATE_SEGMENTS {
                continue;
            }
            *count += 1;
            let longest_s = longest_s.get(segment.source.slot()).copied();
            let max_delay = longest_s.unwrap_or(0.0) * f64::from(self.receivers.rate_hz);
            let max_delay = max_delay.ceil() as i64;
            let targets = self.targets(segment, step, &decays[group], max_delay, correction);
            self.sends[index * LATE_SEGMENTS + step].retarget(&targets, left, ramp);
        }
        let each = self.sends.chunks_exact_mut(LATE_SEGMENTS);
        for (sends, count) in each.zip(&self.counts) {
            for send in &mut sends[usize::from(*count)..] {
                send.retarget(&[(0, 0, F32x8::ZERO); 2], left, ramp);
            }
        }
    }

    /// Delays, buses and gains of a segment, the `step`-th of its source and group.
    fn targets(
        &self,
        segment: &LateSend,
        step: usize,
        decay: &GroupDecay,
        max_delay: i64,
        correction: &BandCorrection,
    ) -> [(i64, usize, F32x8); 2] {
        let Receivers { rate_hz, timings } = self.receivers;
        let timing = timings[usize::from(segment.group)];
        let slot = segment.source.slot();
        let start_s = segment.start_s.clamp(0.0, max_delay as f32 / rate_hz);
        let energies = segment.energy_per_s;
        let amplitudes = energies.map(|energy| amplitude_of_energy(energy * timing.mean_length_s));
        send_grid::points(start_s, slot).map(|point| {
            let delay = ((point.time_s * rate_hz).ceil() as i64).min(max_delay);
            let bus = (3 * slot + 2 * step + point.index.rem_euclid(2) as usize) % BUSES;
            if point.gain == 0.0 {
                return (delay, bus, F32x8::ZERO);
            }
            let time_s = delay as f32 / rate_hz + timing.nominal_s;
            let gains = F32x8(amplitudes) * F32x8::splat(point.gain) * decay.factors(time_s);
            // Not a number becomes zero.
            let limited = gains.0.map(|gain| match gain < f32::INFINITY {
                true => gain.min(MAX_GAIN),
                false => 0.0,
            });
            (delay, bus, correction.gains(&limited))
        })
    }

    /// Adds one source's sends for a chunk.
    pub(crate) fn collect(&mut self, slot: usize, line: &DelayLine, chunk: ChunkSpan) {
        let ChunkSpan { now, left, frames } = chunk;
        let each = LATE_GROUPS * LATE_SEGMENTS;
        let Some(sends) = self.sends.get(slot * each..(slot + 1) * each) else {
            return;
        };
        let audible = |(_, tap): &(usize, &Tap)| {
            !tap.gain.is_silent(left) && !line.is_silent_from(now - tap.delay)
        };
        let groups = sends.chunks_exact(LATE_SEGMENTS).enumerate();
        let sends = groups.flat_map(|(group, sends)| sends.iter().map(move |send| (group, send)));
        let taps = sends.flat_map(|(group, send)| send.taps.iter().map(move |tap| (group, tap)));
        for (group, tap) in taps.filter(audible) {
            let position = now - tap.delay;
            let (lane, parts) = line.tiles(position, frames);
            let growth = tap.gain.growth_now(left);
            let mut gains = SendGains {
                before: tap.gain.value(left),
                growth,
                left: left as f32,
                index: TILE - lane,
            };
            let is_held = held::is_exact(&growth, &tap.gain.target);
            let mut passed = held::tiles_passed(position - lane as i64);
            let row = &mut self.input[group][tap.bus];
            for tiles in parts.into_iter().filter(|tiles| !tiles.is_empty()) {
                if is_held {
                    add_held_tiles(self.set, tiles, &gains, passed, row);
                } else {
                    add_tiles(self.set, tiles, &gains, row);
                }
                passed = (passed + tiles.len()) % STRETCH_TILES;
                gains.index += tiles.len() * TILE;
            }
        }
    }

    /// The chunk's sum of all sends to a bus of a group.
    pub(crate) fn bus(&self, group: usize, bus: usize, frames: usize) -> &[f32] {
        &self.input[group][bus][TILE..TILE + frames]
    }

    /// Clears the chunk.
    pub(crate) fn clear(&mut self) {
        self.input.as_flattened_mut().as_flattened_mut().fill(0.0);
    }
}

/// Gains of a run of tiles, and the run's index in the row.
#[derive(Debug, Clone, Copy)]
struct SendGains {
    /// Gain before the chunk's first frame.
    before: F32x8,
    /// Growth per frame.
    growth: F32x8,
    /// Frames left of the ramp before the chunk's first frame.
    left: f32,
    /// Index in the [`Row`].
    index: usize,
}

kernel! {
    /// Adds the weighted sum of the bands of tiles with ramped gains.
    fn add_tiles<L>(tiles: &[Tile], gains: &SendGains, row: &mut Row) {
        let before = L::splat_each(gains.before);
        let growth = L::splat_each(gains.growth);
        let row = row.get_mut(gains.index..).unwrap_or_default();
        // The chunk's first frame, at index TILE, has grown once. The integer steps are exact.
        let mut grown = L::from_array(LANE_INDICES).add(L::splat(gains.index as f32 - (TILE - 1) as f32));
        for (tile, sums) in tiles.iter().zip(row.as_chunks_mut::<TILE>().0) {
            let mut sum = L::load(sums);
            for band in 0..BANDS {
                let gain = grown.mul_add(growth[band], before[band]);
                sum = L::from_halves(&tile[band_index(band)]).mul_add(gain, sum);
            }
            sum.store(sums);
            grown = grown.add(L::splat(TILE as f32));
        }
    }
}

kernel! {
    /// Adds the weighted sum of the bands of tiles with gains that are held; `passed` tiles of the first stretch come before them.
    fn add_held_tiles<L>(tiles: &[Tile], gains: &SendGains, passed: usize, row: &mut Row) {
        let mut sums = row.get_mut(gains.index..).unwrap_or_default().as_chunks_mut::<TILE>().0.iter_mut();
        let (mut tiles, mut passed) = (tiles, passed);
        // Frames grown in the middle of the stretch.
        let mut grown = gains.index as f32 - (TILE - 1) as f32 - (passed * TILE) as f32 + MIDDLE;
        while !tiles.is_empty() {
            let (now, later) = tiles.split_at((STRETCH_TILES - passed).min(tiles.len()));
            let growth = L::from_array(gains.growth);
            let held = growth.mul_add(L::splat(grown.min(gains.left)), L::from_array(gains.before));
            let held = L::splat_each(held.to_array());
            for (tile, sums) in now.iter().zip(&mut sums) {
                let mut even = L::load(sums);
                let mut odd = L::splat(0.0);
                for band in 0..BANDS / 2 {
                    even = L::from_halves(&tile[2 * band]).mul_add(held[band], even);
                    odd = L::from_halves(&tile[2 * band + 1]).mul_add(held[band + BANDS / 2], odd);
                }
                even.add(odd).store(sums);
            }
            grown += (STRETCH_TILES * TILE) as f32;
            passed = 0;
            tiles = later;
        }
    }
}

/// The decay of a group's bands.
#[derive(Debug, Clone, Copy)]
struct GroupDecay {
    /// Powers of two by which the amplitude grows per second.
    rate: F32x8,
    /// One for each band that sounds; zero for decay times up to [`SHORTEST_T60_S`] or NaN.
    mask: F32x8,
}

impl GroupDecay {
    fn new(group: &LateGroup) -> Self {
        let (mut rate, mut mask) = (F32x8::ZERO, F32x8::ZERO);
        for (band, t60_s) in group.decay_time_s.into_iter().enumerate() {
            if t60_s > SHORTEST_T60_S {
                (rate.0[band], mask.0[band]) = (-3.0 * LOG2_10 / t60_s, 1.0);
            }
        }
        Self { rate, mask }
    }

    /// Amplitudes after a time, relative to those at its beginning; zero below 2⁻¹⁰⁰.
    fn factors(&self, time_s: f32) -> F32x8 {
        let powers = self.rate * F32x8::splat(time_s);
        let limited = powers.0.map(|power| power.clamp(-100.0, 100.0));
        let mut factors = F32x8(limited).exp2() * self.mask;
        for (factor, power) in factors.0.iter_mut().zip(limited) {
            *factor = if power > -100.0 { *factor } else { 0.0 };
        }
        factors
    }
}
