//! Brings the late reverb's lines to the ears as eight far arrivals.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at birth only.
//!
//! The lines arrive from the corners of a cube that stands still in the world, so the tail does not turn with the head.
//! A diffuse-field equalised head-related set has unit mean power over directions, so the power at an ear is that of
//! the lines.

use glam::{Quat, Vec3};

use crate::simd::F32x8;

use super::arrival::{self, Glide, Ready, Weights};
use super::binaural::Binaural;
use super::late_reverb::LINES;
use super::voice_set::tail_frames;
use super::{CHUNK, Hrtf};

/// Eight arrivals at rest in the world.
#[derive(Debug)]
pub(super) struct FarField {
    tail: usize,
    /// One signal a line: its last stretch, then the present chunk.
    signals: [Vec<f32>; LINES],
    delays: [[Glide; 2]; LINES],
    targets: Vec<F32x8>,
    growths: Vec<F32x8>,
    moving: bool,
    /// Whether an orientation has ever been set.
    placed: bool,
    looked_up: Vec<F32x8>,
    ears: [[Vec<f32>; 2]; 2],
    /// Frames since the lines last sounded.
    quiet_frames: usize,
}

impl FarField {
    pub(super) fn new(hrtf: &Hrtf) -> Self {
        let tail = tail_frames(hrtf);
        let width = 2 * hrtf.groups();
        Self {
            tail,
            signals: std::array::from_fn(|_| vec![0.0; tail + CHUNK]),
            delays: Default::default(),
            targets: vec![F32x8::ZERO; LINES * width],
            growths: vec![F32x8::ZERO; LINES * width],
            moving: false,
            placed: false,
            looked_up: vec![F32x8::ZERO; width],
            ears: std::array::from_fn(|_| std::array::from_fn(|_| vec![0.0; CHUNK])),
            quiet_frames: tail,
        }
    }

    /// Turns the head; the first orientation is taken at once.
    pub(super) fn set_orientation(&mut self, hrtf: &Hrtf, to_head: Quat, left: u32, ramp: u32) {
        self.moving = false;
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
                self.moving |= weights.retarget(&self.looked_up, left, ramp);
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
    pub(super) fn render(
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
        for pair in 0..LINES / 2 {
            for (half, ears) in self.ears.iter_mut().enumerate() {
                let line = 2 * pair + half;
                let signal = &mut self.signals[line];
                let [l, r] = ears;
                // Position 0 is the chunk's first frame, as is time 0.
                arrival::read_ears(
                    &signal[..self.tail + frames],
                    -(self.tail as i64),
                    0,
                    &self.delays[line],
                    left,
                    [&mut l[..frames], &mut r[..frames]],
                );
                signal.copy_within(frames..frames + self.tail, 0);
            }
            let ready = |half: usize| Ready {
                ears: [0, 1].map(|ear| &self.ears[half][ear][..frames]),
                target: &self.targets[(2 * pair + half) * width..][..width],
                growth: &self.growths[(2 * pair + half) * width..][..width],
                moving: self.moving,
                groups: width / 2,
            };
            arrival::add(binaural, &ready(0), Some(&ready(1)), left);
        }
    }
}
