//! Conversion of sample rates: a Kaiser-windowed sinc with 32 zero crossings a side, whose pass band ends at 0.93 of the
//! lower Nyquist frequency.
//!
//! Any control thread; allocates. The kernel is computed once a conversion, for a bounded number of fractions of an input
//! sample: for all that occur where the two rates have a common divisor, else for so many that rows between two of them
//! are interpolated. Each output sample is one sum of products, or two.

use std::f64::consts::PI;
use std::sync::Arc;

/// Zero crossings of the sinc on each side.
const CROSSINGS: f64 = 32.0;

/// Shape of the Kaiser window: side lobes below -80 dB.
const KAISER_BETA: f64 = 8.0;

/// End of the pass band re the lower Nyquist frequency: the window's transition band fills the rest.
const PASS: f64 = 0.93;

/// Most values of a kernel that is not interpolated: 512 KiB.
const MOST_VALUES: usize = 1 << 17;

/// Fractions of an interpolated kernel for each zero crossing: the chord of a sine's period divided into twice as many
/// parts is off by less than 1e-6.
const ROWS_A_CROSSING: f64 = 1024.0;

/// Products summed side by side.
const LANES: usize = 8;

/// The samples at another rate; `samples.len() · to_hz / from_hz` of them, rounded up.
pub(super) fn resample(samples: &[f32], from_hz: u32, to_hz: u32) -> Arc<[f32]> {
    let kernel = Kernel::new(from_hz, to_hz);
    let length = (samples.len() as u64 * u64::from(to_hz)).div_ceil(u64::from(from_hz));
    (0..length as usize)
        .map(|n| kernel.sample(samples, n as u64))
        .collect()
}

/// A filter for one pair of rates.
struct Kernel {
    from_hz: u64,
    to_hz: u64,
    /// Weights of input samples, `taps` a row: row r for a centre r / `steps` behind an input sample, to r = `steps`.
    values: Vec<f32>,
    taps: usize,
    /// Input samples before the one in front of the centre.
    before: usize,
    steps: u64,
    /// Whether every centre has a row of its own.
    is_exact: bool,
}

impl Kernel {
    fn new(from_hz: u32, to_hz: u32) -> Self {
        // Cut off below half the lower rate, in cycles an input sample, times two.
        let cutoff = PASS * (f64::from(to_hz) / f64::from(from_hz)).min(1.0);
        let reach = CROSSINGS / cutoff;
        let before = reach as usize;
        let taps = 2 * before + 2;
        let fractions = to_hz / greatest_common_divisor(from_hz, to_hz);
        let is_exact = (fractions as usize + 1) * taps <= MOST_VALUES;
        let steps = match is_exact {
            true => u64::from(fractions),
            false => (ROWS_A_CROSSING * cutoff).ceil() as u64,
        };
        let scale = cutoff / bessel_i0(KAISER_BETA);
        let mut values = Vec::with_capacity((steps as usize + 1) * taps);
        for row in 0..=steps {
            let centre = before as f64 + row as f64 / steps as f64;
            values.extend((0..taps).map(|tap| {
                let x = tap as f64 - centre;
                let inside = 1.0 - (x / reach).powi(2);
                if inside <= 0.0 {
                    return 0.0;
                }
                (scale * sinc(cutoff * x) * bessel_i0(KAISER_BETA * inside.sqrt())) as f32
            }));
        }
        Self {
            from_hz: u64::from(from_hz),
            to_hz: u64::from(to_hz),
            values,
            taps,
            before,
            steps,
            is_exact,
        }
    }

    /// Output sample `n`. Beyond its ends the input is silent.
    fn sample(&self, samples: &[f32], n: u64) -> f32 {
        let position = n * self.from_hz;
        let (whole, rest) = (position / self.to_hz, position % self.to_hz);
        let (row, part) = (
            rest * self.steps / self.to_hz,
            rest * self.steps % self.to_hz,
        );
        let first = (whole as usize).saturating_sub(self.before);
        let skipped = first + self.before - whole as usize;
        let end = (whole as usize + self.taps - self.before).min(samples.len());
        let taken = samples.get(first..end).unwrap_or(&[]);
        let sum = |row: u64| {
            let start = row as usize * self.taps + skipped;
            sum_of_products(taken, &self.values[start..start + taken.len()])
        };
        if self.is_exact {
            return sum(row);
        }
        let part = part as f32 / self.to_hz as f32;
        (1.0 - part) * sum(row) + part * sum(row + 1)
    }
}

