//! A mesh of Bevy as triangles of Foresound.

use bevy_mesh::{Indices, Mesh, PrimitiveTopology, VertexAttributeValues};
use foresound::TriangleMesh;

/// Why a mesh gives no triangles. The game goes on without it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// Lines or points.
    #[error("a mesh of {0:?} has no triangles: leave it out of the geometry")]
    Topology(PrimitiveTopology),
    /// Its corners are on the graphics card only.
    #[error("the mesh is in the render world only: load it with RenderAssetUsages::MAIN_WORLD too")]
    Extracted,
    /// No positions of three floats.
    #[error("the mesh has no positions of three floats: give Mesh::ATTRIBUTE_POSITION")]
    Positions,
    /// The library refuses its indices.
    #[error("{0}")]
    Indices(String),
}

/// The triangles of a mesh in its own coordinates, all of one material.
///
/// # Errors
/// [`MeshError`] says what the mesh lacks.
pub fn triangles(mesh: &Mesh, material: &str) -> Result<TriangleMesh, MeshError> {
    let topology = mesh.primitive_topology();
    let is_strip = match topology {
        PrimitiveTopology::TriangleList => false,
        PrimitiveTopology::TriangleStrip => true,
        other => return Err(MeshError::Topology(other)),
    };
    let positions = mesh
        .try_attribute_option(Mesh::ATTRIBUTE_POSITION)
        .map_err(|_| MeshError::Extracted)?;
    let Some(VertexAttributeValues::Float32x3(positions)) = positions else {
        return Err(MeshError::Positions);
    };
    let indices = mesh
        .try_indices_option()
        .map_err(|_| MeshError::Extracted)?;
    let indices: Vec<u32> = match indices {
        Some(Indices::U16(indices)) => indices.iter().map(|&i| u32::from(i)).collect(),
        Some(Indices::U32(indices)) => indices.clone(),
        None => (0..positions.len() as u32).collect(),
    };
    let indices = match is_strip {
        // Every second triangle of a strip is wound the other way.
        true => (0..indices.len().saturating_sub(2))
            .flat_map(|at| {
                let [a, b, c] = [indices[at], indices[at + 1], indices[at + 2]];
                if at % 2 == 0 { [a, b, c] } else { [b, a, c] }
            })
            .collect(),
        false => indices,
    };
    let materials = vec![0; indices.len() / 3];
    TriangleMesh::from_slices(positions, &indices, &[material], &materials)
        .map_err(|error| MeshError::Indices(error.to_string()))
}

#[cfg(test)]
mod tests {
    use bevy_asset::RenderAssetUsages;

    use super::*;

    const CORNERS: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];

    fn mesh(topology: PrimitiveTopology) -> Mesh {
        let mut mesh = Mesh::new(topology, RenderAssetUsages::default());
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, CORNERS.to_vec());
        mesh
    }

    #[test]
    fn lists_and_strips_are_the_same_triangles() {
        let strip = triangles(&mesh(PrimitiveTopology::TriangleStrip), "wood").expect("a mesh");
        assert_eq!(strip.triangles, [[0, 1, 2], [2, 1, 3]]);
        let mut list = mesh(PrimitiveTopology::TriangleList);
        list.insert_indices(Indices::U16(vec![0, 1, 2, 2, 1, 3]));
        assert_eq!(triangles(&list, "wood"), Ok(strip));
    }

    #[test]
    fn meshes_without_triangles_say_why() {
        let error = triangles(&mesh(PrimitiveTopology::LineList), "wood");
        assert_eq!(error, Err(MeshError::Topology(PrimitiveTopology::LineList)));
        let bare = Mesh::new(
            PrimitiveTopology::TriangleList,
            RenderAssetUsages::default(),
        );
        assert_eq!(triangles(&bare, "wood"), Err(MeshError::Positions));
        let mut wrong = mesh(PrimitiveTopology::TriangleList);
        wrong.insert_indices(Indices::U32(vec![0, 1, 9]));
        let error = triangles(&wrong, "wood").expect_err("no vertex 9");
        assert!(error.to_string().contains("vertex 9 of 4"), "{error}");
        wrong.take_gpu_data().expect("data");
        assert_eq!(triangles(&wrong, "wood"), Err(MeshError::Extracted));
    }
}
