//! Which surfaces might make a path: guide rays from the listener.
//!
//! Rays only suggest; validation decides. Source: \[TAYLOR12\], the separation of visibility by rays from exact images.

use std::ops::Range;

use glam::{DVec3, Mat3, Vec3};

use super::path::MAX_ORDER;
use super::sequence::{Commutation, Sequence};
use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Hit, Ray};
use crate::scene::Scene;
use crate::simd::prefetch;

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
        let depth = self.depth.min(MAX_ORDER);
        let mut rays = 0;
        for directions in self.directions[range].chunks(TOGETHER) {
            let mut together = [GuideRay::ENDED; TOGETHER];
            let together = &mut together[..directions.len()];
            for (ray, direction) in together.iter_mut().zip(directions) {
                ray.ray = Ray::new(self.origin.as_vec3(), self.turn * *direction);
                ray.has_ended = false;
            }
            for step in 0..depth {
                for ray in together.iter_mut().filter(|ray| !ray.has_ended) {
                    rays += 1;
                    ray.cast(scene);
                }
                for ray in together.iter_mut().filter(|ray| !ray.has_ended) {
                    ray.mirror(scene, step);
                }
            }
            let met = together.iter().flat_map(|ray| &ray.met[..ray.count]);
            met.for_each(|sequence| found(*sequence));
        }
        rays
    }
}

/// Rays that are followed side by side, so that the next one's way begins before the last one's is worked out.
const TOGETHER: usize = 16;

/// A guide ray under way.
#[derive(Clone, Copy)]
struct GuideRay {
    ray: Ray,
    hit: Option<Hit>,
    last: u32,
    has_ended: bool,
    /// Filled from the end, so that what is there always runs from source to listener.
    surfaces: [u32; MAX_ORDER],
    normals: [DVec3; MAX_ORDER],
    commutation: Commutation,
    /// What it has found so far.
    met: [Sequence; MAX_ORDER],
    count: usize,
}

impl GuideRay {
    /// In place of one.
    const ENDED: Self = Self {
        ray: Ray {
            origin: Vec3::ZERO,
            direction: Vec3::X,
            t_min: 0.0,
            t_max: 0.0,
        },
        hit: None,
        last: NO_GROUP,
        has_ended: true,
        surfaces: [0; MAX_ORDER],
        normals: [DVec3::ZERO; MAX_ORDER],
        commutation: Commutation::NONE,
        met: [Sequence::NONE; MAX_ORDER],
        count: 0,
    };

    /// To the next surface; ends where there is none, or one that is no mirror.
    #[inline(always)]
    fn cast(&mut self, scene: &Scene) {
        let hit = scene.closest_hit(&self.ray, [self.last, NO_GROUP]);
        self.hit = hit.filter(|hit| scene.is_panel(hit.triangle));
        self.has_ended = self.hit.is_none();
        if let Some(surface) = self.hit.and_then(|hit| scene.kept_surface(hit.group)) {
            prefetch(surface);
        }
    }

    /// Away from it, as reflection number `step`.
    #[inline(always)]
    fn mirror(&mut self, scene: &Scene, step: usize) {
        let Some(hit) = self.hit else { return };
        let first = MAX_ORDER - 1 - step;
        let normal = scene.surface(hit.group).normal;
        self.surfaces[first] = hit.group;
        self.normals[first] = normal;
        self.commutation.put_first(&self.normals[first..]);
        self.met[step] = self.commutation.canonical(&self.surfaces[first..]);
        self.count = step + 1;
        let normal = normal.as_vec3();
        let direction = self.ray.direction;
        let onward = direction - 2.0 * normal.dot(direction) * normal;
        self.ray = Ray::new(self.ray.at(hit.t), onward);
        self.last = hit.group;
    }
}
