//! A committed scene: a welded mesh, its surfaces, edges and a BVH over its triangles. The fixed part does not change;
//! parts that move are [`instances`].
//!
//! [`Scene::commit`] is control side and allocates. All queries take `&self`, neither allocate nor block, and may run on
//! several threads at once.

mod blocks;
mod changed_materials;
pub mod instances;
mod kept_roughness;
pub mod saved;

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::commit::{CommittedMesh, RoughnessSettings, commit_rough_mesh};
use super::edges::EdgeSet;
use super::materials::MaterialTable;
use super::mesh::{MOST_TRIANGLES, TriangleMesh};
use super::surface::curved::CurvedSurface;
use super::surface::finite_panel::{FinitePanel, FinitePanels};
use super::surface::{Surface, SurfaceSet};
use super::weld::IntakeReport;
use crate::acoustics::material::Reflectance;
use crate::acoustics::medium::HIGH_AIR_HZ;
use crate::acoustics::{BandArray, Material, Medium};
use crate::error::{Error, Result};
use crate::geometry::bvh::RayObserver;
use crate::geometry::triangle::PreparedRay;
use crate::geometry::{Bvh, Ray};
use blocks::TriangleBlocks;
use instances::Instances;

/// Settings of [`Scene::commit`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SceneSettings {
    /// The air.
    pub medium: Medium,
    /// Least area in m² of a connected planar panel that reflects specularly. Smaller panels block sound and count for
    /// the late reverb. By Rindel's limit c a* / (2 S cos θ) a panel of 0.5 m² at a* = 3 m reflects from 1 kHz on
    /// (\[RINDEL86\]).
    pub min_panel_m2: f64,
    /// Largest area in m² of a finite panel: a connected planar panel with free edges. Its size limits its reflection,
    /// which fades at its edges; 0 for none. A panel of 40 m² at a* = 10 m reflects from 43 Hz on.
    pub max_finite_panel_m2: f64,
    /// Distance in metres from a common plane within which the corners of neighbouring triangles are roughness of one
    /// plane surface: they are moved into the plane, and scatter instead. Larger structure stays. 0 leaves all corners
    /// where they are. `None` is an eighth of the wavelength at 1 kHz, 43 mm: by Rayleigh's criterion such a surface is
    /// smooth up to there.
    pub acoustic_tolerance_m: Option<f64>,
    /// Most triangles of a mesh; a mesh with more is an error.
    pub max_triangles: usize,
}

impl Default for SceneSettings {
    fn default() -> Self {
        Self {
            medium: Medium::default(),
            min_panel_m2: 0.5,
            max_finite_panel_m2: 40.0,
            acoustic_tolerance_m: None,
            max_triangles: MOST_TRIANGLES,
        }
    }
}

/// Highest frequency in Hz that a surface as rough as the default tolerance mirrors.
const SMOOTH_TO_HZ: f64 = 1000.0;

/// Largest tolerance in metres: an eighth of the wavelength at 86 Hz.
const MOST_TOLERANCE_M: f64 = 0.5;

/// An acoustic scene: a fixed part, shared by all copies, and instances of moving parts ([`Scene::add_instance`]).
///
/// Local coordinates are world coordinates minus the centre of the bounds: single precision suffices far from the origin.
#[derive(Debug, Clone)]
pub struct Scene {
    pub(super) mesh: Arc<CommittedMesh>,
    blocks: TriangleBlocks,
    bvh: Arc<Bvh>,
    edges: Arc<EdgeSet>,
    /// Materials of the fixed part, as they are now.
    materials: Arc<[Material]>,
    reflectances: Arc<[Reflectance]>,
    transmission_factors: Arc<[BandArray]>,
    speed_of_sound_m_s: f64,
    length_scale: f64,
    air_np_per_m: BandArray,
    high_air_np_per_m: [f32; HIGH_AIR_HZ.len()],
    acoustic_tolerance_m: f64,
    diagonal_m: f32,
    finite_panels: Arc<FinitePanels>,
    instances: Instances,
}

