//! One instance at its pose: transforms between part and scene, surfaces and bounds in the scene's local coordinates.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::pose::InstancePose;
use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Aabb, Ray};
use crate::scene::committed::instances::numbering;
use crate::scene::edges::Edge;
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
        for index in 0..set.surfaces.len() as u32 {
            corners.extend(corners_of(part, set, index));
            first.push(corners.len() as u32);
        }
        Self { corners, first }
    }

    fn corners(&self, surface: usize) -> &[Vec3] {
        &self.corners[self.first[surface] as usize..self.first[surface + 1] as usize]
    }
}

fn corners_of(part: &Scene, set: &SurfaceSet, index: u32) -> Vec<Vec3> {
    let triangles = set.triangles_of(index).iter();
    // By their bits, for a reproducible order.
    let distinct: BTreeSet<[u32; 3]> = triangles
        .flat_map(|&t| part.corners_of(t))
        .map(|corner| corner.to_array().map(f32::to_bits))
        .collect();
    if distinct.len() <= MAX_CORNERS {
        let corner = |bits: [u32; 3]| Vec3::from_array(bits.map(f32::from_bits));
        return distinct.into_iter().map(corner).collect();
    }
    let surface = &set.surfaces[index as usize];
    let (low, high) = (surface.bounds_min, surface.bounds_max);
    let corner =
        |n: u32| Vec3::select(glam::BVec3::new(n & 1 > 0, n & 2 > 0, n & 4 > 0), low, high);
    (0..8).map(corner).collect()
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
    pub(super) surfaces: Vec<Surface>,
    /// Bounding box in the scene's coordinates.
    pub(super) bounds: Aabb,
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
            surfaces: surfaces.collect(),
            pose,
            outline,
            axes: DMat3::IDENTITY,
            origin: DVec3::ZERO,
            bounds: Aabb::EMPTY,
            part,
        };
        placed.place(pose, centre);
        placed
    }

    /// Moves it to a pose; `centre` is the origin of the scene's local coordinates. Allocates nothing.
    pub(super) fn place(&mut self, pose: InstancePose, centre: DVec3) {
        self.pose = pose;
        self.axes = pose.axes();
        self.origin = self.axes * self.part.centre() + (pose.position - centre);
        let (axes, origin) = (self.axes, self.origin);
        let mut bounds = Aabb::EMPTY;
        let own = self.part.surfaces().iter().enumerate();
        for (surface, (index, local)) in self.surfaces.iter_mut().zip(own) {
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

    /// The groups that a ray ignores, by the part's numbers.
    #[inline]
    pub(super) fn part_groups(&self, ignored: [u32; 2]) -> [u32; 2] {
        ignored.map(|group| match numbering::split(group) {
            (slot, local) if numbering::is_instance(group) && slot == self.pose.id.slot() => local,
            _ => NO_GROUP,
        })
    }

    /// The scene's number of one of the part's surfaces, triangles or edges.
    #[inline]
    pub(super) fn scene_index(&self, local: u32) -> u32 {
        numbering::global(self.pose.id.slot(), local)
    }

    /// An edge of the part in the scene's coordinates.
    pub(super) fn edge(&self, local: &Edge) -> Edge {
        Edge {
            key: instance_key(local.key, self.pose.id.bits()),
            origin: self.axes * local.origin + self.origin,
            direction: self.axes * local.direction,
            tangent: self.axes * local.tangent,
            normal: self.axes * local.normal,
            faces: local.faces.map(|face| self.scene_index(face)),
            ..*local
        }
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
            + size_of_val(self.surfaces.as_slice())
            + size_of_val(self.outline.corners.as_slice())
            + size_of_val(self.outline.first.as_slice())
    }
}
