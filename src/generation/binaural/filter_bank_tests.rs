//! The buses and their filters, and the kernels against a slow specification.

use super::*;
use crate::generation::synthetic_hrtf;

fn with_silence(one: Contribution) -> [Contribution; BATCH] {
    let mut all = [Contribution::silence(one.signal.len()); BATCH];
    all[1] = one;
    all
}

#[test]
fn weights_before_the_filters_equal_weights_after_them() {
    let hrtf = Hrtf::parse(&synthetic_hrtf::bytes(48_000), "synthetic").unwrap();
    let mut buses = OutputBuses::binaural(&hrtf);
    let weights = F32x8([0.5, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let mut impulse = [0.0; CHUNK];
    impulse[0] = 1.0;
    let impulse = Contribution {
        signal: &impulse,
        target: weights,
        growth: F32x8::ZERO,
    };
    buses.add(1, 0, &with_silence(impulse), None);
    let mut output = [0.0; 2 * CHUNK];
    buses.finish(&mut output, 2);
    for (tap, [left, value]) in output.as_chunks().0.iter().enumerate() {
        assert_eq!(*left, 0.0);
        let basis = hrtf.basis(0).get(tap).copied().unwrap_or_default();
        assert!((value - (0.5 * basis.0[0] - 2.0 * basis.0[1])).abs() < 1e-7);
    }
}

#[test]
fn filtering_does_not_depend_on_the_chunk_size() {
    let hrtf = Hrtf::parse(&synthetic_hrtf::bytes(48_000), "synthetic").unwrap();
    let signal: Vec<f32> = (0..600).map(|i| ((i * i) as f32 * 0.37).sin()).collect();
    let mut results = Vec::new();
    for size in [128, 1, 7, 127] {
        let mut buses = OutputBuses::binaural(&hrtf);
        let mut whole: Vec<f32> = Vec::new();
        for part in signal.chunks(size) {
            let contribution = Contribution {
                signal: part,
                target: F32x8::splat(0.7),
                growth: F32x8::ZERO,
            };
            buses.add(0, 0, &with_silence(contribution), None);
            let mut output = vec![0.0; 2 * part.len()];
            buses.finish(&mut output, 2);
            whole.extend(output.iter().step_by(2));
        }
        results.push(whole);
    }
    for other in &results[1..] {
        assert_eq!(&results[0], other);
    }
}

#[test]
fn lanes_of_a_layout_are_its_channels() {
    for (channels, stride) in [(2, 2), (12, 12), (12, 16)] {
        let mut buses = OutputBuses::of_channels(channels);
        let signal = [1.0, 2.0];
        for group in 0..channels.div_ceil(LANES) {
            let contribution = Contribution {
                signal: &signal,
                target: F32x8(std::array::from_fn(|lane| {
                    (1 + group * LANES + lane) as f32
                })),
                growth: F32x8::ZERO,
            };
            buses.add(0, group, &with_silence(contribution), None);
        }
        let mut output = vec![0.0; 2 * stride];
        buses.finish(&mut output, stride);
        for (index, value) in output.iter().enumerate() {
            let (frame, channel) = (index / stride, index % stride);
            let expected = if channel < channels {
                (1 + frame) * (1 + channel)
            } else {
                0
            };
            assert_eq!(*value, expected as f32, "{channels} {stride} {index}");
        }
        let mut silence = vec![0.0; 2 * stride];
        buses.finish(&mut silence, stride);
        assert!(silence.iter().all(|value| *value == 0.0));
    }
}

/// Deterministic distinct values within ±1.
fn draw(n: usize) -> f32 {
    ((n * n) as f32 * 0.37 + n as f32).sin()
}

fn lanes(n: usize, scale: f32) -> F32x8 {
    F32x8(std::array::from_fn(|lane| scale * draw(8 * n + lane)))
}

/// Signals and their weights.
fn arrivals(signals: &[Vec<f32>; BATCH], growth: f32) -> [Contribution<'_>; BATCH] {
    std::array::from_fn(|n| Contribution {
        signal: &signals[n],
        target: lanes(n, 1.0),
        growth: lanes(100 + n, growth),
    })
}

fn signals(frames: usize) -> [Vec<f32>; BATCH] {
    std::array::from_fn(|n| (0..frames).map(|i| draw(999 * n + i)).collect())
}

/// A bus with content that depends on `number`.
fn bus(number: usize, frames: usize) -> Vec<F32x8> {
    let first = 5000 + 4000 * number;
    (first..first + frames).map(|n| lanes(n, 1.0)).collect()
}

#[test]
fn every_arrival_is_added_with_weights_held_for_each_stretch() {
    // At the ramp's end and before.
    for (hold, frames) in [
        (1, 1),
        (1, 31),
        (1, CHUNK),
        (8, 1),
        (8, 7),
        (8, 64),
        (8, CHUNK),
        (32, 40),
        (32, CHUNK),
        (CHUNK as u32, CHUNK),
    ] {
        for more in [0, 3, 8, 500] {
            let growth = if hold < CHUNK as u32 { 1e-3 } else { 0.0 };
            let signals = signals(frames);
            let arrivals = arrivals(&signals, growth);
            let left = frames as u32 + more;
            let mut found = bus(1, frames);
            let ramp = Ramp { left, hold };
            add_arrivals(LaneSet::best(), &mut found, &arrivals, ramp);
            for (frame, (found, before)) in found.iter().zip(bus(1, frames)).enumerate() {
                let to_come = left - 1 - frame as u32;
                let middle = f64::from(to_come / hold * hold) + 0.5 * f64::from(hold - 1);
                // The held value is that of the line at most half a stretch away.
                assert!((middle - f64::from(to_come)).abs() <= 0.5 * f64::from(hold - 1));
                for lane in 0..8 {
                    let mut exact = f64::from(before.0[lane]);
                    for one in &arrivals {
                        let growth = f64::from(one.growth.0[lane]) * middle;
                        let weight = f64::from(one.target.0[lane]) - growth;
                        exact += weight * f64::from(one.signal[frame]);
                    }
                    // Eight sums below 15, and eight weights below 1.8, each rounded once.
                    let bound = f64::from(f32::EPSILON) * (8.0 * 15.0 + 8.0 * 1.8);
                    let error = (f64::from(found.0[lane]) - exact).abs();
                    assert!(error < bound, "{hold} {frames} {more} {frame}: {error}");
                }
            }
        }
    }
}

/// Filter taps that depend on `number`.
fn basis(number: usize, taps: usize) -> Vec<F32x8> {
    let first = 700 * number;
    (first..first + taps).map(|n| lanes(n, 0.2)).collect()
}

#[test]
fn a_filtered_bus_is_the_convolution() {
    let taps = 37;
    let basis = basis(0, taps);
    for frames in [1, 3, 4, 6, 64] {
        let bus = bus(1, taps - 1 + frames);
        let before = lanes(77, 1.0);
        let mut found = vec![before; frames];
        filter(LaneSet::best(), &basis, &bus, &mut found);
        for (frame, found) in found.iter().enumerate() {
            for lane in 0..8 {
                let mut exact = f64::from(before.0[lane]);
                for (tap, basis) in basis.iter().enumerate() {
                    let at = taps - 1 + frame - tap;
                    exact += f64::from(basis.0[lane]) * f64::from(bus[at].0[lane]);
                }
                // One rounding per tap of sums below 1 plus 0.2 per tap.
                let bound = f64::from(f32::EPSILON / 2.0) * 38.0 * (0.2 * 37.0 + 1.0);
                let error = (f64::from(found.0[lane]) - exact).abs();
                assert!(error < bound, "{frames} {frame}: {error}");
            }
        }
    }
}

#[test]
fn instruction_sets_agree() {
    let signals = signals(CHUNK);
    let rendered = |set: LaneSet| {
        let mut out = vec![F32x8::ZERO; CHUNK - 19];
        for group in 0..2 {
            let mut bus = bus(group, CHUNK);
            for (hold, growth) in [(CHUNK as u32, 0.0), (1, 1e-3), (8, 1e-3)] {
                let left = CHUNK as u32 + 20 * u32::from(growth > 0.0);
                let arrivals = arrivals(&signals, growth).map(|one| Contribution {
                    target: one.target * F32x8::splat((1 + group) as f32),
                    growth: one.growth * F32x8::splat((1 + group) as f32),
                    ..one
                });
                add_arrivals(set, &mut bus, &arrivals, Ramp { left, hold });
            }
            filter(set, &basis(1 - group, 20), &bus, &mut out);
        }
        out
    };
    let specified = rendered(LaneSet::Fused);
    for set in LaneSet::vector_units() {
        assert_eq!(rendered(set), specified, "{set:?}");
    }
    let portable = rendered(LaneSet::Portable);
    for (a, b) in portable.iter().zip(&specified) {
        for (a, b) in a.0.iter().zip(b.0) {
            // Two groups, the second at twice the weights: 24 products below 4 per frame, and 20 frames of up to 100 at 0.2.
            assert!((a - b).abs() < f32::EPSILON * 2.0 * 20.0 * 0.2 * (24.0 * 4.0 + 100.0));
        }
    }
}
