//! Law *leak*: nothing but transmission reaches the other side of a sealed sheet, at places in exact alignment with corners.

use glam::Vec3;

use super::Row;
use super::rooms::Probe;
use super::solids::{Solids, settings};
use foresound::error::Result;
use foresound::propagation::PropagationSettings;
use foresound::scene::TriangleMesh;

/// Distance of places in metres, and places in a row.
const GRID_M: f32 = 0.25;
const PLACES: u32 = 20;

/// Share of the energy that a sheet transmits: −35 dB.
const TRANSMISSION: f32 = 3.162_277_6e-4;

/// Size of the room.
const SIZE: Vec3 = Vec3::new(12.0, 3.0, 6.0);

/// A case: its name and its sheets.
type LeakCase = (&'static str, fn() -> Solids);

pub(super) fn rows() -> Result<Vec<Row>> {
    let cases: [LeakCase; 4] = [
        ("partition of a room", partition),
        ("partition with common vertices", common_vertices),
        ("cell in a corner of a room", cell),
        ("cell of separate sheets that cross", crossing_cell),
    ];
    let mut rows = Vec::new();
    for (name, build) in cases {
        let scene = build().commit()?;
        // On the grid, and on its diagonals through the corners.
        let sources = [Vec3::new(2.0, 1.5, 3.0), Vec3::new(1.0, 1.5, 1.0)];
        let settings = PropagationSettings {
            depth: 4,
            ..settings()
        };
        let mut leaks = 0;
        for source in sources {
            let mut probe = Probe::new(&scene, source, settings)?;
            for place in 0..PLACES * PLACES {
                let (i, k) = (place % PLACES, place / PLACES);
                let listener =
                    Vec3::new(6.0 + GRID_M * (i + 1) as f32, 1.5, 0.5 + GRID_M * k as f32);
                probe.update(listener);
                let paths = &probe.set.paths;
                leaks += u32::from(paths.iter().any(|p| p.order + p.diffraction_order > 0));
            }
        }
        let law = format!("leak: {name}, places of 800 with a path through it");
        rows.push(Row::at_most(law, f64::from(leaks), 0.0, "places"));
    }
    Ok(rows)
}

fn room() -> Solids {
    let mut room = Solids::new(TRANSMISSION);
    room.solid(Vec3::ZERO, SIZE);
    for triangle in &mut room.mesh.triangles {
        triangle.swap(1, 2);
    }
    room
}

fn partition() -> Solids {
    let mut solids = room();
    solids.sheet(Vec3::X * 5.0, Vec3::Y * SIZE.y, Vec3::Z * SIZE.z);
    solids
}

/// The same with floor, ceiling and walls cut at the partition.
fn common_vertices() -> Solids {
    let mut solids = Solids::new(TRANSMISSION);
    for (from, length_m) in [(0.0, 5.0), (5.0, 7.0)] {
        let (at, along) = (Vec3::X * from, Vec3::X * length_m);
        for lift in [Vec3::ZERO, Vec3::Y * SIZE.y] {
            solids.sheet(at + lift, along, Vec3::Z * SIZE.z);
        }
        for side in [Vec3::ZERO, Vec3::Z * SIZE.z] {
            solids.sheet(at + side, along, Vec3::Y * SIZE.y);
        }
    }
    for x in [0.0, 5.0, SIZE.x] {
        solids.sheet(Vec3::X * x, Vec3::Y * SIZE.y, Vec3::Z * SIZE.z);
    }
    solids
}

/// Two sheets that meet around a corner of the room with the sources.
fn cell() -> Solids {
    let mut solids = room();
    let first = solids.mesh.vertices.len() as u32;
    let corners = [(4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];
    let mesh: &mut TriangleMesh = &mut solids.mesh;
    for (x, z) in corners {
        mesh.vertices
            .extend([Vec3::new(x, 0.0, z), Vec3::new(x, SIZE.y, z)]);
    }
    for triangle in [[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]] {
        mesh.triangles.push(triangle.map(|k: u32| first + k));
        mesh.triangle_materials.push(0);
    }
    solids
}

/// The same of sheets that cross each other and the shell.
fn crossing_cell() -> Solids {
    let mut solids = room();
    let low = Vec3::new(-0.5, -0.5, -0.5);
    let up = Vec3::Y * (SIZE.y + 1.0);
    solids.sheet(low + Vec3::X * 4.5, up, Vec3::Z * 5.0);
    solids.sheet(low + Vec3::Z * 4.5, up, Vec3::X * 5.0);
    solids
}
