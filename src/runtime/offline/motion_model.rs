//! Motion prediction of sources: constant turn or constant velocity.
//!
//! Arithmetic; control side. If the last positions fit an even turn, the constant-turn model of target tracking
//! (\[LI03\]) applies, which also describes a pendulum: `x + v sin(ω t) / ω + a (1 − cos(ω t)) / ω²`. Its prediction is
//! bounded. Otherwise a source moves straight on. Listeners turn abruptly and are always predicted straight on.

use std::collections::VecDeque;

use glam::Vec3;

use crate::runtime::offline::schedule::Poses;
use crate::scene::{SourceId, SourcePose};

/// Longest step between two graphics frames that counts as motion, in metres; longer steps are teleports.
const MAX_STEP_M: f32 = 0.5;

/// Positions of a source used by the model, and greatest number of graphics frames between two of them.
const HISTORY_POINTS: usize = 5;
const MAX_STRIDE: usize = 16;

/// Greatest fourth difference of the positions, relative to the longest step.
const UNEVEN: f32 = 0.25;

/// Longest predicted turn in radians.
const MAX_TURN_RAD: f32 = std::f32::consts::PI;

/// Range of a turn as `2 − 2 cos` of the angle between two positions: below it is nearly straight, above ambiguous.
const MIN_CURVATURE: f32 = 1e-4;
const MAX_CURVATURE: f32 = 1.0;

/// Positions of sources in the last graphics frames.
#[derive(Debug)]
pub(crate) struct MotionModel {
    stride: usize,
    /// Newest first.
    history: VecDeque<Vec<(SourceId, Vec3)>>,
}

impl MotionModel {
    /// For updates that start every `interval` graphics frames.
    pub(crate) fn new(interval: usize) -> Self {
        Self {
            stride: (interval / (HISTORY_POINTS - 1)).clamp(1, MAX_STRIDE),
            history: VecDeque::new(),
        }
    }

    /// Stores the poses of a completed graphics frame.
    pub(crate) fn push(&mut self, poses: &Poses) {
        let most = (HISTORY_POINTS - 1) * self.stride;
        let spare = (self.history.len() >= most).then(|| self.history.pop_back());
        let mut history = spare.flatten().unwrap_or_default();
        history.clear();
        history.extend(poses.sources.iter().map(|pose| (pose.id, pose.position)));
        self.history.push_front(history);
    }

    /// Displacement of a source within `frames` from now on, if it moves; `last` are the poses of the previous frame.
    pub(crate) fn displacement(&self, last: &Poses, now: &SourcePose, frames: f32) -> Option<Vec3> {
        let straight = straight_displacement(position_of(last, now.id)?, now.position, frames)?;
        Some(self.turning_displacement(now, frames).unwrap_or(straight))
    }

    /// Displacement by the constant-turn model, if it applies.
    fn turning_displacement(&self, now: &SourcePose, frames: f32) -> Option<Vec3> {
        let mut history = [now.position; HISTORY_POINTS];
        for (step, position) in history.iter_mut().enumerate().skip(1) {
            let known = self.history.get(step * self.stride - 1)?;
            *position = known.iter().find(|(id, _)| *id == now.id)?.1;
        }
        let [p, q, r, s, t] = history;
        let steps = [p - q, q - r, r - s, s - t].map(Vec3::length);
        let longest = steps.into_iter().fold(0.0, f32::max);
        let deviation = (p - 4.0 * q + 6.0 * r - 4.0 * s + t).length();
        let was_teleported = longest > MAX_STEP_M * self.stride as f32;
        if was_teleported || deviation > UNEVEN * longest {
            return None;
        }
        // Central differences at the middle position, exact for circles and pendulums; time in steps.
        let (speed, change) = (0.5 * (q - s), q - 2.0 * r + s);
        let (jerk, snap) = (0.5 * (p - t) - (q - s), p - 4.0 * q + 6.0 * r - 4.0 * s + t);
        let squares = speed.length_squared() + change.length_squared();
        let curvature = -(jerk.dot(speed) + snap.dot(change)) / squares.max(f32::MIN_POSITIVE);
        let time = frames / self.stride as f32;
        if curvature > MIN_CURVATURE && curvature < MAX_CURVATURE {
            let step = (1.0 - 0.5 * curvature).acos();
            let from_middle = |angle: f32| {
                speed * (angle.sin() / step.sin()) + change * ((1.0 - angle.cos()) / curvature)
            };
            let turned = (step * time).min(MAX_TURN_RAD);
            return Some(from_middle(2.0 * step + turned) - from_middle(2.0 * step));
        }
        // Constant acceleration, until the speed has changed by the longest step.
        let most = longest / change.length().max(f32::MIN_POSITIVE);
        let newest = p - q + 0.5 * change;
        Some(newest * time + change * (0.5 * time * time.min(most)))
    }
}

