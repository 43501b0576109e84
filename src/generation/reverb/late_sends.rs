//! The sends of all sources to the late reverb: delayed bands with ramped gains.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at construction only. Input: delay lines; output: a chunk of each
//! band.
//!
//! A send reads at points of a fixed time grid and depends only on the graphics frame. Audio frames are lanes, as in the
//! delay lines' tiles: a tile is weighted band by band.

use crate::acoustics::BANDS;
use crate::acoustics::bands::amplitude_of_energy;
use crate::extrapolation::{FramePaths, LATE_SEGMENTS};
use crate::simd::{F32x8, LANE_INDICES, LaneSet, kernel};

use crate::generation::delay::delay_line::{DelayLine, TILE, Tile, band_index};
use crate::generation::ramp::{BandRamp, ChunkSpan};
use crate::generation::{BandCorrection, CHUNK};

/// Grid of the read delays in seconds: a continuously moving read position would shift the pitch.
const GRID_S: f32 = 0.005;

/// Share of a grid step over which a send cross-fades from one grid point to the next.
const CHANGE: f32 = 0.25;

/// Read positions of a send: two for the cross-fade, two that fade out after a jump.
const TAPS: usize = 4;

/// Gain at which a fade may be truncated: −100 dB.
const INAUDIBLE: f32 = 1e-5;

/// T60 in seconds up to which a band is silent.
const SHORTEST_T60_S: f32 = 0.05;

/// Largest gain of a send, 60 dB.
const MAX_GAIN: f32 = 1000.0;

/// A chunk of one band, with a tile of overwritten samples on either side.
type Row = [f32; CHUNK + 2 * TILE];

