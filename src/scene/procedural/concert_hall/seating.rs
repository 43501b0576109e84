//! Seats: rows on the floor, on tiers and on two balconies.

use glam::{DVec3, dvec3};

use super::super::builder::MeshBuilder;
use super::super::carving::Carving;
use super::super::solids::{Ends, Side};
use super::SIZE;

/// Front of the first row, pitch of rows and of seats in a row, in metres.
const FIRST_ROW_M: f64 = 9.2;
const ROW_PITCH_M: f64 = 0.9;
const SEAT_PITCH_M: f64 = 0.5;
/// Rows on the flat floor, then as many on tiers that rise by a step each.
const FLAT_ROWS: u32 = 10;
const TIER_ROWS: u32 = 10;
const TIER_RISE_M: f64 = 0.15;
/// Balconies: depth, underside and top, front end, in metres.
const BALCONY_DEPTH_M: f64 = 2.2;
const BALCONY: [f64; 2] = [4.0, 4.3];
const BALCONY_FRONT_M: f64 = 9.0;

/// Height of the floor under a row, in metres.
fn row_floor(row: u32) -> f64 {
    TIER_RISE_M * f64::from((row + 1).saturating_sub(FLAT_ROWS))
}

/// Height of the floor behind the last row, in metres.
pub(super) fn back_floor() -> f64 {
    row_floor(FLAT_ROWS + TIER_ROWS - 1)
}

fn row_front(row: u32) -> f64 {
    FIRST_ROW_M + ROW_PITCH_M * f64::from(row)
}

/// Steps across the whole width. Faces behind the side walls and below the floor are omitted.
pub(super) fn tiers(b: &mut MeshBuilder) {
    let mut steps = Carving::in_air();
    for row in FLAT_ROWS..FLAT_ROWS + TIER_ROWS {
        steps.fill(
            dvec3(row_front(row) - 0.2, row_floor(row) - TIER_RISE_M, 0.0),
            dvec3(SIZE.x, row_floor(row), SIZE.z),
        );
    }
    b.part("tiers");
    steps.skin(b, |face| {
        let hidden = face.middle.y <= 0.0 || face.normal.z != 0.0 || face.normal.x > 0.0;
        (!hidden).then_some("wood_floor")
    });
}

pub(super) fn seats(b: &mut MeshBuilder) {
    b.part("seats");
    for row in 0..FLAT_ROWS + TIER_ROWS {
        let at = dvec3(row_front(row), row_floor(row), 0.0);
        seat_row(b, at.with_z(2.5), 14);
        seat_row(b, at.with_z(10.5), 14);
    }
}

/// Seats side by side from `start` (front, floor, first end) along z, facing the stage (−x). Standards are between them
/// and at both ends; cushions and backs are sunk into the standards.
fn seat_row(b: &mut MeshBuilder, start: DVec3, count: u32) {
    for i in 0..=count {
        let low = start + dvec3(0.02, 0.0, SEAT_PITCH_M * f64::from(i) - 0.03);
        b.paint("wood_panel");
        b.standing(low, low + dvec3(0.48, 0.6, 0.06));
        if i == count {
            break;
        }
        b.paint("upholstered_seat");
        let low = start + dvec3(0.0, 0.36, SEAT_PITCH_M * f64::from(i) + 0.025);
        b.cuboid(low, low + dvec3(0.48, 0.10, 0.45), &[]);
        let back = [(0.44, 0.04), (0.52, 0.04), (0.60, 0.59), (0.53, 0.59)];
        b.extrude(
            &back.map(|(x, y)| low + dvec3(x, y, -0.005)),
            DVec3::Z * 0.46,
            Ends::Closed,
        );
    }
}

/// Both sides, the second a mirror image of the first.
pub(super) fn balconies(b: &mut MeshBuilder) {
    let [under, top] = BALCONY;
    b.part("balconies");
    for (far, wall_side) in [(false, Side::ZMin), (true, Side::ZMax)] {
        // A range across, measured from this side's wall.
        let across = |low: f64, high: f64| {
            if far {
                [SIZE.z - high, SIZE.z - low]
            } else {
                [low, high]
            }
        };
        let [z0, z1] = across(0.0, BALCONY_DEPTH_M);
        b.paint("plaster");
        b.cuboid(
            dvec3(BALCONY_FRONT_M, under, z0),
            dvec3(SIZE.x, top, z1),
            &[Side::XMax, wall_side],
        );
        b.paint("wood_panel");
        let [z0, z1] = across(BALCONY_DEPTH_M - 0.14, BALCONY_DEPTH_M - 0.04);
        b.standing(
            dvec3(BALCONY_FRONT_M + 0.04, top, z0),
            dvec3(SIZE.x, top + 0.9, z1),
        );
        let [z0, z1] = across(0.0, BALCONY_DEPTH_M - 0.1);
        b.standing(
            dvec3(BALCONY_FRONT_M + 0.06, top, z0),
            dvec3(BALCONY_FRONT_M + 0.14, top + 0.88, z1),
        );
        for row in 0..14 {
            let [z, _] = across(0.2, 1.2);
            seat_row(b, dvec3(9.9 + 1.4 * f64::from(row), top, z), 2);
        }
    }
}
