//! A triangle mesh before any check.

use glam::{DAffine3, Vec3};

use crate::error::{Error, Result};

/// Largest absolute coordinate of a scene in metres. Beyond it an `f32` resolves less than 1 cm, and the
/// units are probably wrong.
pub const LARGEST_COORDINATE_M: f32 = 1e5;

/// Default limit of a scene's triangles. `bench memory --scene million` measures the memory of a million.
pub const MOST_TRIANGLES: usize = 1 << 22;

/// Triangles with a material each, in metres, right-handed, +y up. The mesh may have duplicate vertices and degenerate
/// triangles: [`Scene::commit`](super::Scene::commit) checks, welds and drops.
///
/// # Examples
/// ```
/// use foresound::TriangleMesh;
///
/// let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.0, 4.0], [0.0, 0.0, 4.0]];
/// let floor = TriangleMesh::from_slices(&corners, &[0, 2, 1, 0, 3, 2], &["wood_floor"], &[0, 0])?;
/// assert_eq!(floor.triangles.len(), 2);
/// # Ok::<(), foresound::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TriangleMesh {
    /// Corner positions.
    pub vertices: Vec<Vec3>,
    /// Three indices into [`Self::vertices`] a triangle.
    pub triangles: Vec<[u32; 3]>,
    /// One index into [`Self::material_names`] a triangle.
    pub triangle_materials: Vec<u32>,
    /// Material names of the file.
    pub material_names: Vec<String>,
}

impl TriangleMesh {
    /// Index of a material name, added if it is new.
    pub fn material(&mut self, name: &str) -> u32 {
        let found = self.material_names.iter().position(|n| n == name);
        let index = found.unwrap_or_else(|| {
            self.material_names.push(name.to_owned());
            self.material_names.len() - 1
        });
        index as u32
    }

