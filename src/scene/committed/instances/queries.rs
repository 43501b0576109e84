//! Queries of a scene with instances. Without instances each is a query of the fixed part after one comparison.
//!
//! Any thread; all take `&self`, neither allocate nor block.

use glam::{DVec3, Vec3};

use crate::acoustics::material::Reflectance;
use crate::acoustics::{BandArray, Material};
use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Aabb, Hit, Ray};
use crate::scene::Scene;
use crate::scene::committed::instances::numbering;
use crate::scene::committed::instances::placed::PlacedInstance;
use crate::scene::surface::Surface;
use crate::scene::surface::finite_panel::FinitePanel;

/// Distance in metres of a point from the bounds of a part's surface that it is on: above the unevenness of surfaces.
const NEAR_M: f64 = 5e-3;

/// Surface of a stale index: it contains no point.
const NO_SURFACE: Surface = Surface {
    key: 0,
    normal: DVec3::Y,
    offset_m: 0.0,
    material: 0,
    area_m2: 0.0,
    bounds_min: Vec3::INFINITY,
    bounds_max: Vec3::NEG_INFINITY,
    first_triangle: 0,
    triangle_count: 0,
    panel_triangle_count: 0,
};

impl Scene {
    /// The first triangle on a ray, of the fixed scene or an instance, in local coordinates; otherwise as
    /// `closest_hit`.
    #[inline(always)]
    pub fn closest_hit(&self, ray: &Ray, ignored: [u32; 2]) -> Option<Hit> {
        if self.instances.is_empty() {
            return self.bvh().closest_hit(ray, ignored);
        }
        self.closest_hit_among_instances(ray, ignored)
    }

    /// Instances first: their hit bounds the search in the fixed part.
    #[inline(never)]
    fn closest_hit_among_instances(&self, ray: &Ray, ignored: [u32; 2]) -> Option<Hit> {
        let found = self.instances.closest_hit(ray, ignored, None);
        // A hit at the same parameter counts, since its index is lower.
        let t_max = found.map_or(ray.t_max, |hit| hit.t.next_up());
        let fixed = self.bvh().closest_hit(&Ray { t_max, ..*ray }, ignored);
        fixed.or(found)
    }

    /// Whether any part is joined with others.
    #[inline]
    pub fn has_joined_instances(&self) -> bool {
        self.instances.joined > 0
    }

    /// [`Self::closest_hit`] among what does not move: the fixed part and joined parts.
    pub(crate) fn closest_static_hit(&self, ray: &Ray, ignored: [u32; 2]) -> Option<Hit> {
        let fixed = self.bvh().closest_hit(ray, ignored);
        match self.has_joined_instances() {
            true => self.instances.closest_joined_hit(ray, ignored, fixed),
            false => fixed,
        }
    }

    /// [`Self::any_hit`] among the same.
    pub(crate) fn is_statically_blocked(&self, ray: &Ray, ignored: [u32; 2]) -> bool {
        self.bvh().any_hit(ray, ignored)
            || self.has_joined_instances() && self.instances.joined_blocker(ray, ignored).is_some()
    }

    /// [`Bvh::crossed_boxes`](crate::geometry::Bvh::crossed_boxes) of the same, for a line that starts in the part where it
    /// is largest. A line through the bounds of all intersects those of one as often as their areas relate.
    pub(crate) fn static_crossed_boxes(&self) -> f64 {
        let fixed = self.bvh().crossed_boxes();
        if !self.has_joined_instances() {
            return fixed;
        }
        let joined = || self.instances.placed().filter(|p| p.joint.is_some());
        let vertices = self.mesh.vertices.iter();
        let own = vertices.fold(Aabb::EMPTY, |bounds, vertex| bounds.with_point(*vertex));
        let all = joined().fold(own, |bounds, placed| bounds.union(&placed.bounds));
        let of_all = all.half_area().max(f64::MIN_POSITIVE);
        let parts = || {
            let of_joined = joined().map(|p| (p.part.bvh().crossed_boxes(), p.bounds));
            let parts = of_joined.chain([(fixed, own)]);
            parts.map(|(boxes, bounds)| (boxes, bounds.half_area() / of_all))
        };
        let crossed: f64 = parts().map(|(boxes, share)| boxes * share).sum();
        let remains = parts().map(|(boxes, share)| boxes * (1.0 - share));
        crossed + remains.fold(0.0, f64::max)
    }

