//! When the next update will be in use, by the time that the last ones took.
//!
//! Arithmetic; control side. In real time this is not known beforehand: the update's own time and the pause after it are
//! estimated by a mean.

use crate::runtime::pipeline::pose_prediction::UseInterval;

/// Weight of a new update in the exponential mean.
const WEIGHT: f64 = 0.25;

/// Mean time of updates.
#[derive(Debug, Default)]
pub(crate) struct UpdateTiming {
    mean_s: Option<f64>,
}

impl UpdateTiming {
    /// Takes the time of an update into account.
    pub(crate) fn observe(&mut self, update_s: f64) {
        let mean_s = self.mean_s.unwrap_or(update_s);
        self.mean_s = Some(mean_s + WEIGHT * (update_s - mean_s));
    }

    /// When an update that begins now is in use; `None` before the first. Its poses are `age_s` old, finished updates wait
    /// `wait_s` for a graphics frame of `frame_s`, and the next update begins after `pause_s`.
    pub(crate) fn in_use(
        &self,
        [age_s, wait_s, frame_s, pause_s]: [f64; 4],
    ) -> Option<UseInterval> {
        let update_s = self.mean_s?;
        Some(UseInterval {
            arrival_s: age_s + update_s + wait_s,
            used_s: (update_s + pause_s - frame_s).max(0.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_update_is_used_until_the_next_one_arrives() {
        let mut timing = UpdateTiming::default();
        assert_eq!(timing.in_use([0.0; 4]), None);
        for _ in 0..40 {
            timing.observe(0.13);
        }
        let interval = timing.in_use([0.0, 0.0, 0.01, 0.0]).expect("measured");
        assert!((interval.arrival_s - 0.13).abs() < 1e-9);
        assert!((interval.used_s - 0.12).abs() < 1e-9);
        timing.observe(0.17);
        let later = timing.in_use([0.004, 0.005, 0.01, 0.1]).expect("measured");
        assert!((later.arrival_s - 0.149).abs() < 1e-9);
        assert!((later.used_s - 0.23).abs() < 1e-9);
    }
}
