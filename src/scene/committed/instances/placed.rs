//! One instance at its pose: transforms between part and scene, surfaces and bounds in the scene's local coordinates.

use std::ops::Deref;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::joint::Joint;
use super::pose::{InstanceId, InstancePose};
use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Aabb, Ray};
use crate::scene::commit::CommittedMesh;
use crate::scene::committed::instances::numbering::{self, FIXED};
use crate::scene::edges::{Edge, EdgeNames, EdgeSet};
use crate::scene::surface::Surface;
use crate::scene::surface::key::instance_key;
use crate::scene::{Scene, SurfaceSet};

/// A surface of more corners is bounded by its box.
const MAX_CORNERS: usize = 64;

/// Margin of an instance's bounds, absolute and relative to the coordinates: many times the rounding of a transformed
/// ray.
const MARGIN_M: f32 = 1e-4;
const MARGIN: f32 = 1.0 / (1u32 << 18) as f32;

/// Points of a part that bound its surfaces, in the part's local coordinates.
#[derive(Debug)]
struct Outline {
    corners: Vec<Vec3>,
    /// Start of each surface's corners, and the end of the list.
    first: Vec<u32>,
}

impl Outline {
    fn of(part: &Scene) -> Self {
        let mut corners = Vec::new();
        let mut first = vec![0];
        let set = part.surface_set();
        let mut own = Vec::new();
        for index in 0..set.surfaces.len() as u32 {
            add_corners_of(part, set, index, &mut own, &mut corners);
            first.push(corners.len() as u32);
        }
        Self { corners, first }
    }

    /// Of the fixed part, whose surfaces stay where they are.
    fn of_fixed() -> Self {
        Self {
            corners: Vec::new(),
            first: Vec::new(),
        }
    }

    fn corners(&self, surface: usize) -> &[Vec3] {
        &self.corners[self.first[surface] as usize..self.first[surface + 1] as usize]
    }
}

/// Adds the distinct corners of a surface, or those of its box if they are many. `own` is scratch memory.
fn add_corners_of(
    part: &Scene,
    set: &SurfaceSet,
    index: u32,
    own: &mut Vec<[u32; 3]>,
    corners: &mut Vec<Vec3>,
) {
    own.clear();
    for &triangle in set.triangles_of(index) {
        let of_triangle = part.corners_of(triangle);
        own.extend(of_triangle.map(|corner| corner.to_array().map(f32::to_bits)));
    }
    // By their bits, for a reproducible order.
    own.sort_unstable();
    own.dedup();
    if own.len() <= MAX_CORNERS {
        let corner = |bits: &[u32; 3]| Vec3::from_array(bits.map(f32::from_bits));
        corners.extend(own.iter().map(corner));
        return;
    }
    let surface = &set.surfaces[index as usize];
    let (low, high) = (surface.bounds_min, surface.bounds_max);
    let corner =
        |n: u32| Vec3::select(glam::BVec3::new(n & 1 > 0, n & 2 > 0, n & 4 > 0), low, high);
    corners.extend((0..8).map(corner));
}

/// The surfaces of an instance: copies of a scene have their own of a part that moves, and share those of a joined part. Those of the
/// fixed part are its commit's.
#[derive(Debug, Clone)]
pub(super) enum SurfaceList {
    Own(Vec<Surface>),
    Shared(Arc<[Surface]>),
    Committed(Arc<CommittedMesh>),
}

impl Deref for SurfaceList {
    type Target = [Surface];

    #[inline]
    fn deref(&self) -> &[Surface] {
        match self {
            Self::Own(list) => list,
            Self::Shared(list) => list,
            Self::Committed(mesh) => &mesh.surfaces.surfaces,
        }
    }
}

impl SurfaceList {
    /// Memory beside the commit's.
    fn own_bytes(&self) -> usize {
        match self {
            Self::Committed(_) => 0,
            _ => size_of_val(&**self),
        }
    }
}

