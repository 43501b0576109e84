//! Triangles of a glTF mesh, in its own coordinates.

use std::collections::HashMap;

use super::accessors::Accessors;
use super::document::Primitive;
use crate::error::Result;
use crate::scene::io::mesh_file::Position;
use crate::scene::mesh::TriangleMesh;

/// Modes of primitives (\[GLTF2\] 3.7.2.1).
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// Compression that takes the place of accessors.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";

/// Triangles of a primitive by corner indices; `None` for points and lines.
fn triangles(mode: u32, corners: &[u32]) -> Option<Vec<[u32; 3]>> {
    Some(match mode {
        TRIANGLES => corners.as_chunks::<3>().0.to_vec(),
        // Every second triangle of a strip is wound the other way.
        STRIP => corners
            .windows(3)
            .enumerate()
            .map(|(number, corners)| match (number % 2, corners) {
                (0, &[a, b, c]) => [a, b, c],
                (_, &[a, b, c]) => [b, a, c],
                _ => [0; 3],
            })
            .collect(),
        FAN => {
            let ring = corners.get(1..).unwrap_or_default();
            let pairs = ring.windows(2);
            pairs.map(|pair| [corners[0], pair[0], pair[1]]).collect()
        }
        _ => return None,
    })
}

/// Adds a primitive with a material's index to a mesh; `false` if it is points or lines.
pub(super) fn add(
    mesh: &mut TriangleMesh,
    position: Position,
    primitive: &Primitive,
    material: u32,
    accessors: &mut Accessors,
    max_triangles: usize,
) -> Result<bool> {
    let mode = primitive.mode.unwrap_or(TRIANGLES);
    let Some(&accessor) = primitive.attributes.get("POSITION") else {
        return Ok(false);
    };
    if !matches!(mode, TRIANGLES | STRIP | FAN) {
        return Ok(false);
    }
    if primitive.extensions.contains_key(DRACO) {
        let accessor = accessors.get(accessor)?;
        if accessor.buffer_view.is_none() && accessor.sparse.is_none() {
            return Err(super::unsupported(position, DRACO));
        }
    }
    let positions = accessors.positions(accessor)?;
    let corners = match primitive.indices {
        Some(index) => accessors.indices(index)?,
        None => (0..positions.len() as u32).collect(),
    };
    let triangles = triangles(mode, &corners).unwrap_or_default();
    let count = mesh.triangles.len() + triangles.len();
    position.check_count(count as u64, max_triangles, "triangles")?;
    let mut index_of = HashMap::new();
    for triangle in triangles {
        let mut placed = [0; 3];
        for (target, corner) in placed.iter_mut().zip(triangle) {
            let Some(&place) = positions.get(corner as usize) else {
                let count = positions.len();
                return Err(super::buffers::missing(
                    position,
                    "vertex",
                    corner as usize,
                    count,
                ));
            };
            *target = *index_of.entry(corner).or_insert_with(|| {
                mesh.vertices.push(place.into());
                mesh.vertices.len() as u32 - 1
            });
        }
        mesh.triangles.push(placed);
        mesh.triangle_materials.push(material);
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        let corners = [0, 1, 2, 3, 4];
        assert_eq!(
            triangles(STRIP, &corners).unwrap(),
            [[0, 1, 2], [2, 1, 3], [2, 3, 4]]
        );
        assert_eq!(
            triangles(FAN, &corners).unwrap(),
            [[0, 1, 2], [0, 2, 3], [0, 3, 4]]
        );
        assert_eq!(triangles(FAN, &[]).unwrap(), [[0; 3]; 0]);
        assert_eq!(triangles(1, &corners), None);
    }
}
