//! Where an update expects the listener, and whether it has turned away from there.
//!
//! Control side. A listener that runs and turns is metres away when an update of the old way arrives. A listener that walks
//! is not: at 1.4 m/s it turns around within [`TURNED_M`].

use glam::Vec3;

use crate::runtime::pipeline::motion_model::Motion;
use crate::runtime::pipeline::pose_history::PoseHistory;
use crate::scene::ListenerPose;

/// Distance in metres from where it is expected at which a listener has turned.
const TURNED_M: f32 = 0.8;

/// Graphics frames whose mean speed counts too, unless the listener has moved in each of them. Positions that come by a network
/// move in steps, between which they rest.
const MEAN_FRAMES: usize = 4;

/// A position and its time in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ExpectedListener {
    time_s: f64,
    position: Vec3,
}

impl ExpectedListener {
    /// Where the listener is so many seconds after the newest graphics frame, if nothing stops it.
    pub(crate) fn after(seconds: f64, history: &PoseHistory) -> Option<Self> {
        let (now, frame_s) = (history.get(0)?, history.frame_s()?);
        let frames = (seconds / frame_s) as f32;
        let displacement = Motion::of_listener(history).displacement(frames);
        Some(Self {
            time_s: now.time_s + seconds,
            position: now.listener + displacement.unwrap_or_default(),
        })
    }

    /// Whether the listener has turned away, by its newest graphics frame and by its last ones; not after that time.
    pub(crate) fn is_missed(&self, history: &PoseHistory) -> bool {
        let is_missed = || {
            let (now, before) = (history.get(0)?, history.get(MEAN_FRAMES)?);
            let ahead_s = self.time_s - now.time_s;
            let newest = Self::after(ahead_s, history)?.position;
            let share = (ahead_s / (now.time_s - before.time_s)) as f32;
            let mean = now.listener + (now.listener - before.listener) * share;
            let is_step = |age| {
                let [later, earlier] = [age, age + 1].map(|age| history.get(age));
                later.map(|frame| frame.listener) != earlier.map(|frame| frame.listener)
            };
            let has_moved = (0..MEAN_FRAMES).all(is_step);
            let is_far = |found: Vec3| found.distance(self.position) > TURNED_M;
            Some(ahead_s > 0.0 && is_far(newest) && (has_moved || is_far(mean)))
        };
        is_missed().unwrap_or(false)
    }
}

/// Notices on the app's thread that the listener has turned away from where the update under way expects it.
#[derive(Debug, Default)]
pub(crate) struct TurnWatch(PoseHistory);

impl TurnWatch {
    /// Takes a graphics frame; returns whether the listener has turned away from where it is expected.
    pub(crate) fn observe(
        &mut self,
        time_s: f64,
        listener: &ListenerPose,
        expected: Option<ExpectedListener>,
    ) -> bool {
        self.0.push(time_s, listener, &[]);
        expected.is_some_and(|expected| expected.is_missed(&self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME_S: f64 = 1.0 / 75.0;

    /// Graphics frames until a watch notices that a way turns after one second, if an update begins with that frame.
    fn noticed_after(position: impl Fn(f64) -> Vec3) -> Option<u32> {
        let (mut watch, mut expected) = (TurnWatch::default(), None);
        for frame in 0..100 {
            let time_s = f64::from(frame) * FRAME_S;
            let pose = ListenerPose::facing(position(time_s), 0.0);
            if watch.observe(time_s, &pose, expected) {
                return Some(frame - 75);
            }
            if frame == 75 {
                expected = ExpectedListener::after(0.26, &watch.0);
            }
        }
        None
    }

    #[test]
    fn a_turn_of_a_run_is_noticed_within_three_frames() {
        let corner = |s: f64| {
            Vec3::new(
                5.0 * s.min(1.0) as f32,
                0.0,
                5.0 * (s - 1.0).max(0.0) as f32,
            )
        };
        assert_eq!(noticed_after(corner), Some(1));
        // From rest and to rest.
        let start = |s: f64| Vec3::X * 5.0 * (s - 1.0).max(0.0) as f32;
        assert_eq!(noticed_after(start), Some(3));
        let stop = |s: f64| Vec3::X * 5.0 * s.min(1.0) as f32;
        assert_eq!(noticed_after(stop), Some(3));
    }

    #[test]
    fn a_walk_has_no_turns() {
        let back = |s: f64| Vec3::X * 1.4 * (s - 1.0).abs() as f32;
        assert_eq!(noticed_after(back), None);
        let run = |s: f64| Vec3::X * 5.0 * s as f32;
        assert_eq!(noticed_after(run), None);
        // Ten positions a second by a network. Update and turn begin between two of them.
        let steps = |s: f64| Vec3::X * 0.14 * (10.0 * s + 0.5).floor() as f32;
        assert_eq!(noticed_after(steps), None);
    }
}
