//! How sources have been moving, and where that leads: straight on, or round.
//!
//! Arithmetic; control side. A source that sways, circles or brakes is not where its last step points to. Where its last
//! places agree with an even turn it goes on turning: the constant-turn model of target tracking (\[LI03\]), which also is
//! that of a pendulum, `x + v sin(ω t) / ω + a (1 − cos(ω t)) / ω²` of speed and its change, where each change is `−ω²` of
//! what is two before it. It stays within reach however long it is followed. People turn on their heels: where the last places
//! agree with no such turn, a source goes straight on, and a listener always does.

use std::collections::VecDeque;

use glam::Vec3;

use crate::runtime::offline::schedule::Poses;
use crate::scene::{SourceId, SourcePose};

/// Longest step between two graphics frames that counts as motion, in metres; beyond it somebody was put elsewhere.
const MAX_STEP_M: f32 = 0.5;

/// Places of a source that are looked at, and graphics frames from one to the next at most.
const HISTORY_POINTS: usize = 5;
const MAX_STRIDE: usize = 16;

/// By how much a source may be beside where its places before would have led it, as a share of its longest step.
const UNEVEN: f32 = 0.25;

/// Longest way that a turn is followed for, in radians.
const MAX_TURN_RAD: f32 = std::f32::consts::PI;

/// Within what a turn is one, `2 − 2 cos` of the angle from one place to the next: below it is as good as straight, above
/// nobody knows which way round.
const MIN_CURVATURE: f32 = 1e-4;
const MAX_CURVATURE: f32 = 1.0;

/// Where sources were in the last graphics frames.
#[derive(Debug)]
pub(crate) struct MotionModel {
    stride: usize,
    /// The newest first.
    history: VecDeque<Vec<(SourceId, Vec3)>>,
}

impl MotionModel {
    /// For updates that start so many graphics frames after each other.
    pub(crate) fn new(interval: usize) -> Self {
        Self {
            stride: (interval / (HISTORY_POINTS - 1)).clamp(1, MAX_STRIDE),
            history: VecDeque::new(),
        }
    }

    /// Keeps the poses of a graphics frame that is over.
    pub(crate) fn push(&mut self, poses: &Poses) {
        let most = (HISTORY_POINTS - 1) * self.stride;
        let spare = (self.history.len() >= most).then(|| self.history.pop_back());
        let mut places = spare.flatten().unwrap_or_default();
        places.clear();
        places.extend(poses.sources.iter().map(|pose| (pose.id, pose.position)));
        self.history.push_front(places);
    }

    /// The way of a source from where it is now, if it moves; `last` are the poses of the graphics frame before.
    pub(crate) fn displacement(&self, last: &Poses, now: &SourcePose, frames: f32) -> Option<Vec3> {
        let straight = straight_displacement(position_of(last, now.id)?, now.position, frames)?;
        Some(self.turning_displacement(now, frames).unwrap_or(straight))
    }

    /// Its way if it turns evenly.
    fn turning_displacement(&self, now: &SourcePose, frames: f32) -> Option<Vec3> {
        let mut places = [now.position; HISTORY_POINTS];
        for (number, place) in places.iter_mut().enumerate().skip(1) {
            let known = self.history.get(number * self.stride - 1)?;
            *place = known.iter().find(|(id, _)| *id == now.id)?.1;
        }
        let [p, q, r, s, t] = places;
        let steps = [p - q, q - r, r - s, s - t].map(Vec3::length);
        let longest = steps.into_iter().fold(0.0, f32::max);
        let beside = (p - 4.0 * q + 6.0 * r - 4.0 * s + t).length();
        let was_put = longest > MAX_STEP_M * self.stride as f32;
        if was_put || beside > UNEVEN * longest {
            return None;
        }
        // Differences about the middle one, of which a pendulum's and a circle's are exact; time in steps.
        let (speed, change) = (0.5 * (q - s), q - 2.0 * r + s);
        let (jerk, snap) = (0.5 * (p - t) - (q - s), p - 4.0 * q + 6.0 * r - 4.0 * s + t);
        let squares = speed.length_squared() + change.length_squared();
        let bend = -(jerk.dot(speed) + snap.dot(change)) / squares.max(f32::MIN_POSITIVE);
        let time = frames / self.stride as f32;
        if bend > MIN_CURVATURE && bend < MAX_CURVATURE {
            let step = (1.0 - 0.5 * bend).acos();
            let from_middle = |angle: f32| {
                speed * (angle.sin() / step.sin()) + change * ((1.0 - angle.cos()) / bend)
            };
            let turned = (step * time).min(MAX_TURN_RAD);
            return Some(from_middle(2.0 * step + turned) - from_middle(2.0 * step));
        }
        // It does not come back: its speed changes by what it is at most.
        let most = longest / change.length().max(f32::MIN_POSITIVE);
        let newest = p - q + 0.5 * change;
        Some(newest * time + change * (0.5 * time * time.min(most)))
    }
}

