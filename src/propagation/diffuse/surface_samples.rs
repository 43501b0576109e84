//! Points on all surfaces of a scene, each with a side, and the patches that they form.
//!
//! Own. Points lie evenly by area on both sides of every surface. Sides that sound cannot reach (cavities of solids, the
//! outside of a closed room) are dropped. A patch is a cluster of samples on one side that see each other, so no patch
//! reaches through a wall. The result depends on the fixed part of the scene and on
//! joined parts alone.

use glam::Vec3;

use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::diffuse::sample_search::SampleSearch;
use crate::propagation::rays::directions::{lambert_direction, mix, unit};
use crate::scene::Scene;

/// Most patches: the responses of pairs are stored and added up for every listener position. With 40 the law late/slopes has
/// no better figures.
pub(crate) const MAX_PATCHES: usize = 28;

/// Samples of a patch on average.
const SAMPLES_PER_PATCH: usize = 10;

/// Rays of a sample that find out whether sound reaches it.
const PROBES: usize = 8;

/// Mean free path in metres below which a set of samples is a cavity, and a sample is in a gap.
const CAVITY_M: f32 = 0.5;

/// Height in metres above the surface of rays between samples.
const HEIGHT_M: f32 = 0.03;

/// Bound of [`SurfaceSamples::leg_factor`].
const MAX_LEG_FACTOR: f32 = 4.0;

/// Most samples tried for a point whose nearest one is behind an obstacle.
const MAX_TRIES: usize = 4;

/// Thickness of a solid in metres up to which its faces are one wall, as in [`crate::propagation::transmission`].
const MAX_THICKNESS_M: f32 = 1.0;

/// Least cosine between two faces of one wall.
const PARALLEL: f32 = 0.985;

/// One side of a point on a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SurfaceSample {
    pub(crate) point: Vec3,
    /// Unit normal on its side.
    pub(crate) normal: Vec3,
    pub(crate) surface: u32,
    /// Index of its patch.
    pub(crate) patch: u16,
    /// Patch on the other side of the wall, which radiates what is transmitted.
    pub(crate) behind: Option<u16>,
    /// Distance in metres along the surface to the nearest obstacle.
    clear_m: f32,
    /// Mean length in metres of its probe rays.
    leg_m: f32,
}

/// All samples of a scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct SurfaceSamples {
    pub(crate) all: Vec<SurfaceSample>,
    /// Area of one sample.
    pub(crate) area_m2: f32,
    /// Length in metres that a quarter of their probe rays have at most.
    pub(crate) short_leg_m: f32,
    /// Number of patches.
    pub(crate) patches: usize,
    /// Mean length in metres of a patch's rays to the next surface.
    pub(crate) leg_m: Vec<f32>,
    search: SampleSearch,
}

impl SurfaceSamples {
    /// About `count` samples of the scene's fixed part and of joined parts. Adds the rays cast to `rays`.
    pub(crate) fn new(scene: &Scene, count: usize, rays: &mut u64) -> Self {
        let mut samples = Self::by_area(scene, count);
        samples.drop_unreachable(scene, rays);
        samples.index();
        samples.measure_clearance(scene, rays);
        samples.form_patches(scene, rays);
        samples.find_other_sides(scene, rays);
        samples
    }

    /// Both sides of points at even steps of area.
    fn by_area(scene: &Scene, count: usize) -> Self {
        let total: f64 = scene.static_areas().map(|(area_m2, _)| area_m2).sum();
        let mut samples = Self {
            area_m2: (total / count as f64) as f32,
            ..Self::default()
        };
        if !(total > 0.0 && total.is_finite()) {
            return samples;
        }
        let step = total / count as f64;
        let (mut sum, mut mark) = (0.0, 0.5 * step);
        for (area_m2, triangle) in scene.static_areas() {
            sum += area_m2;
            while mark < sum && samples.all.len() < 2 * count {
                let Some(corners) = scene.corners_in_scene(triangle) else {
                    break;
                };
                let surface = scene.surface_of(triangle);
                let point = point_within(&corners, (samples.all.len() / 2) as u64);
                let normal = scene.surface(surface).normal.as_vec3();
                for normal in [normal, -normal] {
                    samples.all.push(SurfaceSample {
                        point,
                        normal,
                        surface,
                        patch: 0,
                        behind: None,
                        clear_m: 0.0,
                        leg_m: 0.0,
                    });
                }
                mark += step;
            }
        }
        samples
    }

