//! Objects in the yard: huts, containers, walls, barriers, sandbags, an obstacle course.

use glam::{DVec3, dvec3};

use super::super::builder::MeshBuilder;
use super::super::carving::Carving;
use super::super::solids::{Axis, Ends, heading};

/// Thickness of a hut's walls, in metres.
const HUT_WALL_M: f64 = 0.15;
/// Height of a hut's walls, in metres; the roof's underside lies a little lower.
const HUT_WALL_HEIGHT_M: f64 = 2.65;

/// Six huts: four along the north with their doors to the south, two along the west with their doors to the east.
pub(super) fn huts(b: &mut MeshBuilder) {
    b.part("huts");
    for x in [-20.0, 0.0, 24.0, 34.5] {
        hut(b, dvec3(x, 0.0, -31.0), dvec3(8.0, 0.0, 5.6), false);
    }
    for z in [-10.0, 10.0] {
        hut(b, dvec3(-32.0, 0.0, z), dvec3(5.6, 0.0, 8.0), true);
    }
}

/// One hut around the middle of its floor: walls with an open door (0.95 × 2.1 m) and windows, a floor, a gable roof.
/// The door is in the south wall, or, where the ridge lies north to south, in the east wall.
fn hut(b: &mut MeshBuilder, foot: DVec3, size: DVec3, ridge_along_z: bool) {
    let half = size * 0.5;
    let [min, max] = [foot - half, foot + half];
    let mut walls = Carving::in_air();
    walls.fill(min, max.with_y(HUT_WALL_HEIGHT_M));
    let inset = dvec3(HUT_WALL_M, 0.0, HUT_WALL_M);
    walls.carve(min + inset, (max - inset).with_y(HUT_WALL_HEIGHT_M));
    // Openings as (position along the front, width, sill, lintel), through the front or through the back wall.
    let mut open = |front: bool, along: f64, width: f64, sill: f64, lintel: f64| {
        let [low, high] = [along - 0.5 * width, along + 0.5 * width];
        let (low, high) = if ridge_along_z {
            let wall = if front {
                [max.x - HUT_WALL_M, max.x]
            } else {
                [min.x, min.x + HUT_WALL_M]
            };
            (
                dvec3(wall[0], sill, foot.z + low),
                dvec3(wall[1], lintel, foot.z + high),
            )
        } else {
            let wall = if front {
                [max.z - HUT_WALL_M, max.z]
            } else {
                [min.z, min.z + HUT_WALL_M]
            };
            (
                dvec3(foot.x + low, sill, wall[0]),
                dvec3(foot.x + high, lintel, wall[1]),
            )
        };
        walls.carve(low, high);
    };
    open(true, -1.2, 0.95, 0.0, 2.1);
    open(true, 1.6, 1.2, 0.9, 2.1);
    open(false, -2.0, 1.2, 0.9, 2.1);
    open(false, 2.0, 1.2, 0.9, 2.1);
    walls.skin(b, |face| {
        let underneath = face.normal.y < 0.0 && face.middle.y <= 0.0;
        (!underneath).then_some("wood_panel")
    });
    b.paint("wood_floor");
    b.standing(min + inset * 0.5, (max - inset * 0.5).with_y(0.06));
    // A prism over the walls: its underside, 50 mm below their top, is the ceiling.
    let (eaves, ridge, over) = (HUT_WALL_HEIGHT_M - 0.05, HUT_WALL_HEIGHT_M + 1.35, 0.4);
    let (across, along) = if ridge_along_z {
        (DVec3::X * (half.x + over), DVec3::Z * (half.z + over))
    } else {
        (DVec3::Z * (half.z + over), DVec3::X * (half.x + over))
    };
    let middle = foot.with_y(eaves);
    let mut gable = [
        middle - across - along,
        middle + across - along,
        foot.with_y(ridge) - along,
    ];
    // Counter-clockwise seen from the far gable.
    if (gable[1] - gable[0]).cross(gable[2] - gable[0]).dot(along) < 0.0 {
        gable.swap(0, 1);
    }
    b.extrude(&gable, along * 2.0, Ends::Closed);
}

