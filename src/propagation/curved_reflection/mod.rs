//! Reflections at curved surfaces: one exact path to the smooth surface, alone or with a mirror plane before or after it.
//!
//! Runs with the propagation update. By Fermat's principle a path is stationary over the surface. In a sphere it lies in the
//! plane of its ends and the centre, in a cylinder it projects on a cross-section: both leave the same problem on a circle
//! (`circle`), whose up to four solutions are found by their slope. Facets only decide where the surface ends and what
//! occludes. Bounded by the constants below; deterministic; allocates nothing. Own.

mod circle;
mod sequence;
mod spreading;

pub use sequence::CurvedSequence;

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::acoustics::bands::{CENTRES_HZ, exp_neg};
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::amplitude::apply_directivity;
use crate::propagation::endpoints::Endpoints;
use crate::propagation::image_source::image_path::turning_point;
use crate::propagation::image_source::sequence::{Interaction, interaction_path_id};
use crate::propagation::path::{MAX_DIFFRACTION_ORDER, MAX_ORDER, Path, PathId};
use crate::scene::Scene;
use crate::scene::surface::curved::CurvedSurface;
use spreading::CurvedPoint;

/// Most planes that are combined with curved surfaces, the largest ones.
pub const MAX_PLANES: usize = 6;

/// Part of a whole turn from which a cylinder is a column.
const CLOSED: f64 = 0.95;

/// Least distance in metres of source and listener from a curved surface and from a plane: nearer ones lie in it.
const CLEARANCE_M: f64 = 1e-3;

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
        for before in choices() {
            for after in choices() {
                let order = 1 + usize::from(before.is_some()) + usize::from(after.is_some());
                if order <= depth.min(MAX_ORDER) {
                    let query = Query {
                        scene,
                        endpoints,
                        ends,
                        index: index as u32,
                        surface,
                        planes: [before, after],
                    };
                    query.find(rays, emit);
                }
            }
        }
    }
}

/// A path with its reflection points.
struct CurvedPath {
    path: Path,
    /// On the curved surface.
    point: DVec3,
    /// Cosine of the angle of incidence there.
    cosine: f64,
    /// On the planes before and after it.
    turns: [Option<DVec3>; 2],
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
}

