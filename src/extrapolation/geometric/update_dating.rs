//! Determines the graphics frame that an update describes.
//!
//! An update contains the listener position of its computation. It describes the frame in which the listener was nearest to
//! that position: an update for a past position is dated back, and an update for a predicted position is current if the
//! prediction was correct.

use glam::Vec3;

/// Graphics frames of history: more than the latency of any update.
const HISTORY_FRAMES: usize = 64;

/// Distance in metres within which two positions are the same, besides half of the last step.
const SAME_POSITION_M: f32 = 1e-3;

/// Listener positions of the last graphics frames, the newest first.
#[derive(Debug)]
pub struct ListenerHistory {
    positions: [Vec3; HISTORY_FRAMES],
    count: usize,
}

/// The time for which an update's visibility is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct UpdateEpoch {
    /// The graphics frame that it describes.
    pub frame: u64,
    /// Whether the listener was at the update's position; otherwise its visibility is a hint.
    pub is_reached: bool,
}

impl Default for ListenerHistory {
    fn default() -> Self {
        Self {
            positions: [Vec3::ZERO; HISTORY_FRAMES],
            count: 0,
        }
    }
}

impl ListenerHistory {
    /// Adds the listener position of a new graphics frame, in metres. Real-time.
    pub fn push(&mut self, position: Vec3) {
        self.positions.copy_within(..HISTORY_FRAMES - 1, 1);
        self.positions[0] = position;
        self.count = (self.count + 1).min(HISTORY_FRAMES);
    }

    /// The newest position.
    pub(crate) fn last(&self) -> Option<Vec3> {
        self.positions[..self.count].first().copied()
    }

    /// Dates an update computed for a listener at `position`; `frame` is the present graphics frame. Real-time.
    pub fn date(&self, position: Vec3, frame: u64) -> UpdateEpoch {
        let positions = &self.positions[..self.count];
        let mut nearest = (0, f32::INFINITY);
        for (age, at) in positions.iter().enumerate() {
            let distance_m = at.distance(position);
            if distance_m < nearest.1 {
                nearest = (age, distance_m);
            }
        }
        let last_step_m = positions
            .get(1)
            .map_or(0.0, |before| before.distance(positions[0]));
        UpdateEpoch {
            frame: frame.saturating_sub(nearest.0 as u64),
            is_reached: nearest.1 <= SAME_POSITION_M + 0.5 * last_step_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_update_for_a_past_position_is_dated_back() {
        let mut history = ListenerHistory::default();
        for frame in 0..10 {
            history.push(Vec3::X * frame as f32 * 0.02);
        }
        let epoch = history.date(Vec3::X * 0.08, 9);
        assert_eq!((epoch.frame, epoch.is_reached), (4, true));
        let ahead = history.date(Vec3::X * 0.5, 9);
        assert_eq!((ahead.frame, ahead.is_reached), (9, false));
    }

    #[test]
    fn every_update_is_current_for_a_static_listener() {
        let mut history = ListenerHistory::default();
        for _ in 0..100 {
            history.push(Vec3::ONE);
        }
        let epoch = history.date(Vec3::ONE, 99);
        assert_eq!((epoch.frame, epoch.is_reached), (99, true));
    }
}
