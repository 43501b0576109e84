//! Prepares a mesh for rays: cleans and centres it, groups its triangles into surfaces, resolves materials.
//!
//! Control side.

use glam::{DVec3, Vec3};

use super::closed_parts::closed_parts;
use super::flatten::{flattened, roughness};
use super::materials::MaterialTable;
use super::mesh::TriangleMesh;
use super::surface::SurfaceSet;
use super::weld::{self, IntakeReport};
use crate::acoustics::material::Material;
use crate::binary::{are_below, stored};
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
    /// Rough regions that were flattened.
    pub flattened_regions: usize,
}

/// What counts as rough: see [`super::SceneSettings::acoustic_tolerance_m`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoughnessSettings {
    /// Largest distance in metres of a triangle's corner from the plane of its surface; 0 flattens nothing.
    pub tolerance_m: f64,
    /// Speed of sound in m/s.
    pub speed_m_s: f64,
}

impl RoughnessSettings {
    /// Flattens nothing.
    pub const NONE: Self = Self {
        tolerance_m: 0.0,
        speed_m_s: 343.0,
    };
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
/// reflect specularly ([`SurfaceSet::reflects_at`]). Nothing is flattened.
///
/// # Errors
/// As [`weld::clean`].
pub fn commit_mesh(
    mesh: &TriangleMesh,
    table: &MaterialTable,
    min_panel_m2: f64,
) -> Result<CommittedMesh> {
    commit_rough_mesh(mesh, table, min_panel_m2, RoughnessSettings::NONE)
}

/// [`commit_mesh`], with rough regions moved into planes and their roughness as scattering of their materials.
///
/// # Errors
/// As [`weld::clean`].
pub fn commit_rough_mesh(
    mesh: &TriangleMesh,
    table: &MaterialTable,
    min_panel_m2: f64,
    rough: RoughnessSettings,
) -> Result<CommittedMesh> {
    let (mut clean, mut report) = weld::clean(mesh)?;
    let middle = (report.bounds_min.as_dvec3() + report.bounds_max.as_dvec3()) / 2.0;
    let centre = middle.round() + DVec3::ZERO;
    let centred = |vertex: Vec3| (vertex.as_dvec3() - centre).as_vec3();
    let flat = match rough.tolerance_m > 0.0 {
        true => flattened(&clean, centre, rough.tolerance_m, min_panel_m2),
        false => None,
    };
    let flattened_regions = flat.as_ref().map_or(0, |flat| flat.regions);
    let mut roughness = Vec::new();
    if let Some(flat) = flat {
        (clean, roughness) = (flat.mesh, flat.roughness);
        let kept = clean_again(&mut clean, &mut report)?;
        roughness = kept.iter().map(|&t| roughness[t as usize]).collect();
    }
    // Kilometres from the centre `f32` is coarser than at the old origin: small triangles may collapse.
    let collapsed: Vec<bool> = clean
        .triangles
        .iter()
        .map(|t| !weld::has_area(t.map(|i| centred(clean.vertices[i as usize]).as_dvec3())))
        .collect();
    if collapsed.contains(&true) {
        retain(&mut clean.triangles, &collapsed);
        retain(&mut clean.triangle_materials, &collapsed);
        retain(&mut roughness, &collapsed);
        report.dropped_degenerate += collapsed.iter().filter(|&&f| f).count();
        let kept = clean_again(&mut clean, &mut report)?;
        if !roughness.is_empty() {
            roughness = kept.iter().map(|&t| roughness[t as usize]).collect();
        }
    }
    let vertices: Vec<Vec3> = clean.vertices.iter().map(|&v| centred(v)).collect();
    let mut surfaces = SurfaceSet::build(&clean, centre, &vertices, min_panel_m2);
    let mut resolved = table.resolve(&clean.material_names);
    if !roughness.is_empty() {
        roughness::apply(
            &mut surfaces,
            &mut resolved.materials,
            &roughness,
            rough.speed_m_s,
        );
    }
    Ok(CommittedMesh {
        centre,
        vertices,
        in_closed_part: closed_parts(&clean.triangles),
        triangles: clean.triangles,
        surfaces,
        materials: resolved.materials,
        defaulted: resolved.defaulted,
        report,
        flattened_regions,
    })
}

/// Cleans a mesh whose vertices have moved; adds what is dropped to the report of the first time. Returns the indices of
/// the kept triangles.
fn clean_again(mesh: &mut TriangleMesh, report: &mut IntakeReport) -> Result<Vec<u32>> {
    let (rest, second, kept) = weld::clean_with_sources(mesh)?;
    *mesh = rest;
    *report = IntakeReport {
        triangles_in: report.triangles_in,
        dropped_non_finite: report.dropped_non_finite,
        dropped_degenerate: report.dropped_degenerate + second.dropped_degenerate,
        dropped_duplicate: report.dropped_duplicate + second.dropped_duplicate,
        duplicate_of_other_material: report.duplicate_of_other_material
            + second.duplicate_of_other_material,
        vertices_welded: report.vertices_welded + second.vertices_welded,
        ..second
    };
    Ok(kept)
}

/// Removes the flagged entries; an empty list stays empty.
fn retain<T>(list: &mut Vec<T>, is_dropped: &[bool]) {
    let mut flags = is_dropped.iter();
    list.retain(|_| flags.next() != Some(&true));
}

stored!(CommittedMesh {
    centre: DVec3,
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    surfaces: SurfaceSet,
    in_closed_part: Vec<bool>,
    materials: Vec<Material>,
    defaulted: Vec<String>,
    report: IntakeReport,
    flattened_regions: usize,
});

impl CommittedMesh {
    /// Whether a mesh that was loaded has all that its queries rely on.
    pub(super) fn is_consistent(&self) -> bool {
        let counts = [self.in_closed_part.len(), self.report.triangles];
        !self.triangles.is_empty()
            && are_below(self.triangles.as_flattened(), self.vertices.len())
            && counts.iter().all(|&count| count == self.triangles.len())
            && self
                .surfaces
                .is_consistent(self.triangles.len(), self.materials.len())
    }
}
