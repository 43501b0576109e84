//! How long a slot is empty between two tenants: until the last one has been heard to its end.
//!
//! Control side. Counted in audio that was mixed since the renderer took the frame in which the tenant is gone: a device may
//! stop asking for a while, and the app's clock goes on.

use crate::runtime::engine::mixer::CROSS_FADE_S;
use crate::runtime::engine::release_tails::RELEASE_FRAMES;

/// Seconds of audio that a slot rests, with blocks of up to 1,000 frames.
pub(crate) const MIN_RELEASE_S: f64 = 0.15;

/// How far the app and the renderer are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PlaybackProgress {
    /// The app's graphics frame that goes out now.
    pub(crate) tick: u64,
    /// The newest one that the renderer uses.
    pub(crate) applied_tick: u64,
    /// Seconds of audio mixed so far.
    pub(crate) time_s: f64,
}

/// A slot's rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum SlotRelease {
    /// A tenant may come.
    #[default]
    Free,
    /// Nobody is there from this graphics frame on.
    RemovedAt(u64),
    /// The renderer knows, since this second of audio.
    FadingSince(f64),
}

impl SlotRelease {
    /// Begins with a graphics frame, goes on with each, and is over after so many seconds of audio.
    pub(crate) fn advance(&mut self, heard: &PlaybackProgress, release_s: f64) {
        if let Self::RemovedAt(tick) = *self
            && heard.applied_tick >= tick
        {
            *self = Self::FadingSince(heard.time_s);
        }
        if let Self::FadingSince(since_s) = *self
            && heard.time_s - since_s >= release_s
        {
            *self = Self::Free;
        }
    }
}

/// Seconds of a rest: longer than two cross-fades in whole blocks, of which the second waits for the first, and the end of a
/// sound after them.
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
    fn a_rest_lasts_as_long_as_audio_is_mixed_after_the_frame_is_in_use() {
        let mut rest = SlotRelease::RemovedAt(5);
        let mut heard = PlaybackProgress {
            tick: 5,
            applied_tick: 4,
            time_s: 1.0,
        };
        // The frame is not in use, however much is heard.
        for _ in 0..10 {
            heard.time_s += 1.0;
            rest.advance(&heard, 0.15);
        }
        assert_eq!(rest, SlotRelease::RemovedAt(5));
        // A later one is as good. Nothing is heard, however many go out.
        heard.applied_tick = 7;
        for tick in 7..100 {
            heard.tick = tick;
            rest.advance(&heard, 0.15);
        }
        assert_eq!(rest, SlotRelease::FadingSince(11.0));
        heard.time_s = 11.14;
        rest.advance(&heard, 0.15);
        assert_ne!(rest, SlotRelease::Free);
        heard.time_s = 11.15;
        rest.advance(&heard, 0.15);
        assert_eq!(rest, SlotRelease::Free);
    }

    #[test]
    fn long_blocks_take_longer_rests() {
        assert_eq!(release_s(256, 44_100), MIN_RELEASE_S);
        assert!(release_s(8192, 44_100) > 3.0 * 8192.0 / 44_100.0);
    }
}
