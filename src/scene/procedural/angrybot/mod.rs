//! Angrybot: rooms and corridors, half of the rooms open to a yard without a roof.
//!
//! One floor, 48.2 × 32.2 m, cut out of solid blocks: walls, ceilings and openings have real thickness. From
//! north (z = 0) to south: a row of six closed rooms, a corridor of 2.6 m, a row of six rooms with gates and windows to
//! the yard, and the yard, which extends past the building's east end. The walk is a straight line from a northern room
//! through its door, the corridor, a southern room and its gate into the yard.

mod furnishing;
mod pipes;

use glam::{DVec3, Vec3};

use super::builder::MeshBuilder;
use super::carving::{Block, Carving, Face};
use super::{BenchmarkScene, Walk};

/// Thickness of walls, floor slab and roof, in metres.
const WALL_M: f64 = 0.2;
/// Height of rooms and of the yard's wall, in metres.
const HEIGHT_M: f64 = 3.0;
/// Widths of the rooms from west to east, in metres.
const NORTH_WIDTHS_M: [f64; 6] = [6.0, 8.0, 5.0, 9.0, 7.0, 7.0];
const SOUTH_WIDTHS_M: [f64; 6] = [8.0, 6.0, 7.0, 7.0, 9.0, 5.0];
/// From north to south: the rows of rooms and the corridor between them, the yard, in metres.
const NORTH_Z_M: [f64; 2] = [0.2, 6.2];
const CORRIDOR_Z_M: [f64; 2] = [6.4, 9.0];
const SOUTH_Z_M: [f64; 2] = [9.2, 15.2];
const YARD_Z_M: [f64; 2] = [15.4, 32.0];
/// East end of the building's outer wall and of the yard, in metres.
const BUILDING_X_M: f64 = 43.4;
const YARD_X_M: [f64; 2] = [0.2, 48.0];
/// Width and height of doors and of gates, in metres.
const DOOR_M: [f64; 2] = [1.0, 2.1];
const GATE_M: [f64; 2] = [2.4, 2.4];
/// Windows: width, sill and lintel, in metres.
const WINDOW_M: [f64; 3] = [1.5, 1.0, 2.1];
/// Middles of the doors to the corridor and of the gates, one per room, in metres east.
const NORTH_DOORS_X_M: [f64; 6] = [4.6, 8.0, 17.1, 24.0, 31.0, 41.0];
const SOUTH_DOORS_X_M: [f64; 6] = [4.6, 12.0, 17.1, 24.0, 31.0, 41.0];
const GATES_X_M: [f64; 6] = [6.0, 10.4, 19.0, 24.0, 31.4, 40.6];
/// Middles of the windows between southern rooms and yard, in metres east.
const WINDOWS_X_M: [f64; 4] = [2.2, 13.3, 27.4, 35.6];

/// Rooms, corridor and yard.
pub fn angrybot() -> BenchmarkScene {
    let mut b = MeshBuilder::new();
    building(&mut b);
    furnishing::windows_and_doors(&mut b);
    furnishing::crates(&mut b);
    furnishing::barrels(&mut b);
    furnishing::machines(&mut b);
    pipes::pipes(&mut b);
    pipes::railings(&mut b);
    let walk = Walk::between(Vec3::new(24.0, 1.65, 4.6), Vec3::new(24.0, 1.65, 21.4));
    b.into_scene("angrybot", SOURCES, walk)
}

/// Four in northern rooms, two in the corridor, four in southern rooms, six in the yard.
const SOURCES: [[f32; 3]; 16] = [
    [22.4, 1.5, 3.0],
    [27.2, 1.5, 11.6],
    [20.4, 1.6, 18.6],
    [36.0, 1.5, 7.7],
    [12.4, 1.6, 7.6],
    [11.0, 1.5, 3.2],
    [33.0, 1.4, 2.4],
    [17.6, 1.6, 4.8],
    [18.4, 1.5, 12.4],
    [6.4, 1.4, 12.2],
    [33.4, 1.5, 12.8],
    [29.0, 1.7, 20.6],
    [8.0, 1.5, 22.0],
    [38.0, 1.3, 27.0],
    [45.8, 1.6, 9.0],
    [16.0, 1.5, 29.0],
];

/// Rooms of a row: along x from their widths, within a range of z.
fn row(widths: &[f64; 6], z: [f64; 2]) -> Vec<Block> {
    let mut x = YARD_X_M[0];
    widths
        .iter()
        .map(|width| {
            let room = Block::new([x, x + width], [0.0, HEIGHT_M], z);
            x += width + WALL_M;
            room
        })
        .collect()
}

