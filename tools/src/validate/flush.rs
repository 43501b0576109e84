//! Law *flush*: a solid that stands on a plane blocks sound as one that is sunk into it does, whether it stands exactly,
//! is sunk or lacks a millimetre.

use glam::Vec3;

use super::Row;
use super::solids::{Solids, levels_db, paths};
use foresound::acoustics::BANDS;
use foresound::error::Result;

/// Depths in metres; the last one is the reference. Solids that stand a millimetre off the plane leave a crack.
const DEPTHS_M: [f32; 6] = [-0.001, 0.0, 0.0005, 0.001, 0.004, 0.02];

/// Share of the energy that a solid transmits: −70 dB.
const TRANSMISSION: f32 = 1e-7;

/// Largest difference of levels.
const BOUND_DB: f64 = 1.0;

/// A case: its name, its solids at a depth, and the positions that are heard.
type FlushCase = (&'static str, fn(f32) -> Solids, [Vec3; 4]);

pub(super) fn rows() -> Result<Vec<Row>> {
    let cases: [FlushCase; 3] = [
        (
            "wall of 12 x 80 m on the ground",
            wall,
            [
                Vec3::new(-6.0, 1.5, 0.3),
                Vec3::new(7.0, 1.7, -3.1),
                Vec3::new(4.0, 1.2, 2.2),
                Vec3::new(20.0, 3.0, 6.0),
            ],
        ),
        (
            "partition between floor, ceiling and walls",
            partition,
            [
                Vec3::new(2.1, 1.5, 2.3),
                Vec3::new(7.0, 1.7, 3.1),
                Vec3::new(6.2, 1.2, 1.2),
                Vec3::new(9.0, 2.0, 4.1),
            ],
        ),
        (
            "sheet between floor, ceiling and walls",
            sheet,
            [
                Vec3::new(2.1, 1.5, 2.3),
                Vec3::new(7.0, 1.7, 3.1),
                Vec3::new(6.2, 1.2, 1.2),
                Vec3::new(9.0, 2.0, 4.1),
            ],
        ),
    ];
    let mut rows = Vec::new();
    for (name, build, [source, listeners @ ..]) in cases {
        let mut worst = 0f64;
        for listener in listeners {
            let level = |depth_m: f32| -> Result<[f64; BANDS]> {
                let scene = build(depth_m).commit()?;
                Ok(levels_db(&paths(&scene, source, listener)?))
            };
            let [depths @ .., deepest] = &DEPTHS_M;
            let reference = level(*deepest)?;
            for &depth_m in depths {
                let here = level(depth_m)?;
                for b in 0..BANDS {
                    worst = worst.max((here[b] - reference[b]).abs());
                }
            }
        }
        let law = format!("flush: {name}, -1 to 20 mm sunk");
        rows.push(Row::at_most(law, worst, BOUND_DB, "dB"));
    }
    Ok(rows)
}

/// A slab on a plane that is cut into triangles elsewhere.
fn wall(depth_m: f32) -> Solids {
    let mut solids = Solids::new(TRANSMISSION);
    solids.sheet(
        Vec3::new(-90.0, 0.0, -90.0),
        Vec3::Z * 180.0,
        Vec3::X * 180.0,
    );
    solids.solid(
        Vec3::new(0.0, -depth_m, -40.0),
        Vec3::new(0.5, 12.0 - depth_m, 40.0),
    );
    solids
}

fn room() -> Solids {
    let mut solids = Solids::new(TRANSMISSION);
    let mut shell = Solids::new(TRANSMISSION);
    shell.solid(Vec3::ZERO, Vec3::new(10.0, 3.0, 5.0));
    for triangle in &mut shell.mesh.triangles {
        triangle.swap(1, 2);
    }
    solids.mesh = shell.mesh;
    solids
}

fn partition(depth_m: f32) -> Solids {
    let mut solids = room();
    let out = Vec3::new(0.0, depth_m, depth_m);
    solids.solid(
        Vec3::new(4.0, 0.0, 0.0) - out,
        Vec3::new(4.2, 3.0, 5.0) + out,
    );
    solids
}

fn sheet(depth_m: f32) -> Solids {
    let mut solids = room();
    let out = Vec3::new(0.0, depth_m, depth_m);
    let size = Vec3::new(0.0, 3.0, 5.0) + 2.0 * out;
    solids.sheet(
        Vec3::new(4.0, 0.0, 0.0) - out,
        Vec3::Y * size.y,
        Vec3::Z * size.z,
    );
    solids
}
