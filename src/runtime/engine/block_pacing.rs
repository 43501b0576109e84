//! Spreads the work of a graphics frame evenly over audio blocks.
//!
//! Audio side; arithmetic only. Each block does an equal part of the work that the last frame took; the frame becomes
//! audible when it is complete. Work is counted in units, not timed, and so independent of the machine. Little work is
//! done at once.

use crate::extrapolation::{FrameEffort, WorkBudget};

/// Work that a block may always do for each listener: 0.16 ms of a desktop's core. A few sources make no block long, but a late frame
/// keeps those after it late for a tenth of a second.
const AT_ONCE: u32 = 2_000;

/// Graphics frames in which the peak of their work decays to a third: frames in which an update arrives do more than others,
/// and the peak lasts from one to the next. A peak that is higher above
/// the mean is one of a new scene and decays faster.
const PEAK_FRAMES: u32 = 512;
const OUTLIER_RATIO: f64 = 1.5;
const OUTLIER_FRAMES: u32 = 8;

/// Factor on the even part, for frames larger than the last ones.
const SPARE: f64 = 1.2;

/// Greatest work of a block as a fraction of its period on a desktop's core. A larger frame (in a new scene, where
/// every path is new) needs more blocks and delays the next one.
const MAX_SHARE: f64 = 0.12;

/// A frame may use the rest of a block beside voices, between [`MIN_SHARE`] and [`MAX_SHARE`]. Fractions of the period on a
/// desktop's core: target of the whole block, fixed part, and one voice (`soak` on a Xeon of 2.6 GHz under load).
/// Beyond 660 voices frames are delayed. All but the fixed part hold for each listener, up to [`MOST_SHARE`] for all.
const FULL_SHARE: f64 = 0.26;
const SOURCES_SHARE: f64 = 0.04;
const VOICE_SHARE: f64 = 1.5e-4;
const MIN_SHARE: f64 = 0.015;

/// Greatest target of the whole block, whatever the number of listeners.
const MOST_SHARE: f64 = 0.6;

/// Share of a core that graphics frames may take: with more work they make less effort. A frame that comes late costs more
/// fidelity.
const FRAMES_SHARE: f64 = 0.08;

/// Work of a frame with the next greater effort, relative to the present, and least graphics frames before such a step.
const STEP_RATIO: f64 = 1.08;
const STEP_FRAMES: u32 = 64;

/// Least graphics frames between a step and the next to less work.
const SETTLING_FRAMES: u32 = 8;

/// Weight of a new frame in the mean work.
const MEAN_WEIGHT: f64 = 1.0 / 16.0;

/// Seconds of a unit of work on a fast desktop core: 600 instructions at 8.5 a nanosecond, as an EPYC of 3.66 GHz (Zen 4) computes
/// direct sound and updates, and an eighth more.
const UNIT_S: f64 = 8e-8;

/// Length of a graphics frame in blocks, at least 1.
fn whole_blocks(frame_s: f64, block_s: f64) -> u32 {
    (frame_s / block_s).round().clamp(1.0, 64.0) as u32
}

/// Ramp length in audio frames for a graphics frame: whole blocks, because a block in which a ramp ends is rendered in
/// two parts.
pub fn ramp_frames(frame_s: f64, rate_hz: u32, block_frames: usize) -> u32 {
    let block_s = block_frames as f64 / f64::from(rate_hz);
    whole_blocks(frame_s, block_s).saturating_mul(block_frames as u32)
}

/// Work of a graphics frame per block.
#[derive(Debug)]
pub(crate) struct BlockPacing {
    block_s: f64,
    is_even: bool,
    listeners: u32,
    /// Blocks over which a frame is spread, and those begun.
    blocks: u32,
    block: u32,
    /// Work of the frame in progress, and the decaying peak of the last ones.
    frame_work: u32,
    peak_work: u32,
    /// Frames so far, mean work of a frame, and its limit.
    frames: u32,
    mean_work: f64,
    frame_limit: f64,
    /// Steps below the whole effort.
    effort_steps: u32,
    frames_since_step: u32,
}

impl BlockPacing {
    /// For blocks of `block_s` and so many listeners, with whom a frame is as soon complete as with one; without `is_even` a frame
    /// is done in one block.
    pub(crate) fn new(block_s: f64, is_even: bool, listeners: usize) -> Self {
        Self {
            block_s,
            is_even,
            listeners: listeners as u32,
            blocks: 1,
            block: 0,
            frame_work: 0,
            peak_work: 0,
            frames: 0,
            mean_work: 0.0,
            frame_limit: f64::INFINITY,
            effort_steps: 0,
            frames_since_step: 0,
        }
    }

