//! Construction of the networks.

use super::*;
use crate::extrapolation::LATE_GROUPS;

#[test]
fn line_lengths_share_no_factor_within_and_between_groups() {
    for rate_hz in [16_000, 44_100, 48_000, 192_000] {
        let all: Vec<usize> = (0..LATE_GROUPS)
            .flat_map(|group| lengths(f64::from(rate_hz), group, LATE_GROUPS))
            .collect();
        for (i, a) in all.iter().enumerate() {
            assert!(all[i + 1..].iter().all(|b| b % a != 0 && a % b != 0));
        }
    }
}

#[test]
fn chunks_fit_into_every_line_at_every_rate() {
    for rate_hz in [16_000, 44_100, 48_000, 96_000, 192_000] {
        for group in 0..LATE_GROUPS {
            let network = Network::new(rate_hz, group, LATE_GROUPS);
            for (length, (left, _)) in network.lengths.into_iter().zip(network.entries) {
                assert!(length >= left + CHUNK, "{rate_hz}: {length} {left}");
            }
        }
    }
}

#[test]
fn the_sum_of_all_waves_takes_nearly_equal_parts_of_the_lines() {
    let parts = mix_frame(&balanced_signs());
    let kurtosis = parts.iter().map(|p| p.powi(4)).sum::<f32>() / LINES as f32;
    println!("{parts:?}: {kurtosis:.2}");
    // 3 for a normal distribution of the parts, 24 for a single line.
    assert!(kurtosis < 2.0, "{kurtosis}");
}

#[test]
fn scaled_addition_follows_its_definition() {
    let input: Vec<f32> = (0..CHUNK).map(|n| (n as f32).sin()).collect();
    for frames in [0, 1, 8, 13, CHUNK] {
        for set in [LaneSet::best(), LaneSet::Portable] {
            let mut output = vec![0.5; CHUNK];
            add_scaled(set, 0.3, &input[..frames], &mut output[..frames]);
            for (n, value) in output.iter().enumerate() {
                let added = if n < frames { 0.3 * input[n] } else { 0.0 };
                assert!((value - 0.5 - added).abs() < 2e-7);
            }
        }
    }
}