    /// Area in m² and number of every triangle of the same.
    pub(crate) fn static_areas(&self) -> impl Iterator<Item = (f64, u32)> + '_ {
        let area = |[a, b, c]: [Vec3; 3]| 0.5 * f64::from((b - a).cross(c - a).length());
        let joined = self.instances.placed().filter(|p| p.joint.is_some());
        let of_joined = joined.flat_map(move |placed| {
            let triangles = 0..placed.part.mesh.triangles.len() as u32;
            triangles.map(move |t| (area(placed.part.corners_of(t)), placed.scene_index(t)))
        });
        let fixed = 0..self.mesh.triangles.len() as u32;
        let fixed = fixed.map(move |t| (area(self.corners_of(t)), t));
        fixed.chain(of_joined)
    }

    /// Corners of a triangle in local coordinates.
    pub(crate) fn corners_in_scene(&self, triangle: u32) -> Option<[Vec3; 3]> {
        if !numbering::is_instance(triangle) {
            return self
                .has_triangle(triangle)
                .then(|| self.corners_of(triangle));
        }
        let (placed, local) = self.instances.of(triangle)?;
        let corners = placed
            .part
            .has_triangle(local)
            .then(|| placed.part.corners_of(local));
        Some(corners?.map(|corner| placed.to_scene(corner).as_vec3()))
    }

    /// [`Self::closest_hit`] with the known hit in the fixed part.
    #[inline]
    pub(crate) fn closest_hit_beside(
        &self,
        ray: &Ray,
        ignored: [u32; 2],
        fixed: Option<Hit>,
    ) -> Option<Hit> {
        self.instances.closest_hit(ray, ignored, fixed)
    }

    /// Whether any triangle outside two surfaces lies on a ray, in local coordinates.
    #[inline]
    pub fn any_hit(&self, ray: &Ray, ignored: [u32; 2]) -> bool {
        self.blocker(ray, ignored).is_some()
    }

    /// Any triangle outside two surfaces that a ray hits, in local coordinates; the tree decides among several.
    #[inline]
    pub fn blocker(&self, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
        let found = self.bvh().occluder(ray, ignored);
        if found.is_some() || self.instances.is_empty() {
            return found;
        }
        self.instances.blocker(ray, ignored)
    }

    /// Whether a ray enters the bounding box of any instance that moves, in local coordinates.
    pub fn enters_box_of_instance(&self, ray: &Ray) -> bool {
        let mut is_entered = false;
        self.instances.tree.traverse(ray, |slot, t_max| {
            let placed = self.instances.at(slot as usize);
            is_entered |= placed.is_some_and(|placed| placed.joint.is_none());
            if is_entered { -1.0 } else { t_max }
        });
        is_entered
    }

    /// Whether a surface, triangle or edge is of an instance.
    #[inline]
    pub fn is_of_instance(&self, index: u32) -> bool {
        numbering::is_instance(index)
    }

    /// Whether the scene has instances.
    #[inline]
    pub fn has_instances(&self) -> bool {
        !self.instances.is_empty()
    }

    /// Whether the index of a surface is valid; those of a removed instance are not.
    #[inline]
    pub fn has_surface(&self, surface: u32) -> bool {
        match numbering::is_instance(surface) {
            true => self.instances.surface(surface).is_some(),
            false => (surface as usize) < self.surfaces().len(),
        }
    }

    /// Whether the scene has finite panels.
    #[inline]
    pub fn has_finite_panels(&self) -> bool {
        let has = |scene: &Self| !scene.finite_panels().is_empty();
        has(self) || self.instances.placed().any(|placed| has(&placed.part))
    }
}

/// Queries of instances.
impl Scene {
    #[inline(never)]
    pub(crate) fn instance_surface(&self, index: u32) -> &Surface {
        self.instances.surface(index).unwrap_or(&NO_SURFACE)
    }

