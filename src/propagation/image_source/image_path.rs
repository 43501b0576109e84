//! From a surface sequence to one exact path: mirrored listener and backward validation.
//!
//! Source: \[ALLEN79\] for images, \[BORISH84\] for the validation in polyhedra. All positions are `f64` in local coordinates.
//! Own: the order within a class of commuting reflections is left open. All orders have the same image, and the straight
//! line from the source to it decides which surface comes first.

use glam::DVec3;

use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::image_source::sequence::{Precedence, Sequence};
use crate::propagation::image_source::unfold::{Lines, index_of, planes_of, vector};
use crate::propagation::image_source::unfold_x4::SequenceBatch4;
use crate::propagation::path::MAX_ORDER;
use crate::scene::{Scene, Surface};

/// Margin outside a surface's bounds within which a point still counts, in metres: ten times
/// [`crate::scene::surface::INSIDE_TOLERANCE_M`]. The test of bounds rejects nothing that the exact test accepts.
pub(crate) const MARGIN_M: f64 = 1e-4;

/// Visibility rays turn this share of the longer leg before a reflection point. There is then no point at which one ray ends
/// and the next begins on a wall that meets the surface: in exact alignment neither would hit it.
pub(crate) const TURN_SHARE: f64 = 1e-3;

/// The point at which visibility rays turn for a reflection point between two others: on the longer leg. The ray to the other
/// point stays on the air's side of every plane on whose side the path is.
#[inline]
pub(crate) fn turning_point(before: DVec3, point: DVec3, after: DVec3) -> DVec3 {
    let legs = [before - point, after - point];
    let longer = usize::from(legs[1].length_squared() > legs[0].length_squared());
    point + legs[longer] * TURN_SHARE
}

/// Geometry of one path, from source to listener, in local coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePath {
    /// Indices of the reflecting surfaces; entries beyond `order` are stale.
    pub surfaces: [u32; MAX_ORDER],
    /// Reflection points; entries beyond `order` are stale.
    pub points: [DVec3; MAX_ORDER],
    /// Cosines of the angles of incidence, 0 to 1; entries beyond `order` are stale.
    pub cosines: [f64; MAX_ORDER],
    /// Number of reflections, 0 to [`MAX_ORDER`].
    pub order: usize,
    /// Length in metres.
    pub length_m: f64,
    /// The source mirrored along the path: the image source in the direction of arrival.
    pub image: DVec3,
}

impl ImagePath {
    const EMPTY: Self = Self {
        surfaces: [0; MAX_ORDER],
        points: [DVec3::ZERO; MAX_ORDER],
        cosines: [0.0; MAX_ORDER],
        order: 0,
        length_m: 0.0,
        image: DVec3::ZERO,
    };

    /// Visibility ray number `step` from the source, 0 to `order`, between turning points, and the surfaces at its ends. It meets
    /// their planes at most at its ends, so they cannot block it. `ends` are source and listener.
    #[inline]
    pub fn leg(&self, ends: [DVec3; 2], step: usize) -> (Ray, [u32; 2]) {
        let (from, from_surface) = match step {
            0 => (ends[0], NO_GROUP),
            _ => (self.turn(ends, step - 1), self.surfaces[step - 1]),
        };
        let (to, to_surface) = if step < self.order {
            (self.turn(ends, step), self.surfaces[step])
        } else {
            (ends[1], NO_GROUP)
        };
        let ray = Ray::between(from.as_vec3(), to.as_vec3());
        (ray, [from_surface, to_surface])
    }

    #[inline]
    fn turn(&self, ends: [DVec3; 2], step: usize) -> DVec3 {
        let before = match step {
            0 => ends[0],
            _ => self.points[step - 1],
        };
        let after = match step + 1 < self.order {
            true => self.points[step + 1],
            false => ends[1],
        };
        turning_point(before, self.points[step], after)
    }
}

/// The listener mirrored in all surfaces of a sequence, last one first: the point that the unfolded path leads to.
#[inline]
pub fn mirror_listener(scene: &Scene, sequence: &Sequence, listener: DVec3) -> DVec3 {
    let surfaces = sequence.surfaces().iter().rev();
    surfaces.fold(listener, |point, &surface| {
        scene.surface(surface).mirror(point)
    })
}

/// The path along a sequence, if the straight line from the source to `listener_image` ([`mirror_listener`]) meets every
/// surface. Tests no occlusion. Any thread, no allocation.
pub fn unfold(
    scene: &Scene,
    sequence: &Sequence,
    source: DVec3,
    listener: DVec3,
    listener_image: DVec3,
) -> Option<ImagePath> {
    let precedence = Precedence::of(scene, sequence);
    let line = [source, listener_image];
    let mut unfolded = UnfoldedPath::default();
    if !unfolded.unfold(scene, sequence, &precedence, line) {
        return None;
    }
    let path = *unfolded.finish(scene, line);
    debug_assert!(
        (path.image.distance(listener) - path.length_m).abs() < 1e-6 * (1.0 + path.length_m)
    );
    Some(path)
}

