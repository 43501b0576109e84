//! From a list of surfaces to one exact path: mirrored listeners and backward validation.
//!
//! Source: \[ALLEN79\] for images, \[BORISH84\] for the validation in polyhedra. All in `f64` local coordinates.
//! Differs from the usual in that the order within a class of commuting reflections is left open: the image is the same
//! for all of them, so the straight line from the source to it decides which surface comes first.

use glam::DVec3;

use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::image_source::sequence::{Order, Sequence};
use crate::propagation::image_source::unfold_x4::SequenceBatch4;
use crate::propagation::path::MAX_ORDER;
use crate::scene::{Scene, Surface};

/// Distance from a plane below which a point counts as lying in it, in metres.
pub(crate) const ON_PLANE_M: f64 = 1e-6;

/// How far outside a surface's bounds a point still counts, in metres: ten times
/// [`crate::scene::surface::INSIDE_TOLERANCE_M`], so that a first look refuses nothing that the exact test accepts.
pub(crate) const MARGIN_M: f64 = 1e-4;

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
#[inline]
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
    let order = Order::of(scene, sequence);
    let line = [source, listener_image];
    let mut unfolded = Unfolded::default();
    if !unfolded.along(scene, sequence, &order, line) {
        return None;
    }
    let path = unfolded.finish(scene, line);
    debug_assert!(
        (path.image.distance(listener) - path.length_m).abs() < 1e-6 * (1.0 + path.length_m)
    );
    Some(path)
}

/// A path whose points are known, but not yet its angles and its image: most are blocked, and need none. One is used again
/// for candidate after candidate.
#[derive(Debug)]
pub(crate) struct Unfolded {
    /// The first `order` surfaces and points count; the rest is of who knows which candidate.
    path: ImagePath,
    /// Where each leg points to.
    images: [DVec3; MAX_ORDER],
}

impl Default for Unfolded {
    fn default() -> Self {
        Self {
            path: NO_PATH,
            images: [DVec3::ZERO; MAX_ORDER],
        }
    }
}

const NO_PATH: ImagePath = ImagePath {
    surfaces: [0; MAX_ORDER],
    points: [DVec3::ZERO; MAX_ORDER],
    cosines: [0.0; MAX_ORDER],
    order: 0,
    length_m: 0.0,
    image: DVec3::ZERO,
};

impl Unfolded {
    /// The path so far: its legs.
    pub(crate) fn legs(&self) -> &ImagePath {
        &self.path
    }

    /// The listener's image that it was unfolded to; of a path with a reflection.
    pub(crate) fn goal(&self) -> DVec3 {
        self.images[0]
    }

    /// Becomes lane number `lane` of four sequences that have been unfolded, which is of `sequence`, as far as its points are
    /// within their surfaces' bounds; gives whether all are, so whether the sequence has a path if its points lie
    /// on its surfaces.
    #[inline(always)]
    pub(crate) fn take(
        &mut self,
        scene: &Scene,
        sequence: &Sequence,
        four: &SequenceBatch4,
        lane: usize,
    ) -> bool {
        if !four.meets(lane) {
            return false;
        }
        let order = sequence.len().min(MAX_ORDER);
        let path = &mut self.path;
        let points = path.surfaces.iter_mut().zip(&mut path.points);
        for (step, (number, point)) in points.enumerate() {
            if step == order {
                break;
            }
            let (place, at) = four.step(lane, step);
            *number = sequence.surface_at(place);
            *point = at;
            if !near_bounds(scene.surface(*number), at, MARGIN_M) {
                return false;
            }
        }
        path.order = order;
        for (step, image) in self.images.iter_mut().enumerate() {
            *image = four.goal(lane, step);
        }
        true
    }

    /// Whether its points lie on their surfaces, not only within their bounds.
    pub(crate) fn lies_on_surfaces(&self, scene: &Scene) -> bool {
        (0..self.path.order)
            .all(|step| scene.reflects_at(self.path.surfaces[step], self.path.points[step]))
    }

    /// The whole path along the line that it was unfolded on.
    pub(crate) fn finish(&self, scene: &Scene, [source, listener_image]: [DVec3; 2]) -> ImagePath {
        let mut path = ImagePath {
            order: self.path.order,
            length_m: source.distance(listener_image),
            image: source,
            ..NO_PATH
        };
        let mut from = source;
        for step in 0..path.order {
            let (number, point) = (self.path.surfaces[step], self.path.points[step]);
            let surface = scene.surface(number);
            let line = self.images[step] - from;
            path.surfaces[step] = number;
            path.points[step] = point;
            path.cosines[step] = (surface.normal.dot(line) / line.length()).abs();
            path.image = surface.mirror(path.image);
            from = point;
        }
        path
    }

