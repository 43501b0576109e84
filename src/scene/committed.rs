//! A committed scene: checked, welded, merged into surfaces, with a tree over its triangles. It does not change; another
//! one replaces it.
//!
//! Committing is control side and allocates. All queries take `&self`, neither allocate nor block, and may be asked
//! from any thread at once.

use glam::{DVec3, Vec3};

use super::commit::{CommittedMesh, commit_mesh};
use super::materials::MaterialTable;
use super::mesh::TriangleMesh;
use super::surface::Surface;
use super::surface::free_panel::{FreePanel, FreePanels};
use super::weld::IntakeReport;
use crate::acoustics::material::Reflectance;
use crate::acoustics::{BandArray, Material, Medium};
use crate::error::{Error, Result};
use crate::geometry::triangle::PreparedRay;
use crate::geometry::{Bvh, Ray};

/// How a mesh becomes a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneSettings {
    /// The air.
    pub medium: Medium,
    /// Area in m² that a connected plane piece must have to reflect like a mirror. Smaller ones block sound and count
    /// for the late field, but an image in them would be heard at frequencies only that they cannot reflect: by
    /// Rindel's limit c a* / (2 S cos θ) a panel of 0.5 m² at a* = 3 m mirrors from 1 kHz on (\[RINDEL86\]).
    pub smallest_panel_m2: f64,
    /// Area in m² up to which a connected plane piece whose edges are free reflects as far as its size allows and fades
    /// at its edges ([`crate::scene::surface::free_panel`]); 0 for none. Larger ones limit nothing that is heard: 40 m²
    /// at a* = 10 m reflect from 43 Hz on.
    pub largest_free_panel_m2: f64,
}

impl Default for SceneSettings {
    fn default() -> Self {
        Self {
            medium: Medium::default(),
            smallest_panel_m2: 0.5,
            largest_free_panel_m2: 40.0,
        }
    }
}

/// An immutable acoustic scene.
///
/// Local coordinates are world coordinates less the centre of the bounds, so that single precision lasts far from the
/// origin.
#[derive(Debug, Clone)]
pub struct Scene {
    mesh: CommittedMesh,
    bvh: Bvh,
    reflectances: Vec<Reflectance>,
    transmission_factors: Vec<BandArray>,
    speed_of_sound_m_s: f64,
    air_np_per_m: BandArray,
    diagonal_m: f32,
    free_panels: FreePanels,
}

impl Scene {
    /// Checks a mesh and builds a scene of it.
    ///
    /// # Errors
    /// [`Error::Mesh`] if nothing can be made of the mesh, [`Error::Setting`] for air that is no air.
    pub fn commit(
        mesh: &TriangleMesh,
        materials: &MaterialTable,
        settings: &SceneSettings,
    ) -> Result<Self> {
        let speed_of_sound_m_s = settings.medium.speed_of_sound_m_s();
        let air_np_per_m = settings.medium.absorption_np_per_m();
        let sound = speed_of_sound_m_s.is_finite() && speed_of_sound_m_s > 0.0;
        if !sound || !air_np_per_m.iter().all(|m| m.is_finite() && *m >= 0.0) {
            let problem = format!("{:?} is no air", settings.medium);
            let advice = "give °C above −273, percent above 0 and kPa above 0";
            return Err(Error::setting("medium", problem, advice));
        }
        let mesh = commit_mesh(mesh, materials, settings.smallest_panel_m2)?;
        let bvh = Bvh::build(
            &mesh.vertices,
            &mesh.triangles,
            &mesh.surfaces.triangle_surface,
        );
        let free_panels = FreePanels::build(
            &mesh.vertices,
            &mesh.triangles,
            &mesh.surfaces,
            &bvh,
            settings.largest_free_panel_m2,
        );
        Ok(Self {
            bvh,
            free_panels,
            reflectances: mesh.materials.iter().map(Reflectance::of).collect(),
            transmission_factors: mesh
                .materials
                .iter()
                .map(Material::transmission_factor)
                .collect(),
            speed_of_sound_m_s,
            air_np_per_m,
            diagonal_m: mesh.report.bounds_min.distance(mesh.report.bounds_max),
            mesh,
        })
    }

    /// World to local coordinates.
    #[inline]
    pub fn to_local(&self, world: Vec3) -> DVec3 {
        world.as_dvec3() - self.mesh.centre
    }

