//! Two rooms and one door: the stress case (Figure 7 of the paper).
//!
//! A wall of 0.2 m separates two rooms of 8 × 6 × 3 m; its door is 0.95 m wide. The listener walks obliquely from one
//! room into the other, enters the opening 9 cm beside its far jamb and leaves it through that jamb: for 0.1 m (less than
//! a tenth of a second) the ears are inside the wall, 7 cm from its end. Paths from the other room appear one after the
//! other before the door and all change at the jamb. At the position at rest (the middle of the walk, 1.25 m before the
//! wall) the other room is audible through the door only.

use glam::{DVec3, Vec3, dvec3};

use super::builder::MeshBuilder;
use super::carving::Carving;
use super::solids::Side;
use super::{BenchmarkScene, Walk};

/// Ear height of the walk, in metres.
const EAR_M: f32 = 1.65;

/// Two rooms, one door; closed.
pub fn doorway() -> BenchmarkScene {
    let mut b = MeshBuilder::new();
    rooms(&mut b);
    furniture(&mut b);
    let walk = Walk::between(Vec3::new(12.7, EAR_M, 0.5), Vec3::new(6.2, EAR_M, 5.5));
    b.into_scene("doorway", SOURCES, walk)
}

/// The first eight are in the room where the walk ends, the others where it begins.
const SOURCES: [[f32; 3]; 16] = [
    [4.8, 1.5, 3.2],
    [1.2, 1.5, 1.0],
    [2.6, 1.4, 4.6],
    [6.6, 1.7, 1.2],
    [3.6, 1.6, 1.4],
    [1.0, 1.3, 3.0],
    [5.0, 1.2, 5.0],
    [6.4, 1.5, 3.2],
    [14.6, 1.5, 3.0],
    [9.4, 1.6, 1.0],
    [12.2, 1.4, 4.4],
    [15.2, 1.7, 5.2],
    [10.0, 1.3, 5.2],
    [15.0, 1.5, 0.9],
    [12.6, 1.2, 2.6],
    [13.6, 1.6, 5.4],
];

fn rooms(b: &mut MeshBuilder) {
    let mut air = Carving::in_rock();
    air.carve(DVec3::ZERO, dvec3(8.0, 3.0, 6.0));
    air.carve(dvec3(8.2, 0.0, 0.0), dvec3(16.2, 3.0, 6.0));
    air.carve(dvec3(8.0, 0.0, 3.1), dvec3(8.2, 2.1, 4.05));
    b.part("shell");
    air.skin(b, |face| {
        let in_wall = face.air.x > 8.0 && face.air.x < 8.2;
        Some(match (face.normal.y, in_wall) {
            (y, true) if y > 0.0 => "parquet_on_concrete",
            (_, true) => "wood_panel",
            (y, _) if y > 0.0 => "parquet_on_concrete",
            (y, _) if y < 0.0 => "plaster",
            // The two faces of the dividing wall; the outer walls are solid.
            _ if face.normal.x.abs() > 0.0 && (face.middle.x - 8.1).abs() < 0.2 => "gypsum_board",
            _ => "brick",
        })
    });
}

fn furniture(b: &mut MeshBuilder) {
    b.part("furniture");
    b.paint("wood_panel");
    // A bookcase and a sideboard against the wall.
    b.cuboid(
        dvec3(0.0, 0.0, 3.8),
        dvec3(0.35, 2.0, 5.6),
        &[Side::XMin, Side::YMin],
    );
    b.cuboid(
        dvec3(15.75, 0.0, 1.6),
        dvec3(16.2, 0.9, 3.8),
        &[Side::XMax, Side::YMin],
    );
    table(b, dvec3(2.4, 0.0, 2.4));
    table(b, dvec3(14.0, 0.0, 4.1));
    b.paint("upholstered_seat");
    b.cuboid(
        dvec3(9.0, 0.0, 6.0 - 0.85),
        dvec3(9.4, 0.45, 6.0),
        &[Side::YMin, Side::ZMax],
    );
    b.cuboid(
        dvec3(4.2, 0.0, 0.0),
        dvec3(6.0, 0.8, 0.8),
        &[Side::YMin, Side::ZMin],
    );
    b.paint("curtain");
    b.cuboid(dvec3(2.2, 0.3, 0.0), dvec3(3.8, 2.6, 0.08), &[Side::ZMin]);
    b.cuboid(
        dvec3(12.6, 0.3, 6.0 - 0.08),
        dvec3(14.2, 2.6, 6.0),
        &[Side::ZMax],
    );
    b.part("door");
    b.paint("door_wood");
    // The open leaf at the jamb away from the walk; its hinge side ends in the wall.
    b.cuboid(
        dvec3(7.09, 0.02, 3.02),
        dvec3(8.0, 2.06, 3.06),
        &[Side::XMax],
    );
}

/// 1.2 × 0.8 m, 0.74 m high, on two boards.
fn table(b: &mut MeshBuilder, foot: DVec3) {
    b.cuboid(
        foot + dvec3(-0.6, 0.70, -0.4),
        foot + dvec3(0.6, 0.74, 0.4),
        &[],
    );
    for x in [-0.5, 0.46] {
        let low = foot + dvec3(x, 0.0, -0.35);
        b.cuboid(low, low + dvec3(0.04, 0.70, 0.7), &[Side::YMin]);
    }
}
