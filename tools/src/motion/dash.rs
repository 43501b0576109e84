//! A run at 5 m/s through doorways and around corners, along shortest ways to places out of sight.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::Place;
use super::random::Random;
use super::track::Track;
use crate::open_space::hits;

/// Speed of the run in m/s.
const RUN_M_S: f32 = 5.0;

/// Largest angular speed of the head, which turns to where the listener runs, in rad/s: 180 degrees a second.
const HEAD_RAD_S: f32 = PI;

/// Least distance of the end of a way from its start, in metres, where the floor is large enough.
const LEAST_M: f32 = 5.0;

/// Ends drawn, of which the first out of sight is taken.
const TRIES: usize = 64;

/// The listener's run.
pub(super) fn run(place: &Place<'_>, start: Vec3, duration_s: f64, random: &mut Random) -> Track {
    let mut track = Track::at_rest(start, 0.0);
    while track.end().0 < duration_s {
        let here = track.end().1;
        let there = end_of_way(place, here, random);
        let way = place.floor.way(place.scene, here, there);
        let before_s = track.end().0;
        for leg in way.windows(2) {
            look(&mut track, leg[1] - leg[0]);
            let leg_s = leg[0].distance(leg[1]) / RUN_M_S;
            track.go(leg[1], leg_s.into());
        }
        if track.end().0 <= before_s {
            // A floor of one position.
            track.go(here, duration_s);
        }
    }
    track
}

/// A place to run to: far and out of sight if there is one.
fn end_of_way(place: &Place<'_>, here: Vec3, random: &mut Random) -> Vec3 {
    let all = place.floor.positions();
    let drawn: Vec<Vec3> = (0..TRIES).map(|_| all[random.index(all.len())]).collect();
    let far = drawn.iter().filter(|there| there.distance(here) >= LEAST_M);
    let hidden = far
        .clone()
        .find(|there| hits(place.scene, here, **there))
        .or(far.clone().next());
    let farthest = || {
        let distance = |there: &&Vec3| there.distance_squared(here);
        all.iter()
            .max_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    hidden.or_else(farthest).copied().unwrap_or(here)
}

/// Turns the head towards a direction from now on, by the shorter way, as fast as it can.
fn look(track: &mut Track, ahead: Vec3) {
    let now_s = track.end().0;
    // A turn that is not complete when the next corner comes is completed first.
    let (until_s, yaw_rad) = track.yaw_end();
    track.turn(yaw_rad, (now_s - until_s).max(0.0));
    let wanted_rad = f32::atan2(-ahead.x, -ahead.z);
    let turned_rad = (wanted_rad - yaw_rad + PI).rem_euclid(TAU) - PI;
    track.turn(yaw_rad + turned_rad, (turned_rad.abs() / HEAD_RAD_S).into());
}
