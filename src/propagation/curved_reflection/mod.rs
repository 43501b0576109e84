//! Reflections at curved surfaces: exact paths to the smooth surface, alone or with a mirror plane before or after it.
//!
//! Runs with the propagation update. By Fermat's principle a path is stationary over the surface. In a sphere it lies in the
//! plane of its ends and the centre, in a cylinder it projects on a cross-section: both leave the same problem on a circle
//! (`circle`), whose solutions are found by their slope. Inside a large surface a path may be reflected twice, with a plane
//! between whose mirror image of the shape is the shape itself: a floor through a dome's centre, a vault's end wall. The second
//! reflection focuses what the first one has sent past its focus. Facets only decide where the surface ends and what occludes.
//! Bounded by the constants below; deterministic; allocates nothing. Own.

mod circle;
mod sequence;
mod spreading;
mod twice;

pub use sequence::CurvedSequence;

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::acoustics::bands::{CENTRES_HZ, exp_neg};
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::angle::{atan2, unit_vector};
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::amplitude::apply_directivity;
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::image_path::turning_point;
use crate::propagation::image_source::sequence::interaction_path_id;
use crate::propagation::path::{MAX_DIFFRACTION_ORDER, MAX_ORDER, Path, PathId};
use crate::scene::Scene;
use crate::scene::surface::curved::CurvedSurface;
use circle::{Circle, Directions};
use sequence::interactions;
use spreading::CurvedPoint;

/// Most planes that are combined with curved surfaces, the largest ones.
pub const MAX_PLANES: usize = 6;

/// Part of a whole turn from which a cylinder is a column.
const CLOSED: f64 = 0.95;

/// Most stationary paths over the same surfaces: their numbers are three bits of a path's identity.
const MAX_STATIONARY: usize = 8;

/// Least distance in metres of source and listener from a curved surface and from a plane: nearer ones lie in it.
const CLEARANCE_M: f64 = 1e-3;

/// Radians by which a surface's arc is taken to be wider, for rounding.
const ARC_MARGIN: f64 = 1e-3;

/// Distance in metres by which a ray to a facet may miss the shape beyond the facets' unevenness.
const MARGIN_M: f64 = 5e-3;

/// Least amplitude relative to the free field over the same length: −60 dB.
const MIN_RELATIVE_AMPLITUDE: f32 = 1e-3;

/// Emits the paths with one reflection at a curved surface and at most one at a plane before and after it, `depth` reflections
/// at most. Adds the rays cast to `rays`.
pub fn find(
    scene: &Scene,
    endpoints: &Endpoints,
    depth: usize,
    rays: &mut u64,
    emit: &mut impl FnMut(Path),
) {
    if scene.curved_surfaces().is_empty() {
        return;
    }
    let directions = &Directions::new();
    let planes = scene.edges().large_surfaces();
    let planes = &planes[..planes.len().min(MAX_PLANES)];
    let ends = [endpoints.from, endpoints.to].map(|end| scene.to_local(end));
    for (index, surface) in scene.curved_surfaces().iter().enumerate() {
        let planes = if scene.is_combined(index as u32) {
            planes
        } else {
            &[]
        };
        let choices = || std::iter::once(None).chain(planes.iter().copied().map(Some));
        let find_over =
            |before: Option<u32>, after: Option<u32>, bounces, rays: &mut u64, emit: &mut _| {
                let order = Bounces::order(bounces)
                    + usize::from(before.is_some())
                    + usize::from(after.is_some());
                if order <= depth.min(MAX_ORDER) {
                    let query = Query {
                        scene,
                        endpoints,
                        ends,
                        index: index as u32,
                        surface,
                        planes: [before, after],
                        bounces,
                    };
                    query.find(directions, rays, emit);
                }
            };
        for before in choices() {
            for after in choices() {
                find_over(before, after, Bounces::Once, rays, emit);
                if scene.is_combined(index as u32) {
                    let maps = |plane| surface.is_preserved_by(scene.surface(plane));
                    for between in choices().filter(|plane| plane.is_none_or(maps)) {
                        find_over(before, after, Bounces::Twice(between), rays, emit);
                    }
                }
            }
        }
    }
}