fn building(b: &mut MeshBuilder) {
    let [west, east] = YARD_X_M;
    let south = YARD_Z_M[1];
    let north_rooms = row(&NORTH_WIDTHS_M, NORTH_Z_M);
    let south_rooms = row(&SOUTH_WIDTHS_M, SOUTH_Z_M);
    let corridor = Block::new([west, BUILDING_X_M - WALL_M], [0.0, HEIGHT_M], CORRIDOR_Z_M);
    let roof = HEIGHT_M + WALL_M;

    let mut solid = Carving::in_air();
    // Slab and yard wall, the building on them, then all air.
    let outside = Block::new(
        [0.0, east + WALL_M],
        [-WALL_M, HEIGHT_M],
        [0.0, south + WALL_M],
    );
    let house = Block::new([0.0, BUILDING_X_M], [0.0, roof], [0.0, YARD_Z_M[0]]);
    solid.fill(outside.min, outside.max);
    let mut air = vec![
        Block::new(YARD_X_M, [0.0, HEIGHT_M], YARD_Z_M),
        Block::new(
            [BUILDING_X_M, east],
            [0.0, HEIGHT_M],
            [NORTH_Z_M[0], YARD_Z_M[0]],
        ),
    ];
    for yard in &air {
        solid.carve(yard.min, yard.max);
    }
    solid.fill(house.min, house.max);
    air.clear();
    air.extend(north_rooms.iter().chain(&south_rooms).copied());
    air.push(corridor);
    let across = |x: f64, width: f64, y: [f64; 2], z: [f64; 2]| {
        Block::new([x - 0.5 * width, x + 0.5 * width], y, z)
    };
    let [door_y, gate_y, window_y] = [
        [0.0, DOOR_M[1]],
        [0.0, GATE_M[1]],
        [WINDOW_M[1], WINDOW_M[2]],
    ];
    for x in NORTH_DOORS_X_M {
        air.push(across(
            x,
            DOOR_M[0],
            door_y,
            [NORTH_Z_M[1], CORRIDOR_Z_M[0]],
        ));
    }
    for x in SOUTH_DOORS_X_M {
        air.push(across(
            x,
            DOOR_M[0],
            door_y,
            [CORRIDOR_Z_M[1], SOUTH_Z_M[0]],
        ));
    }
    let front = [SOUTH_Z_M[1], YARD_Z_M[0]];
    for x in GATES_X_M {
        air.push(across(x, GATE_M[0], gate_y, front));
    }
    for x in WINDOWS_X_M {
        air.push(across(x, WINDOW_M[0], window_y, front));
    }
    // From room to room in either row, and from the corridor's east end to the yard.
    for (rooms, i, z) in [
        (&north_rooms, 0, 3.0),
        (&north_rooms, 3, 2.0),
        (&south_rooms, 1, 11.0),
    ] {
        let wall = [rooms[i].max.x, rooms[i + 1].min.x];
        air.push(Block::new(wall, door_y, [z, z + DOOR_M[0]]));
    }
    let end = [corridor.max.x, BUILDING_X_M];
    air.push(Block::new(
        end,
        gate_y,
        [CORRIDOR_Z_M[0] + 0.5, CORRIDOR_Z_M[1] - 0.5],
    ));
    for block in &air {
        solid.carve(block.min, block.max);
    }
    b.part("building");
    solid.skin(b, |face| {
        // Faces below the slab and around it are not reachable.
        let buried = face.middle.y < 0.0;
        (!buried).then(|| paint(face, &north_rooms, &south_rooms, &corridor, &house))
    });
}

/// Material of a face, by the room that it faces.
fn paint(
    face: &Face,
    north: &[Block],
    south: &[Block],
    corridor: &Block,
    house: &Block,
) -> &'static str {
    let (up, down) = (face.normal.y > 0.0, face.normal.y < 0.0);
    let within = |rooms: &[Block]| rooms.iter().position(|room| room.contains(face.air));
    let by_kind = |floor, ceiling, wall| match (up, down) {
        (true, _) => floor,
        (_, true) => ceiling,
        _ => wall,
    };
    if let Some(room) = within(north) {
        let floor = if room % 3 == 1 { "carpet" } else { "concrete" };
        let ceiling = if room % 2 == 0 {
            "acoustic_ceiling"
        } else {
            "gypsum_board"
        };
        by_kind(floor, ceiling, "plaster")
    } else if within(south).is_some() {
        by_kind("concrete", "concrete", "brick")
    } else if corridor.contains(face.air) {
        by_kind("concrete", "plaster", "plaster")
    } else if house.contains(face.air) {
        // Reveals of doors, gates and windows.
        by_kind("concrete", "concrete", "concrete")
    } else if up && face.middle.y < 0.5 * HEIGHT_M {
        "asphalt"
    } else if up && face.middle.y > HEIGHT_M + 0.5 * WALL_M {
        // The roof; the yard wall's top, 0.2 m lower, is brick like its sides.
        "gravel"
    } else {
        "brick"
    }
}

/// A point on the floor.
fn floor(x: f64, z: f64) -> DVec3 {
    DVec3::new(x, 0.0, z)
}
