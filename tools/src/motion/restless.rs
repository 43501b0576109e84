//! A random walk with sudden turns and stops, and a head that turns by itself.

use glam::Vec3;

use super::Place;
use super::random::Random;
use super::reachable_floor::walked;
use super::track::Track;

/// Range of walking speeds in m/s, and of the times between two turns in seconds.
const SPEED_M_S: [f32; 2] = [0.7, 1.8];
const LEG_S: [f32; 2] = [0.3, 1.5];

/// Share of stops, and range of their lengths in seconds.
const STOPS: f32 = 0.25;
const STOP_S: [f32; 2] = [0.2, 1.0];

/// Range of the head's angular speeds in rad/s, up to 180 degrees a second, and largest turn in radians.
const HEAD_RAD_S: [f32; 2] = [0.5, std::f32::consts::PI];
const TURN_RAD: f32 = 2.0;

/// Range of the times in seconds for which the head rests between turns.
const HEAD_RESTS_S: [f32; 2] = [0.0, 0.8];

/// Directions tried before a listener with no room stops.
const TRIES: usize = 32;

/// The listener's walk.
pub(super) fn walk(place: &Place<'_>, start: Vec3, duration_s: f64, random: &mut Random) -> Track {
    let mut track = Track::at_rest(start, 0.0);
    while track.end().0 < duration_s {
        let here = track.end().1;
        let seconds = random.between(LEG_S[0], LEG_S[1]);
        let length_m = seconds * random.between(SPEED_M_S[0], SPEED_M_S[1]);
        let stops = random.between(0.0, 1.0) < STOPS;
        let mut directions = (0..TRIES).map(|_| random.direction());
        let there = directions.find_map(|ahead| walked(place.scene, here, ahead * length_m));
        match there.filter(|_| !stops) {
            Some(there) => track.go(there, seconds.into()),
            None => track.go(here, random.between(STOP_S[0], STOP_S[1]).into()),
        }
    }
    while track.yaw_end().0 < duration_s {
        let yaw_rad = track.yaw_end().1;
        track.turn(
            yaw_rad,
            random.between(HEAD_RESTS_S[0], HEAD_RESTS_S[1]).into(),
        );
        let turned_rad = random.between(-TURN_RAD, TURN_RAD);
        let speed_rad_s = random.between(HEAD_RAD_S[0], HEAD_RAD_S[1]);
        track.turn(
            yaw_rad + turned_rad,
            (turned_rad.abs() / speed_rad_s).into(),
        );
    }
    track
}
