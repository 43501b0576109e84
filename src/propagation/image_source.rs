//! From a list of surfaces to one exact path: mirrored listeners and backward validation.
//!
//! Source: \[ALLEN79\] for images, \[BORISH84\] for the validation in polyhedra. All in `f64` local coordinates.
//! Differs from the usual in that every order of a class of commuting reflections is tried: the image is the same for
//! all of them, so the straight line from the source to it decides which surface comes first.

use glam::DVec3;

use super::path::MAX_ORDER;
use super::sequence::{Commutation, Sequence};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::{Scene, Surface};

/// Distance from a plane below which a point counts as lying in it, in metres.
const ON_PLANE_M: f64 = 1e-6;

/// How far outside a surface's bounds a point still counts, in metres: ten times
/// [`crate::scene::surface::INSIDE_TOLERANCE_M`], so that a first look refuses nothing that the exact test accepts.
pub(super) const MARGIN_M: f64 = 1e-4;

/// Geometry of one valid path, from source to listener.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePath {
    /// Reflecting surfaces; the first `order` count.
    pub surfaces: [u32; MAX_ORDER],
    /// Reflection points in local coordinates; the first `order` count.
    pub points: [DVec3; MAX_ORDER],
    /// Cosines of the angles of incidence; the first `order` count.
    pub cosines: [f64; MAX_ORDER],
    /// Number of reflections.
    pub order: usize,
    /// Length in metres.
    pub length_m: f64,
    /// The source mirrored along the path, in local coordinates: the listener hears the path from there.
    pub image: DVec3,
}

impl ImagePath {
    /// A leg from one stop to the next, counted from the source, and the surfaces it joins: it meets their planes at its
    /// ends only, so they cannot block it. `ends` are source and listener.
    #[inline]
    pub fn leg(&self, ends: [DVec3; 2], step: usize) -> (Ray, [u32; 2]) {
        let (from, from_surface) = match step {
            0 => (ends[0], NO_GROUP),
            _ => (self.points[step - 1], self.surfaces[step - 1]),
        };
        let (to, to_surface) = if step < self.order {
            (self.points[step], self.surfaces[step])
        } else {
            (ends[1], NO_GROUP)
        };
        let ray = Ray::between(from.as_vec3(), to.as_vec3());
        (ray, [from_surface, to_surface])
    }
}

/// The listener mirrored in all surfaces of a sequence, last one first: where the source's line of flight points to.
pub fn mirror_listener(scene: &Scene, sequence: &Sequence, listener: DVec3) -> DVec3 {
    sequence
        .surfaces()
        .iter()
        .rev()
        .fold(listener, |point, &surface| {
            scene.surface(surface).mirror(point)
        })
}

/// The path along a sequence, if the straight line to the listener's image meets every surface within its bounds, from
/// its outside. Says nothing of what stands in between.
pub fn unfold(
    scene: &Scene,
    sequence: &Sequence,
    source: DVec3,
    listener: DVec3,
    listener_image: DVec3,
) -> Option<ImagePath> {
    let mut flight = Flight::along(scene, sequence);
    if !flight.descend(scene, flight.all(), 0, source, listener_image) {
        return None;
    }
    let mut path = ImagePath {
        surfaces: [0; MAX_ORDER],
        points: flight.points,
        cosines: [0.0; MAX_ORDER],
        order: flight.order,
        length_m: source.distance(listener_image),
        image: source,
    };
    let mut from = source;
    for step in 0..path.order {
        let place = flight.places[step];
        let line = flight.images[step] - from;
        path.surfaces[step] = flight.indices[place];
        path.cosines[step] = (flight.normals[place].dot(line) / line.length()).abs();
        path.image = scene.surface(path.surfaces[step]).mirror(path.image);
        from = path.points[step];
    }
    debug_assert!(
        (path.image.distance(listener) - path.length_m).abs() < 1e-6 * (1.0 + path.length_m)
    );
    Some(path)
}

