//! From a list of surfaces to one exact path: mirrored listeners and backward validation.
//!
//! Source: [ALLEN79] for images, [BORISH84] for the validation in polyhedra. All in `f64` local coordinates.
//! Differs from the usual in that every order of a class of commuting reflections is tried: the image is the same for
//! all of them, so the straight line from the source to it decides which surface comes first.

use glam::DVec3;

use super::path::MAX_ORDER;
use super::sequence::Sequence;
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::Scene;

/// Distance from a plane below which a point counts as lying in it, in metres.
const ON_PLANE_M: f64 = 1e-6;

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
    let mut path = ImagePath {
        surfaces: [0; MAX_ORDER],
        points: [DVec3::ZERO; MAX_ORDER],
        cosines: [0.0; MAX_ORDER],
        order: 0,
        length_m: source.distance(listener_image),
        image: source,
    };
    descend(scene, *sequence, source, listener_image, &mut path).then_some(())?;
    let surfaces = path.surfaces;
    path.image = surfaces[..path.order]
        .iter()
        .fold(source, |point, &surface| {
            scene.surface(surface).mirror(point)
        });
    debug_assert!(
        (path.image.distance(listener) - path.length_m).abs() < 1e-6 * (1.0 + path.length_m)
    );
    Some(path)
}

/// Tries every surface that may come next on the line from `from` to `image`, and what follows it.
fn descend(scene: &Scene, rest: Sequence, from: DVec3, image: DVec3, path: &mut ImagePath) -> bool {
    if rest.is_empty() {
        return true;
    }
    let line = image - from;
    let step = path.order;
    for (place, &index) in rest.surfaces().iter().enumerate() {
        if place > 0 && !rest.can_lead(scene, place) {
            continue;
        }
        let surface = scene.surface(index);
        let here = surface.distance_m(from);
        let there = surface.distance_m(image);
        if here * there >= 0.0 || here.abs() < ON_PLANE_M || there.abs() < ON_PLANE_M {
            continue;
        }
        let point = from + line * (here / (here - there));
        if !scene.reflects_at(index, point) {
            continue;
        }
        path.surfaces[step] = index;
        path.points[step] = point;
        path.cosines[step] = (surface.normal.dot(line) / line.length()).abs();
        path.order = step + 1;
        if descend(
            scene,
            rest.without(place),
            point,
            surface.mirror(image),
            path,
        ) {
            return true;
        }
        path.order = step;
    }
    false
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
        !scene.bvh().any_hit(&leg, ignored)
    })
}
