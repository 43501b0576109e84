//! Spreads the work of a graphics frame evenly over audio blocks.
//!
//! Audio side; arithmetic only. Each block does an equal part of the work that the last frame took; the frame becomes
//! audible when it is complete. Work is counted in units, not timed, and so independent of the machine. Little work is
//! done at once.

use crate::extrapolation::WorkBudget;

/// Work that a block always does: less than 0.1 ms of a desktop's core.
const AT_ONCE: u32 = 600;

/// Factor on the even part, for frames slightly larger than the last.
const SPARE: f64 = 1.1;

/// Greatest work of a block as a fraction of its period on a desktop's core. A larger frame (in a new scene, where
/// every path is new) needs more blocks and delays the next one.
const MAX_SHARE: f64 = 0.05;

/// A frame may use the rest of a block beside voices, between [`MIN_SHARE`] and [`MAX_SHARE`]. Fractions of the period on a
/// desktop's core: target of the whole block, fixed part, and one voice (`soak` on a Xeon of 2.6 GHz under load).
/// Beyond 730 voices frames are delayed: a soak with 760 voices renders 34 frames a second instead of 40, and its
/// slowest blocks are 5 % faster.
const FULL_SHARE: f64 = 0.20;
const SOURCES_SHARE: f64 = 0.04;
const VOICE_SHARE: f64 = 1.5e-4;
const MIN_SHARE: f64 = 0.015;

/// Seconds of a unit of work there.
const UNIT_S: f64 = 1e-7;

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
    /// Blocks over which a frame is spread.
    blocks: u32,
    /// Work of the frame in progress, and of the last one.
    frame_work: u32,
    last_frame_work: u32,
}

impl BlockPacing {
    /// For blocks of `block_s`; without `is_even` a frame is done in one block.
    pub(crate) fn new(block_s: f64, is_even: bool) -> Self {
        Self {
            block_s,
            is_even,
            blocks: 1,
            frame_work: 0,
            last_frame_work: 0,
        }
    }

    /// Begins a graphics frame; `tick_s` is the time between the app's frames.
    pub(crate) fn begin(&mut self, tick_s: f64) {
        self.blocks = whole_blocks(tick_s, self.block_s);
        self.frame_work = 0;
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
        let even = SPARE * share * f64::from(self.last_frame_work) / f64::from(self.blocks);
        let left = FULL_SHARE - SOURCES_SHARE - VOICE_SHARE * f64::from(voices);
        let most = share * left.clamp(MIN_SHARE, MAX_SHARE) * self.block_s / UNIT_S;
        WorkBudget::of((even.min(most) as u32).max(AT_ONCE))
    }

    /// Adds the work of a block.
    pub(crate) fn count(&mut self, work: &WorkBudget) {
        self.frame_work = self.frame_work.saturating_add(work.spent());
    }

    /// Ends the frame.
    pub(crate) fn end(&mut self) {
        self.last_frame_work = self.frame_work;
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
        let mut pace = BlockPacing::new(256.0 / 44_100.0, true);
        assert_eq!(blocks_for(&mut pace, 500), 1);
        // The work of a frame is known after the first one.
        blocks_for(&mut pace, 6_000);
        for _ in 0..10 {
            assert_eq!(blocks_for(&mut pace, 6_000), 3);
            assert_eq!(blocks_for(&mut pace, 6_200), 3);
        }
        let mut at_once = BlockPacing::new(256.0 / 44_100.0, false);
        assert_eq!(blocks_for(&mut at_once, 18_000), 1);
        let mut long_blocks = BlockPacing::new(1024.0 / 44_100.0, true);
        assert_eq!(blocks_for(&mut long_blocks, 18_000), 1);
    }

    #[test]
    fn a_large_frame_takes_more_blocks_once() {
        let block_s = 256.0 / 44_100.0;
        let mut pace = BlockPacing::new(block_s, true);
        // 5 % of 5.8 ms in tenths of a microsecond, and the piece that was begun.
        let bound = (0.05 * block_s / 1e-7) as u32 + 50;
        for work in [18_000, 18_000, 30_000] {
            let (blocks, most) = spread(&mut pace, work);
            assert!(most <= bound, "{most}");
            assert!(blocks >= work / bound, "{blocks}");
        }
        blocks_for(&mut pace, 6_000);
        assert_eq!(blocks_for(&mut pace, 6_000), 3);
    }

    #[test]
    fn voices_reduce_the_budget_of_a_frame_to_a_minimum() {
        let block_s = 256.0 / 44_100.0;
        let mut most = Vec::new();
        for voices in [0, 730, 850, 1_000, 10_000] {
            let mut pace = BlockPacing::new(block_s, true);
            spread_beside(&mut pace, 18_000, voices);
            most.push(spread_beside(&mut pace, 18_000, voices).1);
        }
        assert_eq!(most[0], most[1]);
        assert!(most[1] > most[2] && most[2] > most[3], "{most:?}");
        assert_eq!(most[3], most[4]);
        assert!(most[4] >= AT_ONCE, "{most:?}");
    }
}
