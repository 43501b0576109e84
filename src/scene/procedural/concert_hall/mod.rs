//! The concert hall: closed, reflective, 30 × 20 × 10 m.
//!
//! A rectangular shell on a grid of 2 m; a stage across one end with risers, chairs and an organ; 560 upholstered
//! seats, half of them on rising tiers; two balconies, columns, panels, wedges and banners on the upper walls, beams and
//! tilted reflectors under the ceiling. With the built-in materials T60 is about 2 s at mid frequencies. +x is from the
//! stage to the back, z across. The walk is across, between stage and seats.

mod seating;

use glam::{DVec3, Vec3, dvec3};

use super::builder::MeshBuilder;
use super::carving::Carving;
use super::solids::{Axis, Ends, Side};
use super::{BenchmarkScene, Walk};

/// Length (x), height (y) and width (z) of the hall, in metres.
const SIZE: DVec3 = dvec3(30.0, 10.0, 20.0);
/// Grid of the shell, in metres, as in a modeller's file; coplanar triangles merge at intake.
const SHELL_GRID_M: f64 = 2.0;
/// Depth and height of the stage, in metres.
const STAGE: [f64; 2] = [6.5, 1.0];

/// A closed hall with many reflecting surfaces.
pub fn concert_hall() -> BenchmarkScene {
    let mut b = MeshBuilder::new();
    shell(&mut b);
    stage(&mut b);
    seating::tiers(&mut b);
    seating::seats(&mut b);
    seating::balconies(&mut b);
    columns(&mut b);
    walls(&mut b);
    beams(&mut b);
    reflectors(&mut b);
    organ(&mut b);
    let walk = Walk::between(Vec3::new(7.75, 1.65, 3.0), Vec3::new(7.75, 1.65, 17.0));
    b.into_scene("concert_hall", SOURCES, walk)
}

/// Eight on the stage (1.0 m high), the others in aisles, behind the last row and on the balconies.
const SOURCES: [[f32; 3]; 16] = [
    [5.2, 2.5, 10.0],
    [4.4, 2.5, 6.0],
    [4.4, 2.5, 14.0],
    [2.7, 2.6, 8.0],
    [2.7, 2.6, 12.0],
    [5.4, 2.4, 2.4],
    [5.4, 2.4, 17.6],
    [1.6, 2.9, 10.0],
    [12.0, 1.5, 0.9],
    [15.4, 1.6, 19.1],
    [13.4, 1.4, 10.0],
    [28.6, 3.0, 10.0],
    [28.4, 3.1, 4.0],
    [28.2, 3.0, 15.6],
    [15.6, 5.8, 1.6],
    [23.6, 5.9, 18.4],
];

fn shell(b: &mut MeshBuilder) {
    let mut air = Carving::in_rock();
    air.carve(DVec3::ZERO, SIZE);
    for axis in 0..3 {
        for i in 1..(SIZE[axis] / SHELL_GRID_M) as u32 {
            air.cut(axis, f64::from(i) * SHELL_GRID_M);
        }
    }
    b.part("shell");
    air.skin(b, |face| {
        Some(match face.normal.y {
            y if y > 0.0 => "parquet_on_concrete",
            y if y < 0.0 => "gypsum_board",
            _ => "plaster",
        })
    });
}

fn stage(b: &mut MeshBuilder) {
    let [depth, height] = STAGE;
    let hidden = [Side::XMin, Side::YMin, Side::ZMin, Side::ZMax];
    b.part("stage");
    b.paint("wood_floor");
    b.cuboid(dvec3(0.0, 0.0, 0.0), dvec3(depth, height, SIZE.z), &hidden);
    // Risers for the choir, the conductor's stand, steps at both ends.
    b.standing(dvec3(0.9, height, 4.0), dvec3(2.2, height + 0.35, 16.0));
    b.standing(dvec3(5.6, height, 11.2), dvec3(6.3, height + 0.2, 11.9));
    for z in [0.8, 18.0] {
        for (i, x) in [7.4, 7.1, 6.8].into_iter().enumerate() {
            // Sides are inset from those of the step before: no two faces coincide.
            let (inset, top) = (0.01 * i as f64, 0.25 * (i + 1) as f64);
            b.cuboid(
                dvec3(depth, 0.0, z + inset),
                dvec3(x, top, z + 1.2 - inset),
                &[Side::XMin, Side::YMin],
            );
        }
    }
    b.part("stage_chairs");
    for i in 0..12 {
        let (row, column) = (f64::from(i / 6), f64::from(i % 6));
        let z = 4.4 + 2.0 * column + if column > 2.5 { 1.2 } else { 0.0 };
        stage_chair(
            b,
            dvec3(3.2 + 1.4 * row + 0.1 * (column - 2.5).abs(), height, z),
        );
    }
}

/// A wooden chair of 0.42 m: a seat, a back and four legs, facing the hall (+x).
fn stage_chair(b: &mut MeshBuilder, foot: DVec3) {
    b.paint("wood_panel");
    b.cuboid(
        foot + dvec3(-0.21, 0.42, -0.21),
        foot + dvec3(0.21, 0.46, 0.21),
        &[],
    );
    b.cuboid(
        foot + dvec3(-0.23, 0.44, -0.2),
        foot + dvec3(-0.2, 0.85, 0.2),
        &[],
    );
    b.paint("steel");
    for (x, z) in [(-0.19, -0.19), (-0.19, 0.19), (0.19, -0.19), (0.19, 0.19)] {
        b.prism(Axis::Y, foot + dvec3(x, 0.0, z), 0.43, 0.015, 4, Ends::Open);
    }
}

