//! What every source sends to the late reverb: its bands, some time after emission, at ramped gains.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at birth only. Reads delay lines, gives a chunk of each band.
//!
//! A send reads at points of a fixed grid in time. What it makes of a frame depends on that frame alone.
//!
//! Frames are lanes, as in the delay lines' tiles: a tile is weighed band by band and added where it falls.

use crate::acoustics::BANDS;
use crate::acoustics::bands::amplitude_of_energy;
use crate::extrapolation::{FramePaths, LATE_SEGMENTS};
use crate::simd::{F32x8, LANE_INDICES, LaneSet, kernel};

use crate::generation::binaural::ear_ramps::Moment;
use crate::generation::delay::delay_line::{DelayLine, TILE, Tile, place_of};
use crate::generation::reverb::late_reverb::decay;
use crate::generation::{BandCorrection, CHUNK};

/// Sends read at whole multiples of this, in seconds: a reading position that moved would bend every tone.
const GRID_S: f32 = 0.005;

/// Share of a grid step over which a send that is to start between two of its points changes from one to the other.
const CHANGE: f32 = 0.25;

/// Reading positions of a send: two while it changes, two that fade out after a leap.
const TAPS: usize = 4;

/// Gain that no longer counts as one of something that fades, 100 dB below one.
const FAINTEST: f32 = 1e-5;

/// Largest gain of a send, 60 dB.
const MAX_GAIN: f32 = 1000.0;

/// A chunk of one band, with a tile's room on either side for what is spoiled.
type Row = [f32; CHUNK + 2 * TILE];

/// One reading position of a send with ramped gains.
#[derive(Debug, Clone, Copy, Default)]
struct Tap {
    delay: i64,
    gain: F32x8,
    growth: F32x8,
}

impl Tap {
    fn retarget(&mut self, gain: F32x8, left: u32, ramp: u32) {
        let present = self.gain - self.growth * F32x8::splat(left as f32);
        self.growth = (gain - present) * F32x8::splat(1.0 / ramp as f32);
        self.gain = gain;
    }

    fn is_silent(&self, left: u32) -> bool {
        self.gain == F32x8::ZERO && (left == 0 || self.growth == F32x8::ZERO)
    }

    /// Whether it has faded so far that nobody hears where it is cut. One that is told to fade again and again, by frames that
    /// come before their ramps have ended, comes ever nearer to nothing and never there.
    fn is_free(&self, left: u32) -> bool {
        let growth = if left > 0 { self.growth } else { F32x8::ZERO };
        let present = self.gain - growth * F32x8::splat(left as f32);
        self.gain == F32x8::ZERO && present.0.iter().all(|gain| gain.abs() <= FAINTEST)
    }
}

/// A source's send: where it reads. What it makes of a frame depends on that frame alone, so that whoever hears of a way
/// less often sends the same.
#[derive(Debug, Clone, Copy, Default)]
struct Send {
    taps: [Tap; TAPS],
}

impl Send {
    /// Reads at these delays in frames with these gains, and nowhere else. After two leaps within a ramp a third one waits,
    /// unheard, for a frame in which something has faded out: a fade that is cut would click.
    fn retarget(&mut self, wanted: &[(i64, F32x8); 2], left: u32, ramp: u32) {
        let mut is_wanted = [false; TAPS];
        for &(delay, gain) in wanted {
            if gain == F32x8::ZERO {
                continue;
            }
            let has = |tap: &Tap| tap.delay == delay && !tap.is_silent(left);
            let place = self.taps.iter().position(has).or_else(|| {
                let mut taps = self.taps.iter().zip(&is_wanted);
                let place = taps.position(|(tap, is_wanted)| !is_wanted && tap.is_free(left))?;
                self.taps[place] = Tap {
                    delay,
                    ..Tap::default()
                };
                Some(place)
            });
            let Some(place) = place else { continue };
            is_wanted[place] = true;
            self.taps[place].retarget(gain, left, ramp);
        }
        for (tap, is_wanted) in self.taps.iter_mut().zip(is_wanted) {
            if !is_wanted {
                tap.retarget(F32x8::ZERO, left, ramp);
            }
        }
    }
}

/// The two grid points between which a start lies, in steps, and the shares of pressure that they take: their squares
/// sum to one, since what a network makes of two moments is not alike.
fn on_grid(start_s: f32) -> [(f32, f32); 2] {
    let steps = start_s / GRID_S;
    let below = steps.floor();
    let share = ((steps - below - 0.5) / CHANGE + 0.5).clamp(0.0, 1.0);
    let (sin, cos) = (share * std::f32::consts::FRAC_PI_2).sin_cos();
    match share {
        // Exactly one: what is silent is not read.
        0.0 => [(below, 1.0), (below + 1.0, 0.0)],
        1.0 => [(below, 0.0), (below + 1.0, 1.0)],
        _ => [(below, cos), (below + 1.0, sin)],
    }
}

