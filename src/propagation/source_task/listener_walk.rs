//! How far the listener has walked among a source's candidates: which of them need no test. Own.
//!
//! A candidate that failed at some position has no path before the listener has walked a certain distance
//! (`image_source/miss_distance.rs`), while source and scene are the same. It is marked with the length of the whole walk then.

use glam::DVec3;

/// Marks a metre.
const MARKS_A_METRE: f64 = 100.0;

/// Length of a walk in metres after which another one begins. Marks of 16 bits reach farther.
const MAX_WALK_M: f64 = 600.0;

/// What a failure holds for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WalkKey {
    /// The source in local coordinates.
    pub(super) source: DVec3,
    pub(super) scene_state: u64,
    /// Distance in metres by which paths may miss their surfaces.
    pub(super) margin_m: f64,
}

/// The walk of the only listener since the key was another one.
#[derive(Debug, Default)]
pub(super) struct ListenerWalk {
    key: Option<WalkKey>,
    listener: DVec3,
    walked_m: f64,
    is_steady: bool,
}

impl ListenerWalk {
    /// Goes on to a position in local coordinates; without a key nothing is known of candidates. Returns whether earlier marks are
    /// void.
    pub(super) fn go_on(&mut self, key: Option<WalkKey>, listener: DVec3) -> bool {
        let walked_m = self.walked_m + self.listener.distance(listener);
        self.listener = listener;
        self.is_steady = key.is_some() && key == self.key && walked_m < MAX_WALK_M;
        self.walked_m = if self.is_steady { walked_m } else { 0.0 };
        self.key = key;
        !self.is_steady
    }

    /// Whether the update before had the same key: a candidate that fails is worth a mark.
    pub(super) fn is_steady(&self) -> bool {
        self.is_steady
    }

    /// The highest mark of candidates that may have a path here.
    pub(super) fn reached(&self) -> u16 {
        (self.walked_m * MARKS_A_METRE).ceil() as u16
    }

    /// Mark of a candidate that has no path on the next metres.
    pub(super) fn mark(&self, metres: f64) -> u16 {
        ((self.walked_m + metres) * MARKS_A_METRE).floor() as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_is_reached_after_its_distance_at_most() {
        let key = |margin_m| {
            Some(WalkKey {
                source: DVec3::ONE,
                scene_state: 3,
                margin_m,
            })
        };
        let mut walk = ListenerWalk::default();
        let at = |metres: f64| DVec3::new(metres, 0.0, 0.0);
        assert!(walk.go_on(key(0.1), at(5.0)) && !walk.is_steady());
        assert!(!walk.go_on(key(0.1), at(5.0)) && walk.is_steady());
        let mut to = 5.0;
        for (step_m, failed_m) in [(0.004, 0.3), (0.05, 1.0), (0.07, 0.0), (0.3, 40.0)] {
            let (mark, mut walked_m) = (walk.mark(failed_m), 0.0);
            while walk.reached() < mark {
                assert!(walked_m < failed_m);
                // To and fro counts.
                to = if to > 6.0 { to - step_m } else { to + step_m };
                walked_m += step_m;
                assert!(!walk.go_on(key(0.1), at(to)));
            }
            assert!(walked_m > failed_m - step_m - 2.0 / MARKS_A_METRE);
        }
        assert!(walk.mark(-1.0) <= walk.reached() && walk.mark(f64::NAN) == 0);
        assert!(
            walk.go_on(key(0.2), at(to)) && !walk.is_steady(),
            "another key"
        );
        assert!(!walk.go_on(key(0.2), at(to)));
        assert!(walk.go_on(None, at(to)) && walk.go_on(None, at(to)));
        assert!(walk.go_on(key(0.2), at(to)) && !walk.go_on(key(0.2), at(to)));
        assert!(
            walk.go_on(key(0.2), at(to + 700.0)),
            "a mark has no more bits"
        );
    }
}
