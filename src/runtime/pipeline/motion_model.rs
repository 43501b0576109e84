//! Motion prediction: constant turn, constant velocity, or rest.
//!
//! Arithmetic; control side. If the last positions of a source fit an even turn, the constant-turn model of target tracking
//! (\[LI03\]) applies, which also describes a pendulum: `x + v sin(ω t) / ω + a (1 − cos(ω t)) / ω²`. Its prediction is
//! bounded. Otherwise a source moves straight on. Listeners turn abruptly and are always predicted straight on. A jump is no
//! motion. Displacements are counted in graphics frames of [`PoseHistory::frame_s`].

use glam::Vec3;

use crate::runtime::pipeline::pose_history::{PoseFrame, PoseHistory};
use crate::scene::SourcePose;

/// Greatest speed that counts as motion, in metres a second.
pub(crate) const MAX_SPEED_M_S: f64 = 40.0;

/// Greatest speed after a graphics frame of slower motion: metres a second, plus a multiple of the speed before. Who starts
/// to run is slower.
const MAX_START_M_S: f64 = 12.0;
const MAX_START_RATIO: f64 = 3.0;

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

/// The motion of the listener or a source.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Motion {
    /// Displacement in the last graphics frame; `None` at rest, for a new source, and after a jump.
    step: Option<Vec3>,
    /// An even turn; otherwise it moves straight on.
    turn: Option<Turn>,
}

/// Derivatives of a motion by time in strides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Turn {
    /// Graphics frames of a stride.
    stride: f32,
    /// At the middle position, two strides ago.
    speed: Vec3,
    change: Vec3,
    /// `2 − 2 cos` of the angle in a stride.
    curvature: f32,
    /// Speed at the newest position, and the strides until it has changed by the longest step.
    newest: Vec3,
    most: f32,
}

impl Motion {
    /// Motion of the listener.
    pub(crate) fn of_listener(history: &PoseHistory) -> Self {
        Self {
            step: last_step(history, |frame| Some(frame.listener)),
            turn: None,
        }
    }

    /// Motion of a source of the newest graphics frame, probably at `index` in the list; updates start every
    /// `interval_frames` graphics frames.
    pub(crate) fn of_source(
        history: &PoseHistory,
        (index, now): (usize, &SourcePose),
        interval_frames: f32,
    ) -> Self {
        let position = |frame: &PoseFrame| frame.source(now.id, index);
        let step = last_step(history, position);
        let stride = interval_frames.round() as usize / (HISTORY_POINTS - 1);
        let stride = stride.clamp(1, MAX_STRIDE) as f32;
        let turn = step.and_then(|_| turn(history, position, stride));
        Self { step, turn }
    }

    /// Displacement within so many graphics frames from now on, if it moves.
    pub(crate) fn displacement(&self, frames: f32) -> Option<Vec3> {
        let step = self.step?;
        let turned = self.turn.map(|turn| turn.displacement(frames));
        Some(turned.unwrap_or(step * frames))
    }

    /// Distance in metres of the last graphics frame.
    pub(crate) fn step_m(&self) -> f32 {
        self.step.map_or(0.0, Vec3::length)
    }
}

impl Turn {
    fn displacement(&self, frames: f32) -> Vec3 {
        let (time, curvature) = (frames / self.stride, self.curvature);
        if curvature > MIN_CURVATURE && curvature < MAX_CURVATURE {
            let step = (1.0 - 0.5 * curvature).acos();
            let from_middle = |angle: f32| {
                self.speed * (angle.sin() / step.sin())
                    + self.change * ((1.0 - angle.cos()) / curvature)
            };
            let turned = (step * time).min(MAX_TURN_RAD);
            return from_middle(2.0 * step + turned) - from_middle(2.0 * step);
        }
        // Constant acceleration, until the speed has changed by the longest step.
        self.newest * time + self.change * (0.5 * time * time.min(self.most))
    }
}

/// Whether the step of the listener or of a source to the graphics frame `age` frames before the newest is too fast for
/// motion.
pub(crate) fn has_jumped(
    history: &PoseHistory,
    age: usize,
    position: impl Fn(&PoseFrame) -> Option<Vec3>,
) -> bool {
    let speed_m_s = |age: usize| {
        let (now, before) = (history.get(age)?, history.get(age + 1)?);
        let step_m = position(now)?.distance(position(before)?);
        Some(f64::from(step_m) / (now.time_s - before.time_s))
    };
    let Some(now_m_s) = speed_m_s(age) else {
        return false;
    };
    let start_m_s = |before_m_s| MAX_START_M_S + MAX_START_RATIO * before_m_s;
    now_m_s
        > speed_m_s(age + 1)
            .map_or(MAX_SPEED_M_S, start_m_s)
            .min(MAX_SPEED_M_S)
}

/// Displacement in the newest graphics frame, if it is motion.
fn last_step(
    history: &PoseHistory,
    position: impl Fn(&PoseFrame) -> Option<Vec3> + Copy,
) -> Option<Vec3> {
    let (now, before) = (history.get(0)?, history.get(1)?);
    let frames = (history.frame_s()? / (now.time_s - before.time_s)) as f32;
    let step = (position(now)? - position(before)?) * frames;
    (step != Vec3::ZERO && !has_jumped(history, 0, position)).then_some(step)
}

