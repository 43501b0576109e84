//! Queries of a scene with instances. Without instances each is a query of the fixed part after one comparison.
//!
//! Any thread; all take `&self`, neither allocate nor block.

use glam::{DVec3, Vec3};

use crate::acoustics::material::Reflectance;
use crate::acoustics::{BandArray, Material};
use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Hit, Ray};
use crate::scene::Scene;
use crate::scene::committed::instances::numbering;
use crate::scene::edges::{DiffractingEdge, DiffractingEdges, Edge, EdgeMirrors, choose};
use crate::scene::surface::Surface;
use crate::scene::surface::finite_panel::FinitePanel;

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

/// Edge of a stale index: no path crosses it.
const NO_EDGE: Edge = Edge {
    key: 0,
    origin: DVec3::NAN,
    direction: DVec3::Y,
    length_m: 0.0,
    tangent: DVec3::X,
    normal: DVec3::Z,
    n: 2.0,
    faces: [NO_GROUP; 2],
    free_ends: [false; 2],
    length_scale: 1.0,
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

    /// Whether a ray enters the bounding box of any instance, in local coordinates.
    pub fn enters_box_of_instance(&self, ray: &Ray) -> bool {
        self.instances.tree.is_entered(ray)
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

    /// An edge by its index, in local coordinates; an edge that no path crosses for a stale index.
    #[inline]
    pub fn edge(&self, index: u32) -> Edge {
        if numbering::is_instance(index) {
            return self.instance_edge(index);
        }
        let found = self.edges().as_slice().get(index as usize);
        *found.unwrap_or(&NO_EDGE)
    }

    #[inline(never)]
    fn instance_edge(&self, index: u32) -> Edge {
        let found = self.instances.of(index).and_then(|(placed, local)| {
            let edge = placed.part.edges().as_slice().get(local as usize)?;
            Some(placed.edge(edge))
        });
        found.unwrap_or(NO_EDGE)
    }

    /// Edges of the same rigid body that are visible from an edge. Visibility between bodies changes as instances move.
    pub fn edge_neighbours(&self, index: u32) -> impl Iterator<Item = u32> + '_ {
        let (placed, local) = match numbering::is_instance(index) {
            true => match self.instances.of(index) {
                Some((placed, local)) => (Some(placed), local),
                None => (None, NO_GROUP),
            },
            false => (None, index),
        };
        let set = placed.map_or(self.edges(), |placed| placed.part.edges());
        let neighbours = match (local as usize) < set.len() {
            true => set.neighbours(local),
            false => &[],
        };
        neighbours
            .iter()
            .map(move |&other| placed.map_or(other, |placed| placed.scene_index(other)))
    }

    /// The `MAX_DIFFRACTING_EDGES` shortest paths between two points over
    /// one edge, of the fixed part and of instances, up to `longest_m`: both points in the exterior wedge, the crossing
    /// within the edge's ends. Occlusion is not tested. The result for nearby points as `known` saves time without
    /// changing the result.
    pub fn diffracting_edges(
        &self,
        known: &DiffractingEdges,
        from: DVec3,
        to: DVec3,
        longest_m: f64,
    ) -> DiffractingEdges {
        let (edges, mut near) = (self.edges(), DiffractingEdges::default());
        edges.add_known(&mut near, known, (from, to), longest_m);
        edges.add_crossings(&mut near, from, to, longest_m, |edge| edge);
        for placed in self.instances.placed() {
            if placed.min_path_length_m(from, to) <= near.bound_m(longest_m) {
                let (from, to) = (placed.point(from), placed.point(to));
                let set = placed.part.edges();
                set.add_crossings(&mut near, from, to, longest_m, |edge| {
                    placed.scene_index(edge)
                });
            }
        }
        near
    }

    /// The same for a list of edges, which may have duplicates and stale indices.
    pub fn diffracting_edges_over(
        &self,
        edges: impl Iterator<Item = u32>,
        from: DVec3,
        to: DVec3,
    ) -> DiffractingEdges {
        let mut near = DiffractingEdges::default();
        for edge in edges {
            let known = near.as_slice().iter().any(|found| found.edge == edge);
            if let Some(crossing) = self.edge(edge).crossing(from, to).filter(|_| !known) {
                let length_m = crossing.rank_m();
                near.insert(DiffractingEdge { edge, length_m });
            }
        }
        near
    }

    /// The same for edges of paths with several interactions: one end at least lies in the exterior wedge, and a crossing
    /// beyond an edge's end counts as one at its end.
    pub fn outer_crossings(&self, from: DVec3, to: DVec3, longest_m: f64) -> DiffractingEdges {
        let mut near = DiffractingEdges::default();
        let edges = self.edges();
        edges.add_outer_crossings(&mut near, (from, to), longest_m, |edge| edge);
        for placed in self.instances.placed() {
            if placed.min_path_length_m(from, to) <= near.bound_m(longest_m) {
                let ends = (placed.point(from), placed.point(to));
                let index = |edge| placed.scene_index(edge);
                let edges = placed.part.edges();
                edges.add_outer_crossings(&mut near, ends, longest_m, index);
            }
        }
        near
    }

    /// The same over edges of instances only; `from` lies in the exterior wedge.
    pub fn first_crossings_of_instances(
        &self,
        from: DVec3,
        to: DVec3,
        longest_m: f64,
    ) -> DiffractingEdges {
        let mut near = DiffractingEdges::default();
        for placed in self.instances.placed() {
            if placed.min_path_length_m(from, to) <= near.bound_m(longest_m) {
                let ends = (placed.point(from), placed.point(to));
                let index = |edge| placed.scene_index(edge);
                let edges = placed.part.edges();
                edges.add_first_crossings(&mut near, ends, longest_m, index);
            }
        }
        near
    }

    /// Whether two surfaces, triangles or edges are of one instance, or both of the fixed part.
    pub fn is_same_rigid_body(&self, a: u32, b: u32) -> bool {
        numbering::is_same_rigid_body(a, b)
    }

    /// Candidates for a reflection before or after the diffraction at an edge: surfaces of the fixed part and of
    /// instances with a large solid angle from it.
    pub fn edge_mirrors(&self, index: u32) -> EdgeMirrors {
        if !self.has_instances() {
            return self.edges().mirrors(index);
        }
        let large = self.instances.large_surfaces().iter();
        let named = large.map(|&surface| (surface, self.surface(surface)));
        choose(&self.edge(index), named)
    }

    /// Distance in metres from a point of a surface to the nearest edge that it ends at, if that is below `within_m`. Edges
    /// at which another surface continues it on the normal's side (`in_front`) or on the other do not count there.
    #[inline]
    pub fn edge_distance_m(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
        within_m: f64,
    ) -> Option<f64> {
        if numbering::is_instance(surface) {
            return self.instance_edge_distance_m(surface, point, in_front, within_m);
        }
        self.edges().distance_m(surface, point, in_front, within_m)
    }

    /// Whether the scene has edges.
    #[inline]
    pub fn has_edges(&self) -> bool {
        let has = |scene: &Self| !scene.edges().is_empty();
        has(self) || self.instances.placed().any(|placed| has(&placed.part))
    }

    #[inline(never)]
    fn instance_edge_distance_m(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
        within_m: f64,
    ) -> Option<f64> {
        let (placed, local) = self.instances.of(surface)?;
        let (edges, point) = (placed.part.edges(), placed.point(point));
        edges.distance_m(local, point, in_front, within_m)
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
        self.instances.of(surface).is_some_and(|(placed, local)| {
            (local as usize) < placed.surfaces.len()
                && placed.part.reflects_at(local, placed.point(point))
        })
    }

    #[inline(never)]
    pub(crate) fn instance_finite_panel_at(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
    ) -> Option<FinitePanel> {
        let (placed, local) = self.instances.of(surface)?;
        placed.surfaces.get(local as usize)?;
        let point = placed.point(point);
        let panel = placed.part.finite_panel_at(local, point, in_front)?;
        Some(FinitePanel {
            sides: panel.sides.map(|side| placed.direction(side)),
            ..panel
        })
    }

    #[inline(never)]
    pub(crate) fn instance_is_panel(&self, triangle: u32) -> bool {
        self.instances.of(triangle).is_some_and(|(placed, local)| {
            placed.part.has_triangle(local) && placed.part.is_panel(local)
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
            placed.scene_index(placed.part.surface_of(local))
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
