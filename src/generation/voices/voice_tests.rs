//! The mixing kernel against a slow specification.

use super::*;
use crate::generation::delay::delay_line::band_index;
use crate::simd::f16x8::{decoded, encoded};

/// Deterministic distinct values within ±1.
fn draw(n: usize) -> f32 {
    ((n * n) as f32 * 0.37 + n as f32).sin()
}

fn tiles(count: usize) -> Vec<Tile> {
    let tile = |t: usize| {
        std::array::from_fn(|band| {
            F16x8(std::array::from_fn(|frame| {
                encoded(draw(8 * (8 * t + band) + frame))
            }))
        })
    };
    (0..count).map(tile).collect()
}

fn value(tiles: &[Tile], index: usize, band: usize) -> f64 {
    f64::from(decoded(
        tiles[index / TILE][band_index(band)].0[index % TILE],
    ))
}

fn gains(to_come: i64) -> RampedGains {
    RampedGains {
        gain: F32x8(std::array::from_fn(|band| draw(1000 + band))),
        growth: F32x8(std::array::from_fn(|band| 1e-3 * draw(2000 + band))),
        to_come,
    }
}

/// Ramp ends before, at, within and beyond the tiles.
const ENDS: [i64; 8] = [-5, 0, 1, 8, 13, 24, 40, 1000];

#[test]
fn a_mixture_is_the_sum_of_bands_with_gains_constant_after_the_ramp() {
    let tiles = tiles(5);
    for to_come in ENDS {
        let gains = gains(to_come);
        let mut found = [f32::NAN; 5 * TILE];
        mix(LaneSet::best(), &tiles, &gains, &mut found);
        for (index, found) in found.into_iter().enumerate() {
            let left = (to_come - index as i64).max(0) as f64;
            let exact: f64 = (0..BANDS)
                .map(|band| {
                    let gain =
                        f64::from(gains.gain.0[band]) - f64::from(gains.growth.0[band]) * left;
                    gain * value(&tiles, index, band)
                })
                .sum();
            // Seventeen roundings of sums below 8 by the gains and 8 by the ramp of at most 1000 steps of 1e-3.
            let bound = 17.0 * 16.0 * f64::from(f32::EPSILON) / 2.0;
            assert!(
                (f64::from(found) - exact).abs() < bound,
                "{to_come} {index}"
            );
        }
    }
}

#[test]
fn instruction_sets_agree() {
    let tiles = tiles(7);
    for to_come in ENDS {
        let gains = gains(to_come);
        let [mut specified, mut portable] = [[0.0; 7 * TILE]; 2];
        mix(LaneSet::Fused, &tiles, &gains, &mut specified);
        mix(LaneSet::Portable, &tiles, &gains, &mut portable);
        for set in LaneSet::vector_units() {
            let mut found = [0.0; 7 * TILE];
            mix(set, &tiles, &gains, &mut found);
            assert_eq!(found, specified, "{set:?}");
        }
        for (a, b) in portable.iter().zip(specified) {
            // Seventeen products of up to 8 that are rounded before they are added.
            assert!((a - b).abs() < 17.0 * 8.0 * f32::EPSILON / 2.0, "{to_come}");
        }
    }
}

#[test]
fn a_ramp_in_parts_equals_the_whole_ramp() {
    // The ring's end splits the tiles; the second part resumes after the first.
    let tiles = tiles(6);
    let (mut whole, mut parts) = ([0.0; 6 * TILE], [0.0; 6 * TILE]);
    let set = LaneSet::best();
    mix(set, &tiles, &gains(29), &mut whole);
    mix(set, &tiles[..2], &gains(29), &mut parts[..2 * TILE]);
    mix(
        set,
        &tiles[2..],
        &gains(29 - 2 * TILE as i64),
        &mut parts[2 * TILE..],
    );
    assert_eq!(whole, parts);
}

#[test]
fn held_gains_are_those_of_the_middle_of_a_stretch() {
    let (tiles, passed) = (tiles(14), 3);
    for to_come in ENDS {
        let gains = gains(to_come);
        let mut found = [f32::NAN; 14 * TILE];
        mix_held(LaneSet::best(), &tiles, &gains, passed, &mut found);
        for (index, found) in found.into_iter().enumerate() {
            let stretch = (index + passed * TILE) / 64;
            let middle = (64 * stretch) as f64 + 31.5 - (passed * TILE) as f64;
            let left = (to_come as f64 - middle).max(0.0);
            let exact: f64 = (0..BANDS)
                .map(|band| {
                    let gain =
                        f64::from(gains.gain.0[band]) - f64::from(gains.growth.0[band]) * left;
                    gain * value(&tiles, index, band)
                })
                .sum();
            // As of a mixture whose gains grow.
            let bound = 17.0 * 16.0 * f64::from(f32::EPSILON) / 2.0;
            assert!(
                (f64::from(found) - exact).abs() < bound,
                "{to_come} {index}"
            );
        }
        // A part that begins in another stretch has the same gains.
        let mut parts = [0.0; 14 * TILE];
        let set = LaneSet::best();
        mix_held(set, &tiles[..6], &gains, passed, &mut parts[..6 * TILE]);
        let later = self::gains(to_come - 6 * TILE as i64);
        mix_held(set, &tiles[6..], &later, 1, &mut parts[6 * TILE..]);
        assert_eq!(found, parts, "{to_come}");
    }
}
