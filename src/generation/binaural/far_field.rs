//! Brings the late reverb's lines to the ears as eight far arrivals.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at birth only.
//!
//! The lines arrive from the corners of a cube that stands still in the world, so the tail does not turn with the head.
//! A diffuse-field equalised head-related set has unit mean power over directions, so the power at an ear is that of
//! the lines.

use glam::{Quat, Vec3};

use crate::simd::{F32x8, LaneSet};

use crate::generation::binaural::ear_ramps;
use crate::generation::binaural::ear_ramps::{
    EarPair, Glide, Moment, Motion, Ready, Stretch, Weights,
};
use crate::generation::binaural::filter_bank::{Binaural, TOGETHER};
use crate::generation::delay::interpolation::{Intervals, SLACK};
use crate::generation::reverb::late_reverb::LINES;
use crate::generation::voices::voice_set::tail_frames;
use crate::generation::{CHUNK, Hrtf};

/// Eight arrivals at rest in the world.
#[derive(Debug)]
pub(crate) struct FarField {
    tail: usize,
    /// One signal a line: its last stretch, then the present chunk.
    signals: [Vec<f32>; LINES],
    delays: [[Glide; 2]; LINES],
    targets: Vec<F32x8>,
    growths: Vec<F32x8>,
    motion: Motion,
    /// Whether an orientation has ever been set.
    placed: bool,
    looked_up: Vec<F32x8>,
    intervals: Box<Intervals>,
    ears: [EarPair; TOGETHER],
    set: LaneSet,
    /// Frames since the lines last sounded.
    quiet_frames: usize,
}

impl FarField {
    pub(crate) fn new(hrtf: &Hrtf) -> Self {
        let tail = tail_frames(hrtf);
        let width = 2 * hrtf.groups();
        Self {
            tail,
            signals: std::array::from_fn(|_| vec![0.0; tail + CHUNK + SLACK]),
            delays: Default::default(),
            targets: vec![F32x8::ZERO; LINES * width],
            growths: vec![F32x8::ZERO; LINES * width],
            motion: Motion::Resting,
            placed: false,
            looked_up: vec![F32x8::ZERO; width],
            intervals: Intervals::new(),
            ears: ear_ramps::ear_pairs(),
            set: LaneSet::best(),
            quiet_frames: tail,
        }
    }

    /// Turns the head; the first orientation is taken at once.
    pub(crate) fn set_orientation(&mut self, hrtf: &Hrtf, to_head: Quat, left: u32, ramp: u32) {
        self.motion = Motion::Resting;
        let width = self.looked_up.len();
        for line in 0..LINES {
            let sign = |bit: usize| if line & bit == 0 { 1.0 } else { -1.0 };
            let world = Vec3::new(sign(1), sign(2), sign(4));
            let ears = hrtf.look_up(to_head * world, &mut self.looked_up);
            let mut weights = Weights {
                target: &mut self.targets[line * width..][..width],
                growth: &mut self.growths[line * width..][..width],
            };
            if self.placed {
                let motion = weights.retarget(self.set, &self.looked_up, left, ramp);
                self.motion = self.motion.max(motion);
                for (delay, ear) in self.delays[line].iter_mut().zip(ears) {
                    delay.retarget(f64::from(ear), left, ramp);
                }
            } else {
                weights.rest_at(&self.looked_up);
                self.delays[line] = ears.map(|ear| Glide::at_rest(f64::from(ear)));
            }
        }
        self.placed = true;
    }

    /// Adds a chunk to the buses. `fill` writes the lines' signals and says whether they sound.
    pub(crate) fn render(
        &mut self,
        left: u32,
        frames: usize,
        binaural: &mut Binaural,
        mut fill: impl FnMut(&mut [Vec<f32>; LINES], usize) -> bool,
    ) {
        if fill(&mut self.signals, self.tail) {
            self.quiet_frames = 0;
        } else if self.quiet_frames >= self.tail {
            return;
        } else {
            for signal in &mut self.signals {
                signal[self.tail..self.tail + frames].fill(0.0);
            }
            self.quiet_frames += frames;
        }
        let width = self.looked_up.len();
        // Position 0 is the chunk's first frame, as is time 0.
        let moment = Moment {
            now: 0,
            left,
            frames,
        };
        for first in (0..LINES).step_by(TOGETHER) {
            for (line, ears) in (first..).zip(&mut self.ears) {
                let signal = &mut self.signals[line];
                let stretch = Stretch {
                    signal,
                    length: self.tail + frames,
                    start: -(self.tail as i64),
                };
                let delays = &self.delays[line];
                ear_ramps::read_ears(
                    self.set,
                    &stretch,
                    moment,
                    delays,
                    &mut self.intervals,
                    ears,
                );
                signal.copy_within(frames..frames + self.tail, 0);
            }
            let arrivals = std::array::from_fn(|n| {
                let place = (first + n) * width;
                Some(Ready {
                    ears: &self.ears[n],
                    target: &self.targets[place..][..width],
                    growth: &self.growths[place..][..width],
                    motion: self.motion,
                })
            });
            ear_ramps::add(binaural, &arrivals, width / 2, moment);
        }
    }
}
