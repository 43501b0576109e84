//! Points on all surfaces of a scene, each with a side, and the patches that they form.
//!
//! Own. Points lie by area on both sides of every surface ([`crate::propagation::diffuse::sample_points`]). Sides that sound
//! cannot reach (cavities of solids, the outside of a closed room) are dropped
//! ([`crate::propagation::diffuse::air_spaces`]). Points depend on the fixed part of the scene and on joined parts, in large scenes
//! also on where listeners and sources were when they were chosen; what they see and their patches
//! ([`crate::propagation::diffuse::patches`]) depend on instances as well.

use glam::Vec3;

use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Hit, Ray};
use crate::propagation::diffuse::sample_points::{Focus, PointDensity};
use crate::propagation::diffuse::sample_search::SampleSearch;
use crate::propagation::rays::directions::{GOLDEN_TURN, lambert_direction};
use crate::scene::Scene;

/// Most patches: the responses of pairs are stored and added up for every listener position. With 40 the law late/slopes has
/// no better figures.
pub(crate) const MAX_PATCHES: usize = 28;

/// [`SurfaceSample::patch`] of a sample that sees no patch.
pub(crate) const NO_PATCH: u16 = u16::MAX;

/// Height in metres above the surface of rays between samples; less where another surface is nearer than twice of it.
const HEIGHT_M: f32 = 0.03;

/// Distance in metres of points from a plane up to which they are on one surface: the two faces of a leaf are further apart.
const COPLANAR_M: f32 = 5e-3;

/// Most samples tried for a point whose nearest one is behind an obstacle.
pub(crate) const MAX_TRIES: usize = 4;

/// Thickness of a solid in metres up to which its faces are one wall, as in [`crate::propagation::transmission`].
const MAX_THICKNESS_M: f32 = 1.0;

/// Least cosine between two faces of one wall.
const PARALLEL: f32 = 0.985;

/// Spacings of samples without any, from which on a part of a surface is a gap.
const GAP_SPACINGS: f32 = 4.0;

/// One side of a point on a surface.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct SurfaceSample {
    pub(crate) point: Vec3,
    /// Unit normal on its side.
    pub(crate) normal: Vec3,
    pub(crate) surface: u32,
    /// Index of its patch, or [`NO_PATCH`].
    pub(crate) patch: u16,
    /// Patch on the other side of the wall, which radiates what is transmitted.
    pub(crate) behind: Option<u16>,
    /// The same point, raised above the surface by [`HEIGHT_M`] at most: nothing is between both.
    pub(crate) raised: Vec3,
    /// Distance in metres along the surface to the nearest obstacle.
    pub(super) clear_m: f32,
    /// Mean length in metres of its probe rays.
    pub(crate) leg_m: f32,
    /// Area in square metres that it stands for.
    pub(crate) area_m2: f32,
}

impl SurfaceSample {
    /// Whether another surface is so near that rays between samples cannot start at their full height.
    pub(crate) fn is_in_gap(&self) -> bool {
        self.raised.distance(self.point) < 0.99 * HEIGHT_M
    }

    /// Whether a point with a normal is on the same surface, without an obstacle between both.
    fn is_beside(&self, point: Vec3, normal: Vec3) -> bool {
        let offset = point - self.point;
        self.normal.dot(normal) > PARALLEL
            && self.normal.dot(offset).abs() < COPLANAR_M
            && offset.length() < self.clear_m
    }
}

/// All samples of a scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct SurfaceSamples {
    pub(crate) all: Vec<SurfaceSample>,
    /// Least area in square metres of a sample.
    pub(crate) area_m2: f32,
    /// Where they are closest.
    pub(crate) focus: Focus,
    /// Whether parts of surfaces have none: what hits them leaves the field.
    pub(super) has_gaps: bool,
    /// Length in metres that a quarter of their probe rays have at most.
    pub(crate) short_leg_m: f32,
    /// Number of closed spaces without an occupant, whose samples are left out.
    pub(crate) left_out: usize,
    /// Number of patches.
    pub(crate) patches: usize,
    /// Mean length in metres of a patch's rays to the next surface.
    pub(crate) leg_m: Vec<f32>,
    /// Share of all samples of each patch, and area in square metres of its own.
    pub(crate) share: Vec<f32>,
    pub(crate) patch_m2: Vec<f32>,
    /// Samples that the patches are about.
    pub(crate) centres: Vec<usize>,
    pub(crate) search: SampleSearch,
}