/// A sequence's planes side by side, and how far the line has been followed through them.
struct Flight {
    order: usize,
    indices: [u32; MAX_ORDER],
    normals: [DVec3; MAX_ORDER],
    offsets_m: [f64; MAX_ORDER],
    commutation: Commutation,
    /// Of each step its plane's place in the sequence, its point and the image it aims at.
    places: [usize; MAX_ORDER],
    points: [DVec3; MAX_ORDER],
    images: [DVec3; MAX_ORDER],
}

impl Flight {
    #[inline]
    fn along(scene: &Scene, sequence: &Sequence) -> Self {
        let mut flight = Self {
            order: sequence.len(),
            indices: [0; MAX_ORDER],
            normals: [DVec3::ZERO; MAX_ORDER],
            offsets_m: [0.0; MAX_ORDER],
            commutation: Commutation::default(),
            places: [0; MAX_ORDER],
            points: [DVec3::ZERO; MAX_ORDER],
            images: [DVec3::ZERO; MAX_ORDER],
        };
        for (place, &index) in sequence.surfaces().iter().enumerate().rev() {
            let surface = scene.surface(index);
            flight.indices[place] = index;
            flight.normals[place] = surface.normal;
            flight.offsets_m[place] = surface.offset_m;
            let behind = &flight.normals[place..flight.order];
            flight.commutation.put_first(behind);
        }
        flight
    }

    /// The places of all planes, one a bit.
    fn all(&self) -> u8 {
        (1 << self.order) - 1
    }

    /// Tries every plane of `rest` that may come next on the line from `from` to `image`, and what follows it.
    fn descend(&mut self, scene: &Scene, rest: u8, step: usize, from: DVec3, image: DVec3) -> bool {
        if rest == 0 {
            return true;
        }
        let line = image - from;
        for place in 0..self.order {
            if rest >> place & 1 == 0 || !self.commutation.leads(place, rest) {
                continue;
            }
            let (normal, offset_m) = (self.normals[place], self.offsets_m[place]);
            let here = normal.dot(from) - offset_m;
            let there = normal.dot(image) - offset_m;
            if here * there >= 0.0 || here.abs() < ON_PLANE_M || there.abs() < ON_PLANE_M {
                continue;
            }
            let point = from + line * (here / (here - there));
            let index = self.indices[place];
            if !near_bounds(scene.surface(index), point) || !scene.reflects_at(index, point) {
                continue;
            }
            self.places[step] = place;
            self.points[step] = point;
            self.images[step] = image;
            let next = image - 2.0 * there * normal;
            if self.descend(scene, rest & !(1 << place), step + 1, point, next) {
                return true;
            }
        }
        false
    }
}

/// Whether a point of a surface's plane is inside its bounds or near them, as seen along the surface's main axis; cheap,
/// and never false where the surface has the point.
#[inline]
pub(super) fn near_bounds(surface: &Surface, point: DVec3) -> bool {
    let low = surface.bounds_min.as_dvec3() - MARGIN_M;
    let high = surface.bounds_max.as_dvec3() + MARGIN_M;
    let inside = |axis: usize| (point[axis] >= low[axis]) & (point[axis] <= high[axis]);
    let n = surface.normal.abs();
    let largest = n.max_element();
    (inside(0) | (n.x == largest)) & (inside(1) | (n.y == largest)) & (inside(2) | (n.z == largest))
}

/// Whether nothing stands between the points of a path. Adds the rays it cast to `rays`.
pub fn is_clear(
    scene: &Scene,
    path: &ImagePath,
    source: DVec3,
    listener: DVec3,
    rays: &mut u64,
) -> bool {
    (0..=path.order).all(|step| {
        *rays += 1;
        let (leg, ignored) = path.leg([source, listener], step);
        !scene.any_hit(&leg, ignored)
    })
}