/// Where a source is.
pub(crate) fn position_of(poses: &Poses, id: SourceId) -> Option<Vec3> {
    let pose = poses.sources.iter().find(|pose| pose.id == id);
    pose.map(|pose| pose.position)
}

/// The way from `at` straight on, if that is motion.
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

    fn poses(place: Vec3) -> Poses {
        Poses {
            sources: vec![SourcePose::at(ID, place)],
            ..Poses::default()
        }
    }

    /// Where a source is taken to be `frames` graphics frames after `now` that has been moving like this.
    fn followed(place: impl Fn(f32) -> Vec3, now: i32, frames: f32) -> Vec3 {
        let mut courses = MotionModel::new(25);
        let at = |frame: i32| place(frame as f32 / RATE_HZ);
        for frame in now - 40..now {
            courses.push(&poses(at(frame)));
        }
        let way = courses.displacement(&poses(at(now - 1)), &poses(at(now)).sources[0], frames);
        at(now) + way.unwrap_or_default()
    }

    fn missed_m(place: impl Fn(f32) -> Vec3, now: i32, frames: f32) -> f32 {
        let there = place((now as f32 + frames) / RATE_HZ);
        followed(place, now, frames).distance(there)
    }

    #[test]
    fn what_sways_or_circles_is_followed_round() {
        let sway = |s: f32| Vec3::X * 1.2 * (1.7 * s).sin();
        let circle = |s: f32| Vec3::new(2.0 + (1.5 * s).cos(), 1.0, (1.5 * s).sin());
        for now in [100, 127, 150, 211] {
            let straight = |place: &dyn Fn(f32) -> Vec3| {
                let at = |frame: i32| place(frame as f32 / RATE_HZ);
                let line = at(now) + 49.0 * (at(now) - at(now - 1));
                line.distance(at(now + 49))
            };
            for place in [&sway as &dyn Fn(f32) -> Vec3, &circle] {
                let missed = missed_m(place, now, 49.0);
                assert!(missed < 0.02, "{missed} m in frame {now}");
            }
            assert!(straight(&circle) > 0.3, "a line would do");
            // Half a turn and more ahead it stays within reach.
            let far = followed(sway, now, 300.0);
            assert!(far.length() < 3.0, "{far}");
        }
    }

    #[test]
    fn who_walks_straight_on_is_followed_straight_on() {
        let walk = |s: f32| Vec3::new(30.0, 1.5, 1.4 * s);
        assert!(missed_m(walk, 100, 49.0) < 0.01);
    }

    #[test]
    fn who_turns_on_the_heel_is_not_followed_round() {
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
    fn who_was_put_elsewhere_or_rests_stays() {
        let put = |s: f32| Vec3::X * if s < 0.999 { 0.0 } else { 5.0 };
        assert_eq!(followed(put, 75, 20.0), Vec3::X * 5.0);
        assert_eq!(followed(|_| Vec3::ONE, 75, 20.0), Vec3::ONE);
    }
}