/// The reflections of a path at its curved surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Bounces {
    Once,
    /// Twice, with the plane between them.
    Twice(Option<u32>),
}

impl Bounces {
    /// Number of reflections at surface and plane.
    fn order(self) -> usize {
        match self {
            Self::Once => 1,
            Self::Twice(between) => 2 + usize::from(between.is_some()),
        }
    }
}

/// Reflection points of a path, without its amplitude, which occluded paths never need.
struct CurvedPath {
    /// Source and listener, or their images in the planes before and after the surface.
    images: [DVec3; 2],
    /// On the curved surface: the first and the last reflection, which are the same where it is met once; the last one as it is,
    /// and unfolded at the plane between both.
    points: [DVec3; 2],
    unfolded: [DVec3; 2],
    /// Their plane surfaces.
    facets: [u32; 2],
    /// 1 on the side of the shape's outward normal, else −1.
    side: f64,
    /// Cosine of the angle of incidence there.
    cosine: f64,
    /// On the planes before and after it.
    turns: [Option<DVec3>; 2],
    /// The plane between both reflections, and the point there.
    between: Option<(u32, DVec3)>,
}

/// Which stationary paths are searched for.
#[derive(Clone, Copy)]
enum Search<'a> {
    /// All.
    Around(&'a Directions),
    /// The one whose first reflection is near a point.
    Near(DVec3),
}

/// The search for paths over one curved surface and given planes.
struct Query<'a> {
    scene: &'a Scene,
    endpoints: &'a Endpoints,
    ends: [DVec3; 2],
    /// Of the curved surface.
    index: u32,
    surface: &'a CurvedSurface,
    /// Before and after it.
    planes: [Option<u32>; 2],
    bounces: Bounces,
}

