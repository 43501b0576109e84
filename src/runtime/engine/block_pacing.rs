//! How much of a graphics frame's work the sound thread does in each block.
//!
//! Audio side; arithmetic. A block that comes right after a graphics frame would have all of it to do and the next ones
//! nothing; so each does its share of what the last frame took, and the frame is heard when it is done, before the next
//! one comes or, where that is too much for a block, as soon as it is done. Work is counted, not timed: what is even here
//! is even on any machine. What takes a fraction of a block anyway is done at once.

use crate::extrapolation::WorkBudget;

/// Work that is done at once, however long a graphics frame is: less than a tenth of a millisecond of a desktop's core.
const AT_ONCE: u32 = 600;

/// Share of a frame's work beyond an even part of it, so that one that grows a little takes no block longer.
const SPARE: f64 = 1.1;

/// Most work in a block, as a share of its period on a desktop's core. Where a frame takes more (that of a scene that has
/// just come, in which every path is new), the next one waits for it: fewer frames are heard for a moment, each of them
/// whole, and no block is much longer than the others.
const MAX_SHARE: f64 = 0.05;

/// What voices leave of a block that is as full as blocks should be is what a frame's work may take, between [`MIN_SHARE`]
/// and [`MAX_SHARE`]: a thousand voices are a fifth of a block, and what is added to them is what makes the slowest blocks.
/// Shares of the period on a desktop's core: of the whole block, of what does not hang on voices, and of a voice (`soak` on a
/// Xeon of 2.6 GHz with other work beside it). Beyond 730 voices frames take more blocks than the app's frames last: a soak
/// of 760 in the mean hears 34 a second instead of 40, and its slowest blocks take a twentieth less.
const FULL_SHARE: f64 = 0.20;
const SOURCES_SHARE: f64 = 0.04;
const VOICE_SHARE: f64 = 1.5e-4;
const MIN_SHARE: f64 = 0.015;

/// What a unit of work takes there, in seconds.
const UNIT_S: f64 = 1e-7;

/// Blocks that a graphics frame lasts, one at least.
fn whole_blocks(frame_s: f64, block_s: f64) -> u32 {
    (frame_s / block_s).round().clamp(1.0, 64.0) as u32
}

/// Audio frames within which everything reaches the values of a graphics frame of this length: its own length in whole
/// blocks, because a block in which a ramp ends is rendered in two pieces, which takes longer.
pub fn ramp_frames(frame_s: f64, rate_hz: u32, block_frames: usize) -> u32 {
    let block_s = block_frames as f64 / f64::from(rate_hz);
    whole_blocks(frame_s, block_s).saturating_mul(block_frames as u32)
}

/// The share of a graphics frame that each block works out.
#[derive(Debug)]
pub(crate) struct BlockPacing {
    block_s: f64,
    is_even: bool,
    /// Blocks that a frame's work is spread over.
    blocks: u32,
    /// Of the frame under way, and of the last one.
    frame_work: u32,
    last_frame_work: u32,
}

impl BlockPacing {
    /// For blocks of this length; without `is_even` every frame is done at once.
    pub(crate) fn new(block_s: f64, is_even: bool) -> Self {
        Self {
            block_s,
            is_even,
            blocks: 1,
            frame_work: 0,
            last_frame_work: 0,
        }
    }

    /// A graphics frame begins; the app's come this far apart.
    pub(crate) fn begin(&mut self, tick_s: f64) {
        self.blocks = whole_blocks(tick_s, self.block_s);
        self.frame_work = 0;
    }

    /// Whether blocks are to take alike time.
    pub(crate) fn is_even(&self) -> bool {
        self.is_even
    }

    /// What a block with so many voices, those that wait for their start among them, may do, or a piece of one that takes this
    /// share of it.
    pub(crate) fn work_budget(&self, share: f64, voices: u32) -> WorkBudget {
        if !self.is_even || self.blocks == 1 {
            return WorkBudget::boundless();
        }
        let even = SPARE * share * f64::from(self.last_frame_work) / f64::from(self.blocks);
        let left = FULL_SHARE - SOURCES_SHARE - VOICE_SHARE * f64::from(voices);
        let most = share * left.clamp(MIN_SHARE, MAX_SHARE) * self.block_s / UNIT_S;
        WorkBudget::of((even.min(most) as u32).max(AT_ONCE))
    }

    /// Counts what a block did.
    pub(crate) fn count(&mut self, effort: &WorkBudget) {
        self.frame_work = self.frame_work.saturating_add(effort.spent());
    }

    /// The frame is done.
    pub(crate) fn end(&mut self) {
        self.last_frame_work = self.frame_work;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks that a frame of so much work takes, in pieces of 50.
    fn blocks_for(pace: &mut BlockPacing, work: u32) -> u32 {
        spread(pace, work).0
    }

    /// The same, and the most work of a block.
    fn spread(pace: &mut BlockPacing, work: u32) -> (u32, u32) {
        spread_beside(pace, work, 0)
    }

    /// The same beside so many voices.
    fn spread_beside(pace: &mut BlockPacing, work: u32, voices: u32) -> (u32, u32) {
        pace.begin(1.0 / 60.0);
        let (mut left, mut blocks, mut most) = (work, 0, 0);
        while left > 0 {
            let mut effort = pace.work_budget(1.0, voices);
            while left > 0 && !effort.is_spent() {
                effort.spend(50);
                left = left.saturating_sub(50);
            }
            pace.count(&effort);
            most = most.max(effort.spent());
            blocks += 1;
        }
        pace.end();
        (blocks, most)
    }

    #[test]
    fn much_work_is_spread_and_little_is_not() {
        let mut pace = BlockPacing::new(256.0 / 44_100.0, true);
        assert_eq!(blocks_for(&mut pace, 500), 1);
        // What a frame takes is known after the first of its kind.
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
    fn what_is_too_much_for_a_frames_blocks_takes_more_of_them_and_then_no_more() {
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
    fn voices_leave_a_frame_less_of_a_block_but_never_nothing() {
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