/// An instance at its pose.
#[derive(Debug, Clone)]
pub(super) struct PlacedInstance {
    pub(super) pose: InstancePose,
    pub(super) part: Arc<Scene>,
    outline: Arc<Outline>,
    /// From the part's local coordinates to the scene's.
    axes: DMat3,
    origin: DVec3,
    /// The part's surfaces in the scene's coordinates, with the scene's indices of materials.
    pub(super) surfaces: SurfaceList,
    /// Bounding box in the scene's coordinates.
    pub(super) bounds: Aabb,
    /// Of a part that is joined with others and does not move.
    pub(super) joint: Option<Arc<Joint>>,
}

impl PlacedInstance {
    /// Of a part at a pose; `materials` are the scene's numbers of the part's materials. `like` is another instance of
    /// the same part, if there is one.
    pub(super) fn new(
        part: Arc<Scene>,
        pose: InstancePose,
        materials: &[u32],
        centre: DVec3,
        like: Option<&Self>,
    ) -> Self {
        let outline = match like {
            Some(like) => Arc::clone(&like.outline),
            None => Arc::new(Outline::of(&part)),
        };
        let surfaces = part.surfaces().iter().map(|surface| Surface {
            key: instance_key(surface.key, pose.id.bits()),
            material: materials[surface.material as usize],
            ..*surface
        });
        let mut placed = Self {
            surfaces: SurfaceList::Own(surfaces.collect()),
            pose,
            outline,
            axes: DMat3::IDENTITY,
            origin: DVec3::ZERO,
            bounds: Aabb::EMPTY,
            joint: None,
            part,
        };
        placed.place(pose, centre);
        placed
    }

    /// The fixed part as one that others are joined with: in the scene's own coordinates, under the scene's own numbers.
    pub(super) fn of_fixed(fixed: Arc<Scene>) -> Self {
        Self {
            bounds: fixed.blocks.all(),
            surfaces: SurfaceList::Committed(Arc::clone(&fixed.mesh)),
            pose: InstancePose::at(InstanceId::new(FIXED as u16, 0), DVec3::ZERO),
            outline: Arc::new(Outline::of_fixed()),
            axes: DMat3::IDENTITY,
            origin: DVec3::ZERO,
            joint: Some(Arc::new(Joint::default())),
            part: fixed,
        }
    }

    #[inline]
    pub(super) fn is_fixed(&self) -> bool {
        self.pose.id.slot() == FIXED
    }

    /// The same at rest for good: copies share its surfaces.
    pub(super) fn at_rest(mut self) -> Self {
        if let SurfaceList::Own(list) = &mut self.surfaces {
            self.surfaces = SurfaceList::Shared(std::mem::take(list).into());
        }
        self
    }

    /// Moves it to a pose; `centre` is the origin of the scene's local coordinates. Allocates nothing. A part at rest stays.
    pub(super) fn place(&mut self, pose: InstancePose, centre: DVec3) {
        let SurfaceList::Own(surfaces) = &mut self.surfaces else {
            return;
        };
        self.pose = pose;
        self.axes = pose.axes();
        self.origin = self.axes * self.part.centre() + (pose.position - centre);
        let (axes, origin) = (self.axes, self.origin);
        let mut bounds = Aabb::EMPTY;
        let own = self.part.surfaces().iter().enumerate();
        for (surface, (index, local)) in surfaces.iter_mut().zip(own) {
            surface.normal = axes * local.normal;
            surface.offset_m = local.offset_m + surface.normal.dot(origin);
            let corners = self.outline.corners(index).iter();
            let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for corner in corners {
                let to_scene = axes * corner.as_dvec3() + origin;
                (low, high) = (low.min(to_scene), high.max(to_scene));
            }
            (surface.bounds_min, surface.bounds_max) = (low.as_vec3(), high.as_vec3());
            bounds = bounds.union(&Aabb {
                min: surface.bounds_min,
                max: surface.bounds_max,
            });
        }
        let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
        let margin_m = MARGIN_M + MARGIN * largest;
        self.bounds = Aabb {
            min: bounds.min - margin_m,
            max: bounds.max + margin_m,
        };
    }

