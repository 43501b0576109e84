//! Collects faces into a welded mesh on a millimetre grid.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::{BenchmarkScene, ObjectRange, TriangleMesh, Walk, named};

/// A mesh under construction. Corners are given in metres and rounded to whole millimetres; equal corners are one
/// vertex. Faces are counter-clockwise seen from the air.
pub(super) struct MeshBuilder {
    mesh: TriangleMesh,
    vertex_at_mm: HashMap<[i32; 3], u32>,
    parts: Vec<ObjectRange>,
    material: u32,
}

impl MeshBuilder {
    /// An empty mesh.
    pub(super) fn new() -> Self {
        Self {
            mesh: TriangleMesh::default(),
            vertex_at_mm: HashMap::new(),
            parts: Vec::new(),
            material: 0,
        }
    }

    /// Begins the objects of a kind.
    pub(super) fn part(&mut self, name: &'static str) {
        let here = self.mesh.triangles.len();
        self.parts.push(ObjectRange {
            name,
            triangles: here..here,
        });
    }

    /// Sets the material of the next faces.
    pub(super) fn paint(&mut self, material: &str) {
        self.material = self.mesh.material(material);
    }

    /// One triangle.
    pub(super) fn triangle(&mut self, corners: [DVec3; 3]) {
        let triangle = corners.map(|corner| self.vertex(corner));
        self.mesh.triangles.push(triangle);
        self.mesh.triangle_materials.push(self.material);
        if let Some(part) = self.parts.last_mut() {
            part.triangles.end = self.mesh.triangles.len();
        }
    }

    /// A convex planar polygon, as a fan around its first corner.
    pub(super) fn polygon(&mut self, corners: &[DVec3]) {
        for pair in corners.windows(2).skip(1) {
            self.triangle([corners[0], pair[0], pair[1]]);
        }
    }

    fn vertex(&mut self, position: DVec3) -> u32 {
        let mm = position
            .to_array()
            .map(|metres| (metres * 1000.0).round() as i32);
        let vertices = &mut self.mesh.vertices;
        *self.vertex_at_mm.entry(mm).or_insert_with(|| {
            // One correctly rounded division: the same number as "1.234" read from a file.
            vertices.push(Vec3::from(mm.map(|c| c as f32 / 1000.0)));
            (vertices.len() - 1) as u32
        })
    }

    /// The finished scene. Within a part triangles are sorted by material: files get shorter.
    pub(super) fn into_scene(
        self,
        name: &'static str,
        sources: [[f32; 3]; 16],
        walk: Walk,
    ) -> BenchmarkScene {
        let mut mesh = self.mesh;
        let mut order: Vec<usize> = (0..mesh.triangles.len()).collect();
        for part in &self.parts {
            order[part.triangles.clone()].sort_by_key(|&t| mesh.triangle_materials[t]);
        }
        mesh.triangles = order.iter().map(|&t| mesh.triangles[t]).collect();
        mesh.triangle_materials = order.iter().map(|&t| mesh.triangle_materials[t]).collect();
        BenchmarkScene {
            name,
            mesh,
            parts: self.parts,
            sources: named(sources),
            walk,
        }
    }
}
