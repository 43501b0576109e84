//! Which surfaces might make a path: guide rays from the listener, and the first legs of source rays.
//!
//! Rays only suggest; validation decides. Source: [TAYLOR12], the separation of visibility by rays from exact images.

use glam::{DVec3, Mat3};

use super::path::MAX_ORDER;
use super::sampling::fibonacci_direction;
use super::sequence::{Sequence, SequenceSet};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::Scene;

/// Traces guide rays from the listener by specular reflection and adds every sequence they meet, and each of its
/// beginnings, turned round so that it runs from source to listener. Adds the rays it cast to `rays`.
pub fn trace_guide_rays(
    scene: &Scene,
    listener: DVec3,
    turn: &Mat3,
    count: u32,
    depth: usize,
    found: &mut SequenceSet,
    rays: &mut u64,
) {
    for index in 0..count {
        let direction = *turn * fibonacci_direction(index, count);
        let mut ray = Ray::new(listener.as_vec3(), direction);
        let mut last = NO_GROUP;
        // Filled from the end, so that what is there always runs from source to listener.
        let mut surfaces = [0; MAX_ORDER];
        for step in 0..depth.min(MAX_ORDER) {
            *rays += 1;
            let Some(hit) = scene.bvh().closest_hit(&ray, [last, NO_GROUP]) else {
                break;
            };
            if !scene.is_panel(hit.triangle) {
                break;
            }
            let first = MAX_ORDER - 1 - step;
            surfaces[first] = hit.group;
            found.insert(Sequence::canonical(scene, &surfaces[first..]));
            let normal = scene.surface(hit.group).normal.as_vec3();
            let onward = ray.direction - 2.0 * normal.dot(ray.direction) * normal;
            ray = Ray::new(ray.at(hit.t), onward);
            last = hit.group;
        }
    }
}
