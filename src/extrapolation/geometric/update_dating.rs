//! Where the listener has been, to find out how old an update is.
//!
//! An update tells for which pose it was computed. The graphics frame in which the listener was nearest to that pose is
//! the one it speaks of: an update of the past is dated back, one computed for a predicted pose is as good as new where
//! the prediction came true.

use glam::Vec3;

/// Graphics frames remembered: more than an update is ever late.
const FRAMES: usize = 64;

/// Distance in metres within which two poses are the same, besides half of the last step.
const SAME_PLACE_M: f32 = 1e-3;

/// Places of the last graphics frames.
#[derive(Debug)]
pub struct History {
    places: [Vec3; FRAMES],
    count: usize,
}

/// What an update's word on visibility is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Word {
    /// The graphics frame it speaks of.
    pub frame: u64,
    /// Whether the listener was there; else it is a hint.
    pub binding: bool,
}

impl Default for History {
    fn default() -> Self {
        Self {
            places: [Vec3::ZERO; FRAMES],
            count: 0,
        }
    }
}

impl History {
    /// Adds the place of a new graphics frame.
    pub fn push(&mut self, place: Vec3) {
        self.places.copy_within(..FRAMES - 1, 1);
        self.places[0] = place;
        self.count = (self.count + 1).min(FRAMES);
    }

    /// Dates an update computed for a listener at `place`; `frame` is the present graphics frame's number.
    pub fn date(&self, place: Vec3, frame: u64) -> Word {
        let known = &self.places[..self.count];
        let mut nearest = (0, f32::INFINITY);
        for (age, at) in known.iter().enumerate() {
            let distance_m = at.distance(place);
            if distance_m < nearest.1 {
                nearest = (age, distance_m);
            }
        }
        let last_step_m = known.get(1).map_or(0.0, |before| before.distance(known[0]));
        Word {
            frame: frame.saturating_sub(nearest.0 as u64),
            binding: nearest.1 <= SAME_PLACE_M + 0.5 * last_step_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_update_of_the_past_is_dated_back() {
        let mut history = History::default();
        for frame in 0..10 {
            history.push(Vec3::X * frame as f32 * 0.02);
        }
        let word = history.date(Vec3::X * 0.08, 9);
        assert_eq!((word.frame, word.binding), (4, true));
        let ahead = history.date(Vec3::X * 0.5, 9);
        assert_eq!((ahead.frame, ahead.binding), (9, false));
    }

    #[test]
    fn a_listener_at_rest_makes_every_update_new() {
        let mut history = History::default();
        for _ in 0..100 {
            history.push(Vec3::ONE);
        }
        let word = history.date(Vec3::ONE, 99);
        assert_eq!((word.frame, word.binding), (99, true));
    }
}
