//! Objects in rooms and yard: panes, door leaves, crates, barrels, machines.

use glam::{DVec3, dvec3};

use super::super::builder::MeshBuilder;
use super::super::carving::Carving;
use super::super::solids::{Axis, Ends, Side};
use super::{
    DOOR_M, NORTH_DOORS_X_M, NORTH_Z_M, SOUTH_DOORS_X_M, SOUTH_Z_M, WINDOW_M, WINDOWS_X_M,
    YARD_Z_M, floor,
};

/// Panes in the windows, and an open leaf at some doors, perpendicular to its wall.
pub(super) fn windows_and_doors(b: &mut MeshBuilder) {
    b.part("panes");
    b.paint("glass");
    let [width, sill, lintel] = WINDOW_M;
    let z = 0.5 * (SOUTH_Z_M[1] + YARD_Z_M[0]);
    for x in WINDOWS_X_M {
        b.cuboid(
            dvec3(x - 0.5 * width, sill, z - 0.006),
            dvec3(x + 0.5 * width, lintel, z + 0.006),
            &[],
        );
    }
    b.part("doors");
    b.paint("door_wood");
    let leaf = |b: &mut MeshBuilder, x: f64, z: [f64; 2], without: Side| {
        let jamb = x + 0.5 * DOOR_M[0] + 0.03;
        b.cuboid(
            dvec3(jamb, 0.01, z[0]),
            dvec3(jamb + 0.04, DOOR_M[1] - 0.04, z[1]),
            &[without],
        );
    };
    for x in [0, 1, 3, 4].map(|i: usize| NORTH_DOORS_X_M[i]) {
        let wall = NORTH_Z_M[1];
        leaf(b, x, [wall - DOOR_M[0], wall], Side::ZMax);
    }
    for x in [0, 2, 4, 5].map(|i: usize| SOUTH_DOORS_X_M[i]) {
        let wall = SOUTH_Z_M[0];
        leaf(b, x, [wall, wall + DOOR_M[0]], Side::ZMin);
    }
}

/// Single framed crates, and heaps of plain ones.
pub(super) fn crates(b: &mut MeshBuilder) {
    b.part("crates");
    for (x, z, size) in [
        (1.0, 1.0, 1.0),
        (2.4, 0.9, 0.8),
        (13.2, 1.2, 1.0),
        (26.9, 1.0, 1.2),
        (1.2, 10.6, 1.2),
        (37.0, 14.0, 1.0),
        (20.2, 28.4, 1.2),
        (33.0, 24.6, 1.2),
        (3.0, 27.0, 1.2),
        (45.4, 2.6, 1.2),
    ] {
        framed_crate(b, floor(x, z), size);
    }
    b.paint("wood_panel");
    for (x, z, high) in [
        (11.6, 5.4, 1),
        (30.4, 1.2, 2),
        (42.2, 1.4, 2),
        (9.2, 12.8, 1),
        (9.6, 10.2, 2),
        (28.0, 9.9, 1),
        (42.4, 14.4, 2),
        (11.0, 18.0, 3),
        (12.4, 18.3, 2),
        (13.6, 17.6, 1),
        (27.0, 25.4, 3),
        (28.4, 25.0, 2),
        (6.4, 30.4, 2),
        (40.2, 30.6, 3),
        (46.6, 20.2, 2),
        (46.0, 29.6, 1),
    ] {
        for i in 0..high {
            let (size, lift) = (0.9 - 0.06 * f64::from(i), f64::from(i) * 0.88);
            let turns = 0.03 * f64::from(i) + 0.01 * x;
            // Upper ones overhang the lower ones' sides.
            let ends = if i == 0 { Ends::Far } else { Ends::Closed };
            b.standing_turned(
                floor(x, z) + DVec3::Y * lift,
                dvec3(size, 0.88, size),
                turns,
                ends,
            );
        }
    }
}

/// A cube of recessed panels in a frame of boards.
fn framed_crate(b: &mut MeshBuilder, foot: DVec3, size: f64) {
    const BOARD_M: f64 = 0.1;
    const RECESS_M: f64 = 0.025;
    let half = dvec3(0.5 * size, 0.0, 0.5 * size);
    let [min, max] = [foot - half, (foot + half).with_y(size)];
    let mut body = Carving::in_air();
    body.fill(min, max);
    let [inner_min, inner_max] = [min + BOARD_M, max - BOARD_M];
    for axis in 0..3 {
        for near in [true, false] {
            if axis == 1 && near {
                continue;
            }
            let [mut low, mut high] = [inner_min, inner_max];
            if near {
                [low[axis], high[axis]] = [min[axis], min[axis] + RECESS_M];
            } else {
                [low[axis], high[axis]] = [max[axis] - RECESS_M, max[axis]];
            }
            body.carve(low, high);
        }
    }
    body.skin(b, |face| {
        (face.normal.y >= 0.0 || face.middle.y > 0.0).then_some("wood_panel")
    });
}