impl Scene {
    /// Checks a mesh (metres, +y up) and builds a scene of it. Material names missing from the table get
    /// `GENERIC_MATERIAL` and are listed in [`Self::defaulted_materials`]. Control
    /// side; takes seconds for a million triangles.
    ///
    /// # Errors
    /// [`Error::Mesh`] for a mesh without a usable triangle or with too many, [`Error::Setting`] for a medium, an area or a
    /// tolerance out of range.
    ///
    /// # Examples
    /// ```
    /// use foresound::{MaterialTable, Scene, SceneSettings, shoebox};
    ///
    /// let room = shoebox([8.0, 3.0, 5.0], "plaster");
    /// let scene = Scene::commit(&room, &MaterialTable::built_in(), &SceneSettings::default())?;
    /// assert_eq!(scene.surfaces().len(), 6);
    /// assert!(scene.defaulted_materials().is_empty());
    /// # Ok::<(), foresound::Error>(())
    /// ```
    pub fn commit(
        mesh: &TriangleMesh,
        materials: &MaterialTable,
        settings: &SceneSettings,
    ) -> Result<Self> {
        Self::commit_observed(mesh, materials, settings, &mut |_| true)
    }

    /// As [`Self::commit`], and calls `observe` with the share that is done, 0 to 1, before and after each of four phases (mesh,
    /// tree, edges, panels); it cancels by returning `false`. A phase takes up to a second for a million triangles.
    ///
    /// # Errors
    /// As [`Self::commit`]; [`Error::Cancelled`].
    ///
    /// # Examples
    /// ```
    /// use foresound::{Error, MaterialTable, Scene, SceneSettings, shoebox};
    ///
    /// let room = shoebox([8.0, 3.0, 5.0], "plaster");
    /// let settings = SceneSettings::default();
    /// let cancelled = Scene::commit_observed(&room, &MaterialTable::built_in(), &settings, &mut |done| done < 0.5);
    /// assert_eq!(cancelled.err(), Some(Error::Cancelled));
    /// ```
    pub fn commit_observed(
        mesh: &TriangleMesh,
        materials: &MaterialTable,
        settings: &SceneSettings,
        observe: &mut dyn FnMut(f32) -> bool,
    ) -> Result<Self> {
        let mut report = |done: f32| match observe(done) {
            true => Ok(()),
            false => Err(Error::Cancelled),
        };
        report(0.0)?;
        let speed_of_sound_m_s = settings.medium.speed_of_sound_m_s();
        let air_np_per_m = settings.medium.absorption_np_per_m();
        let sound = speed_of_sound_m_s.is_finite() && speed_of_sound_m_s > 0.0;
        if !sound || !air_np_per_m.iter().all(|m| m.is_finite() && *m >= 0.0) {
            let problem = format!("{:?} is not a possible state of air", settings.medium);
            let advice = "give °C above −273, percent above 0 and kPa above 0";
            return Err(Error::setting("medium", problem, advice));
        }
        let areas = [
            ("min_panel_m2", settings.min_panel_m2),
            ("max_finite_panel_m2", settings.max_finite_panel_m2),
        ];
        if let Some((name, area_m2)) = areas.into_iter().find(|(_, m2)| m2.is_nan() || *m2 < 0.0) {
            let problem = format!("{area_m2} m² is no area");
            return Err(Error::setting(
                name,
                problem,
                "give square metres, 0 or more",
            ));
        }
        if mesh.triangles.len() > settings.max_triangles {
            let problem = format!(
                "{} triangles, more than {}",
                mesh.triangles.len(),
                settings.max_triangles
            );
            let advice =
                "simplify the model, sound needs walls and not ornaments; or raise max_triangles";
            return Err(Error::mesh(problem, advice));
        }
        let acoustic_tolerance_m = settings
            .acoustic_tolerance_m
            .unwrap_or(speed_of_sound_m_s / SMOOTH_TO_HZ / 8.0);
        if !(0.0..=MOST_TOLERANCE_M).contains(&acoustic_tolerance_m) {
            let problem = format!("{acoustic_tolerance_m} is outside 0 to {MOST_TOLERANCE_M}");
            let advice = "give metres: an eighth of the shortest wave that is to be mirrored";
            return Err(Error::setting("acoustic_tolerance_m", problem, advice));
        }
        let rough = RoughnessSettings {
            tolerance_m: acoustic_tolerance_m,
            speed_m_s: speed_of_sound_m_s,
        };
        let mesh = commit_rough_mesh(mesh, materials, settings.min_panel_m2, rough)?;
        report(0.25)?;
        let bvh = Bvh::build(
            &mesh.vertices,
            &mesh.triangles,
            &mesh.surfaces.triangle_surface,
        );
        report(0.6)?;
        let edges = EdgeSet::build(
            &mesh.vertices,
            &mesh.triangles,
            &mesh.surfaces,
            mesh.centre,
            &bvh,
            length_scale(speed_of_sound_m_s),
        );
        report(0.9)?;
        let finite_panels = FinitePanels::build(
            &mesh.vertices,
            &mesh.triangles,
            &mesh.surfaces,
            &bvh,
            settings.max_finite_panel_m2,
        );
        report(1.0)?;
        Ok(Self {
            bvh: Arc::new(bvh),
            edges: Arc::new(edges),
            finite_panels: Arc::new(finite_panels),
            materials: mesh.materials.as_slice().into(),
            reflectances: mesh.materials.iter().map(Reflectance::of).collect(),
            transmission_factors: mesh
                .materials
                .iter()
                .map(Material::transmission_factor)
                .collect(),
            speed_of_sound_m_s,
            length_scale: length_scale(speed_of_sound_m_s),
            air_np_per_m,
            high_air_np_per_m: settings.medium.high_absorption_np_per_m(),
            acoustic_tolerance_m,
            blocks: TriangleBlocks::build(&mesh.vertices, &mesh.triangles),
            diagonal_m: mesh.report.bounds_min.distance(mesh.report.bounds_max),
            mesh: Arc::new(mesh),
            instances: Instances::default(),
        })
    }