    /// Drops sides from which nothing is hit, cavities, and narrow gaps that are open at an end: nobody is in them, and their
    /// short legs would set the time base of the whole scene. What is reflected there belongs to the nearest sample.
    fn drop_unreachable(&mut self, scene: &Scene, rays: &mut u64) {
        self.index();
        let mut space: Vec<usize> = (0..self.all.len()).collect();
        let mut legs = vec![(0.0f32, 0u32); self.all.len()];
        let mut all_m = Vec::new();
        for index in 0..self.all.len() {
            for probe in 0..PROBES {
                let ray = probe_ray(&self.all[index], index, probe, PROBES);
                *rays += 1;
                let own = self.all[index].surface;
                let Some(hit) = scene.closest_static_hit(&ray, [own, NO_GROUP]) else {
                    continue;
                };
                all_m.push((index, hit.t));
                legs[index].0 += hit.t;
                legs[index].1 += 1;
                let normal = facing(scene, hit.group, ray.direction);
                if let Some(other) = self.search.nearest(ray.at(hit.t), normal, &[]) {
                    let (a, b) = (root(&mut space, index), root(&mut space, other));
                    space[a.max(b)] = a.min(b);
                }
            }
        }
        let mut sums = vec![(0.0f32, 0u32); self.all.len()];
        for index in 0..self.all.len() {
            let own = root(&mut space, index);
            sums[own].0 += legs[index].0;
            sums[own].1 += legs[index].1;
        }
        let is_kept = |index: usize, space: &mut [usize]| {
            let (own_m, own_count) = legs[index];
            let (sum_m, count) = sums[root(space, index)];
            own_m > CAVITY_M * own_count as f32 && sum_m > CAVITY_M * count as f32
        };
        all_m.retain(|(index, _)| is_kept(*index, &mut space));
        if !all_m.is_empty() {
            let quarter = all_m.len() / 4;
            let by_length = |a: &(usize, f32), b: &(usize, f32)| a.1.total_cmp(&b.1);
            self.short_leg_m = all_m.select_nth_unstable_by(quarter, by_length).1.1;
        }
        let mut index = 0;
        self.all.retain_mut(|sample| {
            let (own_m, own_count) = legs[index];
            sample.leg_m = own_m / own_count.max(1) as f32;
            index += 1;
            is_kept(index - 1, &mut space)
        });
    }

    fn index(&mut self) {
        let samples = self.all.iter().map(|sample| (sample.point, sample.normal));
        let samples: Vec<_> = samples.collect();
        // A sample on the other side counts as far as one at the next but two.
        self.search = SampleSearch::new(&samples, 4.0 * self.area_m2);
    }

    fn measure_clearance(&mut self, scene: &Scene, rays: &mut u64) {
        let longest_m = 4.0 * self.area_m2.sqrt();
        for sample in &mut self.all {
            let (side, other) = sample.normal.any_orthonormal_pair();
            sample.clear_m = longest_m;
            for step in 0..8 {
                let (sin, cos) = (step as f32 * std::f32::consts::FRAC_PI_4).sin_cos();
                let origin = sample.point + HEIGHT_M * sample.normal;
                let ray = Ray::new(origin, side * cos + other * sin);
                *rays += 1;
                if let Some(hit) = scene.closest_static_hit(&ray, [NO_GROUP; 2]) {
                    sample.clear_m = sample.clear_m.min(hit.t);
                }
            }
        }
    }

    /// Chooses centres far from each other and gives every sample to the nearest one that it sees.
    fn form_patches(&mut self, scene: &Scene, rays: &mut u64) {
        let count = (self.all.len() / SAMPLES_PER_PATCH).clamp(1, MAX_PATCHES);
        let spread_m2 = self.area_m2 * self.all.len() as f32 / count as f32;
        let distance = |a: &SurfaceSample, b: &SurfaceSample| {
            let turn = 1.0 - a.normal.dot(b.normal);
            a.point.distance_squared(b.point) + 2.0 * spread_m2 * turn
        };
        let mut centres: Vec<SurfaceSample> = Vec::new();
        let mut nearest = vec![f32::INFINITY; self.all.len()];
        while centres.len() < count {
            let far = nearest.iter().zip(&self.all);
            let far = far.max_by(|(a, _), (b, _)| a.total_cmp(b));
            let Some((_, far)) = far else { return };
            let far = *far;
            centres.push(far);
            for (nearest, sample) in nearest.iter_mut().zip(&self.all) {
                *nearest = nearest.min(distance(sample, &far));
            }
        }
        let mut order: Vec<u16> = Vec::new();
        for sample in &mut self.all {
            order.clear();
            order.extend(0..count as u16);
            let to = |patch: &u16| distance(sample, &centres[usize::from(*patch)]);
            order.sort_by(|a, b| to(a).total_cmp(&to(b)));
            let seen = order.iter().take(MAX_TRIES).find(|patch| {
                *rays += 1;
                let centre = &centres[usize::from(**patch)];
                let leg = Ray::between(raised(sample), raised(centre));
                !scene.is_statically_blocked(&leg, [NO_GROUP; 2])
            });
            sample.patch = *seen.unwrap_or(&order[0]);
        }
        self.patches = count;
        let mut counts = vec![0.0f32; count];
        self.leg_m = vec![0.0; count];
        for sample in &self.all {
            self.leg_m[usize::from(sample.patch)] += sample.leg_m;
            counts[usize::from(sample.patch)] += 1.0;
        }
        for (leg_m, count) in self.leg_m.iter_mut().zip(counts) {
            *leg_m /= count.max(1.0);
        }
    }

