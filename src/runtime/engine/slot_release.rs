//! When a slot may be reused: after the fade-out of its last source.
//!
//! Control side. Time is counted in mixed audio since the renderer applied the frame that removed the source, because a
//! device may stall while the app's clock runs.

use crate::runtime::engine::mixer::CROSS_FADE_S;
use crate::runtime::engine::release_tails::RELEASE_FRAMES;

/// Shortest release of a slot in seconds of audio; sufficient for blocks of up to 1,000 frames.
pub(crate) const MIN_RELEASE_S: f64 = 0.15;

/// Progress of app and renderer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PlaybackProgress {
    /// The app's current graphics frame.
    pub(crate) tick: u64,
    /// The graphics frame that the renderer applied last.
    pub(crate) applied_tick: u64,
    /// Seconds of audio mixed so far.
    pub(crate) time_s: f64,
}

/// Release state of a slot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum SlotRelease {
    /// Reusable.
    #[default]
    Free,
    /// Empty from this graphics frame on, which the renderer has not applied.
    RemovedAt(u64),
    /// The renderer applied the frame at this second of audio.
    FadingSince(f64),
}

impl SlotRelease {
    /// Updates the state; a slot becomes free `release_s` seconds of audio after the renderer applied the frame.
    pub(crate) fn advance(&mut self, progress: &PlaybackProgress, release_s: f64) {
        if let Self::RemovedAt(tick) = *self
            && progress.applied_tick >= tick
        {
            *self = Self::FadingSince(progress.time_s);
        }
        if let Self::FadingSince(since_s) = *self
            && progress.time_s - since_s >= release_s
        {
            *self = Self::Free;
        }
    }
}

/// Release time in seconds: two consecutive cross-fades in whole blocks, and a fade-out after them.
pub(crate) fn release_s(block_frames: usize, rate_hz: u32) -> f64 {
    let block = block_frames as f64;
    let rate_hz = f64::from(rate_hz);
    let fade = (f64::from(CROSS_FADE_S) * rate_hz / block).ceil() * block;
    let frames = 2.0 * fade + block + RELEASE_FRAMES as f64;
    MIN_RELEASE_S.max(frames / rate_hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_release_counts_audio_mixed_after_the_frame_is_applied() {
        let mut release = SlotRelease::RemovedAt(5);
        let mut progress = PlaybackProgress {
            tick: 5,
            applied_tick: 4,
            time_s: 1.0,
        };
        // The frame is not applied, however much audio is mixed.
        for _ in 0..10 {
            progress.time_s += 1.0;
            release.advance(&progress, 0.15);
        }
        assert_eq!(release, SlotRelease::RemovedAt(5));
        // A later frame counts as well. No audio is mixed, however many ticks pass.
        progress.applied_tick = 7;
        for tick in 7..100 {
            progress.tick = tick;
            release.advance(&progress, 0.15);
        }
        assert_eq!(release, SlotRelease::FadingSince(11.0));
        progress.time_s = 11.14;
        release.advance(&progress, 0.15);
        assert_ne!(release, SlotRelease::Free);
        progress.time_s = 11.15;
        release.advance(&progress, 0.15);
        assert_eq!(release, SlotRelease::Free);
    }

    #[test]
    fn long_blocks_need_longer_releases() {
        assert_eq!(release_s(256, 44_100), MIN_RELEASE_S);
        assert!(release_s(8192, 44_100) > 3.0 * 8192.0 / 44_100.0);
    }
}
