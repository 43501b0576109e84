//! Questions to a scene that its instances have a part in. Without instances each is the fixed scene's, and one
//! comparison.
//!
//! Any thread; all take `&self`, neither allocate nor block.

use glam::{DVec3, Vec3};

use crate::acoustics::material::Reflectance;
use crate::acoustics::{BandArray, Material};
use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Hit, Ray};
use crate::scene::Scene;
use crate::scene::edges::{Edge, EdgeMirrors, NearEdge, NearEdges, choose};
use crate::scene::instances::numbering;
use crate::scene::surface::Surface;
use crate::scene::surface::free_panel::FreePanel;

/// What a number names that is nobody's any more: no point lies in it.
const NOWHERE: Surface = Surface {
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

/// The same for edges: no way bends over it.
const NO_EDGE: Edge = Edge {
    key: 0,
    origin: DVec3::NAN,
    direction: DVec3::Y,
    length_m: 0.0,
    tangent: DVec3::X,
    normal: DVec3::Z,
    n: 2.0,
    faces: [NO_GROUP; 2],
};

impl Scene {
    /// The first triangle a ray meets, of the fixed scene or an instance, in local coordinates; otherwise as
    /// [`crate::geometry::Bvh::closest_hit`].
    #[inline(always)]
    pub fn closest_hit(&self, ray: &Ray, ignored: [u32; 2]) -> Option<Hit> {
        if self.instances.is_empty() {
            return self.bvh().closest_hit(ray, ignored);
        }
        self.closest_hit_among_instances(ray, ignored)
    }

    /// Instances first: what the fixed scene has beyond them need not be looked at.
    #[inline(never)]
    fn closest_hit_among_instances(&self, ray: &Ray, ignored: [u32; 2]) -> Option<Hit> {
        let found = self.instances.closest_hit(ray, ignored, None);
        // One at the same parameter still counts, since its number is lower.
        let t_max = found.map_or(ray.t_max, |hit| hit.t.next_up());
        let fixed = self.bvh().closest_hit(&Ray { t_max, ..*ray }, ignored);
        fixed.or(found)
    }

    /// [`Self::closest_hit`] for whom knows already what the ray meets in the fixed scene.
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

    /// A triangle outside two surfaces that lies on a ray, in local coordinates; if several do, which one depends on the
    /// tree.
    #[inline]
    pub fn blocker(&self, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
        let found = self.bvh().occluder(ray, ignored);
        if found.is_some() || self.instances.is_empty() {
            return found;
        }
        self.instances.blocker(ray, ignored)
    }

    /// Whether a ray comes into the box around any instance, in local coordinates.
    pub fn enters_box_of_instance(&self, ray: &Ray) -> bool {
        self.instances.tree.is_entered(ray)
    }

    /// Whether a surface, triangle or edge is of an instance.
    #[inline]
    pub fn is_of_instance(&self, number: u32) -> bool {
        numbering::is_instance(number)
    }

    /// Whether anything in it can move.
    #[inline]
    pub fn has_instances(&self) -> bool {
        !self.instances.is_empty()
    }

    /// Whether a surface's number still names one: those of an instance end with it, and those of another scene's
    /// updates never did.
    #[inline]
    pub fn has_surface(&self, surface: u32) -> bool {
        match numbering::is_instance(surface) {
            true => self.instances.surface(surface).is_some(),
            false => (surface as usize) < self.surfaces().len(),
        }
    }

    /// An edge by its number, in local coordinates; one that no way bends over if the number names none.
    #[inline]
    pub fn edge(&self, number: u32) -> Edge {
        if numbering::is_instance(number) {
            return self.instance_edge(number);
        }
        let found = self.edges().as_slice().get(number as usize);
        *found.unwrap_or(&NO_EDGE)
    }

    #[inline(never)]
    fn instance_edge(&self, number: u32) -> Edge {
        let found = self.instances.of(number).and_then(|(placed, local)| {
            let edge = placed.part.edges().as_slice().get(local as usize)?;
            Some(placed.edge(edge))
        });
        found.unwrap_or(NO_EDGE)
    }

    /// Edges that an edge sees as long as nothing comes between: a fixed edge fixed ones, one of an instance the instance's
    /// own. What else they see changes as instances move.
    pub fn edge_neighbours(&self, number: u32) -> impl Iterator<Item = u32> + '_ {
        let (placed, local) = match numbering::is_instance(number) {
            true => match self.instances.of(number) {
                Some((placed, local)) => (Some(placed), local),
                None => (None, NO_GROUP),
            },
            false => (None, number),
        };
        let set = placed.map_or(self.edges(), |placed| placed.part.edges());
        let neighbours = match (local as usize) < set.len() {
            true => set.neighbours(local),
            false => &[],
        };
        neighbours
            .iter()
            .map(move |&other| placed.map_or(other, |placed| placed.number(other)))
    }

    /// The [`MOST_NEAR`](crate::scene::edges::MOST_NEAR) shortest ways from one place to another over one edge, of the fixed
    /// scene and of instances, none longer than `longest_m`: both places outside the wedge and the bend within the edge's
    /// ends. Says nothing of what stands in between. With the answer for places not far away as `known` it is found sooner,
    /// and no other one.
    pub fn diffracting_edges(
        &self,
        known: &NearEdges,
        from: DVec3,
        to: DVec3,
        longest_m: f64,
    ) -> NearEdges {
        let (edges, mut near) = (self.edges(), NearEdges::default());
        edges.add_known(&mut near, known, (from, to), longest_m);
        edges.add_bends(&mut near, from, to, longest_m, |edge| edge);
        for placed in self.instances.placed() {
            if placed.least_way_m(from, to) <= near.bound_m(longest_m) {
                let (from, to) = (placed.point(from), placed.point(to));
                let set = placed.part.edges();
                set.add_bends(&mut near, from, to, longest_m, |edge| placed.number(edge));
            }
        }
        near
    }

    /// The same, asked of some edges only, each of which may come more than once, or have gone.
    pub fn diffracting_edges_over(
        &self,
        edges: impl Iterator<Item = u32>,
        from: DVec3,
        to: DVec3,
    ) -> NearEdges {
        let mut near = NearEdges::default();
        for edge in edges {
            let known = near.as_slice().iter().any(|found| found.edge == edge);
            if let Some(bend) = self.edge(edge).bend(from, to).filter(|_| !known) {
                let length_m = bend.length_m();
                near.insert(NearEdge { edge, length_m });
            }
        }
        near
    }

    /// The same for ways that may bend again; otherwise as [`crate::scene::EdgeSet::first_bends`].
    pub fn first_bends(&self, from: DVec3, to: DVec3, longest_m: f64) -> NearEdges {
        let mut near = self.edges().first_bends(from, to, longest_m);
        self.add_instances_first_bends(&mut near, from, to, longest_m);
        near
    }

    /// The same over edges of instances only.
    pub fn first_bends_of_instances(&self, from: DVec3, to: DVec3, longest_m: f64) -> NearEdges {
        let mut near = NearEdges::default();
        self.add_instances_first_bends(&mut near, from, to, longest_m);
        near
    }

    fn add_instances_first_bends(
        &self,
        near: &mut NearEdges,
        from: DVec3,
        to: DVec3,
        longest_m: f64,
    ) {
        for placed in self.instances.placed() {
            if placed.least_way_m(from, to) <= near.bound_m(longest_m) {
                let (from, to) = (placed.point(from), placed.point(to));
                let set = placed.part.edges();
                set.add_first_bends(near, from, to, longest_m, |edge| placed.number(edge));
            }
        }
    }

    /// Whether two surfaces, triangles or edges are of one instance, or both of the fixed scene: such never move against
    /// each other.
    pub fn moves_as_one(&self, a: u32, b: u32) -> bool {
        numbering::is_one(a, b)
    }

    /// Surfaces that look large from an edge: those worth trying before and behind a bend around it, of the fixed scene
    /// and of instances as they stand.
    pub fn edge_mirrors(&self, number: u32) -> EdgeMirrors {
        if !self.has_instances() {
            return self.edges().mirrors(number);
        }
        let large = self.instances.large_surfaces().iter();
        let named = large.map(|&surface| (surface, self.surface(surface)));
        choose(&self.edge(number), named)
    }

    /// Distance in metres from a point of a surface to the nearest edge that it ends at, if that is below `within_m`.
    #[inline]
    pub fn edge_distance_m(&self, surface: u32, point: DVec3, within_m: f64) -> Option<f64> {
        if numbering::is_instance(surface) {
            return self.instance_edge_distance_m(surface, point, within_m);
        }
        self.edges().distance_m(surface, point, within_m)
    }

    /// Whether anything at all has edges.
    #[inline]
    pub fn has_edges(&self) -> bool {
        let has = |scene: &Self| !scene.edges().is_empty();
        has(self) || self.instances.placed().any(|placed| has(&placed.part))
    }

    #[inline(never)]
    fn instance_edge_distance_m(&self, surface: u32, point: DVec3, within_m: f64) -> Option<f64> {
        let (placed, local) = self.instances.of(surface)?;
        let point = placed.point(point);
        placed.part.edges().distance_m(local, point, within_m)
    }

    /// Whether any small panel stands free.
    #[inline]
    pub fn has_free_panels(&self) -> bool {
        let has = |scene: &Self| !scene.free_panels().is_empty();
        has(self) || self.instances.placed().any(|placed| has(&placed.part))
    }
}

