//! Finds the graphics frame that an update describes.
//!
//! An update carries the listener position that it was computed for. It describes the frame in which the listener was
//! nearest to that position: an update of the past is dated back, and an update for a predicted pose is current where the
//! prediction came true.

use glam::Vec3;

/// Graphics frames of history: more than any update is late.
const HISTORY_FRAMES: usize = 64;

/// Distance in metres within which two positions are the same, besides half of the last step.
const SAME_POSITION_M: f32 = 1e-3;

/// Listener positions of the last graphics frames, the newest first.
#[derive(Debug)]
pub struct ListenerHistory {
    positions: [Vec3; HISTORY_FRAMES],
    count: usize,
}

/// When an update's visibility holds.
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
    /// Adds the position of a new graphics frame.
    pub fn push(&mut self, position: Vec3) {
        self.positions.copy_within(..HISTORY_FRAMES - 1, 1);
        self.positions[0] = position;
        self.count = (self.count + 1).min(HISTORY_FRAMES);
    }

    /// Dates an update computed for a listener at `position`; `frame` is the present graphics frame.
    pub fn date(&self, position: Vec3, frame: u64) -> UpdateEpoch {
        let known = &self.positions[..self.count];
        let mut nearest = (0, f32::INFINITY);
        for (age, at) in known.iter().enumerate() {
            let distance_m = at.distance(position);
            if distance_m < nearest.1 {
                nearest = (age, distance_m);
            }
        }
        let last_step_m = known.get(1).map_or(0.0, |before| before.distance(known[0]));
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
    fn an_update_of_the_past_is_dated_back() {
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
    fn a_listener_at_rest_makes_every_update_new() {
        let mut history = ListenerHistory::default();
        for _ in 0..100 {
            history.push(Vec3::ONE);
        }
        let epoch = history.date(Vec3::ONE, 99);
        assert_eq!((epoch.frame, epoch.is_reached), (99, true));
    }
}