    /// A ray in the part's coordinates; parameters mean the same.
    #[inline]
    pub(super) fn ray(&self, ray: &Ray) -> Ray {
        let back = self.axes.transpose();
        Ray {
            origin: (back * (ray.origin.as_dvec3() - self.origin)).as_vec3(),
            direction: (back * ray.direction.as_dvec3()).as_vec3(),
            ..*ray
        }
    }

    /// A point in the part's coordinates.
    #[inline]
    pub(super) fn point(&self, point: DVec3) -> DVec3 {
        self.axes.transpose() * (point - self.origin)
    }

    /// A point of the part in the scene's coordinates.
    pub(super) fn to_scene(&self, local: Vec3) -> DVec3 {
        self.axes * local.as_dvec3() + self.origin
    }

    /// A direction of the part in the scene's coordinates.
    pub(super) fn direction(&self, local: Vec3) -> Vec3 {
        (self.axes * local.as_dvec3()).as_vec3()
    }

    /// The part's number of a surface of the scene that is not common.
    #[inline]
    pub(super) fn part_group(&self, group: u32) -> u32 {
        match numbering::split(group) {
            _ if self.is_fixed() && !numbering::is_instance(group) => group,
            (slot, local) if numbering::is_instance(group) && slot == self.pose.id.slot() => local,
            _ => NO_GROUP,
        }
    }

    /// The scene's number of one of the part's surfaces: its own, or that of a common surface.
    #[inline]
    pub(super) fn surface_number(&self, local: u32) -> u32 {
        let joint = self.joint.as_ref();
        let number = joint.and_then(|joint| joint.surfaces.get(local as usize));
        number.copied().unwrap_or_else(|| self.scene_index(local))
    }

    /// The scene's number of one of the part's surfaces, triangles or edges.
    #[inline]
    pub(super) fn scene_index(&self, local: u32) -> u32 {
        match self.is_fixed() {
            true => local,
            false => numbering::global(self.pose.id.slot(), local),
        }
    }

    /// An edge of the part, as committed, in the scene's coordinates.
    pub(super) fn edge(&self, local: &Edge) -> Edge {
        Edge {
            key: match self.is_fixed() {
                true => local.key,
                false => instance_key(local.key, self.pose.id.bits()),
            },
            faces: local.faces.map(|face| self.surface_number(face)),
            ..self.moved(local)
        }
    }

    /// The same by its index, in the part's own coordinates and of its own surfaces; those of border pieces come after the others.
    pub(super) fn own_edge(&self, index: u32) -> &Edge {
        let edges = self.part.edges();
        match edges.as_slice().get(index as usize) {
            Some(edge) => edge,
            None => &edges.border().as_slice()[index as usize - edges.len()],
        }
    }

    /// [`Self::edge`] by its index.
    pub(super) fn committed_edge(&self, index: u32) -> Edge {
        self.edge(self.own_edge(index))
    }

    /// Numbers of its own edges and of those of its border pieces.
    pub(super) fn edge_counts(&self) -> [u32; 2] {
        let edges = self.part.edges();
        [edges.len(), edges.border().as_slice().len()].map(|count| count as u32)
    }

    /// Whether a border piece is a panel together with other parts.
    #[inline]
    pub(super) fn is_raised(&self, piece: u32) -> bool {
        let joint = self.joint.as_ref();
        joint.is_some_and(|joint| joint.raised.binary_search(&piece).is_ok())
    }

    /// Whether an edge is one, by the panels of its faces.
    pub(super) fn is_edge(&self, index: u32) -> bool {
        let raised = self.raised_edges();
        index < self.edge_counts()[0] || raised.binary_search(&index).is_ok()
    }

    /// Edges of raised border pieces, ascending.
    pub(super) fn raised_edges(&self) -> &[u32] {
        let joint = self.joint.as_ref();
        joint.map_or(&[], |joint| &joint.raised_edges)
    }

