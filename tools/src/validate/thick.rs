//! Law *thick*: behind obstacles of growing thickness the level falls without a cliff, however they are wound.

use glam::Vec3;

use super::Row;
use super::solids::{Solids, levels_db, paths};
use foresound::acoustics::BANDS;
use foresound::error::Result;

/// Ratio of successive thicknesses: from 0.3 to 30 m in 96 steps.
const RATIO: f32 = 1.049;
const THINNEST_M: f32 = 0.3;
const STEPS: i32 = 97;

/// Largest change of a level over one step. By the solution for a thick barrier (\[PIERCE74\]) the level falls by at most
/// 20 lg of the ratio, 0.4 dB; the spherical spreading of a path that is longer by the step adds as much.
const STEP_BOUND_DB: f64 = 1.0;

/// Least level at 63 Hz behind 30 m relative to that behind 5 m. Two wedges of a rigid barrier in series lose 10 lg of the
/// ratio of thicknesses, 8 dB, and the spreading from 25 m to 50 m adds 6 dB.
const LEAST_DB: f64 = -20.0;

/// Largest difference of levels between a solid wound outwards and the same wound inwards.
const WINDING_BOUND_DB: f64 = 0.01;

pub(super) fn rows() -> Result<Vec<Row>> {
    let mut levels: Vec<(f32, [f64; BANDS])> = Vec::new();
    let mut winding_db = 0f64;
    for step in 0..STEPS {
        let thickness_m = THINNEST_M * RATIO.powi(step);
        let outwards = level(thickness_m, false)?;
        if step % 12 == 0 {
            let inwards = level(thickness_m, true)?;
            winding_db = (0..BANDS).fold(winding_db, |worst, b| {
                worst.max((inwards[b] - outwards[b]).abs())
            });
        }
        levels.push((thickness_m, outwards));
    }
    let mut jump_db = 0f64;
    for pair in levels.windows(2) {
        for b in 0..BANDS {
            jump_db = jump_db.max((pair[1].1[b] - pair[0].1[b]).abs());
        }
    }
    let near = levels.iter().find(|(m, _)| *m > 5.0);
    let fall_db = match (near, levels.last()) {
        (Some((_, near)), Some((_, far))) => far[0] - near[0],
        _ => f64::NEG_INFINITY,
    };
    Ok(vec![
        Row::at_most(
            "thick: change over 5 % of thickness, 0.3 to 30 m",
            jump_db,
            STEP_BOUND_DB,
            "dB",
        ),
        Row::at_least(
            "thick: level behind 30 m relative to 5 m, 63 Hz",
            fall_db,
            LEAST_DB,
            "dB",
        ),
        Row::at_most(
            "thick: obstacle wound inwards",
            winding_db,
            WINDING_BOUND_DB,
            "dB",
        ),
    ])
}

/// Level behind a block on the ground, 5 m from source and listener.
fn level(thickness_m: f32, inwards: bool) -> Result<[f64; BANDS]> {
    let mut block = Solids::new(0.0);
    block.solid(
        Vec3::new(0.0, 0.0, -30.0),
        Vec3::new(thickness_m, 4.0, 30.0),
    );
    if inwards {
        for triangle in &mut block.mesh.triangles {
            triangle.swap(1, 2);
        }
    }
    block.sheet(
        Vec3::new(-90.0, 0.0, -90.0),
        Vec3::Z * 180.0,
        Vec3::X * 180.0,
    );
    let listener = Vec3::new(thickness_m + 5.0, 1.6, -0.4);
    let paths = paths(&block.commit()?, Vec3::new(-5.0, 1.7, 0.3), listener)?;
    Ok(levels_db(&paths))
}
