//! Reads a signal between its samples.
//!
//! Audio side; wait-free, bounded by the output's length; allocates nothing.
//!
//! Six-point, fifth-order Lagrange interpolation ([LAAKSO96]), written about the middle of the interval so that
//! weights come in mirrored pairs. At half a sample it is 0.3 dB low at 10 kHz and 44.1 kHz, at other fractions less;
//! it is exact at whole samples, and continuous where the reading position passes one.

/// Samples needed before the one at or below the reading position.
pub(super) const BEHIND: usize = 2;
/// Samples needed after the one at or below the reading position; a reader lags by this much to have them.
pub(super) const AHEAD: usize = 3;

/// Factors of the three mirrored pairs, from the outer to the inner: product of the nodes' distances, inverted.
const OUTER: f32 = 1.0 / 120.0;
const MIDDLE: f32 = -1.0 / 24.0;
const INNER: f32 = 1.0 / 12.0;

/// Weights of the six points around a position `fraction` behind the third.
fn weights(fraction: f32) -> [f32; 6] {
    let x = fraction - 0.5;
    let square = x * x;
    let near = square - 0.25;
    let mid = square - 2.25;
    let far = square - 6.25;
    let outer = near * mid * OUTER;
    let middle = near * far * MIDDLE;
    let inner = mid * far * INNER;
    [
        outer * (2.5 - x),
        middle * (1.5 - x),
        inner * (0.5 - x),
        inner * (0.5 + x),
        middle * (1.5 + x),
        outer * (2.5 + x),
    ]
}

/// Writes `signal(position + i (1 − glide))` for every i of `out`.
///
/// `position` counts from `signal[0]`; `signal` has to reach [`BEHIND`] before the first and [`AHEAD`] beyond the last
/// position, and to be [`BEHIND`] + [`AHEAD`] longer than `out`. `glide` is the growth of the delay in frames a frame.
///
/// A position that rounding carries over the edge of `signal` is read from the polynomial of the last interval.
pub(super) fn read(signal: &[f32], position: f64, glide: f64, out: &mut [f32]) {
    let count = out.len();
    let room = |frames: usize| (signal.len() - frames - BEHIND - AHEAD) as i64;
    // Positions are positive but for rounding, where truncation and floor differ by less than one interval.
    let whole = position as i64;
    let start = whole - BEHIND as i64;
    let fraction = (position - whole as f64) as f32;
    if glide == 0.0 {
        let base = start.clamp(0, room(count));
        let signal = &signal[base as usize..][..count + BEHIND + AHEAD];
        read_steady(signal, fraction + (start - base) as f32, out);
        return;
    }
    let glide = glide as f32;
    let mut from = 0;
    while from < count {
        // Within a run the whole part of the position moves with i, and one set of slices serves.
        let first = fraction - glide * from as f32;
        let shift = floor(first);
        let to_edge = if glide > 0.0 {
            (fraction - shift) / glide
        } else {
            (fraction - shift - 1.0) / glide
        };
        let to = (to_edge.min(count as f32) as usize + 1).clamp(from + 1, count);
        let run = &mut out[from..to];
        let wanted = start + from as i64 + shift as i64;
        let base = wanted.clamp(0, room(run.len()));
        let signal = &signal[base as usize..][..run.len() + BEHIND + AHEAD];
        let offset = fraction - shift - 0.5 + (wanted - base) as f32;
        read_run(signal, offset, glide, from, run);
        from = to;
    }
}

/// `f32::floor` of a small number; the function itself is a library call on x86-64 without SSE 4.1.
#[inline(always)]
fn floor(value: f32) -> f32 {
    let truncated = value as i32 as f32;
    if truncated > value {
        truncated - 1.0
    } else {
        truncated
    }
}

/// One fraction for all: a filter of six taps.
fn read_steady(signal: &[f32], fraction: f32, out: &mut [f32]) {
    let weights = weights(fraction);
    let count = out.len();
    let [a, b, c, d, e, f] = taps(signal, count);
    for i in 0..count {
        out[i] = (weights[0] * a[i] + weights[5] * f[i])
            + (weights[1] * b[i] + weights[4] * e[i])
            + (weights[2] * c[i] + weights[3] * d[i]);
    }
}

/// A fraction that moves by `glide` a frame: the same sum with the weights worked out on the way.
#[inline(always)]
fn read_run(signal: &[f32], offset: f32, glide: f32, from: usize, out: &mut [f32]) {
    let count = out.len();
    let [a, b, c, d, e, f] = taps(signal, count);
    let from = from as i32;
    for i in 0..count {
        let x = offset - glide * (from + i as i32) as f32;
        let square = x * x;
        let near = square - 0.25;
        let mid = square - 2.25;
        let far = square - 6.25;
        let outer = near * mid * OUTER;
        let middle = near * far * MIDDLE;
        let inner = mid * far * INNER;
        out[i] = outer * (2.5 * (f[i] + a[i]) + x * (f[i] - a[i]))
            + middle * (1.5 * (e[i] + b[i]) + x * (e[i] - b[i]))
            + inner * (0.5 * (d[i] + c[i]) + x * (d[i] - c[i]));
    }
}

#[inline(always)]
fn taps(signal: &[f32], count: usize) -> [&[f32]; 6] {
    std::array::from_fn(|tap| &signal[tap..][..count])
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
