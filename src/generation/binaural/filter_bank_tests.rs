//! What buses and their filters do, and the kernels against a slow specification.

use super::*;
use crate::generation::synthetic_hrtf;

fn with_silence(one: Contribution) -> [Contribution; TOGETHER] {
    let mut all = [Contribution::silence(one.signal.len(), F32x8::ZERO); TOGETHER];
    all[1] = one;
    all
}

#[test]
fn weights_before_the_filters_are_weights_after_them() {
    let hrtf = Hrtf::parse(&synthetic_hrtf::bytes(48_000), "synthetic").unwrap();
    let mut binaural = Binaural::new(&hrtf);
    let weights = F32x8([0.5, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let mut impulse = [0.0; CHUNK];
    impulse[0] = 1.0;
    let impulse = Contribution {
        signal: &impulse,
        target: weights,
        growth: F32x8::ZERO,
    };
    binaural.add(1, 0, &with_silence(impulse), None);
    let (mut left, mut right) = ([1.0; CHUNK], [1.0; CHUNK]);
    binaural.finish([&mut left, &mut right]);
    assert_eq!(left, [0.0; CHUNK]);
    for (tap, value) in right.iter().enumerate() {
        let basis = hrtf.basis(0).get(tap).copied().unwrap_or_default();
        assert!((value - (0.5 * basis.0[0] - 2.0 * basis.0[1])).abs() < 1e-7);
    }
}

#[test]
fn odd_chunks_filter_like_even_ones() {
    let hrtf = Hrtf::parse(&synthetic_hrtf::bytes(48_000), "synthetic").unwrap();
    let signal: Vec<f32> = (0..600).map(|i| ((i * i) as f32 * 0.37).sin()).collect();
    let mut results = Vec::new();
    for size in [128, 1, 7, 127] {
        let mut binaural = Binaural::new(&hrtf);
        let mut whole = Vec::new();
        for part in signal.chunks(size) {
            let contribution = Contribution {
                signal: part,
                target: F32x8::splat(0.7),
                growth: F32x8::ZERO,
            };
            binaural.add(0, 0, &with_silence(contribution), None);
            let (mut left, mut right) = (vec![0.0; part.len()], vec![0.0; part.len()]);
            binaural.finish([&mut left, &mut right]);
            whole.extend(left);
        }
        results.push(whole);
    }
    for other in &results[1..] {
        assert_eq!(&results[0], other);
    }
}

/// Whole numbers' sines: bounded by one, no two alike.
fn draw(n: usize) -> f32 {
    ((n * n) as f32 * 0.37 + n as f32).sin()
}

fn lanes(n: usize, scale: f32) -> F32x8 {
    F32x8(std::array::from_fn(|lane| scale * draw(8 * n + lane)))
}

/// Signals and their weights.
fn arrivals(signals: &[Vec<f32>; TOGETHER], growth: f32) -> [Contribution<'_>; TOGETHER] {
    std::array::from_fn(|n| Contribution {
        signal: &signals[n],
        target: lanes(n, 1.0),
        growth: lanes(100 + n, growth),
    })
}

fn signals(frames: usize) -> [Vec<f32>; TOGETHER] {
    std::array::from_fn(|n| (0..frames).map(|i| draw(999 * n + i)).collect())
}

/// Two groups that are not alike.
fn bus(frames: usize) -> Vec<Pair> {
    let both = |frame| [lanes(5000 + frame, 1.0), lanes(9000 + frame, 1.0)];
    (0..frames).map(both).collect()
}

/// The same arrivals for both groups of a pair.
fn paired<'a>(one: [Contribution<'a>; TOGETHER]) -> [Contribution<'a, Pair>; TOGETHER] {
    one.map(|one| Contribution {
        signal: one.signal,
        target: [one.target, one.target + one.target],
        growth: [one.growth, one.growth + one.growth],
    })
}

