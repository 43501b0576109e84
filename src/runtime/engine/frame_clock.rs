//! Mean time between rendered graphics frames: T_g of Eq. 1. Audio side; several ticks between two blocks count as one.

use std::time::Instant;

use super::settings::FrameTime;

/// Longer intervals, in seconds, are pauses and do not count.
const MAX_FRAME_S: f64 = 0.5;
/// Weight of a new frame in the exponential mean.
const FRAME_WEIGHT: f64 = 0.1;
/// Initial T_g in seconds.
const FIRST_FRAME_S: f64 = 1.0 / 60.0;

/// Mean time between graphics frames.
pub(super) struct FrameClock {
    frame_s: f64,
    /// Mean time between the app's frames.
    tick_s: f64,
    /// Time and number of the last frame taken.
    last: Option<(Instant, u64)>,
    is_fixed: bool,
}

impl FrameClock {
    pub(super) fn new(frame_time: FrameTime) -> Self {
        let (frame_s, is_fixed) = match frame_time {
            FrameTime::Fixed(frame_s) => (frame_s, true),
            FrameTime::Measured => (FIRST_FRAME_S, false),
        };
        Self {
            frame_s,
            tick_s: frame_s,
            last: None,
            is_fixed,
        }
    }

    /// Takes frame number `ticks` at a time; returns T_g in seconds.
    pub(super) fn take(&mut self, at: Instant, ticks: u64) -> f64 {
        if self.is_fixed {
            return self.frame_s;
        }
        if let Some((last, before)) = self.last.replace((at, ticks)) {
            let passed_s = at.saturating_duration_since(last).as_secs_f64();
            let passed = ticks.saturating_sub(before).max(1) as f64;
            if passed_s < MAX_FRAME_S {
                self.frame_s += FRAME_WEIGHT * (passed_s - self.frame_s);
                self.tick_s += FRAME_WEIGHT * (passed_s / passed - self.tick_s);
            }
        }
        self.frame_s
    }

    /// Mean time between the app's graphics frames in seconds.
    pub(super) fn tick_s(&self) -> f64 {
        self.tick_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::threads::clock::now;
    use std::time::Duration;

    #[test]
    fn the_mean_follows_frames_and_excludes_pauses() {
        let mut clock = FrameClock::new(FrameTime::Measured);
        let mut at = now();
        assert_eq!(clock.take(at, 1), FIRST_FRAME_S);
        for tick in 0..200 {
            at += Duration::from_millis(8);
            clock.take(at, 2 + tick);
        }
        at += Duration::from_secs(3);
        assert!((clock.take(at, 202) - 0.008).abs() < 1e-6);
        let mut fixed = FrameClock::new(FrameTime::Fixed(0.01));
        assert_eq!(fixed.take(at, 1), 0.01);
        assert_eq!(fixed.tick_s(), 0.01);
    }

    #[test]
    fn skipped_frames_count_in_the_tick_time() {
        let mut clock = FrameClock::new(FrameTime::Measured);
        let mut at = now();
        for tick in 0..200 {
            clock.take(at, 2 * tick);
            at += Duration::from_millis(32);
        }
        assert!((clock.take(at, 400) - 0.032).abs() < 1e-6);
        assert!((clock.tick_s() - 0.016).abs() < 1e-6);
    }
}