    /// From an engine's buffers: positions in metres, three indices per triangle, one material index per triangle.
    /// Both material lists may be empty: then every triangle has the material `default`.
    ///
    /// # Errors
    /// [`Error::Mesh`] for indices that are not a multiple of three, refer to no position or no material, and for
    /// another number of triangle materials than of triangles.
    pub fn from_slices(
        positions: &[[f32; 3]],
        indices: &[u32],
        materials: &[&str],
        triangle_materials: &[u32],
    ) -> Result<Self> {
        let (triangles, rest) = indices.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(Error::mesh(
                format!("{} indices are not a multiple of three", indices.len()),
                "give three indices a triangle",
            ));
        }
        let (material_names, triangle_materials) =
            if materials.is_empty() && triangle_materials.is_empty() {
                (vec!["default".into()], vec![0; triangles.len()])
            } else {
                let names = materials.iter().map(|&name| name.to_owned()).collect();
                (names, triangle_materials.to_vec())
            };
        let mesh = Self {
            vertices: positions.iter().map(|&p| Vec3::from_array(p)).collect(),
            triangles: triangles.to_vec(),
            triangle_materials,
            material_names,
        };
        mesh.check_indices()?;
        Ok(mesh)
    }

    /// Adds another mesh at a position of its own, turned, scaled or sheared: a prefab, a part of a level. Materials of one
    /// name are one. A mirrored part keeps its outside.
    ///
    /// # Errors
    /// As [`Self::check_indices`] of the part.
    ///
    /// # Examples
    /// ```
    /// use foresound::glam::{DAffine3, DVec3};
    /// use foresound::shoebox;
    ///
    /// let mut house = shoebox([8.0, 3.0, 5.0], "plaster");
    /// let half_size = DAffine3::from_translation(DVec3::new(20.0, 0.0, 0.0)) * DAffine3::from_scale(DVec3::splat(0.5));
    /// house.append(&shoebox([8.0, 3.0, 5.0], "concrete"), &half_size)?;
    /// assert_eq!(house.material_names, ["plaster", "concrete"]);
    /// # Ok::<(), foresound::Error>(())
    /// ```
    pub fn append(&mut self, part: &Self, placement: &DAffine3) -> Result<()> {
        part.check_indices()?;
        let base = self.vertices.len() as u32;
        // Adding zero turns −0 into 0, which some ray tests mistake for a miss.
        let placed = |v: &Vec3| placement.transform_point3(v.as_dvec3()).as_vec3() + Vec3::ZERO;
        self.vertices.extend(part.vertices.iter().map(placed));
        let is_mirrored = placement.matrix3.determinant() < 0.0;
        self.triangles.extend(part.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|corner| base + corner);
            if is_mirrored { [a, c, b] } else { [a, b, c] }
        }));
        let names = part.material_names.iter();
        let materials: Vec<u32> = names.map(|name| self.material(name)).collect();
        let of_part = part.triangle_materials.iter();
        self.triangle_materials
            .extend(of_part.map(|&m| materials[m as usize]));
        Ok(())
    }

    /// Drops the names that no triangle has; the others keep their order.
    pub(crate) fn drop_unused_materials(&mut self) {
        let mut is_used = vec![false; self.material_names.len()];
        for &material in &self.triangle_materials {
            is_used[material as usize] = true;
        }
        let mut index_of = Vec::new();
        let mut count = 0;
        for &is_used in &is_used {
            index_of.push(count);
            count += u32::from(is_used);
        }
        let mut flags = is_used.iter();
        self.material_names.retain(|_| flags.next() == Some(&true));
        for material in &mut self.triangle_materials {
            *material = index_of[*material as usize];
        }
    }

    /// Checks that all indices are in range.
    ///
    /// # Errors
    /// [`Error::Mesh`] for indices that refer to no vertex or no material, and for another number of triangle materials
    /// than of triangles.
    pub fn check_indices(&self) -> Result<()> {
        if self.triangle_materials.len() != self.triangles.len() {
            return Err(Error::mesh(
                format!(
                    "{} triangle materials for {} triangles",
                    self.triangle_materials.len(),
                    self.triangles.len()
                ),
                "give one material index a triangle",
            ));
        }
        let vertices = self.vertices.len();
        for (number, triangle) in self.triangles.iter().enumerate() {
            if let Some(index) = triangle.iter().find(|&&i| i as usize >= vertices) {
                return Err(Error::mesh(
                    format!("triangle {number} refers to vertex {index} of {vertices}"),
                    "count vertices from 0 and give all that triangles use",
                ));
            }
        }
        let materials = self.material_names.len();
        for (number, &index) in self.triangle_materials.iter().enumerate() {
            if index as usize >= materials {
                return Err(Error::mesh(
                    format!("triangle {number} refers to material {index} of {materials}"),
                    "count materials from 0 and name all that triangles use",
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSITIONS: [[f32; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn engine_buffers_become_a_mesh() {
        let mesh = TriangleMesh::from_slices(&POSITIONS, &[0, 1, 2], &["a", "b"], &[1]).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.triangle_materials, [1]);
        let bare = TriangleMesh::from_slices(&POSITIONS, &[0, 1, 2], &[], &[]).unwrap();
        assert_eq!(bare.material_names, ["default"]);
    }

    #[test]
    fn buffers_that_do_not_fit_are_refused() {
        for (indices, materials, triangle_materials, expected) in [
            (&[0, 1][..], &["a"][..], &[0][..], "multiple of three"),
            (&[0, 1, 3], &["a"], &[0], "vertex 3 of 3"),
            (&[0, 1, 2], &["a"], &[1], "material 1 of 1"),
            (&[0, 1, 2], &["a"], &[], "0 triangle materials for 1"),
        ] {
            let error =
                TriangleMesh::from_slices(&POSITIONS, indices, materials, triangle_materials);
            assert!(error.unwrap_err().to_string().contains(expected));
        }
    }
}