    /// Begins a graphics frame; `tick_s` is the time between the app's frames.
    pub(crate) fn begin(&mut self, tick_s: f64) {
        // Rounded down: the next frame begins after the last of these.
        self.blocks = (tick_s / self.block_s).clamp(1.0, 64.0) as u32;
        (self.block, self.frame_work) = (0, 0);
        if self.is_even {
            self.frame_limit = FRAMES_SHARE * tick_s / UNIT_S;
        }
    }

    /// The effort of the next graphics frame.
    pub(crate) fn effort(&self) -> FrameEffort {
        FrameEffort::reduced(self.effort_steps)
    }

    /// Whether this block may commit the frame. Every frame is committed in the same block of its own, the last: at uneven
    /// times, motion would be uneven. Beyond the last one, a frame is committed as soon as it is complete.
    pub(crate) fn may_commit(&self) -> bool {
        !self.is_even || self.block + 1 >= self.blocks
    }

    /// Whether the frame has to be prepared in this block, to be committed in the next.
    pub(crate) fn must_prepare(&self) -> bool {
        self.block + 2 >= self.blocks
    }

    /// Whether frames are spread over blocks.
    pub(crate) fn is_even(&self) -> bool {
        self.is_even
    }

    /// Work budget of a block, or of a fraction `share` of one, with so many voices including waiting ones.
    pub(crate) fn work_budget(&self, share: f64, voices: u32) -> WorkBudget {
        if !self.is_even || self.blocks == 1 {
            return WorkBudget::boundless();
        }
        let even = SPARE * share * f64::from(self.peak_work) / f64::from(self.blocks);
        let listeners = f64::from(self.listeners);
        let full = (FULL_SHARE * listeners).min(MOST_SHARE);
        let left = full - SOURCES_SHARE - VOICE_SHARE * f64::from(voices);
        let left = left.clamp(MIN_SHARE * listeners, MAX_SHARE * listeners);
        let most = share * left * self.block_s / UNIT_S;
        WorkBudget::of((even.min(most) as u32).max(AT_ONCE * self.listeners))
    }

    /// Adds the work of a block.
    pub(crate) fn count(&mut self, work: &WorkBudget) {
        self.frame_work = self.frame_work.saturating_add(work.spent());
        self.block = self.block.saturating_add(1);
    }

