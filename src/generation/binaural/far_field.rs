//! Renders the late reverb as plane waves.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at construction only.
//!
//! The waves' directions are fixed in world coordinates: the late reverb does not rotate with the listener. A diffuse-field
//! equalised HRTF set has unit mean power over directions: each ear has the power of the waves. The coarse groups of the
//! table are enough for a sum over all directions: the first group of an HRTF set, all channels of other layouts.

use glam::{Quat, Vec3};

use crate::simd::{F32x8, LaneSet};

use crate::generation::CHUNK;
use crate::generation::binaural::ear_ramps;
use crate::generation::binaural::ear_ramps::{
    Arrival, EarPair, RampRate, SignalWindow, Weights, history_frames,
};
use crate::generation::binaural::filter_bank::{BATCH, OutputBuses};
use crate::generation::delay::interpolation::{Intervals, SLACK};
use crate::generation::panning::direction_table::DirectionTable;
use crate::generation::ramp::{ChunkSpan, LinearRamp};
use crate::generation::reverb::mixing::{LINES, Rows};
use crate::generation::reverb::wave_shares::wave_directions;

/// Plane waves, fixed in world coordinates.
#[derive(Debug)]
pub(crate) struct FarField {
    /// Readings of a wave, and the groups of each.
    ears: usize,
    groups: usize,
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
    ear_signals: [EarPair; BATCH],
    set: LaneSet,
    /// Frames since the waves were last audible.
    quiet_frames: usize,
    /// Gain of all waves, its target, its growth per frame and the frames left until the target.
    gain: f32,
    target_gain: f32,
    gain_growth: f32,
    gain_left: usize,
}

impl FarField {
    pub(crate) fn new(table: &DirectionTable) -> Self {
        let history = history_frames(table);
        let (ears, groups) = (table.ears(), table.coarse_groups());
        let width = ears * groups;
        Self {
            ears,
            groups,
            history,
            signals: std::array::from_fn(|_| vec![0.0; history + CHUNK + SLACK]),
            delays: [[LinearRamp::default(); 2]; LINES],
            directions: wave_directions(),
            targets: vec![F32x8::ZERO; LINES * width],
            growths: vec![F32x8::ZERO; LINES * width],
            rate: RampRate::Constant,
            has_orientation: false,
            lookup: vec![F32x8::ZERO; table.width()],
            intervals: Intervals::new(),
            ear_signals: ear_ramps::ear_pairs(0),
            set: LaneSet::best(),
            quiet_frames: history,
            gain: 1.0,
            target_gain: 1.0,
            gain_growth: 0.0,
            gain_left: 0,
        }
    }

    /// Ramps to a listener orientation; the first one applies immediately.
    pub(crate) fn set_orientation(
        &mut self,
        table: &DirectionTable,
        to_head: Quat,
        left: u32,
        ramp: u32,
    ) {
        self.rate = RampRate::Constant;
        let (groups, width) = (self.groups, self.ears * self.groups);
        for (line, direction) in self.directions.into_iter().enumerate() {
            let corners = table.find(to_head * direction);
            let ears = table.blend(&corners, groups, &mut self.lookup);
            // The first groups of both ears, side by side.
            for ear in 1..self.ears {
                let first = ear * table.groups();
                self.lookup.copy_within(first..first + groups, ear * groups);
            }
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
        if !self.has_orientation && self.gain == 0.0 {
            self.ramp_gain(1.0, ramp);
        }
        self.has_orientation = true;
    }

    /// Starts from silence: the waves rise within the ramp of the first orientation.
    pub(crate) fn start_silent(&mut self) {
        self.gain = 0.0;
    }

    /// Fades out at constant directions.
    pub(crate) fn fade(&mut self, left: u32, ramp: u32) {
        self.rate = RampRate::Constant;
        let mut all = Weights {
            target: &mut self.targets,
            growth: &mut self.growths,
        };
        all.stop(left);
        for delay in self.delays.iter_mut().flatten() {
            delay.stop(left);
        }
        self.ramp_gain(0.0, ramp);
    }

    fn ramp_gain(&mut self, target: f32, ramp: u32) {
        (self.target_gain, self.gain_left) = (target, ramp as usize);
        self.gain_growth = (target - self.gain) / ramp as f32;
    }

    /// Takes a chunk of the waves, scaled by the gain.
    fn take_waves(&mut self, waves: &Rows, frames: usize) {
        let (gain, growth, left) = (self.gain, self.gain_growth, self.gain_left);
        let is_steady = left == 0 && gain == 1.0;
        for (signal, wave) in self.signals.iter_mut().zip(waves) {
            let signal = &mut signal[self.history..self.history + frames];
            signal.copy_from_slice(&wave[..frames]);
            if !is_steady {
                for (number, sample) in (1..).zip(signal) {
                    *sample *= gain + growth * left.min(number) as f32;
                }
            }
        }
    }

    fn advance_gain(&mut self, frames: usize) {
        let passed = self.gain_left.min(frames);
        self.gain_left -= passed;
        self.gain = match self.gain_left {
            0 => self.target_gain,
            _ => self.gain + self.gain_growth * passed as f32,
        };
    }

    /// Adds a chunk of the waves to the buses; `None` is silence.
    pub(crate) fn render(
        &mut self,
        left: u32,
        frames: usize,
        buses: &mut OutputBuses,
        waves: Option<&Rows>,
    ) {
        if let Some(waves) = waves {
            self.take_waves(waves, frames);
            self.advance_gain(frames);
            self.quiet_frames = 0;
        } else if self.quiet_frames >= self.history {
            self.advance_gain(frames);
            return;
        } else {
            self.advance_gain(frames);
            for signal in &mut self.signals {
                signal[self.history..self.history + frames].fill(0.0);
            }
            self.quiet_frames += frames;
        }
        let width = self.ears * self.groups;
        // Time and position 0 are the chunk's first frame.
        let chunk = ChunkSpan {
            now: 0,
            left,
            frames,
        };
        for first in (0..LINES).step_by(BATCH) {
            for (line, ears) in (first..).zip(&mut self.ear_signals) {
                let signal = &mut self.signals[line];
                let window = SignalWindow {
                    signal,
                    length: self.history + frames,
                    start: -(self.history as i64),
                };
                let delays = &self.delays[line][..self.ears];
                ear_ramps::read_ears(self.set, &window, chunk, delays, &mut self.intervals, ears);
                signal.copy_within(frames..frames + self.history, 0);
            }
            let arrivals = std::array::from_fn(|n| {
                let offset = (first + n) * width;
                Some(Arrival {
                    ears: self.ear_signals[n].each_ref().map(Vec::as_slice),
                    target: &self.targets[offset..][..width],
                    growth: &self.growths[offset..][..width],
                    rate: self.rate,
                })
            });
            ear_ramps::add(buses, &arrivals, [self.groups; 2], chunk);
        }
    }
}