/// Shipping containers (6.06 × 2.59 × 2.44 m), some on top of others, two of them open at one end.
pub(super) fn containers(b: &mut MeshBuilder) {
    const SIZE: DVec3 = dvec3(6.06, 2.59, 2.44);
    b.part("containers");
    b.paint("steel");
    for (x, z, turns) in [
        (24.0, -12.0, 0.0),
        (24.4, -8.4, 0.02),
        (33.0, -4.0, 0.24),
        (29.0, 4.0, 0.11),
        (22.6, 17.0, 0.0),
        (34.0, 22.0, 0.27),
        (27.0, 34.0, 0.04),
        (-30.0, 32.0, 0.3),
        (-24.0, 34.4, 0.97),
    ] {
        b.standing_turned(dvec3(x, 0.0, z), SIZE, turns, Ends::Far);
    }
    for (x, z, turns) in [(24.1, -10.2, 0.01), (27.6, 33.8, 0.05)] {
        b.standing_turned(dvec3(x, SIZE.y, z), SIZE, turns, Ends::Closed);
    }
    for (x, z) in [(-12.0, 20.0), (31.0, 14.0)] {
        let [min, max] = [dvec3(x, 0.0, z), dvec3(x + SIZE.x, SIZE.y, z + SIZE.z)];
        let wall = dvec3(0.08, 0.08, 0.08);
        let mut open_box = Carving::in_air();
        open_box.fill(min, max);
        open_box.carve(min + wall, (max - wall).with_x(max.x));
        open_box.skin(b, |face| (face.middle.y > 0.0).then_some("steel"));
    }
}

/// Walls of 2.4 m and barriers of 0.8 m.
pub(super) fn concrete(b: &mut MeshBuilder) {
    b.part("concrete_walls");
    b.paint("concrete");
    for (x, z, length, turns) in [
        (-4.0, 3.0, 6.0, 0.0),
        (7.0, 9.4, 5.0, 0.0),
        (-13.0, -4.0, 8.0, 0.21),
        (6.0, -10.0, 8.0, 0.9),
        (-20.0, 12.0, 7.0, 0.25),
        (0.0, 20.0, 9.0, 0.03),
        (-5.0, -18.0, 8.0, 0.0),
        (21.0, 25.0, 6.0, 0.22),
    ] {
        b.standing_turned(dvec3(x, 0.0, z), dvec3(length, 2.4, 0.3), turns, Ends::Far);
    }
    b.part("barriers");
    for i in 0..10 {
        let z = -36.0 + 7.4 * f64::from(i);
        barrier(b, dvec3(11.5, 0.0, z), 0.25);
    }
    for (x, z, turns) in [
        (-2.0, 10.6, 0.02),
        (-8.6, -13.0, 0.4),
        (5.0, -24.0, 0.1),
        (-26.0, 0.0, 0.3),
        (-10.0, 31.0, 0.45),
        (20.6, 6.6, 0.16),
    ] {
        barrier(b, dvec3(x, 0.0, z), turns);
    }
}

/// A barrier 3 m long with the profile of a New Jersey wall (0.6 m wide at its foot, 0.15 m at its top).
fn barrier(b: &mut MeshBuilder, foot: DVec3, turns: f64) {
    let (along, across) = heading(turns);
    let profile = [(-0.3, 0.0), (-0.3, 0.08), (-0.12, 0.33), (-0.075, 0.81)];
    let right = profile.iter().rev().map(|&(side, up)| (-side, up));
    let outline: Vec<DVec3> = profile
        .into_iter()
        .chain(right)
        .map(|(side, up)| foot + across * side + DVec3::Y * up - along * 1.5)
        .collect();
    // The profile is concave at its foot: the ends are fans around the middle of the bottom, not around a corner.
    for pair in outline.windows(2) {
        b.polygon(&[
            pair[0],
            pair[1],
            pair[1] + along * 3.0,
            pair[0] + along * 3.0,
        ]);
    }
    let hub = foot - along * 1.5;
    for pair in outline.windows(2) {
        b.triangle([hub, pair[1], pair[0]]);
        b.triangle([
            hub + along * 3.0,
            pair[0] + along * 3.0,
            pair[1] + along * 3.0,
        ]);
    }
}