/// A path with its points but without angles and image, which occluded candidates never need. The memory is
/// reused for candidate after candidate.
#[derive(Debug)]
pub(crate) struct UnfoldedPath {
    path: ImagePath,
    /// The listener's image that each leg leads to.
    targets: [DVec3; MAX_ORDER],
}

impl Default for UnfoldedPath {
    fn default() -> Self {
        Self {
            path: ImagePath::EMPTY,
            targets: [DVec3::ZERO; MAX_ORDER],
        }
    }
}

impl UnfoldedPath {
    /// Surfaces, points and order; the rest is not computed.
    pub(crate) fn legs(&self) -> &ImagePath {
        &self.path
    }

    /// The image of the listener that it was unfolded to. The path must have a reflection.
    pub(crate) fn listener_image(&self) -> DVec3 {
        self.targets[0]
    }

    /// Loads a lane of an unfolded batch, which holds `sequence`. Returns the largest distance in metres at which the line meets
    /// the planes outside the surfaces' bounds. `None` where it misses one, or by more than `margin_m`, [`MARGIN_M`] or more; the
    /// value is then partly overwritten.
    #[inline(always)]
    pub(crate) fn take(
        &mut self,
        scene: &Scene,
        sequence: &Sequence,
        batch: &SequenceBatch4,
        lane: usize,
        margin_m: f64,
    ) -> Option<f64> {
        if !batch.meets_all(lane) {
            return None;
        }
        let mut farthest_m = 0.0;
        self.path.order = sequence.len().min(MAX_ORDER);
        for step in 0..self.path.order {
            let (index, point, target) = batch.step(lane, step);
            let surface = sequence.surface_at(index);
            let outside_m = outside_bounds_m(scene.surface(surface), point);
            if outside_m > margin_m {
                return None;
            }
            farthest_m = if outside_m > farthest_m {
                outside_m
            } else {
                farthest_m
            };
            self.path.surfaces[step] = surface;
            self.path.points[step] = point;
            self.targets[step] = target;
        }
        Some(farthest_m)
    }

    /// Whether its points lie on their surfaces, not only within their bounds.
    pub(crate) fn lies_on_surfaces(&self, scene: &Scene) -> bool {
        (0..self.path.order)
            .all(|step| scene.reflects_at(self.path.surfaces[step], self.path.points[step]))
    }

    /// The whole path along the line that it was unfolded on.
    pub(crate) fn finish(
        &mut self,
        scene: &Scene,
        [source, listener_image]: [DVec3; 2],
    ) -> &ImagePath {
        let path = &mut self.path;
        let (mut from, mut image) = (source, source);
        for step in 0..path.order.min(MAX_ORDER) {
            let surface = scene.surface(path.surfaces[step]);
            let line = self.targets[step] - from;
            path.cosines[step] = (surface.normal.dot(line) / line.length()).abs();
            image = surface.mirror(image);
            from = path.points[step];
        }
        path.length_m = source.distance(listener_image);
        path.image = image;
        path
    }

    /// Unfolds a sequence along the line from the source to the listener's image. Returns whether the line meets every
    /// surface; otherwise the value is partly overwritten.
    pub(crate) fn unfold(
        &mut self,
        scene: &Scene,
        sequence: &Sequence,
        precedence: &Precedence,
        [source, listener_image]: [DVec3; 2],
    ) -> bool {
        let count = sequence.len().min(MAX_ORDER);
        self.path.order = count;
        let planes = planes_of(scene, sequence);
        let image = listener_image.to_array().map(|value| [value]);
        let mut line = Lines::new(source, image, [precedence.bits().into()], count);
        for step in 0..count {
            self.targets[step] = vector(&line.image, 0);
            let [taken] = line.advance(&planes, count);
            if line.misses != [0] {
                return false;
            }
            let surface = sequence.surface_at(index_of(taken));
            let point = vector(&line.from, 0);
            if outside_bounds_m(scene.surface(surface), point) > MARGIN_M
                || !scene.reflects_at(surface, point)
            {
                return false;
            }
            self.path.surfaces[step] = surface;
            self.path.points[step] = point;
        }
        true
    }
}

/// Distance in metres of a point of a surface's plane outside the surface's bounds, along the axis across which it is the largest,
/// without the surface's main axis. It is [`MARGIN_M`] or less for every point of the surface.
#[inline]
pub(crate) fn outside_bounds_m(surface: &Surface, point: DVec3) -> f64 {
    let (low, high) = (surface.bounds_min.as_dvec3(), surface.bounds_max.as_dvec3());
    let outside = (low - point).max(point - high);
    let most_m = outside.max_element();
    if most_m <= MARGIN_M {
        return most_m;
    }
    let normal = surface.normal.abs();
    let is_main = normal.cmpeq(DVec3::splat(normal.max_element()));
    DVec3::select(is_main, DVec3::NEG_INFINITY, outside).max_element()
}

/// Whether nothing blocks the legs of a path. Adds the number of rays cast to `rays`.
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
