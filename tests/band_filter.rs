//! Laws of the band filter, against a direct transform of its impulse response and a filter tree in `f64`.

use foresound::acoustics::BANDS;
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::generation::{BandCorrection, BandFilter};
use foresound::simd::F32x8;

mod reference;
use reference::{crossover, dft};

const RATES_HZ: [u32; 2] = [44_100, 48_000];
/// The lowest crossover's impulse response has fallen by 200 dB after this many frames.
const RESPONSE: usize = 16_384;

fn filtered(input: &[f32], rate_hz: u32) -> [Vec<f64>; BANDS] {
    let mut filter = BandFilter::new(rate_hz);
    let mut lanes = vec![F32x8::ZERO; input.len()];
    // The filter splits four signals at once: the other three are silence or noise.
    let other: Vec<f32> = (0..100).map(|n| (n as f32 * 1.7).sin()).collect();
    let mut others = [[F32x8::ZERO; 100]; 3];
    let [a, b, c] = &mut others;
    for (input, lanes) in input.chunks(100).zip(lanes.chunks_mut(100)) {
        filter.process([&other, &other, input, &other], [a, b, lanes, c]);
    }
    std::array::from_fn(|b| lanes.iter().map(|lane| f64::from(lane.0[b])).collect())
}

fn impulse_responses(rate_hz: u32) -> [Vec<f64>; BANDS] {
    let mut impulse = vec![0.0; RESPONSE];
    impulse[0] = 1.0;
    filtered(&impulse, rate_hz)
}

fn weighted(bands: &[Vec<f64>; BANDS], gains: F32x8) -> Vec<f64> {
    (0..RESPONSE)
        .map(|n| {
            (0..BANDS)
                .map(|b| bands[b][n] * f64::from(gains.0[b]))
                .sum()
        })
        .collect()
}

#[test]
fn sum_of_all_bands_is_flat() {
    for rate_hz in RATES_HZ {
        let sum = weighted(&impulse_responses(rate_hz), F32x8::splat(1.0));
        let mut worst = 0.0f64;
        for i in 0..=200 {
            let frequency_hz = 20.0 * 1000f64.powf(f64::from(i) / 200.0);
            worst = worst.max(dft::magnitude_db(&sum, frequency_hz, f64::from(rate_hz)).abs());
        }
        println!("{rate_hz} Hz: sum within {worst:.6} dB of flat, 20 Hz to 20 kHz");
        // Rounding only; the library promises 0.5 dB.
        assert!(worst < 0.001);
    }
}

#[test]
fn every_amplitude_acts_at_its_own_centre() {
    for rate_hz in RATES_HZ {
        let bands = impulse_responses(rate_hz);
        let correction = BandCorrection::new(rate_hz);
        let mut worst = 0.0f64;
        for (one, others) in [(1.0, 0.0), (0.5, 1.0), (1.0, 0.5)] {
            for b in 0..BANDS {
                let mut amplitude = [others; BANDS];
                amplitude[b] = one;
                let out = weighted(&bands, correction.gains(&amplitude));
                let wanted_db = 20.0 * f64::from(one).log10();
                let off_db = dft::magnitude_db(&out, CENTRES_HZ[b], f64::from(rate_hz)) - wanted_db;
                worst = worst.max(off_db.abs());
            }
        }
        println!("{rate_hz} Hz: amplitudes within {worst:.6} dB at the centres");
        assert!(worst < 0.01);
    }
}

#[test]
fn response_between_centres_follows_a_sloping_spectrum() {
    for rate_hz in RATES_HZ {
        let bands = impulse_responses(rate_hz);
        // 6 dB an octave, as a wall's transmission has it.
        let amplitude = std::array::from_fn(|b| 0.5f32.powi(b as i32));
        let out = weighted(&bands, BandCorrection::new(rate_hz).gains(&amplitude));
        let mut worst = 0.0f64;
        for i in 0..=140 {
            let octaves = f64::from(i) / 20.0;
            let frequency_hz = CENTRES_HZ[0] * 10f64.powf(0.3 * octaves);
            let line_db = -6.0206 * octaves;
            let off_db = dft::magnitude_db(&out, frequency_hz, f64::from(rate_hz)) - line_db;
            worst = worst.max(off_db.abs());
        }
        println!("{rate_hz} Hz: within {worst:.3} dB of a slope of 6 dB an octave");
        assert!(worst < 1.0);
    }
}

#[test]
fn rounding_noise_lies_120_db_below_the_signal() {
    for rate_hz in RATES_HZ {
        for frequency_hz in [40.0, 89.0, 1000.0, 7900.0] {
            let step = std::f64::consts::TAU * frequency_hz / f64::from(rate_hz);
            let input: Vec<f32> = (0..40_000)
                .map(|n| (step * f64::from(n)).sin() as f32)
                .collect();
            let exact_input: Vec<f64> = input.iter().map(|&x| f64::from(x)).collect();
            let exact = crossover::split(&exact_input, f64::from(rate_hz));
            let bands = filtered(&input, rate_hz);
            let signal: f64 = exact_input.iter().map(|x| x * x).sum();
            // All bands together; the band the signal is in dominates.
            let noise: f64 = (0..input.len())
                .map(|n| {
                    (0..BANDS)
                        .map(|b| bands[b][n] - exact[b][n])
                        .sum::<f64>()
                        .powi(2)
                })
                .sum();
            let worst_band = (0..BANDS)
                .map(|b| {
                    let noise: f64 = bands[b]
                        .iter()
                        .zip(&exact[b])
                        .map(|(x, y)| (x - y).powi(2))
                        .sum();
                    10.0 * (noise / signal).log10()
                })
                .fold(f64::NEG_INFINITY, f64::max);
            let noise_db = 10.0 * (noise / signal).log10();
            println!(
                "{rate_hz} Hz, tone of {frequency_hz} Hz: sum {noise_db:.1} dB, worst band {worst_band:.1} dB"
            );
            assert!(noise_db < -120.0 && worst_band < -120.0);
        }
    }
}

#[test]
fn oracle_sums_to_an_allpass_too() {
    let mut impulse = vec![0.0; RESPONSE];
    impulse[0] = 1.0;
    let bands = crossover::split(&impulse, 44_100.0);
    let sum: Vec<f64> = (0..RESPONSE)
        .map(|n| bands.iter().map(|band| band[n]).sum())
        .collect();
    for frequency_hz in [30.0, 89.1, 500.0, 3000.0, 15_000.0] {
        assert!(dft::magnitude_db(&sum, frequency_hz, 44_100.0).abs() < 1e-6);
    }
}

#[test]
fn filter_comes_to_rest() {
    let mut filter = BandFilter::new(44_100);
    let mut lanes = [[F32x8::ZERO; 128]; 4];
    let [a, b, c, d] = &mut lanes;
    let (ones, zeros) = ([1.0; 128], [0.0; 128]);
    filter.process([&zeros, &ones, &zeros, &zeros], [a, b, c, d]);
    assert!(filter.is_sounding(1) && !filter.is_sounding(0));
    let mut blocks = 0;
    while filter.is_sounding(1) {
        filter.process([&zeros; 4], [a, b, c, d]);
        blocks += 1;
        assert!(blocks < 344, "still sounding after a second");
    }
}
