//! A triangle mesh as it comes in, before anything is checked.

use glam::Vec3;

/// Triangles with a material each, in metres, right-handed, +y up. Nothing is promised about quality:
/// committing a scene checks, welds and drops.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TriangleMesh {
    /// Corner positions.
    pub vertices: Vec<Vec3>,
    /// Three indices into [`Self::vertices`] a triangle.
    pub triangles: Vec<[u32; 3]>,
    /// One index into [`Self::material_names`] a triangle.
    pub triangle_materials: Vec<u32>,
    /// Material names, as the file has them.
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
}