    /// The first part of [`unfold`], on the line from the source to the listener's image; gives whether there is a path.
    pub(crate) fn along(
        &mut self,
        scene: &Scene,
        sequence: &Sequence,
        order: &Order,
        line: [DVec3; 2],
    ) -> bool {
        let accepts = |number, surface: &Surface, point| {
            near_bounds(surface, point, MARGIN_M) && scene.reflects_at(number, point)
        };
        self.along_where(scene, sequence, order, line, accepts)
    }

    /// The same for a path that may miss its surfaces by `reach_m` metres: one that may be there for a listener nearby.
    pub(crate) fn along_nearby(
        &mut self,
        scene: &Scene,
        sequence: &Sequence,
        order: &Order,
        line: [DVec3; 2],
        reach_m: f64,
    ) -> bool {
        let margin_m = reach_m + MARGIN_M;
        let accepts = |_, surface: &Surface, point| near_bounds(surface, point, margin_m);
        self.along_where(scene, sequence, order, line, accepts)
    }

    #[inline(always)]
    fn along_where(
        &mut self,
        scene: &Scene,
        sequence: &Sequence,
        order: &Order,
        [source, listener_image]: [DVec3; 2],
        mut accepts: impl FnMut(u32, &Surface, DVec3) -> bool,
    ) -> bool {
        self.path.order = sequence.len();
        let surfaces = sequence.surfaces();
        let Some(&first) = surfaces.first() else {
            return true;
        };
        // Each is looked up once, however often its distance is asked for.
        let mut planes = [(first, scene.surface(first)); MAX_ORDER];
        for place in 1..surfaces.len().min(MAX_ORDER) {
            planes[place] = (surfaces[place], scene.surface(surfaces[place]));
        }
        let (mut from, mut image) = (source, listener_image);
        let mut rest = order.all();
        for step in 0..self.path.order.min(MAX_ORDER) {
            let Some(next) = next_plane(&planes, order, rest, from, image) else {
                return false;
            };
            let (number, surface) = planes[next.place % MAX_ORDER];
            let point = from + (image - from) * next.share;
            if !accepts(number, surface, point) {
                return false;
            }
            self.path.surfaces[step] = number;
            self.path.points[step] = point;
            self.images[step] = image;
            from = point;
            image -= 2.0 * next.there * surface.normal;
            rest &= !(1 << next.place);
        }
        true
    }
}

/// The plane that a line meets first.
#[derive(Clone, Copy)]
struct Next {
    place: usize,
    /// Where on the line, from 0 to 1; beyond it if there is none yet.
    share: f64,
    /// Distance of the line's end from the plane.
    there: f64,
}

/// Of the planes that may come next the one that the line from `from` to `image` meets first, if it meets them all.
///
/// Those that may come next commute, so mirroring in one changes no distance from another: whichever of them is not met,
/// or only behind one that was taken first, is never met.
#[inline(always)]
fn next_plane(
    planes: &[(u32, &Surface); MAX_ORDER],
    order: &Order,
    rest: u8,
    from: DVec3,
    image: DVec3,
) -> Option<Next> {
    let mut next = Next {
        place: 0,
        share: f64::INFINITY,
        there: 0.0,
    };
    let mut left = rest;
    while left != 0 {
        let place = left.trailing_zeros() as usize % MAX_ORDER;
        left &= left - 1;
        if !order.leads(place, rest) {
            continue;
        }
        let plane = planes[place].1;
        let (here, there) = (plane.distance_m(from), plane.distance_m(image));
        if here * there >= 0.0 || here.abs() < ON_PLANE_M || there.abs() < ON_PLANE_M {
            return None;
        }
        let share = here / (here - there);
        if share < next.share {
            next = Next {
                place,
                share,
                there,
            };
        }
    }
    // Places that are no numbers have no share.
    (next.share < f64::INFINITY).then_some(next)
}

/// Whether a point of a surface's plane is inside its bounds or within `margin_m` metres, as seen along the surface's main
/// axis; cheap, and from [`MARGIN_M`] on never false where the surface has the point.
#[inline]
pub(crate) fn near_bounds(surface: &Surface, point: DVec3, margin_m: f64) -> bool {
    let (low, high) = (surface.bounds_min, surface.bounds_max);
    let within = |at: f64, low: f32, high: f32| {
        at >= f64::from(low) - margin_m && at <= f64::from(high) + margin_m
    };
    let is_main = |along: f64| along.abs() == surface.normal.abs().max_element();
    (within(point.x, low.x, high.x) || is_main(surface.normal.x))
        && (within(point.y, low.y, high.y) || is_main(surface.normal.y))
        && (within(point.z, low.z, high.z) || is_main(surface.normal.z))
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
