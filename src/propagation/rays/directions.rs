//! Directions of guide and source rays, the same in every run.
//!
//! Guide rays: a spherical Fibonacci lattice (\[KEINERT15\]), turned by one of sixteen fixed rotations. Sixteen updates
//! together sample as densely as one with sixteen times the rays. Source rays: sixteen interleaved lattices, which together are
//! as even as one with sixteen times the rays, all turned by one rotation.

use glam::{Mat3, Quat, Vec3};

/// Number of rotations after which ray directions repeat.
pub const ROTATIONS: u64 = 16;

/// 2⁶⁴ divided by the golden ratio, odd: the multiplier of hashes (Fibonacci hashing) and the step of SplitMix64.
pub(crate) const GOLDEN_RATIO_64: u64 = 0x9e37_79b9_7f4a_7c15;

/// Turns between neighbours in a spherical Fibonacci lattice: 1 / golden ratio².
pub(crate) const GOLDEN_TURN: f64 = 0.381_966_011_250_105_1;

/// Unit vector `index` of `count`, evenly spread over the sphere.
pub fn fibonacci_direction(index: u32, count: u32) -> Vec3 {
    // Reduced in f64 to keep the precision of large indices.
    let turns = (f64::from(index) * GOLDEN_TURN).fract();
    direction_at((f64::from(index) + 0.5) / f64::from(count), turns)
}

/// The unit vector below so many parts of the sphere's area, at an azimuth in turns.
fn direction_at(area: f64, turns: f64) -> Vec3 {
    let height = 1.0 - 2.0 * area;
    let radius = (1.0 - height * height).max(0.0).sqrt();
    let angle = std::f64::consts::TAU * turns;
    Vec3::new(
        (radius * angle.cos()) as f32,
        height as f32,
        (radius * angle.sin()) as f32,
    )
}

/// `count` unit vectors, evenly spread over the sphere.
pub fn lattice(count: u32) -> Vec<Vec3> {
    let mut directions = Vec::new();
    fill_lattice(&mut directions, count);
    directions
}

/// [`lattice`] into existing memory; allocates only if it is too small.
pub fn fill_lattice(directions: &mut Vec<Vec3>, count: u32) {
    directions.clear();
    directions.extend((0..count).map(|i| fibonacci_direction(i, count)));
}

/// Parts of each period of a lattice that interleaved ones are shifted by.
pub(crate) const INTERLEAVED_PARTS: u32 = 4;

// Each shift once.
const _: () = assert!((INTERLEAVED_PARTS * INTERLEAVED_PARTS) as u64 == ROTATIONS);

/// Shifts of a rotation's lattice in parts of both periods: from one point to the next, and around. Of any first few rotations each is
/// far from the others.
pub(crate) fn interleaved_shift(rotation: u64) -> [u32; 2] {
    let bit = |number: u32| (rotation >> number & 1) as u32;
    [2 * bit(0) + bit(2), 2 * bit(1) + bit(3)]
}

/// `count` unit vectors, evenly spread over the sphere, for each of [`ROTATIONS`]: all together are as even as one lattice
/// (`interleaved_shift`). Into existing memory; allocates only if it is too small.
pub fn fill_interleaved_lattices(directions: &mut Vec<Vec3>, count: u32) {
    let parts = f64::from(INTERLEAVED_PARTS);
    directions.clear();
    for rotation in 0..ROTATIONS {
        let [along, around] = interleaved_shift(rotation).map(|shift| f64::from(shift) / parts);
        directions.extend((0..count).map(|index| {
            let index = f64::from(index) + along;
            let area = (index + 0.5 / parts) / f64::from(count);
            direction_at(area, (index * GOLDEN_TURN + around).fract())
        }));
    }
}

/// [`fill_interleaved_lattices`] into new memory.
pub fn interleaved_lattices(count: u32) -> Vec<Vec3> {
    let mut directions = Vec::new();
    fill_interleaved_lattices(&mut directions, count);
    directions
}

/// The one of [`interleaved_lattices`] of a rotation modulo [`ROTATIONS`].
pub fn lattice_of(directions: &[Vec3], rotation: u64) -> &[Vec3] {
    let count = directions.len() / ROTATIONS as usize;
    &directions[(rotation % ROTATIONS) as usize * count..][..count]
}