/// Position of a source.
pub(crate) fn position_of(poses: &Poses, id: SourceId) -> Option<Vec3> {
    let pose = poses.sources.iter().find(|pose| pose.id == id);
    pose.map(|pose| pose.position)
}

/// Displacement at constant velocity, if the last step counts as motion.
pub(crate) fn straight_displacement(before: Vec3, at: Vec3, frames: f32) -> Option<Vec3> {
    let step = at - before;
    let moves = step != Vec3::ZERO && step.length() <= MAX_STEP_M;
    moves.then(|| step * frames)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: SourceId = SourceId::new(3, 1);
    const RATE_HZ: f32 = 75.0;

    fn poses(position: Vec3) -> Poses {
        Poses {
            sources: vec![SourcePose::at(ID, position)],
            ..Poses::default()
        }
    }

    /// Predicted position `frames` graphics frames after `now`.
    fn followed(position: impl Fn(f32) -> Vec3, now: i32, frames: f32) -> Vec3 {
        let mut model = MotionModel::new(25);
        let at = |frame: i32| position(frame as f32 / RATE_HZ);
        for frame in now - 40..now {
            model.push(&poses(at(frame)));
        }
        let displacement =
            model.displacement(&poses(at(now - 1)), &poses(at(now)).sources[0], frames);
        at(now) + displacement.unwrap_or_default()
    }

    fn missed_m(position: impl Fn(f32) -> Vec3, now: i32, frames: f32) -> f32 {
        let there = position((now as f32 + frames) / RATE_HZ);
        followed(position, now, frames).distance(there)
    }

    #[test]
    fn swinging_and_circling_sources_are_predicted() {
        let sway = |s: f32| Vec3::X * 1.2 * (1.7 * s).sin();
        let circle = |s: f32| Vec3::new(2.0 + (1.5 * s).cos(), 1.0, (1.5 * s).sin());
        for now in [100, 127, 150, 211] {
            let straight = |position: &dyn Fn(f32) -> Vec3| {
                let at = |frame: i32| position(frame as f32 / RATE_HZ);
                let line = at(now) + 49.0 * (at(now) - at(now - 1));
                line.distance(at(now + 49))
            };
            for position in [&sway as &dyn Fn(f32) -> Vec3, &circle] {
                let missed = missed_m(position, now, 49.0);
                assert!(missed < 0.02, "{missed} m in frame {now}");
            }
            assert!(straight(&circle) > 0.3, "a line would do");
            // Half a turn and more ahead the prediction stays bounded.
            let far = followed(sway, now, 300.0);
            assert!(far.length() < 3.0, "{far}");
        }
    }

    #[test]
    fn straight_motion_is_predicted_straight() {
        let walk = |s: f32| Vec3::new(30.0, 1.5, 1.4 * s);
        assert!(missed_m(walk, 100, 49.0) < 0.01);
    }

    #[test]
    fn abrupt_turns_are_not_predicted_as_circles() {
        let turn = |s: f32| Vec3::X * 1.4 * (s - 1.0).abs();
        // In the frame of the turn and in those after it the last step counts.
        for now in [75, 77, 80, 84, 90, 120] {
            let at = |frame: i32| turn(frame as f32 / RATE_HZ);
            let line = at(now) + 20.0 * (at(now) - at(now - 1));
            let found = followed(turn, now, 20.0);
            assert!(found.distance(line) < 0.02, "{found} in frame {now}");
        }
    }

    #[test]
    fn teleports_and_rest_predict_no_motion() {
        let put = |s: f32| Vec3::X * if s < 0.999 { 0.0 } else { 5.0 };
        assert_eq!(followed(put, 75, 20.0), Vec3::X * 5.0);
        assert_eq!(followed(|_| Vec3::ONE, 75, 20.0), Vec3::ONE);
    }
}
