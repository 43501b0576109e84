//! Interpolation of polynomials and tones, and agreement of the instruction sets.

use super::*;

fn read(signal: &[f32], position: f64, growth: f64, out: &mut [f32]) {
    read_with(LaneSet::best(), signal, position, growth, out);
}

fn read_with(set: LaneSet, signal: &[f32], position: f64, growth: f64, out: &mut [f32]) {
    let at = ReadRequest {
        position,
        growth,
        count: out.len(),
        length: signal.len(),
    };
    let signal = [signal, &[f32::NAN; SLACK]].concat();
    let mut wide = vec![0.0; out.len() + SLACK];
    let mut intervals = Intervals::new();
    super::read(set, &signal, &[at], &mut intervals, [&mut wide]);
    out.copy_from_slice(&wide[..out.len()]);
}

#[test]
fn instruction_sets_agree() {
    let signal: Vec<f32> = (0..170).map(|i| (i as f32 * i as f32).sin()).collect();
    for growth in [0.0, 0.004, -0.004, 0.07, 0.25, -0.25] {
        for count in [1, 7, 8, 60, 128] {
            let with = |set: LaneSet| {
                let mut out = [0.0; 128];
                read_with(set, &signal, 3.4, growth, &mut out[..count]);
                out
            };
            let (specified, portable) = (with(LaneSet::Fused), with(LaneSet::Portable));
            for set in LaneSet::vector_units() {
                assert_eq!(with(set), specified, "{set:?}");
            }
            for (a, b) in portable.iter().zip(specified) {
                // Ten roundings of values below 5, which the terms in x² and x³ reach.
                assert!((a - b).abs() < 3e-6, "{growth} {count}: {a} {b}");
            }
        }
    }
}

#[test]
fn whole_samples_constants_and_slopes_are_read_exactly() {
    let signal: Vec<f32> = (0..100).map(|i| (i as f32 * i as f32).sin()).collect();
    let mut out = [0.0; 60];
    for growth in [0.0, 1e-9] {
        read(&signal, 10.0, growth, &mut out);
        for (i, &value) in out.iter().enumerate() {
            // Seven roundings of values below 2.
            assert!((value - signal[10 + i]).abs() < 1e-6, "{growth} {i}");
        }
    }
    let line = |t: f64| 0.3 + 0.01 * t;
    let signal: Vec<f32> = (0..100).map(|i| line(f64::from(i)) as f32).collect();
    for growth in [0.0, 0.013, -0.013, 0.25, -0.25, 1e-7] {
        read(&signal, 10.37, growth, &mut out);
        for (i, &value) in out.iter().enumerate() {
            let exact = line(10.37 + i as f64 * (1.0 - growth));
            // Seven roundings of values below 2, and a position error of 4e-6 on a slope of a hundredth.
            assert!((f64::from(value) - exact).abs() < 1e-6, "{growth} {i}");
        }
    }
}

#[test]
fn readings_are_continuous_at_the_samples() {
    let signal: Vec<f32> = (0..100).map(|i| (i as f32 * i as f32).sin()).collect();
    let (mut before, mut after) = ([0.0; 8], [0.0; 8]);
    for growth in [0.0, 1e-9] {
        read(&signal, 20.0 - 1e-6, growth, &mut before);
        read(&signal, 20.0 + 1e-6, growth, &mut after);
        for (a, b) in before.iter().zip(after) {
            // Two millionths of a slope below 3, and roundings.
            assert!((a - b).abs() < 7e-6, "{a} {b}");
        }
    }
}

/// Largest error in dB for a tone of amplitude one, over all fractions.
fn tone_error_db(hz: f64, weights: impl Fn(f64) -> [f64; 6]) -> f64 {
    let w = std::f64::consts::TAU * hz / 44_100.0;
    let mut worst = 0.0f64;
    for step in 0..=32 {
        let fraction = f64::from(step) / 32.0;
        let (mut re, mut im) = (-(w * (2.0 + fraction)).cos(), -(w * (2.0 + fraction)).sin());
        for (tap, weight) in weights(fraction).into_iter().enumerate() {
            re += weight * (w * tap as f64).cos();
            im += weight * (w * tap as f64).sin();
        }
        worst = worst.max(re.hypot(im));
    }
    20.0 * worst.log10()
}

#[test]
fn tones_are_read_within_the_stated_bounds() {
    let ours = |fraction: f64| weights(fraction as f32).map(f64::from);
    let lagrange = |fraction: f64| {
        let at = 2.0 + fraction;
        std::array::from_fn(|tap| {
            let others = (0..6).filter(|&other| other != tap);
            others
                .map(|other| (at - other as f64) / (tap as f64 - other as f64))
                .product()
        })
    };
    for (to_hz, bound_db) in [(4_000, -72.0), (8_000, -56.0), (10_000, -38.0)] {
        let each = (100..=to_hz).step_by(100).map(f64::from);
        let worst = |weights: &dyn Fn(f64) -> [f64; 6]| {
            each.clone()
                .map(|hz| tone_error_db(hz, weights))
                .fold(f64::NEG_INFINITY, f64::max)
        };
        let (found, fifth_order) = (worst(&ours), worst(&lagrange));
        println!("to {to_hz} Hz: {found:.1} dB, Lagrange {fifth_order:.1} dB");
        assert!(found < bound_db);
    }
}

#[test]
fn moving_readings_follow_tones_within_the_bounds_of_constant_ones() {
    for (hz, bound_db) in [(1_000.0, -72.0), (4_000.0, -72.0), (8_000.0, -56.0)] {
        let w = std::f64::consts::TAU * hz / 44_100.0;
        let signal: Vec<f32> = (0..400).map(|i| (w * f64::from(i)).sin() as f32).collect();
        for growth in [0.0, 0.004, -0.004, 0.25, -0.25] {
            let mut out = [0.0; 256];
            read(&signal, 30.3, growth, &mut out);
            for (i, &value) in out.iter().enumerate() {
                let exact = (w * (30.3 + i as f64 * (1.0 - growth))).sin();
                let off_db = 20.0 * (f64::from(value) - exact).abs().log10();
                assert!(off_db < bound_db + 0.5, "{hz} {growth} {i}: {off_db}");
            }
        }
    }
}

#[test]
fn response_is_flat_within_an_eighth_of_a_decibel_to_ten_kilohertz() {
    let mut worst = 0.0f64;
    for step in 0..=32 {
        let fraction = step as f32 / 32.0;
        let weights = weights(fraction);
        for hz in (100..=10_000).step_by(100) {
            let w = std::f64::consts::TAU * f64::from(hz) / 44_100.0;
            let (mut re, mut im) = (0.0, 0.0);
            for (tap, &weight) in weights.iter().enumerate() {
                re += f64::from(weight) * (w * tap as f64).cos();
                im += f64::from(weight) * (w * tap as f64).sin();
            }
            worst = worst.max((10.0 * (re * re + im * im).log10()).abs());
        }
    }
    println!("largest deviation {worst:.3} dB");
    assert!(worst < 0.125);
}

#[test]
fn constant_and_very_slow_readings_agree() {
    let signal: Vec<f32> = (0..200)
        .map(|i| (f64::from(i) * 0.9).sin() as f32)
        .collect();
    let (mut steady, mut creeping) = ([0.0; 128], [0.0; 128]);
    read(&signal, 30.6, 0.0, &mut steady);
    read(&signal, 30.6, 1e-12, &mut creeping);
    for (a, b) in steady.iter().zip(&creeping) {
        assert!((a - b).abs() < 1e-6);
    }
}
