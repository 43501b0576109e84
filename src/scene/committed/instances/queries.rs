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
use crate::scene::edges::{
    DiffractingEdge, DiffractingEdges, Edge, EdgeMirrors, NO_EDGE, OwnEdges, choose,
};
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

    /// An edge by its index, in local coordinates; an edge that no path crosses for a stale index.
    #[inline]
    pub fn edge(&self, index: u32) -> Edge {
        if numbering::is_instance(index) {
            return self.instance_edge(index);
        }
        if let Some(fixed) = &self.instances.fixed {
            return fixed.edge_at(index).unwrap_or(NO_EDGE);
        }
        let found = self.edges().as_slice().get(index as usize);
        *found.unwrap_or(&NO_EDGE)
    }

    /// Surfaces of an edge's faces ([`Edge::faces`]), without its geometry.
    pub(crate) fn edge_faces(&self, index: u32) -> [u32; 2] {
        let has_instances = numbering::is_instance(index) || self.instances.fixed.is_some();
        match self.edges().as_slice().get(index as usize) {
            Some(edge) if !has_instances => edge.faces,
            _ => self.edge(index).faces,
        }
    }

    /// All edges in local coordinates: those of the fixed part, and of each instance as joining has left them.
    pub fn all_edges(&self) -> impl Iterator<Item = Edge> + '_ {
        let joined = self.instances.fixed.as_ref();
        let fixed = match joined {
            Some(_) => &[],
            None => self.edges().as_slice(),
        };
        let placed = joined.into_iter().chain(self.instances.placed());
        fixed.iter().copied().chain(placed.flat_map(|placed| {
            let own = 0..placed.part.edges().len() as u32;
            let further = placed.further_numbers();
            own.chain(further)
                .filter_map(|number| placed.edge_at(number))
                .filter(|edge| edge.length_m > 0.0)
        }))
    }

    #[inline(never)]
    fn instance_edge(&self, index: u32) -> Edge {
        let found = self.instances.of(index);
        let edge = found.and_then(|(placed, local)| placed.edge_at(local));
        edge.unwrap_or(NO_EDGE)
    }

    /// Edges of the same rigid body that are visible from an edge. Visibility between bodies changes as instances move.
    pub fn edge_neighbours(&self, index: u32) -> impl Iterator<Item = u32> + '_ {
        let (placed, local) = match numbering::is_instance(index) {
            true => match self.instances.of(index) {
                Some((placed, local)) => (Some(placed), local),
                None => (None, NO_GROUP),
            },
            false => (self.instances.fixed.as_ref(), index),
        };
        let set = placed.map_or(self.edges(), |placed| placed.part.edges());
        let neighbours = match (local as usize) < set.len() {
            true => set.neighbours(local),
            false => &[],
        };
        let is_covered = move |other: &u32| {
            let joint = placed.and_then(|placed| placed.joint.as_ref());
            joint.is_some_and(|joint| joint.edges.is_covered(*other))
        };
        neighbours
            .iter()
            .filter(move |other| !is_covered(other))
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
        match &self.instances.fixed {
            None => {
                edges.add_known(&mut near, known, (from, to), longest_m, &OwnEdges);
                edges.add_crossings(&mut near, from, to, longest_m, &OwnEdges);
            }
            Some(fixed) => {
                let names = fixed.part_edges();
                edges.add_known(&mut near, known, (from, to), longest_m, &names);
                edges.add_crossings(&mut near, from, to, longest_m, &names);
                if let Some((set, names)) = fixed.further_edges() {
                    set.add_crossings(&mut near, from, to, longest_m, &names);
                }
            }
        }
        for placed in self.instances.placed() {
            if placed.min_path_length_m(from, to) <= near.bound_m(longest_m) {
                let (from, to) = (placed.point(from), placed.point(to));
                let set = placed.part.edges();
                set.add_crossings(&mut near, from, to, longest_m, &placed.part_edges());
                if let Some((set, names)) = placed.further_edges() {
                    set.add_crossings(&mut near, from, to, longest_m, &names);
                }
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
            if near.as_slice().iter().any(|found| found.edge == edge) {
                continue;
            }
            let rank_m = self.edge(edge).crossing_rank_m(from, to, f64::INFINITY);
            if let Some(length_m) = rank_m {
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
        match &self.instances.fixed {
            None => edges.add_outer_crossings(&mut near, (from, to), longest_m, &OwnEdges),
            Some(fixed) => {
                let names = fixed.part_edges();
                edges.add_outer_crossings(&mut near, (from, to), longest_m, &names);
                if let Some((edges, names)) = fixed.further_edges() {
                    edges.add_outer_crossings(&mut near, (from, to), longest_m, &names);
                }
            }
        }
        for placed in self.instances.placed() {
            if placed.min_path_length_m(from, to) <= near.bound_m(longest_m) {
                let ends = (placed.point(from), placed.point(to));
                let edges = placed.part.edges();
                edges.add_outer_crossings(&mut near, ends, longest_m, &placed.part_edges());
                if let Some((edges, names)) = placed.further_edges() {
                    edges.add_outer_crossings(&mut near, ends, longest_m, &names);
                }
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
                let edges = placed.part.edges();
                edges.add_first_crossings(&mut near, ends, longest_m, &placed.part_edges());
                if let Some((edges, names)) = placed.further_edges() {
                    edges.add_first_crossings(&mut near, ends, longest_m, &names);
                }
            }
        }
        near
    }

    /// The same over edges of the fixed part only.
    pub fn first_crossings_of_fixed(
        &self,
        from: DVec3,
        to: DVec3,
        longest_m: f64,
    ) -> DiffractingEdges {
        let Some(fixed) = &self.instances.fixed else {
            return self.edges().first_crossings(from, to, longest_m);
        };
        let (mut near, ends) = (DiffractingEdges::default(), (from, to));
        let names = fixed.part_edges();
        self.edges()
            .add_first_crossings(&mut near, ends, longest_m, &names);
        if let Some((edges, names)) = fixed.further_edges() {
            edges.add_first_crossings(&mut near, ends, longest_m, &names);
        }
        near
    }

    /// Whether a commit has searched for a line of sight between two edges: both are of the fixed part, or of one part and
    /// neither a further piece that joining has added.
    pub fn is_committed_pair(&self, a: u32, b: u32) -> bool {
        let is_further = |edge: u32| {
            let fixed = self.instances.fixed.as_ref().map(|fixed| (fixed, edge));
            let found = match numbering::is_instance(edge) {
                true => self.instances.of(edge),
                false => fixed,
            };
            let joint = found.and_then(|(placed, local)| Some((placed.joint.as_ref()?, local)));
            joint.is_some_and(|(joint, local)| joint.edges.is_further(local))
        };
        a == b || numbering::is_same_rigid_body(a, b) && !is_further(a) && !is_further(b)
    }

    /// Candidates for a reflection before or after the diffraction at an edge: surfaces of the fixed part and of
    /// instances with a large solid angle from it.
    pub fn edge_mirrors(&self, index: u32) -> EdgeMirrors {
        if !self.has_instances() {
            return self.edges().mirrors(index);
        }
        if let Some(merged) = self.instances.continued.merged() {
            let edge = self.edge(index);
            let is_face = |surface: u32| {
                edge.faces.contains(&surface)
                    || self
                        .continued_by(surface)
                        .is_some_and(|other| edge.faces.contains(&other))
            };
            let mirrors = merged.iter().filter(|(surface, _)| !is_face(*surface));
            return choose(&edge, mirrors.map(|(surface, merged)| (*surface, merged)));
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
        let fixed = self.instances.fixed.as_ref();
        let joint = fixed.and_then(|fixed| fixed.joint.as_ref());
        joint
            .and_then(|joint| joint.rims.distance_m(surface, point, in_front, within_m))
            .unwrap_or_else(|| self.edges().distance_m(surface, point, in_front, within_m))
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
        let of_part = |placed: &PlacedInstance, local: u32, in_front: bool| {
            let at = placed.point(point);
            let joint = placed.joint.as_ref();
            let joined = joint.and_then(|j| j.rims.distance_m(local, at, in_front, within_m));
            let edges = placed.part.edges();
            joined.unwrap_or_else(|| edges.distance_m(local, at, in_front, within_m))
        };
        if let Some((placed, local)) = self.instances.of(surface) {
            return of_part(placed, local, in_front);
        }
        let members = self.instances.members_at(surface, point, within_m);
        let distances = members.filter_map(|(placed, member)| {
            of_part(placed, member.local, in_front != member.is_turned)
        });
        distances.min_by(f64::total_cmp)
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