impl Query<'_> {
    /// Source and listener, or their images in the planes before and after the surface.
    fn images(&self) -> [DVec3; 2] {
        [0, 1].map(|end| match self.planes[end] {
            Some(plane) => self.scene.surface(plane).mirror(self.ends[end]),
            None => self.ends[end],
        })
    }

    /// A position after the first reflection, seen through the mirror plane between both.
    fn unfolded(&self, point: DVec3) -> DVec3 {
        match self.bounces {
            Bounces::Twice(Some(plane)) => self.scene.surface(plane).mirror(point),
            _ => point,
        }
    }

    fn find(&self, directions: &Directions, rays: &mut u64, emit: &mut impl FnMut(Path)) {
        let images = self.images();
        let unfolded = [images[0], self.unfolded(images[1])];
        // Valid paths, shortest first, so that numbers do not depend on where the circle begins.
        let mut found = [(f64::INFINITY, [DVec3::ZERO; 2]); MAX_STATIONARY];
        let mut count = 0;
        self.stationary_points(unfolded, Search::Around(directions), |points| {
            if count < found.len() {
                found[count] = (length_m(unfolded, points), points);
                count += 1;
            }
        });
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (number, (_, points)) in found[..count].iter().enumerate() {
            if let Some(reflections) = self.reflections(*points, images, rays)
                && self.is_unoccluded(&reflections, rays)
                && let Some(path) = self.path(&reflections, number as u64)
            {
                emit(path);
            }
        }
    }

    /// Calls `found` with the first and the last reflection of the stationary paths between two positions, unfolded at the
    /// plane between them.
    fn stationary_points(
        &self,
        [from, to]: [DVec3; 2],
        search: Search<'_>,
        mut found: impl FnMut([DVec3; 2]),
    ) {
        let shape = &self.surface.shape;
        let [a, b] = [from, to].map(|end| shape.radial(end));
        // The cross-section's axes: of a sphere the plane of centre, source and listener.
        let longer = if a.length_squared() > b.length_squared() {
            a
        } else {
            b
        };
        let Some(x) = longer.try_normalize() else {
            return;
        };
        let y = match shape.axis {
            Some(axis) => axis.cross(x),
            None => {
                let other = a + b;
                let aside = other - other.dot(x) * x;
                aside.try_normalize().unwrap_or(x.any_orthonormal_vector())
            }
        };
        let flat = |radial: DVec3| DVec2::new(radial.dot(x), radial.dot(y));
        let [p, q] = [flat(a), flat(b)];
        let circle = Circle {
            radius_m: shape.radius_m,
            from: p,
            to: q,
            is_twice: self.is_twice(),
        };
        let mut at_angle = |angle: f64| {
            let outward = unit_vector(angle);
            let first = outward * shape.radius_m;
            let last = if circle.is_twice {
                circle.second(outward)
            } else {
                first
            };
            let legs_m = [p.distance(first), first.distance(last), last.distance(q)];
            let all_m = legs_m.iter().sum::<f64>().max(1e-12);
            let at = |around: DVec2, from_m: f64| {
                let along = shape.axis.map_or(DVec3::ZERO, |axis| {
                    let heights = [from, to].map(|end| (end - shape.centre).dot(axis));
                    (heights[0] + from_m / all_m * (heights[1] - heights[0])) * axis
                });
                shape.centre + along + around.x * x + around.y * y
            };
            found([at(first, legs_m[0]), at(last, legs_m[0] + legs_m[1])]);
        };
        let is_outside = |end: DVec2| end.length() > shape.radius_m;
        // Around a whole column only the path on the near side is in the air.
        let is_column = self.surface.half_m[0] > CLOSED * PI * shape.radius_m;
        let guess = match search {
            Search::Near(point) => flat(shape.radial(point)),
            Search::Around(_) if is_column && is_outside(p) && is_outside(q) => {
                if circle.is_twice {
                    return;
                }
                p.normalize_or_zero() + q.normalize_or_zero()
            }
            Search::Around(directions) => {
                let arc = self.arc([x, y]);
                if arc.is_some_and(|arc| circle.may_be_stationary_on(directions, arc)) {
                    circle.stationary(directions, at_angle);
                }
                return;
            }
        };
        circle
            .near(atan2(guess.y, guess.x))
            .into_iter()
            .for_each(&mut at_angle);
    }

    /// Middle and half width in radians of the arc that the surface has in a cross-section with these axes; `None` if it has
    /// none there.
    fn arc(&self, [x, y]: [DVec3; 2]) -> Option<[f64; 2]> {
        let CurvedSurface { shape, towards, .. } = self.surface;
        let towards = DVec2::new(towards.dot(x), towards.dot(y));
        let half = self.surface.half_m[0] / shape.radius_m + ARC_MARGIN;
        if half >= PI {
            return Some([0.0, PI]);
        }
        let half = match shape.axis {
            Some(_) => half,
            // A cross-section passes beside the middle of a spherical cap.
            None => {
                let cosine = half.cos() / towards.length();
                if cosine > 1.0 {
                    return None;
                }
                if cosine > -1.0 { cosine.acos() } else { PI }
            }
        };
        Some([atan2(towards.y, towards.x), half])
    }

    /// Stationary points, unfolded at the plane between them, as reflections if they lie on the surface and on those of the
    /// planes. Occlusion is not tested.
    fn reflections(
        &self,
        unfolded: [DVec3; 2],
        images: [DVec3; 2],
        rays: &mut u64,
    ) -> Option<CurvedPath> {
        let shape = &self.surface.shape;
        let ends = [images[0], self.unfolded(images[1])];
        let points = [unfolded[0], self.unfolded(unfolded[1])];
        let side = (ends[0] - unfolded[0])
            .dot(shape.normal(unfolded[0]))
            .signum();
        let is_off = |end: usize| {
            let height_m = (ends[end] - unfolded[end]).dot(shape.normal(unfolded[end]));
            height_m * side >= CLEARANCE_M
        };
        let chord_m = unfolded[0].distance(unfolded[1]);
        let is_impossible = self.is_twice() && (side > 0.0 || chord_m < CLEARANCE_M);
        if !is_off(0) || !is_off(1) || is_impossible {
            return None;
        }
        let mirrored = [0, 1].map(|end| self.plane_point(end, images[end], points[end]));
        let turns = [mirrored[0]?, mirrored[1]?];
        let between = match self.bounces {
            Bounces::Twice(Some(plane)) => {
                Some((plane, self.crossing(plane, points, unfolded[1])?))
            }
            _ => None,
        };
        let mut facets = [0; 2];
        for (facet, point) in facets.iter_mut().zip(points) {
            *facet = self.facet_at(point, shape.normal(point), rays)?;
        }
        let incoming = (ends[0] - unfolded[0]).normalize_or_zero();
        Some(CurvedPath {
            images,
            points,
            unfolded,
            facets,
            side,
            cosine: incoming.dot(side * shape.normal(unfolded[0])),
            turns,
            between,
        })
    }

    /// The path over its reflections, if it is loud enough.
    fn path(&self, over: &CurvedPath, number: u64) -> Option<Path> {
        let (scene, points) = (self.scene, over.points);
        let ends = [over.images[0], self.unfolded(over.images[1])];
        let length_m = length_m(ends, over.unfolded);
        let wavenumbers = {
            let per_hz = std::f64::consts::TAU / scene.speed_of_sound_m_s();
            CENTRES_HZ.map(|hz| hz * per_hz)
        };
        let mut amplitude = match self.is_twice() {
            true => twice::amplitude(self.surface, ends, over.unfolded, &wavenumbers),
            false => {
                let at = CurvedPoint {
                    surface: self.surface,
                    point: points[0],
                    normal: over.side * self.surface.shape.normal(points[0]),
                    from: ends[0],
                    to: ends[1],
                };
                at.amplitude(&wavenumbers)
            }
        };
        let steps = [
            over.turns[0].zip(self.planes[0]),
            Some((points[0], over.facets[0])),
            over.between.map(|(plane, at)| (at, plane)),
            self.is_twice().then_some((points[1], over.facets[1])),
            over.turns[1].zip(self.planes[1]),
        ];
        let mut stops = [DVec3::ZERO; MAX_ORDER];
        let mut surfaces = [0; MAX_ORDER];
        let mut order = 0;
        for (at, surface) in steps.into_iter().flatten() {
            (stops[order], surfaces[order]) = (at, surface);
            order += 1;
        }
        let stops_met = &stops[..order];
        self.absorb(&mut amplitude, stops_met, &surfaces, over.cosine, length_m);
        let bound = MIN_RELATIVE_AMPLITUDE / length_m as f32;
        if amplitude.iter().all(|a| a.abs() < bound) {
            return None;
        }
        let departure = (stops[0] - self.ends[0]).as_vec3();
        apply_directivity(&mut amplitude, &self.endpoints.source, departure);
        let arrival = (stops[order - 1] - self.ends[1]).normalize_or_zero();
        let along = interactions(self.index, self.planes, self.bounces);
        // Of the shortest path; several have the same interactions.
        let id = interaction_path_id(scene, self.endpoints.source.id, along);
        Some(Path {
            id: PathId(id.0.wrapping_add(number << 61)),
            source: self.endpoints.source.id,
            order: order as u8,
            diffraction_order: 0,
            surfaces,
            edges: [0; MAX_DIFFRACTION_ORDER],
            points: stops.map(|point| scene.to_world(point)),
            image: scene.to_world(self.ends[1] + arrival * length_m),
            length_m: length_m as f32,
            amplitude,
        })
    }

    fn is_twice(&self) -> bool {
        self.bounces != Bounces::Once
    }

    /// Whether nothing occludes a path.
    fn is_unoccluded(&self, path: &CurvedPath, rays: &mut u64) -> bool {
        let is_open = [0, 1].into_iter().all(|end| {
            let ignored = self.planes[end].unwrap_or(NO_GROUP);
            let last = path.turns[end].unwrap_or(self.ends[end]);
            let point = path.points[end];
            let is_clear = |turn: DVec3, rays: &mut u64| {
                *rays += 1;
                let turn = turning_point(self.ends[end], turn, point);
                let ray = Ray::between(self.ends[end].as_vec3(), turn.as_vec3());
                !self.scene.any_hit(&ray, [ignored, NO_GROUP])
            };
            self.reaches(last, point, path.cosine, ignored, rays)
                && path.turns[end].is_none_or(|turn| is_clear(turn, rays))
        });
        let between = match self.bounces {
            Bounces::Twice(Some(plane)) => plane,
            _ => NO_GROUP,
        };
        let mut reaches = |from, to| self.reaches(from, to, path.cosine, between, rays);
        // Between both reflections: on the plane, or halfway without one.
        let [first, last] = path.points;
        let middle = path.between.map_or(0.5 * (first + last), |(_, at)| at);
        is_open && (!self.is_twice() || reaches(middle, first) && reaches(middle, last))
    }

    /// The reflection point in a plane between two positions, of which the last one's image is given.
    fn crossing(&self, plane: u32, [first, last]: [DVec3; 2], image: DVec3) -> Option<DVec3> {
        let [first_m, last_m] = [first, last].map(|at| self.scene.surface(plane).distance_m(at));
        if first_m * last_m <= 0.0 || first_m.abs() < CLEARANCE_M || last_m.abs() < CLEARANCE_M {
            return None;
        }
        let crossing = first + first_m / (first_m + last_m) * (image - first);
        self.scene.reflects_at(plane, crossing).then_some(crossing)
    }

    /// The reflection point in the plane before or after the surface; `None` where there is none, `Some(None)` without a plane.
    fn plane_point(&self, end: usize, image: DVec3, point: DVec3) -> Option<Option<DVec3>> {
        let Some(plane) = self.planes[end] else {
            return Some(None);
        };
        self.crossing(plane, [point, self.ends[end]], image)
            .map(Some)
    }

    /// The plane surface of the facet at a point of the shape; `None` where the curved surface has ended.
    fn facet_at(&self, point: DVec3, outward: DVec3, rays: &mut u64) -> Option<u32> {
        let reach = (2.0 * self.surface.unevenness_m + MARGIN_M) * outward;
        *rays += 1;
        let ray = Ray::between((point + reach).as_vec3(), (point - reach).as_vec3());
        let hit = self.scene.closest_hit(&ray, [NO_GROUP; 2])?;
        self.is_facet(hit.triangle)
            .then(|| self.scene.surface_of(hit.triangle))
    }

    fn is_facet(&self, triangle: u32) -> bool {
        self.scene.curved_surface_of(triangle) == Some(self.index)
    }

    /// Whether nothing occludes the point of the shape from a position: facets of the surface itself may hide it where they
    /// deviate from the shape.
    fn reaches(
        &self,
        from: DVec3,
        point: DVec3,
        cosine: f64,
        ignored: u32,
        rays: &mut u64,
    ) -> bool {
        *rays += 1;
        let ray = Ray::between(from.as_vec3(), point.as_vec3());
        let Some(hit) = self.scene.closest_hit(&ray, [ignored, NO_GROUP]) else {
            return true;
        };
        let hidden_m = from.distance(point) * (1.0 - f64::from(hit.t / ray.t_max));
        let uneven_m = self.surface.unevenness_m / cosine.max(1e-3);
        self.is_facet(hit.triangle)
            && hidden_m < uneven_m.min(self.surface.facet_m) + 2.0 * MARGIN_M
    }

    /// Absorption of air and surfaces along a path, and the bound of amplitudes.
    fn absorb(
        &self,
        amplitude: &mut BandArray,
        stops: &[DVec3],
        surfaces: &[u32; MAX_ORDER],
        cosine: f64,
        length_m: f64,
    ) {
        let scene = self.scene;
        let air = exp_neg(&scene.air_np_per_m().map(|np| np * length_m as f32));
        let most = (1.0 / self.endpoints.min_distance_m) as f32;
        for b in 0..BANDS {
            amplitude[b] = amplitude[b].min(most) * air[b];
        }
        for (number, (stop, &surface)) in stops.iter().zip(surfaces).enumerate() {
            let before = number.checked_sub(1).map_or(self.ends[0], |n| stops[n]);
            // Facets are no panels: they reflect by the smooth surface's normal.
            let plane = scene.surface(surface);
            let cosine = match plane.panel_triangle_count {
                0 => cosine,
                _ => (before - *stop).normalize_or_zero().dot(plane.normal).abs(),
            };
            let factor = scene.reflectance(surface).factor(cosine as f32);
            for b in 0..BANDS {
                amplitude[b] *= factor[b];
            }
        }
    }
}

/// Length of a path between two positions by way of two points.
fn length_m([from, to]: [DVec3; 2], [first, last]: [DVec3; 2]) -> f64 {
    from.distance(first) + first.distance(last) + last.distance(to)
}
