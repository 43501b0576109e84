//! When the next update will be in use, by the time that the last ones took.
//!
//! Arithmetic; control side. In real time this is not known beforehand: the update's own time and the pause after it are
//! estimated by a mean.

use crate::extrapolation::PredictorKind;
use crate::runtime::pipeline::jumps::UpdateKind;
use crate::runtime::pipeline::pose_prediction::UseInterval;

/// Weight of a new update in the exponential mean.
const WEIGHT: f64 = 0.25;

/// Graphics frames from the poses of an update to its use on a virtual clock, if a whole update takes `whole` and this one a
/// share of its time. At least one: no update is free.
pub(crate) fn delay_frames(share: f64, whole: u64) -> u64 {
    ((share * whole as f64).ceil() as u64).max(1)
}

/// Mean time of updates of each kind.
#[derive(Debug, Default)]
pub(crate) struct UpdateTiming {
    mean_s: [Option<f64>; 6],
}

impl UpdateTiming {
    /// Takes the time of an update into account.
    pub(crate) fn observe(&mut self, kind: UpdateKind, update_s: f64) {
        let mean = &mut self.mean_s[kind as usize];
        let mean_s = mean.unwrap_or(update_s);
        *mean = Some(mean_s + WEIGHT * (update_s - mean_s));
    }

    /// When an update of a kind that begins now is in use; `None` before the first. Its poses are `age_s` old, finished
    /// updates wait `wait_s` for a graphics frame of `frame_s`, and the next update begins after `pause_s`.
    pub(crate) fn in_use(
        &self,
        (kind, predictor, sources): (UpdateKind, PredictorKind, usize),
        [age_s, wait_s, frame_s, pause_s]: [f64; 4],
    ) -> Option<UseInterval> {
        let whole_s = self.mean_s[UpdateKind::Whole as usize]?;
        let expected_s = |kind: UpdateKind| {
            let measured_s = self.mean_s[kind as usize];
            measured_s.unwrap_or(kind.share(predictor, sources) * whole_s)
        };
        Some(UseInterval {
            arrival_s: age_s + expected_s(kind) + wait_s,
            used_s: (expected_s(kind.next()) + pause_s - frame_s).max(0.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: (UpdateKind, PredictorKind, usize) = (UpdateKind::Whole, PredictorKind::Hold, 4);

    #[test]
    fn an_update_is_used_until_the_next_one_arrives() {
        let mut timing = UpdateTiming::default();
        assert_eq!(timing.in_use(WHOLE, [0.0; 4]), None);
        for _ in 0..40 {
            timing.observe(UpdateKind::Whole, 0.13);
        }
        let interval = timing
            .in_use(WHOLE, [0.0, 0.0, 0.01, 0.0])
            .expect("measured");
        assert!((interval.arrival_s - 0.13).abs() < 1e-9);
        assert!((interval.used_s - 0.12).abs() < 1e-9);
        timing.observe(UpdateKind::Whole, 0.17);
        let later = timing
            .in_use(WHOLE, [0.004, 0.005, 0.01, 0.1])
            .expect("measured");
        assert!((later.arrival_s - 0.149).abs() < 1e-9);
        assert!((later.used_s - 0.23).abs() < 1e-9);
    }

    #[test]
    fn an_urgent_update_arrives_earlier_and_is_used_until_the_plain_one_arrives() {
        let mut timing = UpdateTiming::default();
        timing.observe(UpdateKind::Whole, 0.1);
        let urgent = (UpdateKind::Urgent, PredictorKind::default(), 4);
        let [share, plain] =
            [UpdateKind::Urgent, UpdateKind::Plain].map(|kind| kind.share(urgent.1, urgent.2));
        let interval = timing.in_use(urgent, [0.0; 4]).expect("measured");
        assert!((interval.arrival_s - 0.1 * share).abs() < 1e-9);
        assert!((interval.used_s - 0.1 * plain).abs() < 1e-9);
        timing.observe(UpdateKind::Urgent, 0.03);
        let interval = timing.in_use(urgent, [0.0; 4]).expect("measured");
        assert!((interval.arrival_s - 0.03).abs() < 1e-9);
    }
}