fn sum_of_products(a: &[f32], b: &[f32]) -> f32 {
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest = a_rest.iter().zip(b_rest).map(|(a, b)| a * b);
    sums.into_iter().chain(rest).sum()
}

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        (PI * x).sin() / (PI * x)
    }
}

/// The modified Bessel function of order zero, by its series.
fn bessel_i0(x: f64) -> f64 {
    let quarter = x * x / 4.0;
    let mut term = 1.0;
    let mut sum = 1.0;
    for k in 1..40 {
        term *= quarter / f64::from(k * k);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(rate_hz: u32, frequency_hz: f64, count: usize) -> Vec<f32> {
        let phase = 2.0 * PI * frequency_hz / f64::from(rate_hz);
        (0..count)
            .map(|n| (phase * n as f64).sin() as f32)
            .collect()
    }

    #[test]
    fn a_tone_keeps_its_pitch_and_level() {
        for (from, to) in [(44_100, 48_000), (48_000, 44_100), (16_000, 48_000)] {
            let made = resample(&sine(from, 1000.0, 4800), from, to);
            let wanted = sine(to, 1000.0, made.len());
            // Beyond the sinc's reach from both ends; a window of -80 dB leaves 1e-4.
            let middle = 200..made.len() - 200;
            for n in middle {
                assert!((made[n] - wanted[n]).abs() < 2e-4, "{from} to {to} at {n}");
            }
        }
    }

    #[test]
    fn what_the_lower_rate_cannot_hold_is_gone() {
        let made = resample(&sine(48_000, 12_000.0, 4800), 48_000, 16_000);
        let loudest = made[100..made.len() - 100]
            .iter()
            .fold(0.0f32, |most, s| most.max(s.abs()));
        assert!(loudest < 1e-3, "{loudest}");
    }

    /// An output sample without a table.
    fn direct(samples: &[f32], from_hz: u32, to_hz: u32, n: usize) -> f64 {
        let ratio = f64::from(from_hz) / f64::from(to_hz);
        let cutoff = PASS * (1.0 / ratio).min(1.0);
        let reach = CROSSINGS / cutoff;
        let centre = n as f64 * ratio;
        let weight = |i: usize| {
            let x = i as f64 - centre;
            let edge = (1.0 - (x / reach).powi(2)).max(0.0).sqrt();
            let window = bessel_i0(KAISER_BETA * edge) / bessel_i0(KAISER_BETA);
            if x.abs() < reach {
                cutoff * sinc(cutoff * x) * window
            } else {
                0.0
            }
        };
        let terms = samples.iter().enumerate();
        terms.map(|(i, s)| f64::from(*s) * weight(i)).sum()
    }

    #[test]
    fn tables_give_what_the_kernel_gives_at_any_pair_of_rates() {
        for (from, to) in [
            (44_100, 48_000),
            (44_101, 48_000),
            (48_000, 44_101),
            (1000, 48_000),
            (383_999, 1001),
            (1001, 384_000),
        ] {
            let count = if from > to { 40_000 } else { 400 };
            // Full scale and without a pattern.
            let noise = |n: usize| {
                (n as u32).wrapping_mul(2_654_435_761) as f32 / (1u32 << 31) as f32 - 1.0
            };
            let samples: Vec<f32> = (0..count).map(noise).collect();
            let made = resample(&samples, from, to);
            assert_eq!(made.len(), (count * to as usize).div_ceil(from as usize));
            for n in (0..made.len())
                .step_by(made.len().div_ceil(97))
                .chain([made.len() - 1])
            {
                let wanted = direct(&samples, from, to, n);
                // Chords are off by 1e-6 of each of 70 taps, which add up as noise, and sums by a few roundings of `f32`.
                let error = (f64::from(made[n]) - wanted).abs();
                assert!(error < 1e-5, "{from} to {to} at {n}: {error}");
            }
        }
    }

    #[test]
    fn kernels_are_small_at_any_pair_of_rates() {
        let rates = [
            1000, 1001, 8000, 11_025, 16_000, 44_100, 44_101, 48_000, 383_999, 384_000,
        ];
        for from in rates {
            for to in rates.into_iter().filter(|&to| to != from) {
                let kernel = Kernel::new(from, to);
                // The length of a clip does not occur: all kernel values are in the table.
                assert!(
                    kernel.values.len() <= MOST_VALUES,
                    "{from} to {to}: {}",
                    kernel.values.len()
                );
                let products = kernel.taps * if kernel.is_exact { 1 } else { 2 };
                // 70 a sample of the higher rate.
                let higher = f64::from(from.max(to)) / f64::from(to);
                assert!(
                    products as f64 <= 145.0 * higher,
                    "{from} to {to}: {products}"
                );
            }
        }
    }
}