    /// Energy that a listener hears of specular energy that leaves a patch, relative to Lambert's law: in the mean over the
    /// room it is in proportion to the length of the leg. `None` for a ray that leaves the scene.
    pub(crate) fn leg_factor(&self, patch: usize, leg_m: Option<f32>) -> f32 {
        match (leg_m, self.leg_m[patch]) {
            (Some(leg_m), mean_m) if mean_m > 0.0 => (leg_m / mean_m).min(MAX_LEG_FACTOR),
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
            let mut point = sample.point;
            let ray = Ray {
                t_max: MAX_THICKNESS_M,
                ..Ray::new(sample.point, -sample.normal)
            };
            *rays += 1;
            if let Some(hit) = scene.closest_static_hit(&ray, [sample.surface, NO_GROUP]) {
                let other = scene.surface(hit.group);
                let is_parallel = other.normal.as_vec3().dot(sample.normal).abs() > PARALLEL;
                if other.material == scene.surface(sample.surface).material && is_parallel {
                    point = ray.at(hit.t);
                }
            }
            let found = self.locate(scene, point, -sample.normal, rays);
            self.all[index].behind = found.map(|found| self.all[found].patch);
        }
    }

    /// The sample nearest to a point with a normal, that the point sees. Adds the rays cast to `rays`.
    pub(crate) fn locate(
        &self,
        scene: &Scene,
        point: Vec3,
        normal: Vec3,
        rays: &mut u64,
    ) -> Option<usize> {
        let mut tried = [usize::MAX; MAX_TRIES];
        for attempt in 0..MAX_TRIES {
            let found = self.search.nearest(point, normal, &tried[..attempt])?;
            let sample = &self.all[found];
            let is_near = sample.normal.dot(normal) > PARALLEL
                && sample.point.distance(point) < sample.clear_m;
            if is_near {
                return Some(found);
            }
            *rays += 1;
            let leg = Ray::between(point + HEIGHT_M * normal, raised(sample));
            if !scene.is_statically_blocked(&leg, [NO_GROUP; 2]) {
                return Some(found);
            }
            tried[attempt] = found;
        }
        None
    }
}

/// A point just above a sample.
fn raised(sample: &SurfaceSample) -> Vec3 {
    sample.point + HEIGHT_M * sample.normal
}

/// Ray `number` of `count` from a sample, by Lambert's law.
pub(crate) fn probe_ray(sample: &SurfaceSample, index: usize, number: usize, count: usize) -> Ray {
    let shift = mix(index as u64);
    let u = (number as f32 + unit(shift)) / count as f32;
    // The golden ratio spreads the second coordinate.
    let v = (number as f32 * 0.618_034 + unit(mix(shift))).fract();
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

/// A point of a triangle: an R2 low-discrepancy sequence (\[ROBERTS18\]), folded.
fn point_within([a, b, c]: &[Vec3; 3], number: u64) -> Vec3 {
    let n = number as f64;
    let u = (0.5 + n * 0.754_877_666_246_692_8).fract() as f32;
    let v = (0.5 + n * 0.569_840_290_998_053_3).fract() as f32;
    let (u, v) = if u + v > 1.0 {
        (1.0 - u, 1.0 - v)
    } else {
        (u, v)
    };
    *a + u * (b - a) + v * (c - a)
}

/// The root of an index in a forest of sets.
fn root(sets: &mut [usize], mut index: usize) -> usize {
    while sets[index] != index {
        sets[index] = sets[sets[index]];
        index = sets[index];
    }
    index
}
