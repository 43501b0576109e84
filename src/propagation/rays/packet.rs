//! Rays that are followed side by side, one a lane: the processor looks for one ray's hit while it still works at another's,
//! and what is the same for all of them is worked out in lanes. Lanes whose ray has ended hold anything.

use glam::Vec3;

use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Hit, Ray};
use crate::scene::Scene;
use crate::simd::prefetch;

/// Rays that are followed side by side: enough for the next one's way to begin before the last one's is worked out, few enough
/// to stay at hand.
pub(crate) const TOGETHER: usize = 16;

/// One of each ray.
pub(crate) type Each<T> = [T; TOGETHER];

/// Vectors, one a ray.
pub(crate) type Vectors = [Each<f32>; 3];

/// The lanes of a mask, the lowest first.
#[inline(always)]
pub(crate) fn lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros() as usize % TOGETHER;
        let is_same_rigid_body = mask != 0;
        mask &= mask.wrapping_sub(1);
        is_same_rigid_body.then_some(lane)
    })
}

/// A lane of some vectors.
#[inline(always)]
pub(crate) fn vector(of: &Vectors, lane: usize) -> Vec3 {
    Vec3::new(of[0][lane], of[1][lane], of[2][lane])
}

/// Puts a vector into its lane.
#[inline(always)]
pub(crate) fn put_vector(into: &mut Vectors, lane: usize, vector: Vec3) {
    into[0][lane] = vector.x;
    into[1][lane] = vector.y;
    into[2][lane] = vector.z;
}

/// Rays under way.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rays {
    pub(crate) origin: Vectors,
    pub(crate) direction: Vectors,
    /// The surface that each starts from.
    pub(crate) last: Each<u32>,
    /// Those that have not ended, one a bit.
    pub(crate) under_way: u32,
}

/// What some rays met.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Met {
    /// Length of the way there, as directions are unit vectors; zero where nothing was met.
    pub(crate) leg_m: Each<f32>,
    pub(crate) surface: Each<u32>,
    pub(crate) triangle: Each<u32>,
    /// The rays that met something, one a bit.
    pub(crate) rays: u32,
}

impl Met {
    /// Nothing.
    pub(crate) const NONE: Self = Self {
        leg_m: [0.0; TOGETHER],
        surface: [0; TOGETHER],
        triangle: [0; TOGETHER],
        rays: 0,
    };
}

impl Default for Met {
    fn default() -> Self {
        Self::NONE
    }
}

impl Rays {
    /// None yet.
    pub(crate) const NONE: Self = Self {
        origin: [[0.0; TOGETHER]; 3],
        direction: [[1.0; TOGETHER], [0.0; TOGETHER], [0.0; TOGETHER]],
        last: [NO_GROUP; TOGETHER],
        under_way: 0,
    };

    /// A ray sets out.
    #[inline(always)]
    pub(crate) fn begin(&mut self, lane: usize, ray: &Ray) {
        put_vector(&mut self.origin, lane, ray.origin);
        put_vector(&mut self.direction, lane, ray.direction);
        self.last[lane] = NO_GROUP;
        self.under_way |= 1 << lane;
    }

    /// The ray of a lane.
    #[inline(always)]
    pub(crate) fn ray(&self, lane: usize) -> Ray {
        Ray::new(vector(&self.origin, lane), vector(&self.direction, lane))
    }

    /// Casts those under way, all before what they met is looked at: surfaces are asked for, and have come by then.
    #[inline(always)]
    pub(crate) fn cast(&self, scene: &Scene, met: &mut Met) {
        self.cast_by(scene, met, |_, ray, last| {
            scene.closest_hit(ray, [last, NO_GROUP])
        });
    }

    /// The same, where `closest_hit` knows what a lane's ray meets that starts from a surface.
    #[inline(always)]
    pub(crate) fn cast_by(
        &self,
        scene: &Scene,
        met: &mut Met,
        mut closest_hit: impl FnMut(usize, &Ray, u32) -> Option<Hit>,
    ) {
        met.leg_m = [0.0; TOGETHER];
        met.rays = 0;
        for lane in lanes(self.under_way) {
            let hit = closest_hit(lane, &self.ray(lane), self.last[lane]);
            let Some(hit) = hit else { continue };
            met.leg_m[lane] = hit.t;
            met.surface[lane] = hit.group;
            met.triangle[lane] = hit.triangle;
            met.rays |= 1 << lane;
            if let Some(surface) = scene.fixed_surface(hit.group) {
                prefetch(surface);
                prefetch(&surface.material);
            }
        }
    }

