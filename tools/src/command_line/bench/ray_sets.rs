//! The three fixed sets of rays that are measured, as propagation casts them.
//!
//! Rays start a millimetre off the surfaces that they leave; another tracer, without groups to ignore, then traces the
//! same.

use foresound::geometry::bvh::NO_GROUP;
use foresound::geometry::{Bvh, Ray};
use foresound::propagation::rays::directions::{fibonacci_direction, lambert_direction, mix, unit};
use foresound::scene::Scene;
use glam::Vec3;

/// Guide rays, of four legs each.
const GUIDE_RAYS: u32 = 1024;

/// Source rays of each source, of four legs each.
const SOURCE_RAYS: u32 = 128;

/// Legs of a ray.
const LEGS: u64 = 4;

/// Segments between origins of rays.
const SEGMENTS: u64 = 16_384;

/// How far from a surface a ray starts, in metres.
const START_OFF_M: f32 = 1e-3;

/// Rays of one kind.
pub(super) struct RaySet {
    /// `guide`, `source` or `visibility`.
    pub(super) name: &'static str,
    pub(super) rays: Vec<Ray>,
    /// Any hit instead of the closest.
    pub(super) any: bool,
}

/// The sets of a scene, from the positions of listener and sources in local coordinates.
pub(super) fn ray_sets(scene: &Scene, listener: Vec3, sources: &[Vec3]) -> [RaySet; 3] {
    let guide = legs(scene, listener, GUIDE_RAYS, None);
    let source: Vec<Ray> = sources
        .iter()
        .zip(0u64..)
        .flat_map(|(&from, seed)| legs(scene, from, SOURCE_RAYS, Some(seed)))
        .collect();
    let origins: Vec<Vec3> = guide.iter().chain(&source).map(|ray| ray.origin).collect();
    let draw = |k: u64| (mix(k) % origins.len() as u64) as usize;
    let visibility = (0..SEGMENTS)
        .map(|i| Ray::between(origins[draw(2 * i)], origins[draw(2 * i + 1)]))
        .filter(|ray| ray.direction != Vec3::ZERO)
        .collect();
    [
        RaySet {
            name: "guide",
            rays: guide,
            any: false,
        },
        RaySet {
            name: "source",
            rays: source,
            any: false,
        },
        RaySet {
            name: "visibility",
            rays: visibility,
            any: true,
        },
    ]
}

/// All legs of rays from one position: mirrored, or scattered by a seed.
fn legs(scene: &Scene, from: Vec3, count: u32, scattered: Option<u64>) -> Vec<Ray> {
    let mut all = Vec::new();
    for index in 0..count {
        let mut ray = Ray::new(from, fibonacci_direction(index, count));
        for leg in 0..LEGS {
            all.push(ray);
            let Some(hit) = scene.bvh().closest_hit(&ray, [NO_GROUP; 2]) else {
                break;
            };
            let outward = scene.surface(hit.group).normal.as_vec3();
            let normal = outward * -outward.dot(ray.direction).signum();
            let onward = match scattered {
                Some(seed) => {
                    let draw =
                        |k: u64| unit(mix(seed << 32 | u64::from(index) << 8 | leg << 1 | k));
                    lambert_direction(normal, draw(0), draw(1))
                }
                None => ray.direction - 2.0 * normal.dot(ray.direction) * normal,
            };
            ray = Ray::new(ray.at(hit.t) + normal * START_OFF_M, onward);
        }
    }
    all
}

/// Traces all rays of a set and returns the number of hits.
pub(super) fn trace(bvh: &Bvh, set: &RaySet) -> usize {
    let hits = |ray: &&Ray| {
        if set.any {
            bvh.any_hit(ray, [NO_GROUP; 2])
        } else {
            bvh.closest_hit(ray, [NO_GROUP; 2]).is_some()
        }
    };
    set.rays.iter().filter(hits).count()
}