/// Steel drums of 0.6 m with two swages.
pub(super) fn barrels(b: &mut MeshBuilder) {
    // Height and radius of the wall from the floor up; the last two are the rim and the lid inside it.
    const WALL: [(f64, f64); 11] = [
        (0.0, 0.29),
        (0.28, 0.29),
        (0.30, 0.305),
        (0.32, 0.29),
        (0.57, 0.29),
        (0.59, 0.305),
        (0.61, 0.29),
        (0.86, 0.29),
        (0.88, 0.30),
        (0.865, 0.27),
        (0.865, 0.0),
    ];
    b.part("barrels");
    b.paint("steel");
    for (x, z) in [
        (5.4, 0.9),
        (5.5, 1.7),
        (18.9, 0.8),
        (19.1, 1.6),
        (21.0, 5.4),
        (35.4, 5.4),
        (35.3, 4.6),
        (7.6, 14.6),
        (7.6, 13.9),
        (14.0, 9.9),
        (22.3, 14.6),
        (37.4, 9.8),
        (1.0, 16.4),
        (1.8, 16.3),
        (1.4, 17.1),
        (17.0, 23.4),
        (17.7, 23.6),
        (17.3, 24.2),
        (31.0, 29.8),
        (44.6, 14.0),
        (44.5, 13.2),
        (36.0, 17.0),
    ] {
        b.revolve(Axis::Y, floor(x, z), &WALL, 12);
    }
}

/// A lathe-like bench, presses, tanks, a hopper.
pub(super) fn machines(b: &mut MeshBuilder) {
    b.part("machines");
    b.paint("steel");
    for (x, z) in [
        (10.6, 0.9),
        (34.6, 1.0),
        (19.6, 9.9),
        (33.8, 10.0),
        (3.6, 14.4),
    ] {
        bench(b, floor(x, z));
    }
    for (x, z) in [
        (39.6, 3.2),
        (2.0, 4.6),
        (12.9, 14.2),
        (26.8, 14.3),
        (45.2, 24.0),
    ] {
        press(b, floor(x, z));
    }
    for (x, z, radius) in [
        (15.4, 1.2, 0.6),
        (41.0, 11.6, 0.7),
        (44.6, 17.8, 1.0),
        (8.6, 26.4, 1.1),
        (35.6, 30.4, 1.0),
    ] {
        tank(b, floor(x, z), radius);
    }
    hopper(b, floor(24.6, 29.0));
}

/// A bed on two feet with a headstock and a chuck.
fn bench(b: &mut MeshBuilder, foot: DVec3) {
    for x in [-0.8, 0.5] {
        b.standing(
            foot + dvec3(x, 0.0, -0.25),
            foot + dvec3(x + 0.3, 0.72, 0.25),
        );
    }
    b.cuboid(
        foot + dvec3(-1.0, 0.70, -0.3),
        foot + dvec3(1.0, 0.85, 0.3),
        &[],
    );
    b.standing(
        foot + dvec3(-0.95, 0.85, -0.22),
        foot + dvec3(-0.4, 1.3, 0.22),
    );
    let chuck = foot + dvec3(-0.4, 1.08, 0.0);
    b.prism(Axis::X, chuck, 0.14, 0.13, 16, Ends::Far);
    b.prism(Axis::X, chuck, 1.1, 0.03, 8, Ends::Far);
    b.standing(foot + dvec3(0.6, 0.85, -0.12), foot + dvec3(0.9, 1.2, 0.12));
}

/// A frame with a ram over a table.
fn press(b: &mut MeshBuilder, foot: DVec3) {
    b.standing(foot + dvec3(-0.5, 0.0, -0.4), foot + dvec3(0.5, 0.8, 0.4));
    for x in [-0.45, 0.33] {
        b.standing(
            foot + dvec3(x, 0.8, -0.06),
            foot + dvec3(x + 0.12, 1.75, 0.06),
        );
    }
    b.cuboid(
        foot + dvec3(-0.52, 1.73, -0.3),
        foot + dvec3(0.52, 2.1, 0.3),
        &[],
    );
    b.prism(
        Axis::Y,
        foot + dvec3(0.0, 1.2, 0.0),
        0.55,
        0.1,
        16,
        Ends::Closed,
    );
}

/// An upright tank with a domed top.
fn tank(b: &mut MeshBuilder, foot: DVec3, radius: f64) {
    let body = 2.2 * radius;
    let rings = [
        (0.0, 1.0),
        (0.5 * body, 1.0),
        (body, 1.0),
        (body + 0.2 * radius, 0.92),
        (body + 0.36 * radius, 0.72),
        (body + 0.45 * radius, 0.4),
        (body + 0.48 * radius, 0.0),
    ]
    .map(|(up, share)| (up, share * radius));
    b.revolve(Axis::Y, foot, &rings, 24);
}

/// A square bin over a cone on four legs.
fn hopper(b: &mut MeshBuilder, foot: DVec3) {
    for (x, z) in [(-0.9, -0.9), (-0.9, 0.9), (0.9, -0.9), (0.9, 0.9)] {
        b.prism(Axis::Y, foot + dvec3(x, 0.0, z), 2.1, 0.06, 8, Ends::Open);
    }
    b.cuboid(
        foot + dvec3(-1.1, 2.0, -1.1),
        foot + dvec3(1.1, 3.0, 1.1),
        &[],
    );
    b.revolve(Axis::Y, foot, &[(1.0, 0.0), (1.0, 0.15), (2.0, 0.9)], 24);
}