/// Columns from below the floor to above the ceiling, through the balconies' fronts, and half columns at the stage.
fn columns(b: &mut MeshBuilder) {
    b.part("columns");
    b.paint("marble");
    let length = SIZE.y;
    for z in [1.9, SIZE.z - 1.9] {
        for i in 0..6 {
            let foot = dvec3(9.6 + 4.0 * f64::from(i), 0.0, z);
            b.prism(Axis::Y, foot, length, 0.2, 12, Ends::Open);
        }
    }
    for z in [0.1, SIZE.z - 0.1] {
        b.prism(Axis::Y, dvec3(6.5, 0.0, z), length, 0.45, 16, Ends::Open);
    }
}

fn walls(b: &mut MeshBuilder) {
    b.part("wall_panels");
    for (far, wall_side) in [(false, Side::ZMin), (true, Side::ZMax)] {
        let across = |depth: f64| {
            if far {
                [SIZE.z - depth, SIZE.z]
            } else {
                [0.0, depth]
            }
        };
        b.paint("wood_panel");
        for i in 0..3 {
            let x = 0.5 + 1.9 * f64::from(i);
            let [z0, z1] = across(0.08);
            b.cuboid(dvec3(x, 1.6, z0), dvec3(x + 1.5, 4.8, z1), &[wall_side]);
        }
        b.paint("curtain");
        for i in 0..6 {
            let x = 3.6 + 4.0 * f64::from(i);
            let [z0, z1] = across(0.1);
            b.cuboid(dvec3(x, 8.5, z0), dvec3(x + 3.2, 9.8, z1), &[wall_side]);
        }
        b.paint("door_wood");
        let [z0, z1] = across(0.05);
        b.cuboid(
            dvec3(7.2, 0.0, z0),
            dvec3(8.8, 2.3, z1),
            &[Side::YMin, wall_side],
        );
    }
    for (material, depth, y, z) in [
        ("door_wood", 0.05, [seating::back_floor(), 3.8], [3.0, 5.0]),
        (
            "door_wood",
            0.05,
            [seating::back_floor(), 3.8],
            [15.0, 17.0],
        ),
        ("curtain", 0.12, [seating::back_floor(), 3.6], [5.6, 9.4]),
        ("curtain", 0.12, [seating::back_floor(), 3.6], [10.6, 14.4]),
        // One above the last rows, where no seats absorb.
        ("curtain", 0.12, [4.8, 9.4], [1.0, 19.0]),
    ] {
        b.paint(material);
        b.cuboid(
            dvec3(SIZE.x - depth, y[0], z[0]),
            dvec3(SIZE.x, y[1], z[1]),
            &[Side::XMax],
        );
    }
    b.part("wedges");
    b.paint("wood_panel");
    for i in 0..13 {
        let x = 2.0 + 2.0 * f64::from(i);
        // Counter-clockwise from above: the far wall's outline is reversed.
        let outline = |wall: f64, tip: f64, [a, b, c]: [f64; 3]| {
            [(a, wall), (b, tip), (c, wall)].map(|(along, z)| dvec3(x + along, 6.4, z))
        };
        let near = outline(0.0, 0.3, [0.1, 1.3, 1.9]);
        let far = outline(SIZE.z, SIZE.z - 0.3, [1.9, 1.3, 0.1]);
        for outline in [near, far] {
            b.extrude(&outline, DVec3::Y * 2.0, Ends::Closed);
        }
    }
}

/// Beams across under the ceiling, which scatter sound downwards that would circulate above the audience.
fn beams(b: &mut MeshBuilder) {
    b.part("beams");
    b.paint("gypsum_board");
    for i in 0..7 {
        let x = 3.0 + 4.0 * f64::from(i);
        b.cuboid(
            dvec3(x, SIZE.y - 0.6, 0.0),
            dvec3(x + 0.4, SIZE.y, SIZE.z),
            &[Side::ZMin, Side::ZMax],
        );
    }
}

/// Slabs of 3.0 × 4.2 m, tilted towards the seats, over the stage and the front rows.
fn reflectors(b: &mut MeshBuilder) {
    b.part("reflectors");
    b.paint("wood_panel");
    for (x, height, rise) in [
        (1.0, 6.6, 0.9),
        (4.4, 7.2, 0.7),
        (8.2, 7.8, 0.5),
        (12.4, 8.2, 0.3),
    ] {
        for z in [2.9, 7.9, 12.9] {
            let profile = [(0.0, 0.0), (3.0, rise), (3.0, rise + 0.06), (0.0, 0.06)];
            b.extrude(
                &profile.map(|(along, up)| dvec3(x + along, height + up, z)),
                DVec3::Z * 4.2,
                Ends::Closed,
            );
        }
    }
}

/// A case in the end wall and a row of pipes before it, longest in the middle.
fn organ(b: &mut MeshBuilder) {
    let floor = STAGE[1];
    b.part("organ");
    b.paint("wood_panel");
    b.cuboid(
        dvec3(0.0, floor, 5.0),
        dvec3(0.5, floor + 2.4, 15.0),
        &[Side::XMin, Side::YMin],
    );
    b.paint("steel");
    for i in 0..20 {
        let from_middle = (f64::from(i) - 9.5).abs();
        let foot = dvec3(0.25, floor + 2.4, 5.25 + 0.5 * f64::from(i));
        b.prism(Axis::Y, foot, 4.0 - 0.2 * from_middle, 0.18, 10, Ends::Far);
    }
}