impl SurfaceSamples {
    /// About `count` samples of the scene's fixed part and of joined parts, in the spaces of the `occupants` (listener and
    /// sources, in local coordinates) and in the open. Adds the rays cast to `rays`.
    pub(crate) fn new(scene: &Scene, count: usize, occupants: &[Vec3], rays: &mut u64) -> Self {
        let mut reached = |density: &PointDensity| {
            let mut samples = Self::at_points(scene, density);
            samples.raise(rays, |ray, own| scene.closest_static_hit(ray, own));
            samples.index();
            samples.drop_unreachable(scene, occupants, rays);
            samples
        };
        let mut last = None;
        let count_reached = |density: &PointDensity| {
            let samples = last.insert((density.count, reached(density)));
            samples.1.all.len()
        };
        let density = PointDensity::choose(scene, count, occupants, count_reached);
        // A density with the count of the last one that was tried is that one.
        let tried = last.filter(|(count, _)| *count == density.count);
        let mut samples = tried.map_or_else(|| reached(&density), |(_, samples)| samples);
        if density.count > count {
            samples.thin(count);
            samples.has_gaps = true;
        }
        samples.index();
        samples.choose_centres();
        samples
    }

    /// Finds what samples see among the instances' present poses, and their patches; returns whether any has changed. Adds the
    /// rays cast to `rays`.
    pub(crate) fn look_around(&mut self, scene: &Scene, rays: &mut u64) -> bool {
        let before = self.all.clone();
        self.raise(rays, |ray, own| scene.closest_hit(ray, own));
        self.measure_clearance(scene, rays);
        self.form_patches(scene, rays);
        self.find_other_sides(scene, rays);
        self.all != before
    }

    /// Both sides of points.
    fn at_points(scene: &Scene, density: &PointDensity) -> Self {
        let (points, area_m2) = density.points(scene);
        let sides = points.iter().flat_map(|at| {
            let surface = scene.surface_of(at.triangle);
            let normal = scene.surface(surface).normal.as_vec3();
            [normal, -normal].map(|normal| SurfaceSample {
                point: at.point,
                normal,
                surface,
                patch: 0,
                behind: None,
                raised: at.point,
                clear_m: 0.0,
                leg_m: 0.0,
                area_m2: at.area_m2,
            })
        });
        Self {
            all: sides.collect(),
            area_m2,
            focus: density.focus.clone(),
            ..Self::default()
        }
    }

    /// Keeps about `count` samples, evenly chosen, which stand for the area of all. Both sides of a point follow each other: the
    /// choice is by multiples of the golden ratio, not by even steps.
    fn thin(&mut self, count: usize) {
        let share = count as f64 / self.all.len() as f64;
        if share >= 1.0 {
            return;
        }
        let mut turns = 0.0f64;
        self.all.retain_mut(|sample| {
            sample.area_m2 /= share as f32;
            turns = (turns + GOLDEN_TURN).fract();
            turns < share
        });
        self.area_m2 /= share as f32;
    }

    fn index(&mut self) {
        let samples = self.all.iter().map(|sample| (sample.point, sample.normal));
        let samples: Vec<_> = samples.collect();
        // A sample on the other side counts as far as one at the next but two.
        self.search = SampleSearch::new(&samples, 4.0 * self.area_m2);
    }

    /// Raises the samples before what `cast` hits, except for their own surface.
    fn raise(&mut self, rays: &mut u64, cast: impl Fn(&Ray, [u32; 2]) -> Option<Hit>) {
        for sample in &mut self.all {
            let own = [sample.surface, NO_GROUP];
            sample.raised = raised(sample.point, sample.normal, rays, |ray| cast(ray, own));
        }
    }

    fn measure_clearance(&mut self, scene: &Scene, rays: &mut u64) {
        for sample in &mut self.all {
            let longest_m = 4.0 * sample.area_m2.sqrt();
            let (side, other) = sample.normal.any_orthonormal_pair();
            sample.clear_m = longest_m;
            for step in 0..8 {
                let (sin, cos) = (step as f32 * std::f32::consts::FRAC_PI_4).sin_cos();
                let ray = Ray::new(sample.raised, side * cos + other * sin);
                *rays += 1;
                if let Some(hit) = scene.closest_hit(&ray, [NO_GROUP; 2]) {
                    sample.clear_m = sample.clear_m.min(hit.t);
                }
            }
        }
    }

    /// Energy that a listener hears of specular energy that leaves a patch, relative to Lambert's law: in the mean over the
    /// room it is in proportion to the length of the leg. `None` for a ray that leaves the scene. Where in the room it is heard
    /// follows from [`crate::propagation::diffuse::specular_legs`].
    pub(crate) fn leg_factor(&self, patch: usize, leg_m: Option<f32>) -> f32 {
        match (leg_m, self.leg_m[patch]) {
            (Some(leg_m), mean_m) if mean_m > 0.0 => leg_m / mean_m,
            _ => 1.0,
        }
    }

