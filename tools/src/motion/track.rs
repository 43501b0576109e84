//! A pose over time: positions and head angles, interpolated between key times. Two keys of one time are a jump.

use foresound::scene::ListenerPose;
use glam::Vec3;

/// Position and yaw over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Seconds and metres, in order of time; at least one.
    positions: Vec<(f64, Vec3)>,
    /// Seconds and radians to the left of −z, in order of time; at least one.
    yaws: Vec<(f64, f32)>,
}

impl Track {
    /// Rests at a position with a yaw from time 0 on.
    pub fn at_rest(position: Vec3, yaw_rad: f32) -> Self {
        Self {
            positions: vec![(0.0, position)],
            yaws: vec![(0.0, yaw_rad)],
        }
    }

    /// Time and value of the last position.
    pub fn end(&self) -> (f64, Vec3) {
        self.positions.last().copied().unwrap_or_default()
    }

    /// Time and value of the last yaw in radians.
    pub fn yaw_end(&self) -> (f64, f32) {
        self.yaws.last().copied().unwrap_or_default()
    }

    /// Moves evenly to a position, which is reached after some seconds.
    pub fn go(&mut self, position: Vec3, seconds: f64) {
        let time_s = self.end().0 + seconds;
        self.positions.push((time_s, position));
    }

    /// Turns evenly to a yaw, which is reached after some seconds.
    pub fn turn(&mut self, yaw_rad: f32, seconds: f64) {
        let time_s = self.yaw_end().0 + seconds;
        self.yaws.push((time_s, yaw_rad));
    }

    /// The position at a time in seconds; the last one after the end.
    pub fn position_at(&self, time_s: f64) -> Vec3 {
        let ([before, after], share) = around(&self.positions, time_s);
        // At rest the same bits.
        before + (after - before) * share
    }

    /// The yaw at a time in radians.
    pub fn yaw_at(&self, time_s: f64) -> f32 {
        let ([before, after], share) = around(&self.yaws, time_s);
        before + (after - before) * share
    }

    /// A listener at a time.
    pub fn pose_at(&self, time_s: f64) -> ListenerPose {
        ListenerPose::facing(self.position_at(time_s), self.yaw_at(time_s))
    }
}

/// The values before and after a time, and how far the time is from the first to the second.
fn around<T: Copy + Default>(keys: &[(f64, T)], time_s: f64) -> ([T; 2], f32) {
    let next = keys.partition_point(|key| key.0 <= time_s);
    let before = keys.get(next.saturating_sub(1)).copied();
    let before = before.unwrap_or_default();
    let after = keys.get(next).copied().unwrap_or(before);
    let span_s = after.0 - before.0;
    let share = match span_s > 0.0 {
        true => ((time_s - before.0) / span_s).clamp(0.0, 1.0),
        false => 0.0,
    };
    ([before.1, after.1], share as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_goes_rests_jumps_and_turns() {
        let mut track = Track::at_rest(Vec3::ZERO, 0.0);
        track.go(Vec3::X, 2.0);
        track.go(Vec3::X, 1.0);
        track.go(Vec3::Z, 0.0);
        track.turn(3.0, 1.5);
        for (time_s, position) in [
            (-1.0, Vec3::ZERO),
            (1.0, 0.5 * Vec3::X),
            (2.5, Vec3::X),
            (3.0, Vec3::Z),
            (9.0, Vec3::Z),
        ] {
            assert_eq!(track.position_at(time_s), position, "{time_s} s");
        }
        assert_eq!(track.yaw_at(0.5), 1.0);
        assert_eq!(track.yaw_at(7.0), 3.0);
    }
}