/// The turn through the last positions, if they fit one.
fn turn(
    history: &PoseHistory,
    position: impl Fn(&PoseFrame) -> Option<Vec3> + Copy,
    stride: f32,
) -> Option<Turn> {
    let mut points = [Vec3::ZERO; HISTORY_POINTS];
    for (step, point) in points.iter_mut().enumerate() {
        *point = history.position(step as f64 * f64::from(stride), position)?;
    }
    let [p, q, r, s, t] = points;
    let steps = [p - q, q - r, r - s, s - t].map(Vec3::length);
    let longest = steps.into_iter().fold(0.0, f32::max);
    let deviation = (p - 4.0 * q + 6.0 * r - 4.0 * s + t).length();
    let longest_m_s = f64::from(longest / stride) / history.frame_s()?;
    if longest_m_s > MAX_SPEED_M_S || deviation > UNEVEN * longest {
        return None;
    }
    // Central differences at the middle position, exact for circles and pendulums; time in strides.
    let (speed, change) = (0.5 * (q - s), q - 2.0 * r + s);
    let (jerk, snap) = (0.5 * (p - t) - (q - s), p - 4.0 * q + 6.0 * r - 4.0 * s + t);
    let squares = speed.length_squared() + change.length_squared();
    Some(Turn {
        stride,
        speed,
        change,
        curvature: -(jerk.dot(speed) + snap.dot(change)) / squares.max(f32::MIN_POSITIVE),
        newest: p - q + 0.5 * change,
        most: longest / change.length().max(f32::MIN_POSITIVE),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ListenerPose, SourceId};

    const ID: SourceId = SourceId::new(3, 1);
    const RATE_HZ: f32 = 75.0;

    /// Positions of the graphics frames up to `now`.
    fn history(position: impl Fn(f32) -> Vec3, now: i32) -> PoseHistory {
        let mut history = PoseHistory::default();
        for frame in now - 40..=now {
            let position = position(frame as f32 / RATE_HZ);
            let source = SourcePose::at(ID, position);
            let listener = ListenerPose::facing(position, 0.0);
            history.push(f64::from(frame) / f64::from(RATE_HZ), &listener, &[source]);
        }
        history
    }

    /// Predicted position `frames` graphics frames after `now`.
    fn followed(position: impl Fn(f32) -> Vec3, now: i32, frames: f32) -> Vec3 {
        let at = position(now as f32 / RATE_HZ);
        let history = history(position, now);
        let motion = Motion::of_source(&history, (0, &SourcePose::at(ID, at)), 25.0);
        at + motion.displacement(frames).unwrap_or_default()
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

    #[test]
    fn a_listener_stops_at_once() {
        let stop = |s: f32| Vec3::X * 5.0 * s.min(1.0);
        let moving = |now| Motion::of_listener(&history(stop, now)).displacement(10.0);
        let step = moving(75).expect("it moves");
        assert!((step - Vec3::X * 50.0 / RATE_HZ).length() < 1e-3, "{step}");
        assert_eq!(moving(76), None);
    }

    #[test]
    fn a_jump_is_no_motion_and_a_dash_is() {
        let jumped = |position: &dyn Fn(f32) -> Vec3, now| {
            has_jumped(&history(position, now), 0, |frame| Some(frame.listener))
        };
        // A step aside of 0.3 m: 22 m/s at this rate.
        let aside = |s: f32| Vec3::X * if s < 0.999 { 0.0 } else { 0.3 };
        assert!(jumped(&aside, 75) && !jumped(&aside, 74) && !jumped(&aside, 76));
        let dash = |s: f32| Vec3::X * 5.0 * (s - 1.0).max(0.0);
        assert!((70..90).all(|now| !jumped(&dash, now)));
        // A car at 30 m/s.
        let car = |s: f32| Vec3::X * 30.0 * s;
        assert!(!jumped(&car, 75));
    }

    #[test]
    fn uneven_ticks_predict_the_same_circle() {
        let circle = |s: f32| Vec3::new(2.0 + (1.5 * s).cos(), 1.0, (1.5 * s).sin());
        let mut history = PoseHistory::default();
        for frame in 0..60 {
            let jitter = [0.0, 0.004, -0.003, 0.002][frame % 4];
            let time_s = frame as f32 / RATE_HZ + jitter;
            let source = SourcePose::at(ID, circle(time_s));
            history.push(f64::from(time_s), &ListenerPose::default(), &[source]);
        }
        let now_s = 59.0 / RATE_HZ + 0.002;
        let now = SourcePose::at(ID, circle(now_s));
        let motion = Motion::of_source(&history, (0, &now), 25.0);
        let ahead = now.position + motion.displacement(20.0).expect("it moves");
        let missed = ahead.distance(circle(now_s + 20.0 / RATE_HZ));
        assert!(missed < 0.02, "{missed} m");
    }
}