/// Walls of four courses of filled bags, straight or curved.
pub(super) fn sandbags(b: &mut MeshBuilder) {
    b.part("sandbags");
    b.paint("sandbag");
    // Start, heading in turns and its change per bag, bags per course.
    for (x, z, turns, change, bags) in [
        (-3.0, 14.0, 0.97, 0.02, 9),
        (4.0, -4.0, 0.02, -0.02, 10),
        (-16.0, -9.0, 0.30, 0.03, 9),
        (18.6, 12.0, 0.80, 0.03, 9),
        (-18.0, 16.6, 0.05, -0.03, 10),
        (6.0, 24.0, 0.97, 0.03, 10),
        (-2.0, -24.0, 0.45, 0.02, 9),
        (30.0, -20.0, 0.60, 0.03, 10),
        (-34.0, 20.0, 0.85, 0.03, 9),
    ] {
        for course in 0..4 {
            let mut turns = turns;
            let mut position = dvec3(x, 0.22 * f64::from(course), z);
            if course % 2 == 1 {
                position += heading(turns).0 * 0.25;
            }
            for i in 0..bags {
                // Every other bag lies 6 mm higher: where bags overlap, their tops are not one plane.
                bag(b, position + DVec3::Y * (0.006 * f64::from(i % 2)), turns);
                position += heading(turns).0 * 0.49;
                turns += change;
            }
        }
    }
}

/// One bag, 0.5 m long, 0.4 m wide, a little higher than its course; lies over its neighbours' ends.
fn bag(b: &mut MeshBuilder, end: DVec3, turns: f64) {
    let (along, across) = heading(turns);
    let profile = [
        (-0.2, 0.12),
        (-0.13, 0.24),
        (0.13, 0.24),
        (0.2, 0.12),
        (0.13, -0.005),
        (-0.13, -0.005),
    ];
    let outline = profile.map(|(side, up)| end + across * side + DVec3::Y * up);
    b.extrude(&outline, along * 0.505, Ends::Closed);
}

/// Beams to climb over, posts with a bar, a watchtower with a pointed roof.
pub(super) fn course(b: &mut MeshBuilder) {
    b.part("course");
    b.paint("wood_panel");
    for i in 0..6 {
        let z = 14.0 + 3.0 * f64::from(i);
        let height = 0.7 + 0.15 * f64::from(i % 3);
        b.prism(
            Axis::X,
            dvec3(-38.0, height, z + 8.0),
            3.2,
            0.12,
            10,
            Ends::Closed,
        );
        for x in [-37.6, -35.2] {
            let foot = dvec3(x, 0.0, z + 8.0);
            b.prism(Axis::Y, foot, height, 0.1, 8, Ends::Open);
        }
    }
    let tower = dvec3(-10.0, 0.0, -32.0);
    for (x, z) in [(-1.2, -1.2), (-1.2, 1.2), (1.2, -1.2), (1.2, 1.2)] {
        b.prism(Axis::Y, tower + dvec3(x, 0.0, z), 6.1, 0.11, 8, Ends::Open);
    }
    b.cuboid(
        tower + dvec3(-1.5, 4.0, -1.5),
        tower + dvec3(1.5, 4.12, 1.5),
        &[],
    );
    // Parapets on three sides; they overlap at their corners, so each ends at its own height.
    for (x, z, top) in [
        ([-1.48, -1.42], [-1.48, 1.48], 5.0),
        ([-1.46, 1.48], [-1.46, -1.40], 4.99),
        ([-1.46, 1.46], [1.40, 1.46], 4.98),
    ] {
        b.standing(
            tower + dvec3(x[0], 4.12, z[0]),
            tower + dvec3(x[1], top, z[1]),
        );
    }
    let roof = [(6.0, 0.0), (6.0, 2.2), (7.3, 0.0)];
    b.revolve(Axis::Y, tower, &roof, 8);
}