#[test]
fn every_arrival_is_added_at_weights_that_are_held_for_a_stretch_of_the_ramp() {
    // Within a run of steady growth, at its end, and beyond; at the ramp's end and before.
    for (hold, frames) in [
        (1, 1),
        (1, RUN as usize - 1),
        (1, RUN as usize),
        (1, RUN as usize + 1),
        (1, CHUNK),
        (8, 1),
        (8, 7),
        (8, 64),
        (8, CHUNK),
        (CHUNK as u32, CHUNK),
    ] {
        for more in [0, 3, 8, 500] {
            let growth = if hold < CHUNK as u32 { 1e-3 } else { 0.0 };
            let signals = signals(frames);
            let arrivals = arrivals(&signals, growth);
            let left = frames as u32 + more;
            let mut found = bus(frames);
            let ramp = Ramp { left, hold };
            add_arrivals(LaneSet::best(), &mut found, 1, &arrivals, ramp);
            for (frame, (found, before)) in found.iter().zip(bus(frames)).enumerate() {
                assert_eq!(found[0], before[0]);
                let (found, before) = (found[1], before[1]);
                let to_come = left - 1 - frame as u32;
                let middle = f64::from(to_come / hold * hold) + 0.5 * f64::from(hold - 1);
                // What is held is the line's value no further away than half a stretch.
                assert!((middle - f64::from(to_come)).abs() <= 0.5 * f64::from(hold - 1));
                for lane in 0..8 {
                    let mut exact = f64::from(before.0[lane]);
                    for one in &arrivals {
                        let growth = f64::from(one.growth.0[lane]) * middle;
                        let weight = f64::from(one.target.0[lane]) - growth;
                        exact += weight * f64::from(one.signal[frame]);
                    }
                    // Eight sums below 15, and each weight within RUN roundings of one below 1.8.
                    let bound = f64::from(f32::EPSILON) * (8.0 * 15.0 + 8.0 * 32.0 * 1.8);
                    let error = (f64::from(found.0[lane]) - exact).abs();
                    assert!(error < bound, "{hold} {frames} {more} {frame}: {error}");
                }
            }
        }
    }
}

/// A tap of two filters that are not alike.
fn basis_tap(tap: usize) -> Pair {
    [lanes(700 + tap, 0.2), lanes(tap, 0.2)]
}

#[test]
fn a_filtered_bus_is_its_convolution() {
    let taps = 37;
    let basis: Vec<Pair> = (0..taps).map(basis_tap).collect();
    for frames in [1, 3, 4, 6, 64] {
        let bus = bus(taps - 1 + frames);
        let before = lanes(77, 1.0);
        let mut found = vec![[before, F32x8::ZERO]; frames];
        filter(LaneSet::best(), &basis, &bus, 1, &mut found);
        for (frame, [found, other]) in found.iter().enumerate() {
            assert_eq!(*other, F32x8::ZERO);
            for lane in 0..8 {
                let mut exact = f64::from(before.0[lane]);
                for (tap, basis) in basis.iter().enumerate() {
                    let at = taps - 1 + frame - tap;
                    exact += f64::from(basis[1].0[lane]) * f64::from(bus[at][1].0[lane]);
                }
                // One rounding a tap of sums below 0.2 a tap and 1.
                let bound = f64::from(f32::EPSILON / 2.0) * 38.0 * (0.2 * 37.0 + 1.0);
                let error = (f64::from(found.0[lane]) - exact).abs();
                assert!(error < bound, "{frames} {frame}: {error}");
            }
        }
    }
}

#[test]
fn instruction_sets_add_and_filter_alike() {
    let signals = signals(CHUNK);
    let basis: Vec<Pair> = (0..20).map(basis_tap).collect();
    let heard = |set: LaneSet| {
        let mut bus = bus(CHUNK);
        for (hold, growth) in [(CHUNK as u32, 0.0), (1, 1e-3), (8, 1e-3)] {
            let left = CHUNK as u32 + 20 * u32::from(growth > 0.0);
            let ramp = Ramp { left, hold };
            let arrivals = arrivals(&signals, growth);
            let both = paired(arrivals);
            let of = |group: usize| {
                both.map(|one| Contribution {
                    signal: one.signal,
                    target: one.target[group],
                    growth: one.growth[group],
                })
            };
            let mut other = bus.clone();
            add_arrivals(set, &mut bus, 0, &of(0), ramp);
            add_arrivals(set, &mut bus, 1, &of(1), ramp);
            add_arrivals_to_pair(set, &mut other, &both, ramp);
            assert_eq!(bus, other, "{set:?}");
        }
        let mut out = vec![[F32x8::ZERO; 2]; CHUNK - 19];
        let mut of_each = out.clone();
        filter_pair(set, &basis, &bus, &mut out);
        filter(set, &basis, &bus, 0, &mut of_each);
        filter(set, &basis, &bus, 1, &mut of_each);
        let sum = out.iter().map(|[a, b]| *a + *b);
        let sum: Vec<F32x8> = sum.collect();
        let of_each: Vec<F32x8> = of_each.iter().map(|[sum, _]| *sum).collect();
        assert_eq!(sum, of_each, "{set:?}");
        sum
    };
    let specified = heard(LaneSet::Fused);
    for set in LaneSet::vector_units() {
        assert_eq!(heard(set), specified, "{set:?}");
    }
    let portable = heard(LaneSet::Portable);
    for (a, b) in portable.iter().zip(&specified) {
        for (a, b) in a.0.iter().zip(b.0) {
            // Two groups, the second at twice the weights: 24 products below 4 a frame, and 20 frames of up to 100 at 0.2.
            assert!((a - b).abs() < f32::EPSILON * 2.0 * 20.0 * 0.2 * (24.0 * 4.0 + 100.0));
        }
    }
}
