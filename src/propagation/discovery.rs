//! Which surfaces might make a path: guide rays from the listener.
//!
//! Rays only suggest; validation decides. Source: \[TAYLOR12\], the separation of visibility by rays from exact images.

use std::ops::Range;

use glam::{DVec3, Mat3, Vec3};

use super::path::MAX_ORDER;
use super::sequence::{Commutation, Sequence};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::Scene;

/// Where guide rays start, where they go and how far they are followed.
#[derive(Debug, Clone, Copy)]
pub struct GuideRays<'a> {
    /// The listener, local coordinates.
    pub origin: DVec3,
    /// Rotation of the lattice.
    pub turn: Mat3,
    /// The lattice.
    pub directions: &'a [Vec3],
    /// Bounces of each, at most [`MAX_ORDER`].
    pub depth: usize,
}

impl GuideRays<'_> {
    /// Traces some of the rays by specular reflection and gives `found` every sequence they meet, and each of its
    /// beginnings, turned round so that it runs from source to listener. Gives the number of rays cast.
    pub fn trace(
        &self,
        scene: &Scene,
        range: Range<usize>,
        mut found: impl FnMut(Sequence),
    ) -> u64 {
        let mut rays = 0;
        for direction in &self.directions[range] {
            let mut ray = Ray::new(self.origin.as_vec3(), self.turn * *direction);
            let mut last = NO_GROUP;
            // Filled from the end, so that what is there always runs from source to listener.
            let mut surfaces = [0; MAX_ORDER];
            let mut normals = [DVec3::ZERO; MAX_ORDER];
            let mut commutation = Commutation::default();
            for step in 0..self.depth.min(MAX_ORDER) {
                rays += 1;
                let Some(hit) = scene.closest_hit(&ray, [last, NO_GROUP]) else {
                    break;
                };
                if !scene.is_panel(hit.triangle) {
                    break;
                }
                let first = MAX_ORDER - 1 - step;
                let normal = scene.surface(hit.group).normal;
                surfaces[first] = hit.group;
                normals[first] = normal;
                commutation.put_first(&normals[first..]);
                found(commutation.canonical(&surfaces[first..]));
                let normal = normal.as_vec3();
                let onward = ray.direction - 2.0 * normal.dot(ray.direction) * normal;
                ray = Ray::new(ray.at(hit.t), onward);
                last = hit.group;
            }
        }
        rays
    }
}