/// What the fixed scene does not have.
impl Scene {
    #[inline(never)]
    pub(crate) fn instance_surface(&self, number: u32) -> &Surface {
        self.instances.surface(number).unwrap_or(&NOWHERE)
    }

    #[inline(never)]
    pub(crate) fn instance_reflects_at(&self, surface: u32, point: DVec3) -> bool {
        self.instances.of(surface).is_some_and(|(placed, local)| {
            (local as usize) < placed.surfaces.len()
                && placed.part.reflects_at(local, placed.point(point))
        })
    }

    #[inline(never)]
    pub(crate) fn instance_free_panel_at(
        &self,
        surface: u32,
        point: DVec3,
        in_front: bool,
    ) -> Option<FreePanel> {
        let (placed, local) = self.instances.of(surface)?;
        placed.surfaces.get(local as usize)?;
        let point = placed.point(point);
        let panel = placed.part.free_panel_at(local, point, in_front)?;
        Some(FreePanel {
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

    /// The surface of an instance's triangle, or [`NO_GROUP`].
    #[inline(never)]
    pub(crate) fn instance_surface_of(&self, triangle: u32) -> u32 {
        let found = self.instances.of(triangle);
        let found = found.filter(|(placed, local)| placed.part.has_triangle(*local));
        found.map_or(NO_GROUP, |(placed, local)| {
            placed.number(placed.part.surface_of(local))
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
    pub(crate) fn more_material(&self, number: usize) -> Option<&Material> {
        self.instances.materials.material(number)
    }

    #[inline(never)]
    pub(crate) fn more_reflectance(&self, number: usize) -> Option<&Reflectance> {
        self.instances.materials.reflectance(number)
    }

    #[inline(never)]
    pub(crate) fn more_transmission(&self, number: usize) -> Option<&BandArray> {
        self.instances.materials.transmission_factor(number)
    }

    /// Corners of every triangle of the instances, in local coordinates.
    pub(crate) fn instance_triangles(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.instances.placed().flat_map(|placed| {
            let triangles = 0..placed.part.bvh().triangle_count() as u32;
            let triangles = triangles.filter(|&t| placed.part.has_triangle(t));
            triangles.map(|t| placed.part.corners_of(t).map(|c| placed.there(c)))
        })
    }
}