impl Query<'_> {
    /// Source and listener, or their images in the planes.
    fn images(&self) -> [DVec3; 2] {
        [0, 1].map(|end| match self.planes[end] {
            Some(plane) => self.scene.surface(plane).mirror(self.ends[end]),
            None => self.ends[end],
        })
    }

    fn find(&self, rays: &mut u64, emit: &mut impl FnMut(Path)) {
        let images = self.images();
        // Valid paths, shortest first, so that numbers do not depend on where the circle begins.
        let mut points = [(f64::INFINITY, DVec3::ZERO); 4];
        let mut count = 0;
        self.stationary_points(images, None, |point| {
            if count < points.len() {
                points[count] = (images[0].distance(point) + point.distance(images[1]), point);
                count += 1;
            }
        });
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (number, (_, point)) in points[..count].iter().enumerate() {
            if let Some(path) = self.path(*point, images, number as u64, rays)
                && self.is_unoccluded(&path, rays)
            {
                emit(path.path);
            }
        }
    }

    /// Calls `found` with the stationary points of the shape between two positions: all of them, or the one near a point.
    fn stationary_points(
        &self,
        [from, to]: [DVec3; 2],
        near: Option<DVec3>,
        mut found: impl FnMut(DVec3),
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
        let mut at_angle = |angle: f64| {
            let around = DVec2::from_angle(angle) * shape.radius_m;
            let radial = around.x * x + around.y * y;
            let along_m = shape.axis.map_or(DVec3::ZERO, |axis| {
                let heights = [from, to].map(|end| (end - shape.centre).dot(axis));
                let [near, far] = [p, q].map(|end| end.distance(around));
                let share = near / (near + far).max(1e-12);
                (heights[0] + share * (heights[1] - heights[0])) * axis
            });
            found(shape.centre + along_m + radial);
        };
        let is_outside = |end: DVec2| end.length() > shape.radius_m;
        // Around a whole column only the path on the near side is in the air.
        let is_column = self.surface.half_m[0] > CLOSED * PI * shape.radius_m;
        let guess = match near {
            Some(near) => flat(shape.radial(near)),
            None if is_column && is_outside(p) && is_outside(q) => {
                p.normalize_or_zero() + q.normalize_or_zero()
            }
            None => {
                circle::stationary(p, q, shape.radius_m, at_angle);
                return;
            }
        };
        let found = circle::near(p, q, shape.radius_m, guess.to_angle());
        found.into_iter().for_each(&mut at_angle);
    }

    /// The path over a stationary point, if it lies on the surface and on those of the planes. Occlusion is not tested.
    fn path(
        &self,
        point: DVec3,
        images: [DVec3; 2],
        number: u64,
        rays: &mut u64,
    ) -> Option<CurvedPath> {
        let scene = self.scene;
        let outward = self.surface.shape.normal(point);
        let heights = images.map(|end| (end - point).dot(outward));
        let side = heights[0].signum();
        if heights.iter().any(|height| height * side < CLEARANCE_M) {
            return None;
        }
        let at = CurvedPoint {
            surface: self.surface,
            point,
            normal: side * outward,
            from: images[0],
            to: images[1],
        };
        let mirrored = [0, 1].map(|end| self.plane_point(end, images[end], point));
        let [before, after] = [mirrored[0]?, mirrored[1]?];
        let facet = self.facet_at(point, outward, rays)?;
        let length_m = images[0].distance(point) + point.distance(images[1]);
        let mut amplitude = self.amplitude(&at, facet, [before, after], length_m);
        let bound = MIN_RELATIVE_AMPLITUDE / length_m as f32;
        if amplitude.iter().all(|a| a.abs() < bound) {
            return None;
        }
        let departure = (before.unwrap_or(point) - self.ends[0]).as_vec3();
        apply_directivity(&mut amplitude, &self.endpoints.source, departure);
        let mut points = [DVec3::ZERO; MAX_ORDER];
        let mut surfaces = [0; MAX_ORDER];
        let steps = [
            (before, self.planes[0]),
            (Some(point), Some(facet)),
            (after, self.planes[1]),
        ];
        let mut order = 0;
        for (at, surface) in steps {
            if let (Some(at), Some(surface)) = (at, surface) {
                (points[order], surfaces[order]) = (at, surface);
                order += 1;
            }
        }
        let arrival = (points[order - 1] - self.ends[1]).normalize_or_zero();
        let plane = |end: usize| self.planes[end].map(Interaction::Surface).into_iter();
        let interactions = plane(0)
            .chain([Interaction::Curved(self.index)])
            .chain(plane(1));
        let source = self.endpoints.source.id;
        let id = interaction_path_id(scene, source, interactions);
        let path = Path {
            // Up to four paths have the same interactions.
            id: PathId(id.0.wrapping_add(number << 61)),
            source,
            order: order as u8,
            diffraction_order: 0,
            surfaces,
            edges: [0; MAX_DIFFRACTION_ORDER],
            points: points.map(|point| scene.to_world(point)),
            image: scene.to_world(self.ends[1] + arrival * length_m),
            length_m: length_m as f32,
            amplitude,
        };
        Some(CurvedPath {
            path,
            point,
            cosine: at.cosine(),
            turns: [before, after],
        })
    }

    /// Whether nothing occludes a path.
    fn is_unoccluded(&self, path: &CurvedPath, rays: &mut u64) -> bool {
        [0, 1].into_iter().all(|end| {
            let ignored = self.planes[end].unwrap_or(NO_GROUP);
            let last = path.turns[end].unwrap_or(self.ends[end]);
            let is_clear = |turn: DVec3, rays: &mut u64| {
                *rays += 1;
                let turn = turning_point(self.ends[end], turn, path.point);
                let ray = Ray::between(self.ends[end].as_vec3(), turn.as_vec3());
                !self.scene.any_hit(&ray, [ignored, NO_GROUP])
            };
            self.reaches(last, path.point, path.cosine, ignored, rays)
                && path.turns[end].is_none_or(|turn| is_clear(turn, rays))
        })
    }

    /// The reflection point in the plane before or after the surface; `None` where there is none, `Some(None)` without a plane.
    fn plane_point(&self, end: usize, image: DVec3, point: DVec3) -> Option<Option<DVec3>> {
        let Some(index) = self.planes[end] else {
            return Some(None);
        };
        let plane = self.scene.surface(index);
        let [own_m, other_m] = [self.ends[end], point].map(|at| plane.distance_m(at));
        if own_m * other_m <= 0.0 || own_m.abs() < CLEARANCE_M || other_m.abs() < CLEARANCE_M {
            return None;
        }
        let share = own_m / (own_m + other_m);
        let crossing = image + share * (point - image);
        self.scene
            .reflects_at(index, crossing)
            .then_some(Some(crossing))
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

    fn amplitude(
        &self,
        at: &CurvedPoint<'_>,
        facet: u32,
        mirrored: [Option<DVec3>; 2],
        length_m: f64,
    ) -> BandArray {
        let scene = self.scene;
        let per_hz = std::f64::consts::TAU / scene.speed_of_sound_m_s();
        let mut amplitude = at.amplitude(&CENTRES_HZ.map(|hz| hz * per_hz));
        let air = exp_neg(&scene.air_np_per_m().map(|np| np * length_m as f32));
        let own = scene.reflectance(facet).factor(at.cosine() as f32);
        let most = (1.0 / self.endpoints.min_distance_m) as f32;
        for b in 0..BANDS {
            amplitude[b] = amplitude[b].min(most) * air[b] * own[b];
        }
        for (end, mirrored) in mirrored.into_iter().enumerate() {
            if let (Some(plane), Some(turn)) = (self.planes[end], mirrored) {
                let ray = (self.ends[end] - turn).normalize_or_zero();
                let cosine = ray.dot(scene.surface(plane).normal).abs();
                let factor = scene.reflectance(plane).factor(cosine as f32);
                for b in 0..BANDS {
                    amplitude[b] *= factor[b];
                }
            }
        }
        amplitude
    }
}