/// What the network behind the sends is like.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Network {
    pub(crate) rate_hz: f32,
    pub(crate) mean_length_s: f32,
    /// Lag of the renewals behind an even stream, in seconds.
    pub(crate) lag_s: f32,
}

/// All sends, and the chunk they make.
#[derive(Debug)]
pub(crate) struct LateSends {
    set: LaneSet,
    network: Network,
    sends: Vec<Send>,
    input: Box<[Row; BANDS]>,
}

impl LateSends {
    /// Where the first send reads, in frames, and its gains.
    #[cfg(test)]
    pub(crate) fn first(&self) -> Vec<(i64, F32x8)> {
        let taps = self.sends[0].taps.iter();
        let heard = taps.filter(|tap| tap.gain != F32x8::ZERO);
        let mut first: Vec<_> = heard.map(|tap| (tap.delay, tap.gain)).collect();
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

    /// New sends. A send's start is kept within `max_delay` frames; `left` frames of the last ramp were still to come.
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
        for (place, send) in self.sends.iter_mut().enumerate() {
            let (slot, step) = (place / LATE_SEGMENTS, place % LATE_SEGMENTS);
            let mut own = frame.late.iter().filter(|late| late.source.slot() == slot);
            let Some(wanted) = own.nth(step) else {
                send.retarget(&[(0, F32x8::ZERO); 2], left, ramp);
                continue;
            };
            let start_s = (wanted.start_s - lag_s).clamp(0.0, max_delay as f32 / rate_hz);
            let taps = on_grid(start_s).map(|(steps, share)| {
                let delay = ((steps * GRID_S * rate_hz) as i64).min(max_delay);
                if share == 0.0 {
                    return (delay, F32x8::ZERO);
                }
                let delay_s = delay as f32 / rate_hz;
                let amplitude = std::array::from_fn(|b| {
                    let energy = amplitude_of_energy(wanted.energy_per_s[b] * mean_length_s);
                    let gain = share * energy * decay(delay_s, frame.decay_time_s[b]);
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

    /// Reads one source's send for a chunk.
    pub(crate) fn collect(&mut self, slot: usize, line: &DelayLine, moment: Moment) {
        let Moment { now, left, frames } = moment;
        let first = slot * LATE_SEGMENTS;
        let Some(sends) = self.sends.get(first..first + LATE_SEGMENTS) else {
            return;
        };
        let heard = |tap: &&Tap| !tap.is_silent(left) && !line.is_silent_from(now - tap.delay);
        let taps = sends.iter().flat_map(|send| &send.taps);
        let mut heard = taps.filter(heard).peekable();
        while let Some(tap) = heard.next() {
            // What the next one reads, while this one is added.
            if let Some(next) = heard.peek() {
                line.ahead(now - next.delay, frames).fetch();
            }
            let position = now - tap.delay;
            let growth = if left > 0 { tap.growth } else { F32x8::ZERO };
            let (lane, parts) = line.tiles(position, frames);
            let mut gains = SendGains {
                before: tap.gain - growth * F32x8::splat(left as f32),
                growth,
                place: TILE - lane,
            };
            for tiles in parts.into_iter().filter(|tiles| !tiles.is_empty()) {
                add_tiles(self.set, tiles, &gains, &mut self.input);
                gains.place += tiles.len() * TILE;
            }
        }
    }

    /// What the sends make of the chunk in one band.
    pub(crate) fn band(&self, band: usize, frames: usize) -> &[f32] {
        &self.input[band][TILE..TILE + frames]
    }

    /// Forgets the chunk.
    pub(crate) fn clear(&mut self) {
        self.input.as_flattened_mut().fill(0.0);
    }
}

/// Gains of a stretch of tiles and where it falls.
#[derive(Debug, Clone, Copy)]
struct SendGains {
    /// Before the chunk's first frame.
    before: F32x8,
    /// A frame.
    growth: F32x8,
    /// In every [`Row`].
    place: usize,
}

kernel! {
    /// Adds tiles at growing gains.
    fn add_tiles<L>(tiles: &[Tile], gains: &SendGains, input: &mut [Row; BANDS]) {
        for band in 0..BANDS {
            let before = L::splat(gains.before.0[band]);
            let growth = L::splat(gains.growth.0[band]);
            let row = input[band].get_mut(gains.place..).unwrap_or_default();
            // The chunk's first frame, at place TILE, has grown once. Whole numbers, so that steps are exact.
            let mut grown = L::from_array(LANE_INDICES).add(L::splat(gains.place as f32 - (TILE - 1) as f32));
            for (tile, sums) in tiles.iter().zip(row.as_chunks_mut::<TILE>().0) {
                let gain = grown.mul_add(growth, before);
                L::from_array(tile[place_of(band)]).mul_add(gain, L::load(sums)).store(sums);
                grown = grown.add(L::splat(TILE as f32));
            }
        }
    }
}
