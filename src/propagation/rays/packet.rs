//! Packets of rays, one ray a lane: the searches for their hits overlap in the processor, and the arithmetic between two
//! searches is done in lanes. Lanes of inactive rays are meaningless.

use glam::Vec3;

use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Hit, Ray};
use crate::scene::Scene;
use crate::simd::prefetch;

/// Rays of a packet: enough that searches overlap, few enough that the packet stays in the first-level cache.
pub(crate) const PACKET_SIZE: usize = 16;

/// One value per ray.
pub(crate) type PerRay<T> = [T; PACKET_SIZE];

/// One vector per ray.
pub(crate) type Vectors = [PerRay<f32>; 3];

/// The lanes of a bitmask, the lowest first.
#[inline(always)]
pub(crate) fn lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros() as usize % PACKET_SIZE;
        let is_one = mask != 0;
        mask &= mask.wrapping_sub(1);
        is_one.then_some(lane)
    })
}

/// The vector of a lane.
#[inline(always)]
pub(crate) fn vector(of: &Vectors, lane: usize) -> Vec3 {
    Vec3::new(of[0][lane], of[1][lane], of[2][lane])
}

/// Sets the vector of a lane.
#[inline(always)]
pub(crate) fn put_vector(into: &mut Vectors, lane: usize, vector: Vec3) {
    into[0][lane] = vector.x;
    into[1][lane] = vector.y;
    into[2][lane] = vector.z;
}

/// Rays of one packet: origins and unit directions in local coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RayPacket {
    pub(crate) origin: Vectors,
    pub(crate) direction: Vectors,
    /// The surface that each starts from, or [`NO_GROUP`].
    pub(crate) last: PerRay<u32>,
    /// Bitmask of the active rays.
    pub(crate) active: u32,
}

/// Hits of one packet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HitPacket {
    /// Distance to the hit in metres; 0 without a hit.
    pub(crate) leg_m: PerRay<f32>,
    pub(crate) surface: PerRay<u32>,
    pub(crate) triangle: PerRay<u32>,
    /// Bitmask of the rays with a hit.
    pub(crate) rays: u32,
}

impl HitPacket {
    /// No hit.
    pub(crate) const NONE: Self = Self {
        leg_m: [0.0; PACKET_SIZE],
        surface: [0; PACKET_SIZE],
        triangle: [0; PACKET_SIZE],
        rays: 0,
    };
}

impl Default for HitPacket {
    fn default() -> Self {
        Self::NONE
    }
}

impl RayPacket {
    /// No active ray.
    pub(crate) const NONE: Self = Self {
        origin: [[0.0; PACKET_SIZE]; 3],
        direction: [[1.0; PACKET_SIZE], [0.0; PACKET_SIZE], [0.0; PACKET_SIZE]],
        last: [NO_GROUP; PACKET_SIZE],
        active: 0,
    };

    /// Starts a ray in a lane.
    #[inline(always)]
    pub(crate) fn begin(&mut self, lane: usize, ray: &Ray) {
        put_vector(&mut self.origin, lane, ray.origin);
        put_vector(&mut self.direction, lane, ray.direction);
        self.last[lane] = NO_GROUP;
        self.active |= 1 << lane;
    }

    /// The ray of a lane.
    #[inline(always)]
    pub(crate) fn ray(&self, lane: usize) -> Ray {
        Ray::new(vector(&self.origin, lane), vector(&self.direction, lane))
    }

    /// Casts the active rays, and prefetches the surfaces that they hit.
    #[inline(always)]
    pub(crate) fn cast(&self, scene: &Scene, hits: &mut HitPacket) {
        self.cast_by(scene, hits, |_, ray, last| {
            scene.closest_hit(ray, [last, NO_GROUP])
        });
    }

    /// [`Self::cast`] with another search: `closest_hit` takes lane, ray and the surface that it starts from.
    #[inline(always)]
    pub(crate) fn cast_by(
        &self,
        scene: &Scene,
        hits: &mut HitPacket,
        mut closest_hit: impl FnMut(usize, &Ray, u32) -> Option<Hit>,
    ) {
        hits.leg_m = [0.0; PACKET_SIZE];
        hits.rays = 0;
        for lane in lanes(self.active) {
            let hit = closest_hit(lane, &self.ray(lane), self.last[lane]);
            let Some(hit) = hit else { continue };
            hits.leg_m[lane] = hit.t;
            hits.surface[lane] = hit.group;
            hits.triangle[lane] = hit.triangle;
            hits.rays |= 1 << lane;
            if let Some(surface) = scene.fixed_surface(hit.group) {
                prefetch(surface);
                prefetch(&surface.material);
            }
        }
    }

