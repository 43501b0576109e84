//! Sources that move along random smooth curves: uniform cubic B-splines over random control points.
//!
//! The speed of such a spline is at most the longest step between control points over their interval; the curve lies in
//! the hull of four consecutive control points.

use foresound::scene::Scene;
use glam::Vec3;

use super::random::Random;
use super::track::Track;
use crate::open_space::{clear_m, hits};

/// Largest speed in m/s.
const MOST_M_S: f32 = 2.0;

/// Seconds between two control points.
const INTERVAL_S: f32 = 0.5;

/// Largest distance from a source's own position, in metres, as far as there is room.
const ROAM_M: f32 = 3.0;

/// Least horizontal distance from surfaces in metres; sources stand closer to them than listeners.
const CLEARANCE_M: f32 = 0.2;

/// Control points tried before the curve turns back to the point before.
const TRIES: usize = 32;

/// Straight pieces of the curve between two control points: with them the curve is 0.02 mm off.
const PIECES: usize = 50;

/// The motion of a source.
pub(super) fn drift(scene: &Scene, base: Vec3, duration_s: f64, random: &mut Random) -> Track {
    let mut track = Track::at_rest(base, 0.0);
    let mut control = [base; 4];
    while track.end().0 < duration_s {
        let steps = (0..TRIES).map(|_| {
            let longest_m = MOST_M_S * INTERVAL_S;
            random.direction() * random.between(0.3 * longest_m, longest_m)
        });
        let next = steps
            .map(|step| control[3] + step)
            .find(|next| next.distance(base) <= ROAM_M && is_free(scene, &control, *next));
        control = [
            control[1],
            control[2],
            control[3],
            // Back where the curve has been there is room.
            next.unwrap_or(control[2]),
        ];
        for piece in 1..=PIECES {
            let at = spline(&control, piece as f32 / PIECES as f32);
            track.go(at, f64::from(INTERVAL_S) / PIECES as f64);
        }
    }
    track
}

/// Whether the curve over three control points and a next one has room, also if it turns back afterwards.
fn is_free(scene: &Scene, control: &[Vec3; 4], next: Vec3) -> bool {
    let ahead = [control[1], control[2], control[3], next];
    let back = [control[2], control[3], next, control[3]];
    let further = [control[3], next, control[3], next];
    let is_clear = |at: Vec3| {
        (0..8).all(|k| {
            let (sine, cosine) = (std::f32::consts::TAU * k as f32 / 8.0).sin_cos();
            let around = CLEARANCE_M * Vec3::new(cosine, 0.0, sine);
            clear_m(scene, at, around) >= CLEARANCE_M
        })
    };
    [ahead, back, further].iter().all(|control| {
        let points: Vec<Vec3> = (0..=8).map(|k| spline(control, k as f32 / 8.0)).collect();
        let is_open = points.windows(2).all(|leg| !hits(scene, leg[0], leg[1]));
        is_open && points.into_iter().all(is_clear)
    })
}

/// A point of the uniform cubic B-spline, from 0 to 1 between the two middle control points.
fn spline([a, b, c, d]: &[Vec3; 4], t: f32) -> Vec3 {
    let u = 1.0 - t;
    let squares = t * t;
    let cubes = squares * t;
    (*a * (u * u * u)
        + *b * (3.0 * cubes - 6.0 * squares + 4.0)
        + *c * (-3.0 * cubes + 3.0 * squares + 3.0 * t + 1.0)
        + *d * cubes)
        / 6.0
}
