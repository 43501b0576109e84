//! A million triangles of hilly ground, forty times those of a hall: for the cost of large scenes.
//!
//! Generated on each use; the file would have a hundred megabytes. 708 × 708 squares of 1.5 m, two triangles each; hills
//! of smooth noise up to 12 m, and a level clearing of 60 m around the middle where sources and listener are.

use glam::Vec3;

use super::{BenchmarkScene, TriangleMesh, Walk, named};

/// Squares along a side.
const SIDE: u32 = 708;

/// Metres along a square.
const SQUARE_M: f32 = 1.5;

/// Wavelength of the largest hills in squares, and their height in metres; each finer layer has half of both.
const HILLS: (f32, f32) = (64.0, 12.0);

/// Half the width of the clearing, and distance from it at which hills have their full height, in squares.
const CLEARING: (f32, f32) = (20.0, 60.0);

/// Hilly ground of 1,002,528 triangles.
pub fn million() -> BenchmarkScene {
    let mut mesh = TriangleMesh::default();
    let material = mesh.material("grass");
    let middle = SIDE as f32 / 2.0;
    for row in 0..=SIDE {
        for column in 0..=SIDE {
            let (x, z) = (column as f32 - middle, row as f32 - middle);
            let far = (x.abs().max(z.abs()) - CLEARING.0) / (CLEARING.1 - CLEARING.0);
            let height = far.clamp(0.0, 1.0) * hills(column as f32, row as f32);
            mesh.vertices
                .push(Vec3::new(x * SQUARE_M, height, z * SQUARE_M));
        }
    }
    for row in 0..SIDE {
        for column in 0..SIDE {
            let a = row * (SIDE + 1) + column;
            let (b, c, d) = (a + 1, a + SIDE + 1, a + SIDE + 2);
            // Counter-clockwise from above.
            mesh.triangles.extend([[a, c, b], [b, c, d]]);
            mesh.triangle_materials.extend([material; 2]);
        }
    }
    let sources = std::array::from_fn(|i| {
        let (column, row) = (i % 4, i / 4);
        [-18.0 + 12.0 * column as f32, 1.5, -18.0 + 12.0 * row as f32]
    });
    BenchmarkScene {
        name: "million",
        mesh,
        parts: Vec::new(),
        sources: named(sources),
        walk: Walk::between(Vec3::new(-20.0, 1.7, 3.0), Vec3::new(20.0, 1.7, 4.0)),
    }
}

/// Sum of layers of smooth noise, 0 at least.
fn hills(x: f32, z: f32) -> f32 {
    let (mut wavelength, mut height) = HILLS;
    let mut sum = 0.0;
    for layer in 0..5 {
        sum += height * noise(x / wavelength, z / wavelength, layer);
        wavelength *= 0.5;
        height *= 0.5;
    }
    sum
}

/// Smooth noise from 0 to 1 with a random value at every integer point.
fn noise(x: f32, z: f32, layer: u32) -> f32 {
    let (column, row) = (x.floor(), z.floor());
    let ease = |t: f32| t * t * (3.0 - 2.0 * t);
    let (u, v) = (ease(x - column), ease(z - row));
    let value = |dx: u32, dz: u32| {
        let cell = (column as u32 + dx) << 16 | (row as u32 + dz);
        let mut bits = cell ^ (layer + 1).wrapping_mul(0x9e37_79b9);
        for shift in [15, 13, 16] {
            bits = (bits ^ bits >> shift).wrapping_mul(0x85eb_ca6b);
        }
        (bits >> 8) as f32 / (1 << 24) as f32
    };
    let near = value(0, 0) + (value(1, 0) - value(0, 0)) * u;
    let far = value(0, 1) + (value(1, 1) - value(0, 1)) * u;
    near + (far - near) * v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mesh_has_a_million_triangles_and_a_level_clearing() {
        let scene = million();
        assert_eq!(scene.mesh.triangles.len(), 1_002_528);
        for (_, position) in &scene.sources {
            assert!(
                position.x.abs() < CLEARING.0 * SQUARE_M
                    && position.z.abs() < CLEARING.0 * SQUARE_M
            );
        }
        let flat = |v: &&Vec3| v.x.abs() < 30.0 && v.z.abs() < 30.0;
        assert!(scene.mesh.vertices.iter().filter(flat).all(|v| v.y == 0.0));
        assert!(scene.mesh.vertices.iter().any(|v| v.y > 8.0));
    }
}