    #[inline(never)]
    pub(crate) fn instance_reflects_at(&self, surface: u32, point: DVec3) -> bool {
        if let Some((placed, local)) = self.instances.of(surface) {
            return (local as usize) < placed.surfaces.len()
                && placed.part.reflects_at(local, placed.point(point));
        }
        let mut members = self.instances.members_at(surface, point, NEAR_M);
        members.any(|(placed, member)| placed.mirrors_at(member.local, placed.point(point)))
    }

    /// Finite panels of the fixed part that go on in a joined one, ascending.
    #[inline]
    pub(crate) fn continued_panels(&self) -> &[u32] {
        let fixed = self.instances.fixed.as_ref();
        let joint = fixed.and_then(|fixed| fixed.joint.as_ref());
        joint.map_or(&[], |joint| joint.rims.continued())
    }

    #[inline(never)]
    pub(crate) fn instance_finite_panel_at(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
    ) -> Option<FinitePanel> {
        let of_part = |placed: &PlacedInstance, local: u32, in_front: bool| {
            placed.surfaces.get(local as usize)?;
            let joint = placed.joint.as_ref();
            let without = joint.map_or(&[][..], |joint| joint.rims.continued());
            let panels = placed.part.finite_panels();
            let panel = panels.at_without(local, placed.point(point), in_front, without)?;
            Some(FinitePanel {
                sides: panel.sides.map(|side| placed.direction(side)),
                ..panel
            })
        };
        if let Some((placed, local)) = self.instances.of(surface) {
            return of_part(placed, local, in_front);
        }
        let mut members = self.instances.members_at(surface, point, NEAR_M);
        members.find_map(|(placed, member)| {
            of_part(placed, member.local, in_front != member.is_turned)
        })
    }

    #[inline(never)]
    pub(crate) fn instance_is_panel(&self, triangle: u32) -> bool {
        self.instances.of(triangle).is_some_and(|(placed, local)| {
            placed.part.has_triangle(local) && placed.is_panel(local)
        })
    }

    #[inline(never)]
    pub(crate) fn instance_is_in_closed_part(&self, triangle: u32) -> bool {
        self.instances.of(triangle).is_some_and(|(placed, local)| {
            placed.part.has_triangle(local) && placed.part.is_in_closed_part(local)
        })
    }

    /// The surface of an instance's triangle, or [`NO_GROUP`].
    #[inline(never)]
    pub(crate) fn instance_surface_of(&self, triangle: u32) -> u32 {
        let found = self.instances.of(triangle);
        let found = found.filter(|(placed, local)| placed.part.has_triangle(*local));
        found.map_or(NO_GROUP, |(placed, local)| {
            placed.surface_number(placed.part.surface_of(local))
        })
    }

    #[inline(never)]
    pub(crate) fn instance_blocks(&self, triangle: u32, ray: &Ray) -> bool {
        self.instances.of(triangle).is_some_and(|(placed, local)| {
            placed.part.has_triangle(local) && placed.part.blocks(local, &placed.ray(ray))
        })
    }

    #[inline(never)]
    pub(crate) fn instance_normal(&self, triangle: u32) -> Vec3 {
        let found = self.instances.of(triangle);
        let found = found.filter(|(placed, local)| placed.part.has_triangle(*local));
        found.map_or(Vec3::Y, |(placed, local)| {
            placed.direction(placed.part.triangle_normal(local))
        })
    }

    /// A material that only instances have; `number` counts on from the fixed scene's.
    #[inline(never)]
    pub(crate) fn instance_material(&self, index: usize) -> Option<&Material> {
        self.instances.materials.material(index)
    }

    #[inline(never)]
    pub(crate) fn instance_reflectance(&self, index: usize) -> Option<&Reflectance> {
        self.instances.materials.reflectance(index)
    }

    #[inline(never)]
    pub(crate) fn instance_transmission(&self, index: usize) -> Option<&BandArray> {
        self.instances.materials.transmission_factor(index)
    }

    /// Corners of every triangle of the instances, in local coordinates.
    pub(crate) fn instance_triangles(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.instances.placed().flat_map(|placed| {
            let triangles = 0..placed.part.bvh().triangle_count() as u32;
            let triangles = triangles.filter(|&t| placed.part.has_triangle(t));
            triangles.map(|t| placed.part.corners_of(t).map(|c| placed.to_scene(c)))
        })
    }
}
