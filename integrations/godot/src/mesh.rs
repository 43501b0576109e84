//! Faces of Godot's meshes as triangles of Foresound.

use foresound::glam::{DAffine3, Vec3};
use foresound::{Result, TriangleMesh};

/// Adds faces, three corners each, at a placement. An incomplete last face is left out.
///
/// # Errors
/// As [`TriangleMesh::append`].
pub fn append(
    mesh: &mut TriangleMesh,
    corners: impl Iterator<Item = Vec3>,
    material: &str,
    placement: &DAffine3,
) -> Result<()> {
    let vertices: Vec<Vec3> = corners.collect();
    let faces = (vertices.len() / 3) as u32;
    let part = TriangleMesh {
        triangles: (0..faces).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect(),
        triangle_materials: vec![0; faces as usize],
        material_names: vec![material.to_owned()],
        vertices,
    };
    mesh.append(&part, placement)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_keep_their_order_and_their_material() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X, Vec3::Y];
        let mut mesh = TriangleMesh::default();
        for name in ["wood", "brick", "wood"] {
            let corners = corners.into_iter();
            append(&mut mesh, corners, name, &DAffine3::IDENTITY).expect("faces");
        }
        assert_eq!(mesh.triangles.len(), 3);
        assert_eq!(mesh.material_names, ["wood", "brick"]);
        assert_eq!(mesh.triangle_materials, [0, 1, 0]);
    }
}
