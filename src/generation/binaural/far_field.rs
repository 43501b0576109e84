//! Renders the late reverb's lines as eight plane waves.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at construction only.
//!
//! The lines arrive from the corners of a cube fixed in world coordinates: the late reverb does not rotate with the
//! listener. A diffuse-field equalised HRTF set has unit mean power over directions: each ear has the power of the lines.

use glam::{Quat, Vec3};

use crate::simd::{F32x8, LaneSet};

use crate::generation::binaural::ear_ramps;
use crate::generation::binaural::ear_ramps::{
    Arrival, EarPair, RampRate, SignalWindow, Weights, history_frames,
};
use crate::generation::binaural::filter_bank::{BATCH, Binaural};
use crate::generation::delay::interpolation::{Intervals, SLACK};
use crate::generation::ramp::{ChunkSpan, LinearRamp};
use crate::generation::reverb::late_reverb::LINES;
use crate::generation::{CHUNK, Hrtf};

/// Eight plane waves, fixed in world coordinates.
#[derive(Debug)]
pub(crate) struct FarField {
    history: usize,
    /// One signal per line: its history, then the present chunk.
    signals: [Vec<f32>; LINES],
    delays: [[LinearRamp; 2]; LINES],
    targets: Vec<F32x8>,
    growths: Vec<F32x8>,
    rate: RampRate,
    /// Whether an orientation has been set.
    has_orientation: bool,
    lookup: Vec<F32x8>,
    intervals: Box<Intervals>,
    ears: [EarPair; BATCH],
    set: LaneSet,
    /// Frames since the lines were last audible.
    quiet_frames: usize,
}

impl FarField {
    pub(crate) fn new(hrtf: &Hrtf) -> Self {
        let history = history_frames(hrtf);
        let width = 2 * hrtf.groups();
        Self {
            history,
            signals: std::array::from_fn(|_| vec![0.0; history + CHUNK + SLACK]),
            delays: Default::default(),
            targets: vec![F32x8::ZERO; LINES * width],
            growths: vec![F32x8::ZERO; LINES * width],
            rate: RampRate::Constant,
            has_orientation: false,
            lookup: vec![F32x8::ZERO; width],
            intervals: Intervals::new(),
            ears: ear_ramps::ear_pairs(),
            set: LaneSet::best(),
            quiet_frames: history,
        }
    }

    /// Ramps to a listener orientation; the first one applies immediately.
    pub(crate) fn set_orientation(&mut self, hrtf: &Hrtf, to_head: Quat, left: u32, ramp: u32) {
        self.rate = RampRate::Constant;
        let width = self.lookup.len();
        for line in 0..LINES {
            let sign = |bit: usize| if line & bit == 0 { 1.0 } else { -1.0 };
            let world = Vec3::new(sign(1), sign(2), sign(4));
            let ears = hrtf.look_up(to_head * world, &mut self.lookup);
            let mut weights = Weights {
                target: &mut self.targets[line * width..][..width],
                growth: &mut self.growths[line * width..][..width],
            };
            if self.has_orientation {
                let rate = weights.retarget(self.set, &self.lookup, left, ramp);
                self.rate = self.rate.max(rate);
                for (delay, ear) in self.delays[line].iter_mut().zip(ears) {
                    delay.retarget(f64::from(ear), left, ramp);
                }
            } else {
                weights.rest_at(&self.lookup);
                self.delays[line] = ears.map(|ear| LinearRamp::at_rest(f64::from(ear)));
            }
        }
        self.has_orientation = true;
    }

    /// Adds a chunk to the buses. `fill` writes the lines' signals and returns whether any is audible.
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
        let width = self.lookup.len();
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
