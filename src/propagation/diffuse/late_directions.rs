//! Directions from which late energy arrives.
//!
//! Own. Directions of energy are summed as spherical moments to the second order: nine numbers, and sums of them are exact, which no
//! division between a few fixed directions is. Groups have the mean of all sources' energy. Its shares from
//! [`LATE_DIRECTION_VECTORS`] have the same moments if shares that are not negative can have them.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};
use crate::propagation::late_group::{
    LATE_DIRECTION_VECTORS, LATE_DIRECTIONS, LATE_GROUPS, LateGroup,
};

/// Number of moments: of the order 0, 1 and 2.
pub(crate) const MOMENTS: usize = 9;

/// Most corrections of shares. After three in which some are negative they hardly change.
const ROUNDS: usize = 4;

/// Moments of a group of directions in eight bands.
pub(crate) type Moments = [BandArray; MOMENTS];

/// Moments of the energy that arrives from one source, for each group.
pub type LateDirections = [Moments; LATE_GROUPS];

/// Moments of a unit vector: real spherical harmonics whose mean square over the sphere is 1.
pub(crate) fn moments(towards: Vec3) -> [f32; MOMENTS] {
    let Vec3 { x, y, z } = towards;
    let (first, second) = (3f32.sqrt(), 15f32.sqrt());
    [
        1.0,
        first * x,
        first * y,
        first * z,
        second * x * y,
        second * y * z,
        second * x * z,
        0.5 * 5f32.sqrt() * (3.0 * z * z - 1.0),
        0.5 * second * (x * x - y * y),
    ]
}

/// Gives groups the directions of the energy of all sources together; without energy all directions have the same share.
pub fn set_directions<'a>(
    groups: &mut [LateGroup; LATE_GROUPS],
    sources: impl Iterator<Item = &'a LateDirections>,
) {
    let mut sums = LateDirections::default();
    for source in sources {
        let energies = source.as_flattened().iter();
        for (sum, energy) in sums.as_flattened_mut().iter_mut().zip(energies) {
            for b in 0..BANDS {
                sum[b] += energy[b];
            }
        }
    }
    let vectors = LATE_DIRECTION_VECTORS.map(moments);
    for (group, sums) in groups.iter_mut().zip(&mut sums) {
        let total = sums[0];
        for sum in sums.iter_mut() {
            for b in 0..BANDS {
                sum[b] = match total[b] > f32::MIN_POSITIVE {
                    true => sum[b] / total[b],
                    false => 0.0,
                };
            }
        }
        sums[0] = [1.0; BANDS];
        group.directions = shares_of(sums, &vectors);
    }
}

/// Shares with these moments: the nearest ones by turns with all shares of these moments and with those that are not negative.
fn shares_of(
    wanted: &Moments,
    vectors: &[[f32; MOMENTS]; LATE_DIRECTIONS],
) -> [BandArray; LATE_DIRECTIONS] {
    let mut shares = [[0.0; BANDS]; LATE_DIRECTIONS];
    let mut missing = *wanted;
    for _ in 0..ROUNDS {
        let mut is_negative = false;
        for (share, vector) in shares.iter_mut().zip(vectors) {
            for (moment, missing) in vector.iter().zip(&missing) {
                for b in 0..BANDS {
                    share[b] += moment * missing[b] / LATE_DIRECTIONS as f32;
                }
            }
            for value in share {
                is_negative |= *value < 0.0;
                *value = value.max(0.0);
            }
        }
        if !is_negative {
            break;
        }
        missing = *wanted;
        for (share, vector) in shares.iter().zip(vectors) {
            for (moment, missing) in vector.iter().zip(&mut missing) {
                for b in 0..BANDS {
                    missing[b] -= moment * share[b];
                }
            }
        }
    }
    let mut total = [0.0; BANDS];
    for share in &shares {
        for b in 0..BANDS {
            total[b] += share[b];
        }
    }
    for share in &mut shares {
        for b in 0..BANDS {
            share[b] /= total[b];
        }
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Groups whose directions are those of arrivals, all bands alike.
    fn directions_of(arrivals: &[(Vec3, f32)]) -> [f32; LATE_DIRECTIONS] {
        let mut source = LateDirections::default();
        for (towards, energy) in arrivals {
            for (sum, moment) in source[1].iter_mut().zip(moments(*towards)) {
                for value in sum {
                    *value += moment * energy;
                }
            }
        }
        let mut groups = [LateGroup::default(); LATE_GROUPS];
        set_directions(&mut groups, [source].iter());
        groups[1].directions.map(|share| share[4])
    }

    fn mean_and_squares(shares: &[(Vec3, f32)]) -> (Vec3, Vec3) {
        let mean = shares.iter().map(|(v, share)| *v * *share).sum();
        let squares = shares.iter().map(|(v, share)| *v * *v * *share).sum();
        (mean, squares)
    }

    #[test]
    fn shares_keep_mean_direction_and_squares_of_a_broad_field() {
        // Half from all sides, half from the horizon and there more from one side.
        let mut arrivals: Vec<(Vec3, f32)> = (0..36)
            .map(|n| {
                let angle = f32::to_radians(10.0 * n as f32);
                let towards = Vec3::new(angle.cos(), 0.0, angle.sin());
                (towards, 0.5 * (1.0 + 0.5 * angle.cos()) / 36.0)
            })
            .collect();
        arrivals.extend(LATE_DIRECTION_VECTORS.map(|v| (v, 0.5 / LATE_DIRECTIONS as f32)));
        let shares = directions_of(&arrivals);
        let found: Vec<_> = LATE_DIRECTION_VECTORS.into_iter().zip(shares).collect();
        let (found, wanted) = (mean_and_squares(&found), mean_and_squares(&arrivals));
        assert!(found.0.distance(wanted.0) < 1e-5, "{found:?} {wanted:?}");
        assert!(found.1.distance(wanted.1) < 1e-5, "{found:?} {wanted:?}");
    }

    #[test]
    fn a_plane_wave_comes_from_around_its_direction() {
        for towards in [Vec3::X, Vec3::new(0.6, -0.48, 0.64)] {
            let shares = directions_of(&[(towards, 3.0)]);
            let sum: f32 = shares.iter().sum();
            let near: f32 = LATE_DIRECTION_VECTORS
                .iter()
                .zip(shares)
                .filter(|(v, _)| v.dot(towards) > 0.0)
                .map(|(_, share)| share)
                .sum();
            assert!((sum - 1.0).abs() < 1e-5 && near > 0.85, "{sum} {near}");
        }
    }

    #[test]
    fn without_energy_all_directions_are_alike() {
        let mut groups = [LateGroup::default(); LATE_GROUPS];
        set_directions(&mut groups, [].iter());
        for share in groups
            .iter()
            .flat_map(|group| group.directions.as_flattened())
        {
            assert!(
                (share * LATE_DIRECTIONS as f32 - 1.0).abs() < 1e-6,
                "{share}"
            );
        }
    }
}