    /// Moves all rays to their hits and mirrors them in planes with the unit normals `normal`, of either sign, which are turned
    /// towards the incoming rays. Directions may lose their unit length. Returns the cosines of incidence.
    #[inline(always)]
    pub(crate) fn mirror(&mut self, hits: &HitPacket, normal: &mut Vectors) -> PerRay<f32> {
        let mut into = dot(normal, &self.direction);
        let mut cosine = [0.0; PACKET_SIZE];
        let mut side = [0.0; PACKET_SIZE];
        for l in 0..PACKET_SIZE {
            cosine[l] = into[l].abs();
            side[l] = if into[l] > 0.0 { -1.0 } else { 1.0 };
            into[l] *= side[l];
        }
        // Local copies: the compiler then proves that the lanes do not alias.
        for axis in 0..3 {
            let (mut point, mut direction) = (self.origin[axis], self.direction[axis]);
            let mut normal_here = normal[axis];
            for l in 0..PACKET_SIZE {
                normal_here[l] *= side[l];
                point[l] += direction[l] * hits.leg_m[l];
                direction[l] -= 2.0 * into[l] * normal_here[l];
            }
            (self.origin[axis], self.direction[axis]) = (point, direction);
            normal[axis] = normal_here;
        }
        cosine
    }

    /// Normalises the directions. One without a finite length becomes the normal.
    #[inline(always)]
    pub(crate) fn normalize_or(&mut self, normal: &Vectors) {
        let square = dot(&self.direction, &self.direction);
        let mut factor = [0.0; PACKET_SIZE];
        for l in 0..PACKET_SIZE {
            factor[l] = 1.0 / square[l].sqrt();
        }
        for axis in 0..3 {
            let mut direction = self.direction[axis];
            for l in 0..PACKET_SIZE {
                direction[l] *= factor[l];
            }
            self.direction[axis] = direction;
        }
        // The bits of positive finite floats sort as integers, with a maximum in lanes.
        let mut most = 0;
        for l in 0..PACKET_SIZE {
            most = most.max(factor[l].to_bits().wrapping_sub(1));
        }
        if most >= f32::INFINITY.to_bits() - 1 {
            self.replace_undirected(&factor, normal);
        }
    }

    /// Sets directions to the normals where no factor normalises them.
    #[cold]
    fn replace_undirected(&mut self, factor: &PerRay<f32>, normal: &Vectors) {
        for l in 0..PACKET_SIZE {
            if !(factor[l].is_finite() && factor[l] > 0.0) {
                put_vector(&mut self.direction, l, vector(normal, l));
            }
        }
    }
}

/// Scalar products by lane.
#[inline(always)]
fn dot(a: &Vectors, b: &Vectors) -> PerRay<f32> {
    let mut dot = [0.0; PACKET_SIZE];
    for l in 0..PACKET_SIZE {
        dot[l] = (a[0][l] * b[0][l]) + (a[1][l] * b[1][l]) + (a[2][l] * b[2][l]);
    }
    dot
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::rays::directions::fibonacci_direction;

    #[test]
    fn lanes_are_the_bits_of_a_mask() {
        assert_eq!(lanes(0).count(), 0);
        assert_eq!(
            lanes(0b1000_0000_0001_0110).collect::<Vec<_>>(),
            [1, 2, 4, 15]
        );
        assert!(lanes(0xffff).eq(0..PACKET_SIZE));
    }

    /// Compares bits with single rays, for normals of either sign.
    #[test]
    fn lanes_are_mirrored_as_one_ray_is() {
        let mut rays = RayPacket::NONE;
        let mut hits = HitPacket::NONE;
        let mut normal = [[0.0; PACKET_SIZE]; 3];
        for lane in 0..PACKET_SIZE {
            let direction = fibonacci_direction(lane as u32, 16);
            rays.begin(
                lane,
                &Ray::new(Vec3::new(0.3, lane as f32, -2.0), direction),
            );
            put_vector(&mut normal, lane, fibonacci_direction(3 * lane as u32, 47));
            hits.leg_m[lane] = 0.7 * lane as f32;
        }
        let (before, plain) = (rays, normal);
        let cosines = rays.mirror(&hits, &mut normal);
        rays.normalize_or(&normal);
        for lane in 0..PACKET_SIZE {
            let (ray, up) = (before.ray(lane), vector(&plain, lane));
            let facing = match up.dot(ray.direction) > 0.0 {
                true => -up,
                false => up,
            };
            let into = facing.dot(ray.direction);
            let onward = ray.direction - 2.0 * into * facing;
            assert_eq!(vector(&normal, lane), facing);
            assert_eq!(cosines[lane], into.abs());
            let expected = Ray::new(ray.at(hits.leg_m[lane]), onward.normalize_or(facing));
            assert_eq!(rays.ray(lane), expected, "lane {lane}");
        }
    }

    #[test]
    fn a_ray_without_direction_follows_the_normal() {
        let mut rays = RayPacket::NONE;
        let normal = [[0.0; PACKET_SIZE], [0.0; PACKET_SIZE], [1.0; PACKET_SIZE]];
        for (lane, x) in [0.0, 3.0, f32::NAN, f32::INFINITY, 1e-30]
            .into_iter()
            .enumerate()
        {
            rays.direction[0][lane] = x;
        }
        rays.normalize_or(&normal);
        for (lane, x) in [0.0, 1.0, 0.0, 0.0, 0.0].into_iter().enumerate() {
            let expected = if x == 1.0 { Vec3::X } else { Vec3::Z };
            assert_eq!(vector(&rays.direction, lane), expected, "lane {lane}");
        }
    }
}
