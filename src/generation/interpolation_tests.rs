//! Readings against polynomials, and the instruction sets against each other.

use super::*;

fn read(signal: &[f32], position: f64, glide: f64, out: &mut [f32]) {
    read_with(LaneSet::best(), signal, position, glide, out);
}

fn read_with(set: LaneSet, signal: &[f32], position: f64, glide: f64, out: &mut [f32]) {
    let at = Reading {
        position,
        glide,
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
    for glide in [0.0, 0.004, -0.004, 0.07, 0.25, -0.25] {
        for count in [1, 7, 8, 60, 128] {
            let [mut found, mut specified, mut portable] = [[0.0; 128]; 3];
            for (set, out) in [
                (LaneSet::best(), &mut found),
                (LaneSet::Fused, &mut specified),
                (LaneSet::Portable, &mut portable),
            ] {
                read_with(set, &signal, 3.4, glide, &mut out[..count]);
            }
            if !matches!(LaneSet::best(), LaneSet::Portable) {
                assert_eq!(found, specified);
            }
            for (a, b) in portable.iter().zip(specified) {
                // Ten roundings of values below 2.
                assert!((a - b).abs() < 1.2e-6, "{glide} {count}: {a} {b}");
            }
        }
    }
}

#[test]
fn polynomials_of_fifth_order_are_read_exactly() {
    let polynomial = |t: f64| {
        let u = t / 40.0 - 1.0;
        ((((0.3 * u - 0.5) * u + 0.2) * u + 0.7) * u - 0.1) * u + 0.4
    };
    let signal: Vec<f32> = (0..100).map(|i| polynomial(f64::from(i)) as f32).collect();
    for glide in [0.0, 0.013, -0.013, 0.25, -0.25, 1e-7] {
        let mut out = [0.0; 60];
        read(&signal, 10.37, glide, &mut out);
        for (i, &value) in out.iter().enumerate() {
            let exact = polynomial(10.37 + i as f64 * (1.0 - glide));
            // Seven roundings of values below 2, and a position good to 4e-6 on a slope below 0.1.
            assert!((f64::from(value) - exact).abs() < 2e-6, "{glide} {i}");
        }
    }
}

#[test]
fn response_is_flat_within_half_a_decibel_to_ten_kilohertz() {
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
    assert!(worst < 0.3);
}

#[test]
fn steady_and_creeping_reads_agree() {
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
