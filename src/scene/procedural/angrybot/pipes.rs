//! Pipes under the ceiling and along the walls, and railings in the yard.

use glam::{DVec3, dvec3};

use super::super::builder::MeshBuilder;
use super::super::solids::{Axis, Ends};
use super::{BUILDING_X_M, CORRIDOR_Z_M, HEIGHT_M, NORTH_Z_M, SOUTH_Z_M, YARD_X_M, floor};

/// Length of one pipe between two flanges, in metres.
const PIPE_M: f64 = 3.0;
/// Sides of pipes.
const SIDES: u32 = 8;

/// Two runs through the corridor, one along each row of rooms, and risers in their corners.
pub(super) fn pipes(b: &mut MeshBuilder) {
    b.part("pipes");
    b.paint("steel");
    let [west, east] = [YARD_X_M[0], BUILDING_X_M - 0.2];
    for (z, y, radius) in [
        (CORRIDOR_Z_M[0] + 0.25, 2.7, 0.08),
        (CORRIDOR_Z_M[0] + 0.5, 2.75, 0.05),
        (CORRIDOR_Z_M[1] - 0.3, 2.65, 0.1),
        (NORTH_Z_M[0] + 0.3, 2.6, 0.07),
        (SOUTH_Z_M[0] + 0.3, 2.7, 0.07),
    ] {
        run(b, dvec3(west, y, z), east - west, radius);
    }
    for (x, z) in [
        (6.0, 5.9),
        (14.1, 5.9),
        (28.5, 5.9),
        (35.7, 5.9),
        (0.5, 14.9),
        (14.1, 14.9),
        (28.5, 14.9),
        (37.7, 14.9),
    ] {
        riser(b, floor(x, z));
    }
}

/// A pipe along x in lengths with a flange at every joint.
fn run(b: &mut MeshBuilder, start: DVec3, length: f64, radius: f64) {
    let pieces = (length / PIPE_M).round();
    let piece = length / pieces;
    for i in 0..pieces as u32 {
        let joint = start + DVec3::X * (piece * f64::from(i));
        b.prism(Axis::X, joint, piece, radius, SIDES, Ends::Open);
        if i > 0 {
            flange(b, Axis::X, joint - DVec3::X * 0.025, radius);
        }
    }
}

/// A ring around a pipe: closed discs, the pipe runs through them.
fn flange(b: &mut MeshBuilder, axis: Axis, start: DVec3, radius: f64) {
    b.prism(axis, start, 0.05, radius + 0.035, SIDES, Ends::Closed);
}

/// Two thin pipes from floor to ceiling with flanges and a hand wheel.
fn riser(b: &mut MeshBuilder, foot: DVec3) {
    for x in [0.0, -0.2] {
        let low = foot + dvec3(x, 0.0, 0.0);
        b.prism(Axis::Y, low, HEIGHT_M, 0.05, SIDES, Ends::Open);
        for y in [0.4, 2.3] {
            flange(b, Axis::Y, foot + dvec3(x, y, 0.0), 0.05);
        }
    }
    b.prism(
        Axis::X,
        foot + dvec3(-0.42, 1.1, 0.0),
        0.3,
        0.02,
        8,
        Ends::Closed,
    );
    b.prism(
        Axis::X,
        foot + dvec3(-0.44, 1.1, 0.0),
        0.04,
        0.12,
        16,
        Ends::Closed,
    );
}

/// A loading platform with railings, and more railings in the yard.
pub(super) fn railings(b: &mut MeshBuilder) {
    b.part("railings");
    b.paint("concrete");
    let [min, max] = [dvec3(40.0, 0.0, 20.4), dvec3(44.0, 0.6, 27.0)];
    b.standing(min, max);
    b.paint("steel");
    for x in [min.x + 0.2, max.x - 0.2] {
        railing(b, Axis::Z, dvec3(x, max.y, min.z + 0.1), 6.4);
    }
    railing(b, Axis::X, dvec3(min.x + 0.3, max.y, max.z - 0.2), 3.4);
    for (x, z) in [(2.0, 20.4), (10.0, 22.0), (28.0, 27.6)] {
        railing(b, Axis::X, floor(x, z), 6.0);
    }
    for z in [1.0, 17.0, 24.0] {
        railing(b, Axis::Z, floor(47.2, z), 6.0);
    }
}

/// Posts every metre or so and two rails.
fn railing(b: &mut MeshBuilder, axis: Axis, start: DVec3, length: f64) {
    let along = if axis == Axis::X { DVec3::X } else { DVec3::Z };
    let posts = length.round() as u32;
    for i in 0..=posts {
        let foot = start + along * (length * f64::from(i) / f64::from(posts));
        b.prism(Axis::Y, foot, 1.0, 0.025, 8, Ends::Open);
    }
    for y in [0.5, 1.0] {
        let end = start + DVec3::Y * y - along * 0.05;
        b.prism(axis, end, length + 0.1, 0.03, 8, Ends::Closed);
    }
}