/// One read position of a send.
#[derive(Debug, Clone, Copy, Default)]
struct Tap {
    delay: i64,
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
    /// Ramps to these delays in frames and gains. After two jumps within a ramp a third one is silent until a tap has
    /// faded out: a truncated fade would click.
    fn retarget(&mut self, targets: &[(i64, F32x8); 2], left: u32, ramp: u32) {
        let mut is_target = [false; TAPS];
        for &(delay, gain) in targets {
            if gain == F32x8::ZERO {
                continue;
            }
            let has = |tap: &Tap| tap.delay == delay && !tap.gain.is_silent(left);
            let index = self.taps.iter().position(has).or_else(|| {
                let mut taps = self.taps.iter().zip(&is_target);
                let index = taps.position(|(tap, is_target)| !is_target && tap.is_free(left))?;
                self.taps[index] = Tap {
                    delay,
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

/// The two grid points around a start in grid steps, and their gains. The squares sum to one: the network's responses to
/// different times are uncorrelated.
fn on_grid(start_s: f32) -> [(f32, f32); 2] {
    let steps = start_s / GRID_S;
    let below = steps.floor();
    let share = ((steps - below - 0.5) / CHANGE + 0.5).clamp(0.0, 1.0);
    let (sin, cos) = (share * std::f32::consts::FRAC_PI_2).sin_cos();
    match share {
        // Exactly zero: a silent tap is not read.
        0.0 => [(below, 1.0), (below + 1.0, 0.0)],
        1.0 => [(below, 0.0), (below + 1.0, 1.0)],
        _ => [(below, cos), (below + 1.0, sin)],
    }
}

/// Properties of the network that receives the sends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Network {
    pub(crate) rate_hz: f32,
    pub(crate) mean_length_s: f32,
    /// Lag of the renewals relative to a uniform energy flow, in seconds.
    pub(crate) lag_s: f32,
}

/// All sends and their sum in the present chunk.
#[derive(Debug)]
pub(crate) struct LateSends {
    set: LaneSet,
    network: Network,
    sends: Vec<Send>,
    input: Box<[Row; BANDS]>,
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

    pub(crate) fn new(network: Network, max_sources: usize) -> Self {
        Self {
            set: LaneSet::best(),
            network,
            sends: vec![Send::default(); max_sources * LATE_SEGMENTS],
            input: Box::new([[0.0; CHUNK + 2 * TILE]; BANDS]),
        }
    }

    /// Ramps to the sends of a frame, with delays of at most `max_delay` frames; `left` frames of the last ramp remain.
    pub(crate) fn set_frame(
        &mut self,
        frame: &FramePaths,
        max_delay: i64,
        correction: &BandCorrection,
        left: u32,
        ramp: u32,
    ) {
        let Network {
            rate_hz,
            mean_length_s,
            lag_s,
        } = self.network;
        for (index, send) in self.sends.iter_mut().enumerate() {
            let (slot, step) = (index / LATE_SEGMENTS, index % LATE_SEGMENTS);
            let mut own = frame
                .late
                .iter()
                .filter(|late| late.source.slot() == slot && late.group == 0);
            let Some(segment) = own.nth(step) else {
                send.retarget(&[(0, F32x8::ZERO); 2], left, ramp);
                continue;
            };
            let start_s = (segment.start_s - lag_s).clamp(0.0, max_delay as f32 / rate_hz);
            let taps = on_grid(start_s).map(|(steps, share)| {
                let delay = ((steps * GRID_S * rate_hz) as i64).min(max_delay);
                if share == 0.0 {
                    return (delay, F32x8::ZERO);
                }
                let delay_s = delay as f32 / rate_hz;
                let amplitude = std::array::from_fn(|b| {
                    let energy = amplitude_of_energy(segment.energy_per_s[b] * mean_length_s);
                    let gain =
                        share * energy * decay(delay_s, frame.late_groups[0].decay_time_s[b]);
                    if gain.is_finite() {
                        gain.min(MAX_GAIN)
                    } else {
                        0.0
                    }
                });
                (delay, correction.gains(&amplitude))
            });
            send.retarget(&taps, left, ramp);
        }
    }

    /// Adds one source's sends for a chunk.
    pub(crate) fn collect(&mut self, slot: usize, line: &DelayLine, chunk: ChunkSpan) {
        let ChunkSpan { now, left, frames } = chunk;
        let first = slot * LATE_SEGMENTS;
        let Some(sends) = self.sends.get(first..first + LATE_SEGMENTS) else {
            return;
        };
        let audible =
            |tap: &&Tap| !tap.gain.is_silent(left) && !line.is_silent_from(now - tap.delay);
        let taps = sends.iter().flat_map(|send| &send.taps);
        let mut audible = taps.filter(audible).peekable();
        while let Some(tap) = audible.next() {
            // Prefetches the next tap while this one is added.
            if let Some(next) = audible.peek() {
                line.prefetch_window(now - next.delay, frames).fetch();
            }
            let position = now - tap.delay;
            let (lane, parts) = line.tiles(position, frames);
            let mut gains = SendGains {
                before: tap.gain.value(left),
                growth: tap.gain.growth_now(left),
                index: TILE - lane,
            };
            for tiles in parts.into_iter().filter(|tiles| !tiles.is_empty()) {
                add_tiles(self.set, tiles, &gains, &mut self.input);
                gains.index += tiles.len() * TILE;
            }
        }
    }

    /// The chunk's sum of all sends in one band.
    pub(crate) fn band(&self, band: usize, frames: usize) -> &[f32] {
        &self.input[band][TILE..TILE + frames]
    }

    /// Clears the chunk.
    pub(crate) fn clear(&mut self) {
        self.input.as_flattened_mut().fill(0.0);
    }
}

/// Gains of a run of tiles, and the run's index in the rows.
#[derive(Debug, Clone, Copy)]
struct SendGains {
    /// Gain before the chunk's first frame.
    before: F32x8,
    /// Growth per frame.
    growth: F32x8,
    /// Index in every [`Row`].
    index: usize,
}

kernel! {
    /// Adds tiles with ramped gains.
    fn add_tiles<L>(tiles: &[Tile], gains: &SendGains, input: &mut [Row; BANDS]) {
        for band in 0..BANDS {
            let before = L::splat(gains.before.0[band]);
            let growth = L::splat(gains.growth.0[band]);
            let row = input[band].get_mut(gains.index..).unwrap_or_default();
            // The chunk's first frame, at index TILE, has grown once. The integer steps are exact.
            let mut grown = L::from_array(LANE_INDICES).add(L::splat(gains.index as f32 - (TILE - 1) as f32));
            for (tile, sums) in tiles.iter().zip(row.as_chunks_mut::<TILE>().0) {
                let gain = grown.mul_add(growth, before);
                L::from_array(tile[band_index(band)]).mul_add(gain, L::load(sums)).store(sums);
                grown = grown.add(L::splat(TILE as f32));
            }
        }
    }
}

/// Amplitude factor after `time_s`; zero for decay times up to [`SHORTEST_T60_S`] or NaN.
pub(crate) fn decay(time_s: f32, t60_s: f32) -> f32 {
    if t60_s > SHORTEST_T60_S {
        10f32.powf(-3.0 * time_s / t60_s)
    } else {
        0.0
    }
}
