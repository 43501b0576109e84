//! Tables of layouts and of HRTF sets: interpolation, energies.

use super::*;
use crate::generation::Hrtf;
use crate::generation::synthetic_hrtf;

#[test]
fn unrequested_groups_are_zero_and_the_others_unchanged() {
    let hrtf = Hrtf::parse(&synthetic_hrtf::bytes(44_100), "synthetic").unwrap();
    let set = hrtf.table();
    let groups = set.groups();
    let direction = Vec3::new(0.3, 0.2, -0.9);
    let (mut all, mut few) = (
        vec![F32x8::ZERO; 2 * groups],
        vec![F32x8::splat(9.0); 2 * groups],
    );
    let delays = set.look_up(direction, &mut all);
    for requested in 0..=groups {
        assert_eq!(set.blend(&set.find(direction), requested, &mut few), delays);
        for (n, (few, all)) in few.iter().zip(&all).enumerate() {
            let is_requested = n % groups < requested;
            assert_eq!(*few, if is_requested { *all } else { F32x8::ZERO });
        }
    }
}

#[test]
fn weights_are_the_weighted_sum_of_the_grid_points() {
    let point = |n: usize| -> Vec<F32x8> {
        let lane = |i: usize| ((17 * n + i) as f32 * 0.7).sin();
        (0..2)
            .map(|group| F32x8(std::array::from_fn(|i| lane(8 * group + i))))
            .collect()
    };
    let points: [Vec<F32x8>; 4] = std::array::from_fn(point);
    let grid = points.each_ref().map(Vec::as_slice);
    let shares = [0.1, 0.2, 0.3, 0.4];
    let with = |set: LaneSet| {
        let mut weights = [F32x8::ZERO; 2];
        blend_weights(set, &grid, &shares, &mut weights);
        weights
    };
    for set in LaneSet::vector_units() {
        assert_eq!(with(set), with(LaneSet::Fused), "{set:?}");
    }
    for found in [with(LaneSet::best()), with(LaneSet::Portable)] {
        for (group, found) in found.iter().enumerate() {
            for lane in 0..8 {
                let each = grid.iter().zip(shares);
                let exact: f64 = each
                    .map(|(point, share)| f64::from(point[group].0[lane]) * f64::from(share))
                    .sum();
                // Seven roundings of sums below one.
                let bound = 7.0 * f64::from(f32::EPSILON / 2.0);
                assert!((f64::from(found.0[lane]) - exact).abs() < bound);
            }
        }
    }
}

/// The energy of a reading is the double sum over its weights and the products of their filters.
#[test]
fn quadratic_forms_are_double_sums() {
    let value = |n: usize| ((n * 37 + 11) % 101) as f32 / 101.0 - 0.4;
    let block = |n: usize| F32x8(std::array::from_fn(|lane| value(LANES * n + lane)));
    for groups in 1..=3 {
        let reading: Vec<F32x8> = (0..groups).map(|n| block(n + 50)).collect();
        let products: Vec<F32x8> = (0..LANES * groups * groups).map(block).collect();
        let with = |set: LaneSet| {
            let mut sums = F32x8::ZERO;
            quadratic(set, &products, &reading, &mut sums);
            sums
        };
        for set in LaneSet::vector_units() {
            assert_eq!(with(set), with(LaneSet::Fused), "{set:?}");
        }
        let weight = |n: usize| f64::from(reading[n / LANES].0[n % LANES]);
        let product = |a: usize, b: usize| {
            let row = &products[groups * a..][..groups];
            f64::from(row[b / LANES].0[b % LANES])
        };
        let all = 0..LANES * groups;
        let pairs = all.clone().flat_map(|a| all.clone().map(move |b| (a, b)));
        let exact: f64 = pairs
            .map(|(a, b)| weight(a) * product(a, b) * weight(b))
            .sum();
        for found in [with(LaneSet::best()), with(LaneSet::Portable)] {
            // 576 roundings of sums below a hundred.
            let error = (f64::from(found.sum()) - exact).abs();
            assert!(
                error < 576.0 * 100.0 * f64::from(f32::EPSILON / 2.0),
                "{error}"
            );
        }
    }
}

/// Directions all around, none of them a grid point.
fn directions() -> impl Iterator<Item = Vec3> {
    (0..2000).map(|n| {
        let up = 1.0 - (2 * n + 1) as f32 / 2000.0;
        let across = (1.0 - up * up).sqrt();
        let (sin, cos) = (2.399_963_2 * n as f32).sin_cos();
        Vec3::new(across * cos, up, across * sin)
    })
}

fn gains(table: &DirectionTable, direction: Vec3) -> Vec<f32> {
    let mut weights = vec![F32x8::ZERO; table.width()];
    assert_eq!(table.look_up(direction, &mut weights), [0.0; 2]);
    weights.iter().flat_map(|group| group.0).collect()
}

#[test]
fn every_layout_has_the_energy_of_two_ears_in_every_direction() {
    for layout in Layout::ALL
        .into_iter()
        .filter(|&layout| layout != Layout::Binaural)
    {
        for channels in [layout.channels(), 16] {
            let table = DirectionTable::of_layout(layout, channels);
            for direction in directions() {
                let gains = gains(&table, direction);
                let counted = match layout.ambisonics_order() {
                    Some(_) => &gains[..1],
                    None => &gains[..],
                };
                let energy: f32 = counted.iter().map(|gain| gain * gain).sum();
                // Between grid points of a step h two gains have a sum of squares down by h² / 8 times their slopes' squares:
                // largest where 30 degrees separate two loudspeakers, and by a root's slope where energy folds.
                assert!(
                    (0.98..1.01).contains(&(0.5 * energy)),
                    "{layout} {direction}: {energy}"
                );
            }
        }
    }
}

#[test]
fn interpolated_harmonics_are_within_the_bound_of_the_grid() {
    let table = DirectionTable::of_layout(Layout::Ambisonics3, 16);
    for direction in directions() {
        let exact = ambisonics::harmonics(direction);
        for (found, exact) in gains(&table, direction).iter().zip(exact) {
            // See AZIMUTHS; both axes of the grid.
            assert!(
                (found / CHANNEL_GAIN - exact).abs() < 2.0 * 0.002,
                "{direction}"
            );
        }
    }
}

#[test]
fn mono_sounds_from_both_of_two_channels() {
    let one = gains(&DirectionTable::of_layout(Layout::Mono, 1), Vec3::X);
    let two = gains(&DirectionTable::of_layout(Layout::Mono, 2), Vec3::X);
    assert!((one[0] - SQRT_2).abs() < 1e-5 && one[1] == 0.0);
    assert!((two[0] - 1.0).abs() < 1e-5 && (two[1] - 1.0).abs() < 1e-5 && two[2] == 0.0);
}
