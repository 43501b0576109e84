//! Rates of weight ramps against the exact line.

use super::*;
use crate::simd::F32x8;

/// Deterministic distinct values within ±1.
fn draw(n: usize) -> f32 {
    ((n * n) as f32 * 0.37 + n as f32).sin()
}

fn weights(n: usize, scale: f32) -> [F32x8; 4] {
    std::array::from_fn(|group| {
        F32x8(std::array::from_fn(|lane| {
            scale * draw(100 * n + 8 * group + lane)
        }))
    })
}

fn size(lanes: impl Iterator<Item = f64>) -> f64 {
    lanes.map(|lane| lane * lane).sum::<f64>().sqrt()
}

#[test]
fn weights_are_held_only_within_the_error_bound() {
    let mut counts = [0; 4];
    for n in 0..60 {
        // Changes from zero to the size of the weights, in ramps of one to three blocks.
        let change = if n % 6 == 0 {
            0.0
        } else {
            0.002 * 1.12f32.powi(n as i32)
        };
        let (mut target, mut growth) = (weights(n, 0.7), [F32x8::ZERO; 4]);
        let shift = weights(200 + n, 0.7 * change);
        let wanted: [F32x8; 4] = std::array::from_fn(|group| target[group] + shift[group]);
        let mut ramped = Weights {
            target: &mut target,
            growth: &mut growth,
        };
        let ramp = 256 * (1 + n as u32 % 3);
        let rate = ramped.retarget(LaneSet::best(), &wanted, 0, ramp);
        counts[rate as usize] += 1;
        let Some(Ramp { left, hold }) = rate.ramp(ramp) else {
            assert_eq!(growth, [F32x8::ZERO; 4]);
            continue;
        };
        let lanes = |of: &[F32x8; 4]| {
            of.iter()
                .flat_map(|l| l.0)
                .map(f64::from)
                .collect::<Vec<_>>()
        };
        let (target, growth) = (lanes(&target), lanes(&growth));
        let all = size(target.iter().copied());
        for to_come in 0..left {
            let middle = f64::from(to_come / hold * hold) + 0.5 * f64::from(hold - 1);
            let off = size(growth.iter().map(|g| g * (middle - f64::from(to_come))));
            // The bound, and rounding of the decision.
            assert!(off <= 1e-3 * all * (1.0 + 1e-5), "{n}: {off} of {all}");
        }
        assert_eq!(hold > 1, rate != RampRate::Fast);
    }
    // Every rate occurs.
    assert!(counts.iter().all(|&times| times >= 5), "{counts:?}");
}

#[test]
fn a_finished_ramp_is_none() {
    for rate in [
        RampRate::Constant,
        RampRate::Slow,
        RampRate::Moderate,
        RampRate::Fast,
    ] {
        assert!(rate.ramp(0).is_none());
    }
}
