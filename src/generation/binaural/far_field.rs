//! Renders the late reverb as plane waves.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at construction only.
//!
//! The waves' directions are fixed in world coordinates: the late reverb does not rotate with the listener. A diffuse-field
//! equalised HRTF set has unit mean power over directions: each ear has the power of the waves. The first group of the set's
//! filters is enough for a sum over all directions.

use glam::{Quat, Vec3};

use crate::simd::{F32x8, LaneSet};

use crate::generation::binaural::ear_ramps;
use crate::generation::binaural::ear_ramps::{
    Arrival, EarPair, RampRate, SignalWindow, Weights, history_frames,
};
use crate::generation::binaural::filter_bank::{BATCH, Binaural};
use crate::generation::delay::interpolation::{Intervals, SLACK};
use crate::generation::ramp::{ChunkSpan, LinearRamp};
use crate::generation::reverb::mixing::LINES;
use crate::generation::reverb::wave_shares::wave_directions;
use crate::generation::{CHUNK, Hrtf};

/// Groups of the HRTF set's filters that the waves use.
const GROUPS: usize = 1;

/// Plane waves, fixed in world coordinates.
#[derive(Debug)]
pub(crate) struct FarField {
    history: usize,
    /// One signal per wave: its history, then the present chunk.
    signals: [Vec<f32>; LINES],
    delays: [[LinearRamp; 2]; LINES],
    directions: [Vec3; LINES],
    targets: Vec<F32x8>,
    growths: Vec<F32x8>,
    rate: RampRate,
    /// Whether an orientation has been set.
    has_orientation: bool,
    lookup: Vec<F32x8>,
    intervals: Box<Intervals>,
    ears: [EarPair; BATCH],
    set: LaneSet,
    /// Frames since the waves were last audible.
    quiet_frames: usize,
}

impl FarField {
    pub(crate) fn new(hrtf: &Hrtf) -> Self {
        let history = history_frames(hrtf);
        let width = 2 * GROUPS;
        Self {
            history,
            signals: std::array::from_fn(|_| vec![0.0; history + CHUNK + SLACK]),
            delays: [[LinearRamp::default(); 2]; LINES],
            directions: wave_directions(),
            targets: vec![F32x8::ZERO; LINES * width],
            growths: vec![F32x8::ZERO; LINES * width],
            rate: RampRate::Constant,
            has_orientation: false,
            lookup: vec![F32x8::ZERO; 2 * hrtf.groups()],
            intervals: Intervals::new(),
            ears: ear_ramps::ear_pairs(),
            set: LaneSet::best(),
            quiet_frames: history,
        }
    }

    /// Ramps to a listener orientation; the first one applies immediately.
    pub(crate) fn set_orientation(&mut self, hrtf: &Hrtf, to_head: Quat, left: u32, ramp: u32) {
        self.rate = RampRate::Constant;
        let width = 2 * GROUPS;
        for (line, direction) in self.directions.into_iter().enumerate() {
            let corners = hrtf.find(to_head * direction);
            let ears = hrtf.blend(&corners, GROUPS, &mut self.lookup);
            // The first groups of both ears, side by side.
            self.lookup
                .copy_within(hrtf.groups()..hrtf.groups() + GROUPS, GROUPS);
            let lookup = &self.lookup[..width];
            let mut weights = Weights {
                target: &mut self.targets[line * width..][..width],
                growth: &mut self.growths[line * width..][..width],
            };
            if self.has_orientation {
                let rate = weights.retarget(self.set, lookup, left, ramp);
                self.rate = self.rate.max(rate);
                for (delay, ear) in self.delays[line].iter_mut().zip(ears) {
                    delay.retarget(f64::from(ear), left, ramp);
                }
            } else {
                weights.rest_at(lookup);
                self.delays[line] = ears.map(|ear| LinearRamp::at_rest(f64::from(ear)));
            }
        }
        self.has_orientation = true;
    }

    /// Adds a chunk to the buses. `fill` writes the waves' signals and returns whether any is audible.
    pub(crate) fn render(
        &mut self,
        left: u32,
        frames: usize,
        binaural: &mut Binaural,
        mut fill: impl FnMut(&mut [Vec<f32>; LINES], usize) -> bool,
    ) {
        if fill(&mut self.signals, self.history) {
            self.quiet_frames = 0;
        } else if self.quiet_frames >= self.history {
            return;
        } else {
            for signal in &mut self.signals {
                signal[self.history..self.history + frames].fill(0.0);
            }
            self.quiet_frames += frames;
        }
        let width = 2 * GROUPS;
        // Time and position 0 are the chunk's first frame.
        let chunk = ChunkSpan {
            now: 0,
            left,
            frames,
        };
        for first in (0..LINES).step_by(BATCH) {
            for (line, ears) in (first..).zip(&mut self.ears) {
                let signal = &mut self.signals[line];
                let window = SignalWindow {
                    signal,
                    length: self.history + frames,
                    start: -(self.history as i64),
                };
                let delays = &self.delays[line];
                ear_ramps::read_ears(self.set, &window, chunk, delays, &mut self.intervals, ears);
                signal.copy_within(frames..frames + self.history, 0);
            }
            let arrivals = std::array::from_fn(|n| {
                let offset = (first + n) * width;
                Some(Arrival {
                    ears: &self.ears[n],
                    target: &self.targets[offset..][..width],
                    growth: &self.growths[offset..][..width],
                    rate: self.rate,
                })
            });
            ear_ramps::add(binaural, &arrivals, width / 2, chunk);
        }
    }
}