    /// Edges of border pieces of which any counts, ascending.
    pub(super) fn edges_of_pieces(&self, counts: impl Fn(u32) -> bool) -> Vec<u32> {
        let [count, border] = self.edge_counts();
        let edges = self.part.edges().border();
        let mut numbers: Vec<u32> = (count..count + border).collect();
        numbers.retain(|edge| edges.pieces_of((edge - count) as usize).any(&counts));
        numbers
    }

    /// Surfaces of raised border pieces.
    pub(super) fn raised_surfaces(&self) -> impl Iterator<Item = u32> + '_ {
        let raised = self.joint.iter().flat_map(|joint| &joint.raised);
        let pieces = self.part.surface_set().border().as_slice();
        raised.map(|&piece| pieces[piece as usize].surface)
    }

    /// Calls `visit` with every edge in a box in the part's coordinates.
    pub(super) fn visit_edges(&self, low: DVec3, high: DVec3, mut visit: impl FnMut(u32)) {
        self.part.edges().visit_box(low, high, &mut visit);
        for &number in self.raised_edges() {
            let edge = self.own_edge(number);
            let (from, to) = (edge.origin, edge.at(edge.length_m));
            if from.min(to).cmple(high).all() && from.max(to).cmpge(low).all() {
                visit(number);
            }
        }
    }

    /// Whether a surface of the part mirrors at a point, both in the part's numbers and coordinates.
    #[inline]
    pub(super) fn mirrors_at(&self, local: u32, point: DVec3) -> bool {
        self.part.reflects_at(local, point) || self.is_in_raised_piece(local, point)
    }

    /// Whether a raised border piece of a surface has a point, both in the part's numbers and coordinates.
    pub(super) fn is_in_raised_piece(&self, local: u32, point: DVec3) -> bool {
        let Some(joint) = self.joint.as_ref().filter(|joint| !joint.raised.is_empty()) else {
            return false;
        };
        let set = self.part.surface_set();
        let pieces = set.border().of_surface(local);
        let first = joint.raised.partition_point(|piece| *piece < pieces.start);
        let raised = joint.raised[first..].iter();
        let mut raised = raised.take_while(|piece| **piece < pieces.end);
        raised.any(|&piece| set.border_piece_holds(piece, point))
    }

    /// Whether a triangle of the part is of a panel.
    #[inline]
    pub(super) fn is_panel(&self, local: u32) -> bool {
        self.part.is_panel(local) || self.joint.is_some() && self.is_of_raised_piece(local)
    }

    /// Whether a triangle of the part is of a raised border piece.
    pub(super) fn is_of_raised_piece(&self, local: u32) -> bool {
        let piece = self.part.surface_set().border().of_triangle(local);
        piece.is_some_and(|piece| self.is_raised(piece))
    }

    /// An edge by its number in the part, as joining has left it, in the scene's coordinates.
    pub(super) fn edge_at(&self, number: u32) -> Option<Edge> {
        let joined = self.joint.as_ref().and_then(|j| j.edges.get(number));
        if let Some(edge) = joined {
            return Some(self.moved(edge));
        }
        let committed = self.part.edges().as_slice().get(number as usize)?;
        Some(self.edge(committed))
    }

    /// Numbers in the part of further pieces of its edges.
    pub(super) fn further_numbers(&self) -> impl Iterator<Item = u32> + '_ {
        let joint = self.joint.as_ref();
        let count = joint.map_or(0, |joint| joint.edges.further().len() as u32);
        let number = move |index| joint.map_or(u32::MAX, |joint| joint.edges.number_of(index));
        (0..count).map(number)
    }

    /// An edge from the part's coordinates to the scene's.
    fn moved(&self, local: &Edge) -> Edge {
        Edge {
            origin: self.axes * local.origin + self.origin,
            direction: self.axes * local.direction,
            tangent: self.axes * local.tangent,
            normal: self.axes * local.normal,
            ..*local
        }
    }

    /// An edge from the scene's coordinates to the part's.
    pub(super) fn to_local(&self, edge: &Edge) -> Edge {
        let back = self.axes.transpose();
        Edge {
            origin: self.point(edge.origin),
            direction: back * edge.direction,
            tangent: back * edge.tangent,
            normal: back * edge.normal,
            ..*edge
        }
    }

    /// The names of the part's own edges and of further pieces of them, for queries.
    pub(super) fn part_edges(&self) -> PartEdges<'_> {
        PartEdges(self)
    }

    /// Further pieces of the part's edges and their names.
    pub(super) fn further_edges(&self) -> Option<(&EdgeSet, FurtherEdges<'_>)> {
        let joint = self.joint.as_ref()?;
        let set = joint.edges.further();
        (!set.is_empty()).then_some((set, FurtherEdges(self)))
    }

    /// A direction of the scene in the part's coordinates.
    pub(super) fn local_direction(&self, direction: Vec3) -> Vec3 {
        (self.axes.transpose() * direction.as_dvec3()).as_vec3()
    }

    /// Corners of a surface in the scene's coordinates, or of its box if they are many.
    pub(super) fn outline_of(&self, surface: u32) -> impl Iterator<Item = DVec3> + '_ {
        let corners = self.outline.corners(surface as usize).iter();
        corners.map(|corner| self.to_scene(*corner))
    }

    /// A box of the scene, larger by a margin, within one in the part's coordinates.
    pub(super) fn local_box(&self, bounds: &Aabb, margin_m: f64) -> (DVec3, DVec3) {
        let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let corner = |n: usize| {
            let pick = |axis: usize| [low, high][n >> axis & 1][axis];
            DVec3::new(pick(0), pick(1), pick(2))
        };
        let corners: [DVec3; 8] = std::array::from_fn(corner);
        self.local_bounds_of(corners, margin_m)
    }

    /// Bounds of points of the scene in the part's coordinates, larger by a margin.
    pub(super) fn local_bounds_of<const N: usize>(
        &self,
        points: [DVec3; N],
        margin_m: f64,
    ) -> (DVec3, DVec3) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in points.map(|point| self.point(point)) {
            (low, high) = (low.min(point), high.max(point));
        }
        (low - margin_m, high + margin_m)
    }

    /// Lower bound in metres of the length of a path between two points that touches the instance.
    pub(super) fn min_path_length_m(&self, from: DVec3, to: DVec3) -> f64 {
        let (low, high) = (self.bounds.min.as_dvec3(), self.bounds.max.as_dvec3());
        let outside_m = |p: DVec3| p.distance(p.clamp(low, high));
        outside_m(from) + outside_m(to)
    }

    /// Memory that it occupies beside its part, in bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + self.surfaces.own_bytes()
            + self.joint.as_ref().map_or(0, |joint| joint.memory_bytes())
            + size_of_val(self.outline.corners.as_slice())
            + size_of_val(self.outline.first.as_slice())
    }
}

/// The names of a part's own edges in the scene.
pub(super) struct PartEdges<'a>(&'a PlacedInstance);

impl EdgeNames for PartEdges<'_> {
    fn number(&self, edge: u32) -> u32 {
        self.0.scene_index(edge)
    }

    #[inline]
    fn changed(&self, edge: u32) -> Option<&Edge> {
        self.0.joint.as_ref()?.edges.get(edge)
    }
}

/// The names of a part's further pieces.
pub(super) struct FurtherEdges<'a>(&'a PlacedInstance);

impl EdgeNames for FurtherEdges<'_> {
    fn number(&self, edge: u32) -> u32 {
        let joint = self.0.joint.as_ref();
        let number = joint.map_or(u32::MAX, |joint| joint.edges.number_of(edge));
        self.0.scene_index(number)
    }

    fn changed(&self, _: u32) -> Option<&Edge> {
        None
    }
}
