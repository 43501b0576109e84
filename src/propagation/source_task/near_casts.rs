//! How many rotations of a source that moves are recast in an update although their rays start near it.

use crate::propagation::rays::directions::ROTATIONS;

/// Rotations a second, as far as updates tell the time: those of 60 updates a second that cast one each, from the last update to the
/// end of this one's use. All are due when a source starts to walk, and what was cast at the position of rest is right there. A
/// walking source leaves twelve of its ray origins in a second.
const CASTS_A_SECOND: f64 = 120.0;

/// The times of a source's estimates.
#[derive(Debug)]
pub(super) struct NearCasts {
    /// Of the last estimate in seconds.
    last_s: Option<f64>,
    /// The last two intervals between estimates at different times: infinite if there was none.
    intervals_s: [f64; 2],
}

impl Default for NearCasts {
    fn default() -> Self {
        Self {
            last_s: None,
            intervals_s: [f64::INFINITY; 2],
        }
    }
}

impl NearCasts {
    /// Most such rotations in an update at this time, at least one.
    pub(super) fn most(&mut self, time_s: f64) -> usize {
        if self.last_s != Some(time_s) {
            let last = self.last_s.replace(time_s);
            let interval_s = last.map_or(f64::INFINITY, |last| time_s - last);
            self.intervals_s = [interval_s, self.intervals_s[0]];
        }
        // A short interval may precede a long one.
        let [last_s, before_s] = self.intervals_s;
        let count = (CASTS_A_SECOND * last_s.max(before_s)).ceil() as usize;
        count.clamp(1, ROTATIONS as usize)
    }
}
