//! A committed scene: checked, welded, merged into surfaces, with a tree over its triangles. What is committed does not
//! change; another scene replaces it. What moves stands in [`super::instances`].
//!
//! Committing is control side and allocates. All queries take `&self`, neither allocate nor block, and may be asked
//! from any thread at once.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::commit::{CommittedMesh, commit_mesh};
use super::edges::EdgeSet;
use super::instances::Instances;
use super::materials::MaterialTable;
use super::mesh::{MOST_TRIANGLES, TriangleMesh};
use super::surface::free_panel::{FreePanel, FreePanels};
use super::surface::{Surface, SurfaceSet};
use super::weld::IntakeReport;
use crate::acoustics::material::Reflectance;
use crate::acoustics::{BandArray, Material, Medium};
use crate::error::{Error, Result};
use crate::geometry::bvh::RayObserver;
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
    /// Most triangles of a mesh; one with more is refused before anything is built of it.
    pub most_triangles: usize,
}

impl Default for SceneSettings {
    fn default() -> Self {
        Self {
            medium: Medium::default(),
            smallest_panel_m2: 0.5,
            largest_free_panel_m2: 40.0,
            most_triangles: MOST_TRIANGLES,
        }
    }
}

/// An acoustic scene: a fixed part, shared by all copies, and the instances of parts that move
/// ([`Scene::add_instance`]). Numbers below those of the fixed part name its surfaces, triangles and edges.
///
/// Local coordinates are world coordinates less the centre of the bounds, so that single precision lasts far from the
/// origin.
#[derive(Debug, Clone)]
pub struct Scene {
    pub(super) mesh: Arc<CommittedMesh>,
    bvh: Arc<Bvh>,
    edges: Arc<EdgeSet>,
    reflectances: Arc<[Reflectance]>,
    transmission_factors: Arc<[BandArray]>,
    speed_of_sound_m_s: f64,
    air_np_per_m: BandArray,
    diagonal_m: f32,
    free_panels: Arc<FreePanels>,
    pub(super) instances: Instances,
}

