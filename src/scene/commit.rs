//! Prepares a mesh for rays: cleans and centres it, groups its triangles into surfaces, resolves materials.
//!
//! Control side.

use glam::{DVec3, Vec3};

use super::closed_parts::closed_parts;
use super::materials::MaterialTable;
use super::mesh::TriangleMesh;
use super::surface::SurfaceSet;
use super::weld::{self, IntakeReport};
use crate::acoustics::material::Material;
use crate::error::Result;

/// A mesh after intake.
#[derive(Debug, Clone, PartialEq)]
pub struct CommittedMesh {
    /// Origin of [`Self::vertices`] and of the surfaces' planes in the mesh's own coordinates, in metres: the middle of
    /// the bounds, rounded to whole metres to keep the subtraction nearly exact.
    pub centre: DVec3,
    /// Distinct vertices in metres from [`Self::centre`].
    pub vertices: Vec<Vec3>,
    /// Three indices into [`Self::vertices`] a triangle, in the mesh's order.
    pub triangles: Vec<[u32; 3]>,
    /// Coplanar triangles by surface.
    pub surfaces: SurfaceSet,
    /// Whether each triangle belongs to a connected part of the mesh without boundary edges.
    pub in_closed_part: Vec<bool>,
    /// Materials of the surfaces, under the mesh's names.
    pub materials: Vec<Material>,
    /// Material names missing from the table; their material is its generic one.
    pub defaulted: Vec<String>,
    /// Counts of what was welded and dropped.
    pub report: IntakeReport,
}

impl CommittedMesh {
    /// Memory that the mesh occupies, in bytes.
    pub fn memory_bytes(&self) -> usize {
        let vertices = size_of_val(self.vertices.as_slice());
        let triangles = size_of_val(self.triangles.as_slice());
        let flags = self.in_closed_part.len();
        vertices + triangles + flags + self.surfaces.memory_bytes()
    }
}

/// Cleans a mesh, finds its surfaces and resolves their materials. Connected planar panels of at least `min_panel_m2`
/// reflect specularly ([`SurfaceSet::reflects_at`]).
///
/// # Errors
/// As [`weld::clean`].
pub fn commit_mesh(
    mesh: &TriangleMesh,
    table: &MaterialTable,
    min_panel_m2: f64,
) -> Result<CommittedMesh> {
    let (mut clean, mut report) = weld::clean(mesh)?;
    let middle = (report.bounds_min.as_dvec3() + report.bounds_max.as_dvec3()) / 2.0;
    let centre = middle.round() + DVec3::ZERO;
    let centred = |vertex: Vec3| (vertex.as_dvec3() - centre).as_vec3();
    // Kilometres from the centre `f32` is coarser than at the old origin: small triangles may collapse.
    let flat: Vec<bool> = clean
        .triangles
        .iter()
        .map(|t| !weld::has_area(t.map(|i| centred(clean.vertices[i as usize]).as_dvec3())))
        .collect();
    if flat.contains(&true) {
        let mut flags = flat.iter();
        clean.triangles.retain(|_| flags.next() != Some(&true));
        flags = flat.iter();
        clean
            .triangle_materials
            .retain(|_| flags.next() != Some(&true));
        let (rest, second) = weld::clean(&clean)?;
        let dropped = flat.iter().filter(|&&f| f).count();
        clean = rest;
        report = IntakeReport {
            triangles_in: report.triangles_in,
            dropped_non_finite: report.dropped_non_finite,
            dropped_degenerate: report.dropped_degenerate + dropped,
            dropped_duplicate: report.dropped_duplicate,
            duplicate_of_other_material: report.duplicate_of_other_material,
            vertices_welded: report.vertices_welded,
            ..second
        };
    }
    let vertices: Vec<Vec3> = clean.vertices.iter().map(|&v| centred(v)).collect();
    let surfaces = SurfaceSet::build(&clean, centre, &vertices, min_panel_m2);
    let resolved = table.resolve(&clean.material_names);
    Ok(CommittedMesh {
        centre,
        vertices,
        in_closed_part: closed_parts(&clean.triangles),
        triangles: clean.triangles,
        surfaces,
        materials: resolved.materials,
        defaulted: resolved.defaulted,
        report,
    })
}