    /// Mirrors all in the planes that they met, whose unit normals point to either side: `normal` becomes those on the side
    /// that rays come from. Directions need not be of unit length afterwards. Gives the cosines of incidence.
    #[inline(always)]
    pub(crate) fn mirror(&mut self, met: &Met, normal: &mut Vectors) -> Each<f32> {
        let mut into = dot(normal, &self.direction);
        let mut cosine = [0.0; TOGETHER];
        let mut side = [0.0; TOGETHER];
        for l in 0..TOGETHER {
            cosine[l] = into[l].abs();
            side[l] = if into[l] > 0.0 { -1.0 } else { 1.0 };
            into[l] *= side[l];
        }
        // Copies, so that lanes are seen to be apart from each other.
        for axis in 0..3 {
            let (mut point, mut direction) = (self.origin[axis], self.direction[axis]);
            let mut normal_here = normal[axis];
            for l in 0..TOGETHER {
                normal_here[l] *= side[l];
                point[l] += direction[l] * met.leg_m[l];
                direction[l] -= 2.0 * into[l] * normal_here[l];
            }
            (self.origin[axis], self.direction[axis]) = (point, direction);
            normal[axis] = normal_here;
        }
        cosine
    }

    /// Makes directions unit vectors again; what has no direction goes along the normal.
    #[inline(always)]
    pub(crate) fn normalize_or(&mut self, normal: &Vectors) {
        let square = dot(&self.direction, &self.direction);
        let mut factor = [0.0; TOGETHER];
        for l in 0..TOGETHER {
            factor[l] = 1.0 / square[l].sqrt();
        }
        for axis in 0..3 {
            let mut direction = self.direction[axis];
            for l in 0..TOGETHER {
                direction[l] *= factor[l];
            }
            self.direction[axis] = direction;
        }
        // Bits of what is above zero and finite are a range of numbers, and lanes find the greatest number.
        let mut most = 0;
        for l in 0..TOGETHER {
            most = most.max(factor[l].to_bits().wrapping_sub(1));
        }
        if most >= f32::INFINITY.to_bits() - 1 {
            self.go_along(&factor, normal);
        }
    }

    /// Has rays go along normals whose directions could not be made unit vectors by a factor.
    #[cold]
    fn go_along(&mut self, factor: &Each<f32>, normal: &Vectors) {
        for l in 0..TOGETHER {
            if !(factor[l].is_finite() && factor[l] > 0.0) {
                put_vector(&mut self.direction, l, vector(normal, l));
            }
        }
    }
}

/// Scalar products, lane by lane.
#[inline(always)]
fn dot(a: &Vectors, b: &Vectors) -> Each<f32> {
    let mut dot = [0.0; TOGETHER];
    for l in 0..TOGETHER {
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
        assert!(lanes(0xffff).eq(0..TOGETHER));
    }

    /// As one ray after another is mirrored, with normals to either side, bit by bit.
    #[test]
    fn all_are_mirrored_as_one_is() {
        let mut rays = Rays::NONE;
        let mut met = Met::NONE;
        let mut normal = [[0.0; TOGETHER]; 3];
        for lane in 0..TOGETHER {
            let direction = fibonacci_direction(lane as u32, 16);
            rays.begin(
                lane,
                &Ray::new(Vec3::new(0.3, lane as f32, -2.0), direction),
            );
            put_vector(&mut normal, lane, fibonacci_direction(3 * lane as u32, 47));
            met.leg_m[lane] = 0.7 * lane as f32;
        }
        let (before, plain) = (rays, normal);
        let cosines = rays.mirror(&met, &mut normal);
        rays.normalize_or(&normal);
        for lane in 0..TOGETHER {
            let (ray, up) = (before.ray(lane), vector(&plain, lane));
            let facing = match up.dot(ray.direction) > 0.0 {
                true => -up,
                false => up,
            };
            let into = facing.dot(ray.direction);
            let onward = ray.direction - 2.0 * into * facing;
            assert_eq!(vector(&normal, lane), facing);
            assert_eq!(cosines[lane], into.abs());
            let expected = Ray::new(ray.at(met.leg_m[lane]), onward.normalize_or(facing));
            assert_eq!(rays.ray(lane), expected, "lane {lane}");
        }
    }

    #[test]
    fn what_has_no_direction_goes_along_the_normal() {
        let mut rays = Rays::NONE;
        let normal = [[0.0; TOGETHER], [0.0; TOGETHER], [1.0; TOGETHER]];
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