    /// Ends the frame.
    pub(crate) fn end(&mut self) {
        let is_outlier = f64::from(self.peak_work) > OUTLIER_RATIO * self.mean_work;
        let frames = if is_outlier {
            OUTLIER_FRAMES
        } else {
            PEAK_FRAMES
        };
        let decayed = self.peak_work - self.peak_work / frames;
        self.peak_work = self.frame_work.max(decayed);
        self.frames = self.frames.saturating_add(1);
        let weight = MEAN_WEIGHT.max(1.0 / f64::from(self.frames));
        self.mean_work += weight * (f64::from(self.frame_work) - self.mean_work);
        self.frames_since_step = self.frames_since_step.saturating_add(1);
        let may_rise = self.effort_steps > 0 && self.frames_since_step > STEP_FRAMES;
        let may_fall = self.frames_since_step >= SETTLING_FRAMES;
        let is_above = self.mean_work > self.frame_limit;
        if may_fall && is_above && self.effort_steps < FrameEffort::MOST_STEPS {
            self.effort_steps += 1;
            self.mean_work /= STEP_RATIO;
            self.frames_since_step = 0;
        } else if may_rise && STEP_RATIO * self.mean_work < self.frame_limit {
            self.effort_steps -= 1;
            self.mean_work *= STEP_RATIO;
            self.frames_since_step = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks for a frame of `work`, done in pieces of 50.
    fn blocks_for(pace: &mut BlockPacing, work: u32) -> u32 {
        spread(pace, work).0
    }

    /// The same, and the most work of a block.
    fn spread(pace: &mut BlockPacing, work: u32) -> (u32, u32) {
        spread_beside(pace, work, 0)
    }

    /// The same with voices.
    fn spread_beside(pace: &mut BlockPacing, work: u32, voices: u32) -> (u32, u32) {
        pace.begin(1.0 / 60.0);
        let (mut left, mut blocks, mut most) = (work, 0, 0);
        while left > 0 {
            let mut work = pace.work_budget(1.0, voices);
            while left > 0 && !work.is_spent() {
                work.spend(50);
                left = left.saturating_sub(50);
            }
            pace.count(&work);
            most = most.max(work.spent());
            blocks += 1;
        }
        pace.end();
        (blocks, most)
    }

    #[test]
    fn much_work_is_spread_and_little_is_not() {
        let mut pace = BlockPacing::new(256.0 / 44_100.0, true, 1);
        assert_eq!(blocks_for(&mut pace, 500), 1);
        // The work of a frame is known after the first one. A frame has two whole blocks.
        blocks_for(&mut pace, 6_000);
        for _ in 0..10 {
            assert_eq!(blocks_for(&mut pace, 6_000), 2);
            assert_eq!(blocks_for(&mut pace, 6_200), 2);
        }
        let mut at_once = BlockPacing::new(256.0 / 44_100.0, false, 1);
        assert_eq!(blocks_for(&mut at_once, 18_000), 1);
        let mut long_blocks = BlockPacing::new(1024.0 / 44_100.0, true, 1);
        assert_eq!(blocks_for(&mut long_blocks, 18_000), 1);
    }

    #[test]
    fn a_large_frame_takes_more_blocks_once() {
        let block_s = 256.0 / 44_100.0;
        let mut pace = BlockPacing::new(block_s, true, 1);
        // In units, and the piece that was begun.
        let bound = (MAX_SHARE * block_s / UNIT_S) as u32 + 50;
        for work in [18_000, 18_000, 30_000] {
            let (blocks, most) = spread(&mut pace, work);
            assert!(most <= bound, "{most}");
            assert!(blocks >= work / bound, "{blocks}");
        }
        // Even again some frames later.
        for _ in 0..32 {
            blocks_for(&mut pace, 6_000);
        }
        assert_eq!(blocks_for(&mut pace, 6_000), 2);
    }

    #[test]
    fn frames_of_uneven_work_are_committed_in_the_same_block() {
        let mut pace = BlockPacing::new(256.0 / 44_100.0, true, 1);
        let mut commits = Vec::new();
        for frame in 0..60 {
            let mut left = if frame % 13 == 0 { 5_000 } else { 3_800 };
            pace.begin(1.0 / 74.6);
            for block in 0.. {
                let mut work = pace.work_budget(1.0, 300);
                while left > 0 && !work.is_spent() {
                    work.spend(50);
                    left -= 50;
                }
                let is_committed = left == 0 && pace.may_commit();
                pace.count(&work);
                if is_committed {
                    commits.push(block);
                    break;
                }
            }
            pace.end();
        }
        assert!(commits[2..].iter().all(|block| *block == 1), "{commits:?}");
    }

    #[test]
    fn frames_that_take_too_much_make_less_effort() {
        let mut pace = BlockPacing::new(256.0 / 44_100.0, true, 1);
        let mut run = |work: u32| {
            for _ in 0..600 {
                let work = f64::from(work) * 0.92_f64.powi(pace.effort_steps as i32);
                spread(&mut pace, work as u32);
            }
            pace.effort_steps
        };
        // 8 % of 16.7 ms are 16,667 units.
        assert_eq!(run(15_000), 0);
        // 20,000 times 0.92² are too many.
        assert_eq!(run(20_000), 3);
        assert_eq!(run(200_000), FrameEffort::MOST_STEPS);
        assert_eq!(run(4_000), 0);
    }

    /// Two listeners have twice the work and twice the voices: their frames take as many blocks.
    #[test]
    fn frames_of_two_listeners_are_as_soon_complete() {
        let block_s = 256.0 / 44_100.0;
        for (work, voices) in [(500, 0), (6_000, 100), (12_000, 600), (18_000, 1_000)] {
            let [alone, both] = [1, 2].map(|listeners| {
                let mut pace = BlockPacing::new(block_s, true, listeners as usize);
                spread_beside(&mut pace, listeners * work, listeners * voices);
                spread_beside(&mut pace, listeners * work, listeners * voices).0
            });
            assert!(both <= alone, "{work}: {both} blocks, alone {alone}");
        }
    }

    #[test]
    fn voices_reduce_the_budget_of_a_frame_to_a_minimum() {
        let block_s = 256.0 / 44_100.0;
        let mut most = Vec::new();
        for voices in [0, 660, 900, 1_400, 10_000] {
            let mut pace = BlockPacing::new(block_s, true, 1);
            spread_beside(&mut pace, 18_000, voices);
            most.push(spread_beside(&mut pace, 18_000, voices).1);
        }
        assert_eq!(most[0], most[1]);
        assert!(most[1] > most[2] && most[2] > most[3], "{most:?}");
        assert_eq!(most[3], most[4]);
        assert!(most[4] >= AT_ONCE, "{most:?}");
    }
}