impl Scene {
    /// Checks a mesh and builds a scene of it.
    ///
    /// # Errors
    /// [`Error::Mesh`] if nothing can be made of the mesh or it has too many triangles, [`Error::Setting`] for air that is no air.
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
        if mesh.triangles.len() > settings.most_triangles {
            let problem = format!(
                "{} triangles, more than {}",
                mesh.triangles.len(),
                settings.most_triangles
            );
            let advice =
                "simplify the model, sound needs walls and not ornaments; or raise most_triangles";
            return Err(Error::mesh(problem, advice));
        }
        let mesh = commit_mesh(mesh, materials, settings.smallest_panel_m2)?;
        let bvh = Bvh::build(
            &mesh.vertices,
            &mesh.triangles,
            &mesh.surfaces.triangle_surface,
        );
        let edges = EdgeSet::build(
            &mesh.vertices,
            &mesh.triangles,
            &mesh.surfaces,
            mesh.centre,
            &bvh,
        );
        let free_panels = FreePanels::build(
            &mesh.vertices,
            &mesh.triangles,
            &mesh.surfaces,
            &bvh,
            settings.largest_free_panel_m2,
        );
        Ok(Self {
            bvh: Arc::new(bvh),
            edges: Arc::new(edges),
            free_panels: Arc::new(free_panels),
            reflectances: mesh.materials.iter().map(Reflectance::of).collect(),
            transmission_factors: mesh
                .materials
                .iter()
                .map(Material::transmission_factor)
                .collect(),
            speed_of_sound_m_s,
            air_np_per_m,
            diagonal_m: mesh.report.bounds_min.distance(mesh.report.bounds_max),
            mesh: Arc::new(mesh),
            instances: Instances::default(),
        })
    }

    /// Whether two scenes have the same fixed part, one a copy of the other.
    pub fn same_fixed_part(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.mesh, &other.mesh)
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

    /// The fixed part's tree, in local coordinates; a triangle's group is its surface. [`Self::closest_hit`] and
    /// [`Self::any_hit`] know the instances too.
    #[inline]
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// The same scene, which reports every ray against its fixed part to an observer: for measurements. Control side;
    /// allocates.
    pub fn with_observer(&self, observer: Arc<dyn RayObserver>) -> Self {
        Self {
            bvh: Arc::new(self.bvh.with_observer(observer)),
            ..self.clone()
        }
    }

    /// The fixed part's edges that sound bends around, in local coordinates.
    #[inline]
    pub fn edges(&self) -> &EdgeSet {
        &self.edges
    }

    /// All surfaces of the fixed part.
    pub fn surfaces(&self) -> &[Surface] {
        &self.mesh.surfaces.surfaces
    }

    /// A surface by its index, an instance's as it stands. That of an instance that has gone is nowhere.
    #[inline]
    pub fn surface(&self, index: u32) -> &Surface {
        match self.mesh.surfaces.surfaces.get(index as usize) {
            Some(surface) => surface,
            None => self.instance_surface(index),
        }
    }

    /// A surface of the fixed part by its index.
    #[inline]
    pub(crate) fn kept_surface(&self, index: u32) -> Option<&Surface> {
        self.mesh.surfaces.surfaces.get(index as usize)
    }

    /// Whether a surface can reflect like a mirror at a point of its plane, in local coordinates.
    #[inline]
    pub fn reflects_at(&self, surface: u32, point: DVec3) -> bool {
        if surface as usize >= self.mesh.surfaces.surfaces.len() {
            return self.instance_reflects_at(surface, point);
        }
        self.mesh.surfaces.reflects_at(surface, point)
    }

    /// The fixed part's small panels with free edges.
    #[inline]
    pub fn free_panels(&self) -> &FreePanels {
        &self.free_panels
    }

    /// The small free panel at a point of a surface, seen from the normal's side or from the other, in local coordinates.
    pub fn free_panel_at(&self, surface: u32, point: DVec3, in_front: bool) -> Option<FreePanel> {
        let set = &self.mesh.surfaces;
        if surface as usize >= set.surfaces.len() {
            return self.instance_free_panel_at(surface, point, in_front);
        }
        self.free_panels.at(surface, point, in_front)
    }

    /// Whether a triangle is part of a connected plane piece that is large enough to reflect like a mirror.
    #[inline]
    pub fn is_panel(&self, triangle: u32) -> bool {
        if !self.has_triangle(triangle) {
            return self.instance_is_panel(triangle);
        }
        self.mesh.surfaces.is_panel(triangle)
    }

    /// The surface that a triangle belongs to.
    #[inline]
    pub fn surface_of(&self, triangle: u32) -> u32 {
        match self.mesh.surfaces.triangle_surface.get(triangle as usize) {
            Some(surface) => *surface,
            None => self.instance_surface_of(triangle),
        }
    }

    /// Whether a triangle's number is the fixed part's.
    #[inline]
    pub(super) fn has_triangle(&self, triangle: u32) -> bool {
        (triangle as usize) < self.mesh.triangles.len()
    }

    /// Corners of a triangle of the fixed part, in local coordinates.
    #[inline]
    pub(super) fn corners_of(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].map(|v| self.mesh.vertices[v as usize])
    }

    /// Where it is kept which corners a triangle has, if it is the fixed part's.
    #[inline]
    pub(crate) fn kept_triangle(&self, triangle: u32) -> Option<&[u32; 3]> {
        self.mesh.triangles.get(triangle as usize)
    }

    /// Where the corners of a triangle are kept that [`Self::blocks`] reads, if it is the fixed part's.
    #[inline]
    pub(crate) fn kept_corners(&self, triangle: u32) -> Option<[&Vec3; 3]> {
        let corners = self.kept_triangle(triangle)?;
        Some(corners.map(|v| &self.mesh.vertices[v as usize]))
    }

    /// The fixed part's surfaces with their triangles.
    pub(super) fn surface_set(&self) -> &SurfaceSet {
        &self.mesh.surfaces
    }

    /// Whether a ray meets this triangle: the tree's own test of it, without the tree.
    #[inline]
    pub fn blocks(&self, triangle: u32, ray: &Ray) -> bool {
        if !self.has_triangle(triangle) {
            return self.instance_blocks(triangle, ray);
        }
        let corners = self.corners_of(triangle);
        let margin_m = self.bvh.margin_m();
        PreparedRay::new(ray, margin_m).is_some_and(|ray| ray.intersect(&corners).is_some())
    }

    /// A triangle's normal by its winding, of any length: from the side on which its corners run counter-clockwise.
    #[inline]
    pub fn triangle_normal(&self, triangle: u32) -> Vec3 {
        if !self.has_triangle(triangle) {
            return self.instance_normal(triangle);
        }
        let [a, b, c] = self.corners_of(triangle);
        (b - a).cross(c - a)
    }

    /// A surface's material.
    #[inline]
    pub fn material(&self, surface: u32) -> &Material {
        self.material_of(self.surface(surface))
    }

    /// The same of a surface that has been looked up.
    #[inline]
    pub fn material_of(&self, surface: &Surface) -> &Material {
        let (number, fixed) = (surface.material as usize, &self.mesh.materials);
        match fixed.get(number) {
            Some(found) => found,
            None => self
                .more_material(number - fixed.len())
                .unwrap_or(&fixed[0]),
        }
    }

    /// A surface's reflection at every angle.
    #[inline]
    pub fn reflectance(&self, surface: u32) -> &Reflectance {
        self.reflectance_of(self.surface(surface))
    }

    /// The same of a surface that has been looked up.
    #[inline]
    pub fn reflectance_of(&self, surface: &Surface) -> &Reflectance {
        let (number, fixed) = (surface.material as usize, &self.reflectances);
        match fixed.get(number) {
            Some(found) => found,
            None => self
                .more_reflectance(number - fixed.len())
                .unwrap_or(&fixed[0]),
        }
    }

    /// Pressure factor of one passage through a surface.
    #[inline]
    pub fn transmission_factor(&self, surface: u32) -> &BandArray {
        let (number, fixed) = (
            self.surface(surface).material as usize,
            &self.transmission_factors,
        );
        match fixed.get(number) {
            Some(found) => found,
            None => self
                .more_transmission(number - fixed.len())
                .unwrap_or(&fixed[0]),
        }
    }

    /// All materials in use by the fixed part.
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

    /// Corners of every triangle, in world coordinates: the fixed part's by number, then those of instances.
    pub fn triangles(&self) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        let corner = |v: u32| self.to_world(self.mesh.vertices[v as usize].as_dvec3());
        let fixed = self.mesh.triangles.iter().map(move |t| t.map(corner));
        let of_instances = self.instance_triangles();
        fixed.chain(of_instances.map(|t| t.map(|corner| self.to_world(corner))))
    }

    /// Memory that the scene occupies, in bytes, without the parts of its instances.
    pub fn memory_bytes(&self) -> usize {
        let fixed = self.bvh.memory_bytes() + self.mesh.memory_bytes() + self.edges.memory_bytes();
        fixed + self.instances.memory_bytes()
    }
}
