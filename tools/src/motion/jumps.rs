//! A listener, or a source, that is put elsewhere again and again.

use glam::Vec3;

use super::Moves;
use super::Place;
use super::random::Random;
use super::reachable_floor::walked;
use super::track::Track;

/// Seconds between two teleports of the listener, and between two jumps of sources.
pub(super) const TELEPORT_S: f64 = 1.5;
pub(super) const JUMP_S: f64 = 1.0;

/// Least distance of a teleport or jump in metres, where the floor is large enough.
const LEAST_M: f32 = 3.0;

/// Least distance of a jumping source from the listener in metres.
const APART_M: f32 = 1.0;

/// Speed in m/s of the listener between two teleports.
const WALK_M_S: f64 = 1.4;

/// Positions, or directions, drawn until one fits.
const TRIES: usize = 64;

/// The listener's teleports; in between it walks straight on where there is room, facing a random direction.
pub(super) fn teleports(
    place: &Place<'_>,
    start: Vec3,
    duration_s: f64,
    random: &mut Random,
) -> Moves {
    let mut track = Track::at_rest(start, 0.0);
    let mut jumps_s = Vec::new();
    loop {
        let here = track.end().1;
        let along_m = (WALK_M_S * TELEPORT_S) as f32;
        let mut directions = (0..TRIES).map(|_| random.direction());
        let there = directions.find_map(|ahead| walked(place.scene, here, ahead * along_m));
        track.go(there.unwrap_or(here), TELEPORT_S);
        let yaw_rad = track.yaw_end().1;
        track.turn(yaw_rad, TELEPORT_S);
        let (time_s, here) = track.end();
        if time_s >= duration_s {
            break;
        }
        jumps_s.push(time_s);
        track.go(elsewhere(place, random, |at| at.distance(here)), 0.0);
        let facing_rad = random.between(-std::f32::consts::PI, std::f32::consts::PI);
        track.turn(facing_rad, 0.0);
    }
    Moves {
        listener: Some(track),
        sources: Vec::new(),
        jumps_s,
    }
}

/// The sources' jumps, one at a time, while the listener is on the scene's own walk.
pub(super) fn source_jumps(
    place: &Place<'_>,
    start_m: f64,
    duration_s: f64,
    random: &mut Random,
) -> Moves {
    let at_rest = |source: &Vec3| Track::at_rest(*source, 0.0);
    let mut sources: Vec<Track> = place.sources.iter().map(at_rest).collect();
    let mut jumps_s = Vec::new();
    let mut time_s = JUMP_S;
    while time_s < duration_s && !sources.is_empty() {
        let which = random.index(sources.len());
        let (since_s, here) = sources[which].end();
        let listener = place.walk.position_at(time_s, start_m);
        let there = elsewhere(place, random, |at| {
            let apart_m = at.distance(listener) - APART_M;
            at.distance(here).min(LEAST_M * apart_m)
        });
        sources[which].go(here, time_s - since_s);
        sources[which].go(there, 0.0);
        jumps_s.push(time_s);
        time_s += JUMP_S;
    }
    Moves {
        listener: None,
        sources,
        jumps_s,
    }
}

/// A position with a score of [`LEAST_M`] at least, or the best of those drawn.
fn elsewhere(place: &Place<'_>, random: &mut Random, score: impl Fn(Vec3) -> f32) -> Vec3 {
    let all = place.floor.positions();
    let drawn: Vec<Vec3> = (0..TRIES).map(|_| all[random.index(all.len())]).collect();
    let fitting = drawn.iter().find(|at| score(**at) >= LEAST_M);
    let best = || {
        drawn
            .iter()
            .max_by(|a, b| score(**a).total_cmp(&score(**b)))
    };
    fitting.or_else(best).copied().unwrap_or_default()
}