/// Rotation number `update` modulo [`ROTATIONS`]: uniform over all rotations by Shoemake's map of an R3 low-discrepancy
/// sequence (\[ROBERTS18\]), shifted by `seed`.
pub fn rotation(update: u64, seed: u64) -> Mat3 {
    // Powers of 1 / 1.2207440846, the three-dimensional analogue of the plastic constant.
    const STEP: [f64; 3] = [
        0.819_172_513_396_164_5,
        0.671_043_606_703_789_2,
        0.549_700_477_901_970_3,
    ];
    let n = (update % ROTATIONS) as f64 + 1.0;
    let shift = |k: u64| unit(mix(seed.wrapping_mul(3).wrapping_add(k)));
    let u = [0, 1, 2].map(|k| (n * STEP[k] + f64::from(shift(k as u64))).fract() as f32);
    let (a, b) = ((1.0 - u[0]).sqrt(), u[0].sqrt());
    let (s, t) = (std::f32::consts::TAU * u[1], std::f32::consts::TAU * u[2]);
    Mat3::from_quat(Quat::from_xyzw(a * s.sin(), a * s.cos(), b * t.sin(), b * t.cos()).normalize())
}

/// A 64-bit hash of a counter (SplitMix64's finaliser, \[STEELE14\]).
#[inline]
pub fn mix(counter: u64) -> u64 {
    let mut z = counter.wrapping_add(GOLDEN_RATIO_64);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number from 0 to below 1, from the 24 high bits.
#[inline]
pub fn unit(bits: u64) -> f32 {
    // Vector lanes convert signed 32-bit integers.
    (bits >> 40) as i32 as f32 * (1.0 / 16_777_216.0)
}

/// A unit vector about the unit vector `normal` with density proportional to the cosine (Lambert), from two uniform numbers
/// in 0 … 1.
pub fn lambert_direction(normal: Vec3, u: f32, v: f32) -> Vec3 {
    // A uniform point of the unit sphere added to the normal is cosine distributed.
    let z = 1.0 - 2.0 * u;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let angle = std::f32::consts::TAU * v;
    let sum = normal + Vec3::new(r * angle.cos(), z, r * angle.sin());
    sum.try_normalize().unwrap_or(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_unit_and_balanced() {
        let mut sum = Vec3::ZERO;
        for i in 0..1024 {
            let d = fibonacci_direction(i, 1024);
            assert!((d.length() - 1.0).abs() < 1e-6);
            sum += d;
        }
        assert!(sum.length() < 2.0, "{sum}");
    }

    /// The nearest other direction of all rotations is as far as in one lattice of as many points; of independently turned lattices
    /// it is on average half as far.
    #[test]
    fn interleaved_lattices_are_one_even_lattice() {
        let count = 128;
        let nearest = |all: &[Vec3]| -> f32 {
            let of_others = |own: &Vec3| {
                let others = all.iter().filter(|other| *other != own);
                let distances = others.map(|other| other.distance(*own));
                distances.fold(f32::INFINITY, f32::min)
            };
            all.iter().map(of_others).sum::<f32>() / all.len() as f32
        };
        let together = interleaved_lattices(count);
        let one = lattice(count * ROTATIONS as u32);
        assert!(nearest(&together) > 0.9 * nearest(&one));
        let own = lattice_of(&together, 5);
        assert_eq!(own.len(), count as usize);
        assert!(nearest(own) > 0.9 * nearest(&lattice(count)));
    }

    #[test]
    fn rotations_differ_and_return_after_sixteen() {
        for a in 0..ROTATIONS {
            assert_eq!(rotation(a, 7), rotation(a + ROTATIONS, 7));
            assert!((rotation(a, 7).determinant() - 1.0).abs() < 1e-5);
            for b in 0..a {
                assert!((rotation(a, 7) * Vec3::X).distance(rotation(b, 7) * Vec3::X) > 1e-3);
            }
        }
        assert_ne!(rotation(0, 7), rotation(0, 8));
    }

    #[test]
    fn lambert_has_the_mean_cosine_two_thirds() {
        let n = 40_000u64;
        let mean: f64 = (0..n)
            .map(|i| {
                let d = lambert_direction(Vec3::Y, unit(mix(2 * i)), unit(mix(2 * i + 1)));
                f64::from(d.y) / n as f64
            })
            .sum();
        // Standard error 0.236 / 200 = 0.0012; four of them.
        assert!((mean - 2.0 / 3.0).abs() < 0.005, "{mean}");
    }
}