    /// Local to world coordinates.
    #[inline]
    pub fn to_world(&self, local: DVec3) -> Vec3 {
        (local + self.mesh.centre).as_vec3()
    }

    /// The tree, in local coordinates; a triangle's group is its surface.
    #[inline]
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// All surfaces.
    pub fn surfaces(&self) -> &[Surface] {
        &self.mesh.surfaces.surfaces
    }

    /// A surface by its index.
    ///
    /// # Panics
    /// If there is none.
    #[inline]
    pub fn surface(&self, index: u32) -> &Surface {
        &self.mesh.surfaces.surfaces[index as usize]
    }

    /// Whether a surface can reflect like a mirror at a point of its plane, in local coordinates.
    #[inline]
    pub fn reflects_at(&self, surface: u32, point: DVec3) -> bool {
        self.mesh.surfaces.reflects_at(surface, point)
    }

    /// Small panels with free edges.
    #[inline]
    pub fn free_panels(&self) -> &FreePanels {
        &self.free_panels
    }

    /// The small free panel at a point of a surface, seen from the normal's side or from the other, in local coordinates.
    pub fn free_panel_at(&self, surface: u32, point: DVec3, in_front: bool) -> Option<FreePanel> {
        let set = &self.mesh.surfaces;
        self.free_panels.at(set, surface, point, in_front)
    }

    /// Whether a triangle is part of a connected plane piece that is large enough to reflect like a mirror.
    #[inline]
    pub fn is_panel(&self, triangle: u32) -> bool {
        self.mesh.surfaces.is_panel(triangle)
    }

    /// The surface that a triangle belongs to.
    #[inline]
    pub fn surface_of(&self, triangle: u32) -> u32 {
        self.mesh.surfaces.triangle_surface[triangle as usize]
    }

    /// Whether a ray meets this triangle: the tree's own test of it, without the tree.
    #[inline]
    pub fn blocks(&self, triangle: u32, ray: &Ray) -> bool {
        let corners =
            self.mesh.triangles[triangle as usize].map(|v| self.mesh.vertices[v as usize]);
        let margin_m = self.bvh.margin_m();
        PreparedRay::of(ray, margin_m).is_some_and(|ray| ray.meet(&corners).is_some())
    }

    /// A triangle's normal by its winding, of any length: from the side on which its corners run counter-clockwise.
    #[inline]
    pub fn triangle_normal(&self, triangle: u32) -> Vec3 {
        let [a, b, c] =
            self.mesh.triangles[triangle as usize].map(|v| self.mesh.vertices[v as usize]);
        (b - a).cross(c - a)
    }

    /// A surface's material.
    #[inline]
    pub fn material(&self, surface: u32) -> &Material {
        &self.mesh.materials[self.surface(surface).material as usize]
    }

    /// A surface's reflection at every angle.
    #[inline]
    pub fn reflectance(&self, surface: u32) -> &Reflectance {
        &self.reflectances[self.surface(surface).material as usize]
    }

    /// Pressure factor of one passage through a surface.
    #[inline]
    pub fn transmission_factor(&self, surface: u32) -> &BandArray {
        &self.transmission_factors[self.surface(surface).material as usize]
    }

    /// All materials in use.
    pub fn materials(&self) -> &[Material] {
        &self.mesh.materials
    }

    /// Names of materials that the table did not know.
    pub fn defaulted_materials(&self) -> &[String] {
        &self.mesh.defaulted
    }

    /// What intake found and dropped.
    pub fn report(&self) -> &IntakeReport {
        &self.mesh.report
    }

    /// Speed of sound in m/s.
    #[inline]
    pub fn speed_of_sound_m_s(&self) -> f64 {
        self.speed_of_sound_m_s
    }

    /// Air's amplitude attenuation in Np/m, in each band.
    #[inline]
    pub fn air_np_per_m(&self) -> &BandArray {
        &self.air_np_per_m
    }

    /// Diagonal of the bounds in metres.
    #[inline]
    pub fn diagonal_m(&self) -> f32 {
        self.diagonal_m
    }

    /// Corners of every triangle, in world coordinates.
    pub fn triangles(&self) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        let corner = |v: u32| self.to_world(self.mesh.vertices[v as usize].as_dvec3());
        self.mesh.triangles.iter().map(move |t| t.map(corner))
    }

    /// Memory that the scene occupies, in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.bvh.memory_bytes() + self.mesh.memory_bytes()
    }
}