    /// Whether two scenes share the same fixed part.
    pub fn same_fixed_part(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.mesh, &other.mesh)
    }

    /// What changes with every change of a material.
    pub(crate) fn reflectances(&self) -> &Arc<[Reflectance]> {
        &self.reflectances
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
    /// [`Self::any_hit`] include the instances.
    #[inline]
    pub fn bvh(&self) -> &Bvh {
        &self.bvh
    }

    /// A copy that reports every ray against its fixed part to an observer, for measurements. Control side; allocates.
    #[doc(hidden)]
    pub fn with_observer(&self, observer: Arc<dyn RayObserver>) -> Self {
        Self {
            bvh: Arc::new(self.bvh.with_observer(observer)),
            ..self.clone()
        }
    }

    /// The fixed part's diffracting edges, in local coordinates.
    #[inline]
    pub fn edges(&self) -> &EdgeSet {
        &self.edges
    }

    /// All surfaces of the fixed part.
    pub fn surfaces(&self) -> &[Surface] {
        &self.mesh.surfaces.surfaces
    }

    /// A surface by its index, an instance's at its current pose. The surface of a removed instance contains no point.
    #[inline]
    pub fn surface(&self, index: u32) -> &Surface {
        match self.mesh.surfaces.surfaces.get(index as usize) {
            Some(surface) => surface,
            None => self.instance_surface(index),
        }
    }

    /// A surface of the fixed part by its index.
    #[inline]
    pub(crate) fn fixed_surface(&self, index: u32) -> Option<&Surface> {
        self.mesh.surfaces.surfaces.get(index as usize)
    }

    /// Whether a surface can reflect like a mirror at a point of its plane, in local coordinates.
    #[inline]
    pub fn reflects_at(&self, surface: u32, point: DVec3) -> bool {
        if surface as usize >= self.mesh.surfaces.surfaces.len() {
            return self.instance_reflects_at(surface, point);
        }
        self.mesh.surfaces.reflects_at(surface, point)
            || self.has_joined_instances() && self.fixed_piece_reflects_at(surface, point)
    }

    /// Whether any part of a surface can reflect like a mirror.
    #[inline]
    pub(crate) fn has_panels(&self, surface: u32) -> bool {
        self.surface(surface).panel_triangle_count > 0
            || self.has_joined_instances() && self.has_raised_piece(surface)
    }

    /// The fixed part's finite panels.
    #[inline]
    pub fn finite_panels(&self) -> &FinitePanels {
        &self.finite_panels
    }

    /// The finite panel at a point of a surface (local coordinates), on the normal's side or on the other.
    pub fn finite_panel_at(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
    ) -> Option<FinitePanel> {
        let set = &self.mesh.surfaces;
        if surface as usize >= set.surfaces.len() {
            return self.instance_finite_panel_at(surface, point, in_front);
        }
        let without = self.continued_panels();
        self.finite_panels
            .at_without(surface, point, in_front, without)
    }

    /// Whether a triangle is part of a connected plane piece that is large enough to reflect like a mirror.
    #[inline]
    pub fn is_panel(&self, triangle: u32) -> bool {
        if !self.has_triangle(triangle) {
            return self.instance_is_panel(triangle);
        }
        self.mesh.surfaces.is_panel(triangle)
            || self.has_joined_instances() && self.is_of_fixed_piece(triangle)
    }

    /// Whether a triangle belongs to a connected part of the mesh without boundary edges.
    #[inline]
    pub fn is_in_closed_part(&self, triangle: u32) -> bool {
        match self.mesh.in_closed_part.get(triangle as usize) {
            Some(closed) => *closed,
            None => self.instance_is_in_closed_part(triangle),
        }
    }

    /// Curved reflectors of the fixed part, largest first.
    pub fn curved_surfaces(&self) -> &[CurvedSurface] {
        &self.mesh.surfaces.curved.list
    }

    /// Whether paths may reflect at a curved reflector and at planes before and after it.
    #[inline]
    pub(crate) fn is_combined(&self, curved: u32) -> bool {
        curved < self.mesh.surfaces.curved.combined
    }

    /// Index of a facet's curved reflector and the smooth surface's unit normal at a point of it, in local coordinates.
    #[inline]
    pub(crate) fn smooth_normal(&self, triangle: u32, point: DVec3) -> Option<(u32, DVec3)> {
        let index = self.curved_surface_of(triangle)?;
        let shape = &self.curved_surfaces()[index as usize].shape;
        Some((index, shape.normal(point)))
    }

    /// Index of the curved reflector that a triangle belongs to.
    #[inline]
    pub fn curved_surface_of(&self, triangle: u32) -> Option<u32> {
        self.mesh.surfaces.curved.of_triangle(triangle)
    }

    /// The surface that a triangle belongs to.
    #[inline]
    pub fn surface_of(&self, triangle: u32) -> u32 {
        match self.mesh.surfaces.triangle_surface.get(triangle as usize) {
            Some(surface) => *surface,
            None => self.instance_surface_of(triangle),
        }
    }

    /// Whether the index of a triangle is of the fixed part.
    #[inline]
    pub(super) fn has_triangle(&self, triangle: u32) -> bool {
        (triangle as usize) < self.mesh.triangles.len()
    }

    /// Corners of a triangle of the fixed part, in local coordinates.
    #[inline]
    pub(super) fn corners_of(&self, triangle: u32) -> [Vec3; 3] {
        self.mesh.triangles[triangle as usize].map(|v| self.mesh.vertices[v as usize])
    }

    /// Vertex indices of a triangle of the fixed part, for prefetching.
    #[inline]
    pub(crate) fn fixed_triangle(&self, triangle: u32) -> Option<&[u32; 3]> {
        self.mesh.triangles.get(triangle as usize)
    }

    /// Corners of a triangle of the fixed part that [`Self::blocks`] reads, for prefetching.
    #[inline]
    pub(crate) fn fixed_corners(&self, triangle: u32) -> Option<[&Vec3; 3]> {
        let corners = self.fixed_triangle(triangle)?;
        Some(corners.map(|v| &self.mesh.vertices[v as usize]))
    }

    /// The fixed part's surfaces with their triangles.
    pub(super) fn surface_set(&self) -> &SurfaceSet {
        &self.mesh.surfaces
    }

    /// Whether a ray hits this triangle, by the tree's own triangle test.
    #[inline]
    pub fn blocks(&self, triangle: u32, ray: &Ray) -> bool {
        if !self.has_triangle(triangle) {
            return self.instance_blocks(triangle, ray);
        }
        let corners = self.corners_of(triangle);
        let margin_m = self.bvh.margin_m();
        PreparedRay::new(ray, margin_m).is_some_and(|ray| ray.intersect(&corners).is_some())
    }

    /// A triangle's normal by its counter-clockwise winding, of any length.
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

    /// The same for a known surface.
    #[inline]
    pub fn material_of(&self, surface: &Surface) -> &Material {
        let (number, fixed) = (surface.material as usize, &self.materials);
        match fixed.get(number) {
            Some(found) => found,
            None => self
                .instance_material(number - fixed.len())
                .unwrap_or(&fixed[0]),
        }
    }

    /// A surface's reflection at every angle.
    #[inline]
    pub fn reflectance(&self, surface: u32) -> &Reflectance {
        self.reflectance_of(self.surface(surface))
    }

    /// The reflectances of all materials, by the numbers that surfaces have, those of instances included.
    pub(crate) fn all_reflectances(&self) -> impl Iterator<Item = &Reflectance> {
        let of_instances = self.instances.reflectances();
        self.reflectances.iter().chain(of_instances)
    }

    /// The same for a known surface.
    #[inline]
    pub fn reflectance_of(&self, surface: &Surface) -> &Reflectance {
        let (number, fixed) = (surface.material as usize, &self.reflectances);
        match fixed.get(number) {
            Some(found) => found,
            None => self
                .instance_reflectance(number - fixed.len())
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
                .instance_transmission(number - fixed.len())
                .unwrap_or(&fixed[0]),
        }
    }

    /// All materials in use by the fixed part.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Material names missing from the table.
    pub fn defaulted_materials(&self) -> &[String] {
        &self.mesh.defaulted
    }

    /// Counts of the intake.
    pub fn report(&self) -> &IntakeReport {
        &self.mesh.report
    }

    /// Tolerance of [`SceneSettings::acoustic_tolerance_m`] in metres.
    pub fn acoustic_tolerance_m(&self) -> f64 {
        self.acoustic_tolerance_m
    }

    /// Number of rough regions of the fixed part that were moved into planes.
    pub fn flattened_regions(&self) -> usize {
        self.mesh.flattened_regions
    }

    /// Speed of sound in m/s.
    #[inline]
    pub fn speed_of_sound_m_s(&self) -> f64 {
        self.speed_of_sound_m_s
    }

    /// Wavelengths in the scene's air relative to those in the default air: lengths that decide how a wave is computed are
    /// multiplied by it. A diffracted field depends on lengths in wavelengths alone.
    #[inline]
    pub(crate) fn length_scale(&self) -> f64 {
        self.length_scale
    }

    /// Air's amplitude attenuation in Np/m, in each band.
    #[inline]
    pub fn air_np_per_m(&self) -> &BandArray {
        &self.air_np_per_m
    }

    /// Absorption of air above the bands, in Np per second of delay at [`HIGH_AIR_HZ`].
    pub(crate) fn high_air_np_per_s(&self) -> [f32; HIGH_AIR_HZ.len()] {
        let speed_m_s = self.speed_of_sound_m_s as f32;
        self.high_air_np_per_m.map(|np| np * speed_m_s)
    }

    /// Diagonal of the bounds in metres.
    #[inline]
    pub fn diagonal_m(&self) -> f32 {
        self.diagonal_m
    }

    /// Corners of every triangle, in world coordinates: the fixed part's by index, then those of instances.
    pub fn triangles(&self) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        let corner = |v: u32| self.to_world(self.mesh.vertices[v as usize].as_dvec3());
        let fixed = self.mesh.triangles.iter().map(move |t| t.map(corner));
        let of_instances = self.instance_triangles();
        fixed.chain(of_instances.map(|t| t.map(|corner| self.to_world(corner))))
    }

    /// Memory that the scene occupies, in bytes, without the parts of its instances.
    pub fn memory_bytes(&self) -> usize {
        let fixed = self.bvh.memory_bytes() + self.mesh.memory_bytes() + self.edges.memory_bytes();
        fixed + self.blocks.memory_bytes() + self.instances.memory_bytes()
    }
}

/// [`Scene::length_scale`], exactly 1 in the default air.
fn length_scale(speed_of_sound_m_s: f64) -> f64 {
    speed_of_sound_m_s / Medium::default().speed_of_sound_m_s()
}