    fn find_other_sides(&mut self, scene: &Scene, rays: &mut u64) {
        for index in 0..self.all.len() {
            let sample = self.all[index];
            let through = scene.transmission_factor(sample.surface);
            if through.iter().all(|factor| *factor == 0.0) {
                continue;
            }
            let (mut point, mut surface) = (sample.point, sample.surface);
            let ray = Ray {
                t_max: MAX_THICKNESS_M,
                ..Ray::new(sample.point, -sample.normal)
            };
            *rays += 1;
            if let Some(hit) = scene.closest_static_hit(&ray, [sample.surface, NO_GROUP]) {
                let other = scene.surface(hit.group);
                let is_parallel = other.normal.as_vec3().dot(sample.normal).abs() > PARALLEL;
                if other.material == scene.surface(sample.surface).material && is_parallel {
                    (point, surface) = (ray.at(hit.t), hit.group);
                }
            }
            let found = self.locate(scene, (point, surface), -sample.normal, rays);
            self.all[index].behind = found.map(|found| self.all[found].patch);
        }
    }

    /// Whether sound that hits a point of a surface with a normal leaves the field.
    pub(crate) fn is_left_at(&self, point: Vec3, normal: Vec3) -> bool {
        let nearest = self.search.nearest::<1>(point, normal).next();
        nearest.is_some_and(|nearest| self.is_beyond(&self.all[nearest], point))
    }

    /// Whether a point is farther from the nearest sample than samples lie apart.
    fn is_beyond(&self, nearest: &SurfaceSample, point: Vec3) -> bool {
        let reach_m2 = GAP_SPACINGS * GAP_SPACINGS * nearest.area_m2;
        self.has_gaps && nearest.point.distance_squared(point) > reach_m2
    }

    /// The sample of a patch nearest to a point of a surface with a normal, that the point sees; none where sound leaves the field.
    /// Adds the rays cast to `rays`.
    pub(crate) fn locate(
        &self,
        scene: &Scene,
        (point, surface): (Vec3, u32),
        normal: Vec3,
        rays: &mut u64,
    ) -> Option<usize> {
        let mut origin = None;
        let nearest = self.search.nearest::<MAX_TRIES>(point, normal);
        for (attempt, found) in nearest.enumerate() {
            let sample = &self.all[found];
            if attempt == 0 && self.is_beyond(sample, point) {
                return None;
            }
            if sample.patch != NO_PATCH {
                if sample.is_beside(point, normal) {
                    return Some(found);
                }
                let from = *origin.get_or_insert_with(|| {
                    let own = [surface, NO_GROUP];
                    raised(point, normal, rays, |ray| scene.closest_hit(ray, own))
                });
                *rays += 1;
                if !scene.any_hit(&Ray::between(from, sample.raised), [NO_GROUP; 2]) {
                    return Some(found);
                }
            }
        }
        None
    }
}

/// A point just above a point of a surface, on the side of a normal and before whatever else `cast` hits there. Adds the ray
/// cast to `rays`.
pub(crate) fn raised(
    point: Vec3,
    normal: Vec3,
    rays: &mut u64,
    cast: impl FnOnce(&Ray) -> Option<Hit>,
) -> Vec3 {
    *rays += 1;
    let ray = Ray {
        t_max: 2.0 * HEIGHT_M,
        ..Ray::new(point, normal)
    };
    ray.at(cast(&ray).map_or(HEIGHT_M, |hit| 0.5 * hit.t))
}

/// Steps of an R4 low-discrepancy sequence (\[ROBERTS18\]) that the points' R2 sequence has no part in.
const RAY_STEP: [f64; 2] = [0.856_674_883_854_502_9, 0.538_597_257_220_986];

/// Ray `number` of `count` from a sample, by Lambert's law.
pub(crate) fn probe_ray(sample: &SurfaceSample, index: usize, number: usize, count: usize) -> Ray {
    // Neighbours in the list are on one surface: their rays together are even as well.
    let shift = |step: f64| (index as f64 * step).fract() as f32;
    let u = (number as f32 + shift(RAY_STEP[0])) / count as f32;
    // The golden ratio spreads the second coordinate.
    let v = (number as f32 * 0.618_034 + shift(RAY_STEP[1])).fract();
    Ray::new(sample.point, lambert_direction(sample.normal, u.fract(), v))
}

/// Unit normal of a surface on the side that a direction comes from.
pub(crate) fn facing(scene: &Scene, surface: u32, direction: Vec3) -> Vec3 {
    let normal = scene.surface(surface).normal.as_vec3();
    match normal.dot(direction) > 0.0 {
        true => -normal,
        false => normal,
    }
}
