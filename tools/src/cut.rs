//! Cuts a mesh into the chunks of a grid, for worlds that are put together of parts.

use std::collections::HashMap;

use foresound::scene::TriangleMesh;
use glam::{DVec3, Vec3};

/// The chunks of a mesh between planes across its axes at these positions, ascending, without empty ones. A triangle on both
/// sides of a plane is cut; the new corners of both sides are the same bits.
pub fn cut(mesh: &TriangleMesh, planes: [&[f64]; 3]) -> Vec<TriangleMesh> {
    let mut pieces: Vec<(u32, [DVec3; 3])> = mesh
        .triangles
        .iter()
        .zip(&mesh.triangle_materials)
        .map(|(triangle, &material)| {
            let corner = |v: u32| mesh.vertices[v as usize].as_dvec3();
            (material, triangle.map(corner))
        })
        .collect();
    for (axis, planes) in planes.iter().enumerate() {
        for &at in *planes {
            let before = std::mem::take(&mut pieces);
            for (material, corners) in before {
                split(corners, axis, at, |part| pieces.push((material, part)));
            }
        }
    }
    let mut chunks: HashMap<[usize; 3], Vec<(u32, [DVec3; 3])>> = HashMap::new();
    for (material, corners) in pieces {
        let middle = corners.into_iter().sum::<DVec3>() / 3.0;
        let cell = [0, 1, 2].map(|axis| planes[axis].partition_point(|at| *at < middle[axis]));
        chunks.entry(cell).or_default().push((material, corners));
    }
    let mut cells: Vec<_> = chunks.into_iter().collect();
    cells.sort_by_key(|(cell, _)| *cell);
    cells
        .into_iter()
        .map(|(_, own)| of_pieces(&mesh.material_names, &own))
        .collect()
}

fn of_pieces(names: &[String], pieces: &[(u32, [DVec3; 3])]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let materials: Vec<u32> = names.iter().map(|name| mesh.material(name)).collect();
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    for (material, corners) in pieces {
        let triangle = corners.map(|corner| {
            let corner: Vec3 = corner.as_vec3();
            *known
                .entry(corner.to_array().map(f32::to_bits))
                .or_insert_with(|| {
                    mesh.vertices.push(corner);
                    mesh.vertices.len() as u32 - 1
                })
        });
        mesh.triangles.push(triangle);
        mesh.triangle_materials.push(materials[*material as usize]);
    }
    mesh
}

/// The parts of a triangle on both sides of a plane across an axis.
fn split(corners: [DVec3; 3], axis: usize, at: f64, mut emit: impl FnMut([DVec3; 3])) {
    let sides = [
        corners.map(|c| c[axis] <= at),
        corners.map(|c| c[axis] >= at),
    ];
    if sides.contains(&[true; 3]) {
        emit(corners);
        return;
    }
    for sign in [1.0, -1.0] {
        let height = |p: DVec3| sign * (p[axis] - at);
        let mut part: Vec<DVec3> = Vec::with_capacity(4);
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            if height(a) >= 0.0 {
                part.push(a);
            }
            if height(a) * height(b) < 0.0 {
                part.push(crossing(a, b, axis, at));
            }
        }
        for i in 2..part.len() {
            emit([part[0], part[i - 1], part[i]]);
        }
    }
}

/// Where a side crosses a plane: the same in both directions.
fn crossing(a: DVec3, b: DVec3, axis: usize, at: f64) -> DVec3 {
    let (a, b) = match a.to_array() < b.to_array() {
        true => (a, b),
        false => (b, a),
    };
    let mut point = a + (b - a) * ((at - a[axis]) / (b[axis] - a[axis]));
    point[axis] = at;
    point
}

#[cfg(test)]
mod tests {
    use super::*;
    use foresound::scene::procedural;

    #[test]
    fn chunks_have_the_area_of_the_whole_and_stay_in_their_cells() {
        let mesh = procedural::shoebox(Vec3::new(8.0, 3.0, 6.0), "wall");
        let area = |mesh: &TriangleMesh| -> f64 {
            let areas = mesh.triangles.iter().map(|t| {
                let [a, b, c] = t.map(|v| mesh.vertices[v as usize].as_dvec3());
                0.5 * (b - a).cross(c - a).length()
            });
            areas.sum()
        };
        let chunks = cut(&mesh, [&[2.5, 5.0], &[], &[3.1]]);
        assert_eq!(chunks.len(), 6);
        let sum: f64 = chunks.iter().map(area).sum();
        assert!((sum - area(&mesh)).abs() < 1e-4, "{sum}");
        for chunk in &chunks {
            let left = chunk.vertices.iter().any(|v| v.x < 2.5);
            let right = chunk.vertices.iter().any(|v| v.x > 2.5);
            assert!(left != right);
        }
    }
}
