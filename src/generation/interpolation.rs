//! Reads a signal between its samples.
//!
//! Audio side; wait-free, bounded by the output's length; allocates nothing.
//!
//! Six-point, fifth-order Lagrange interpolation (\[LAAKSO96\]), written about the middle of the interval so that
//! weights come in mirrored pairs. At half a sample it is 0.3 dB low at 10 kHz and 44.1 kHz, at other fractions less;
//! it is exact at whole samples, and continuous where the reading position passes one.

use crate::simd::{Lanes, NUMBERS, kernel};

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

/// Samples that a reader may touch, but not use, beyond the end of what it reads and of what it writes.
pub(super) const SLACK: usize = 8;

/// Where to read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading {
    /// Of the first sample, in frames from `signal[0]`.
    pub(super) position: f64,
    /// Growth of the delay in frames a frame.
    pub(super) glide: f64,
    /// Samples to write.
    pub(super) count: usize,
    /// Samples of the signal that count.
    pub(super) length: usize,
}

kernel! {
    /// Writes `signal(position + i (1 − glide))` to `out[i]` for every i below the count.
    ///
    /// The signal has to reach [`BEHIND`] before the first and [`AHEAD`] beyond the last position, and to be
    /// [`BEHIND`] + [`AHEAD`] longer than the count. Both slices have [`SLACK`] more samples; those of `out` are spoiled.
    ///
    /// A position that rounding carries over the edge of the signal is read from the polynomial of the last interval.
    pub(super) fn read<L>(signal: &[f32], at: &Reading, out: &mut [f32]) {
        let room = (at.length - BEHIND - AHEAD) as i64;
        // Positions are positive but for rounding, where truncation and floor differ by less than one interval.
        let whole = at.position as i64;
        let start = whole - BEHIND as i64;
        let fraction = (at.position - whole as f64) as f32;
        if at.glide == 0.0 {
            let base = start.clamp(0, room - at.count as i64);
            let signal = &signal[base as usize..];
            read_steady::<L>(signal, fraction + (start - base) as f32, &mut out[..at.count + SLACK]);
            return;
        }
        let glide = at.glide as f32;
        let mut from = 0;
        while from < at.count {
            // Within a run the whole part of the position moves with i, and one polynomial serves.
            let first = fraction - glide * from as f32;
            let shift = floor(first);
            let to_edge = if glide > 0.0 {
                (fraction - shift) / glide
            } else {
                (fraction - shift - 1.0) / glide
            };
            let to = (to_edge.min(at.count as f32) as usize + 1).clamp(from + 1, at.count);
            let wanted = start + from as i64 + shift as i64;
            let base = wanted.clamp(0, room - (to - from) as i64);
            let run = Run {
                offset: fraction - shift - 0.5 + (wanted - base) as f32,
                glide,
                from,
            };
            // What a run spoils the next one writes anew.
            read_run::<L>(&signal[base as usize..], &run, &mut out[from..to + SLACK]);
            from = to;
        }
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

/// Eight neighbours of each tap.
#[inline(always)]
fn taps<L: Lanes>(signal: &[f32], place: usize) -> [L; 6] {
    let window = signal[place..].first_chunk::<13>().unwrap_or(&[0.0; 13]);
    [
        L::load_at(window, 0),
        L::load_at(window, 1),
        L::load_at(window, 2),
        L::load_at(window, 3),
        L::load_at(window, 4),
        L::load_at(window, 5),
    ]
}

/// One fraction for all: a filter of six taps. Writes all of `out` but at most [`SLACK`] samples.
#[inline(always)]
fn read_steady<L: Lanes>(signal: &[f32], fraction: f32, out: &mut [f32]) {
    let [wa, wb, wc, wd, we, wf] = weights(fraction);
    let (wa, wb, wc) = (L::splat(wa), L::splat(wb), L::splat(wc));
    let (wd, we, wf) = (L::splat(wd), L::splat(we), L::splat(wf));
    let mut place = 0;
    while place < out.len() - SLACK {
        let [a, b, c, d, e, f] = taps::<L>(signal, place);
        let outer = f.mul_add(wf, a.mul(wa));
        let middle = e.mul_add(we, b.mul(wb));
        let inner = d.mul_add(wd, c.mul(wc));
        outer.add(middle).add(inner).store_at(out, place);
        place += SLACK;
    }
}

/// A stretch in which the reading position passes no sample: sample i of the whole lies `offset − glide · i` from the
/// middle of the interval i intervals on.
struct Run {
    offset: f32,
    glide: f32,
    /// The first of the stretch.
    from: usize,
}

/// Square roots of what [`OUTER`], [`MIDDLE`] and [`INNER`] make of the factors of each node's distance: products of two
/// have the magnitude of the pair's factor.
const NEAR: f32 = 0.064_549_72;
const MID: f32 = 2.0 * NEAR;
const FAR: f32 = 10.0 * NEAR;

/// A fraction that moves: the same sum with the weights worked out on the way. Writes all of `out` but at most
/// [`SLACK`] samples.
#[inline(always)]
fn read_run<L: Lanes>(signal: &[f32], run: &Run, out: &mut [f32]) {
    let (offset, glide) = (L::splat(run.offset), L::splat(run.glide));
    let mut number = L::of(NUMBERS).add(L::splat(run.from as f32));
    let mut place = 0;
    while place < out.len() - SLACK {
        let [a, b, c, d, e, f] = taps::<L>(signal, place);
        let x = number.neg_mul_add(glide, offset);
        let square = x.mul(x);
        let near = square.mul_add(L::splat(NEAR), L::splat(-0.25 * NEAR));
        let mid = square.mul_add(L::splat(MID), L::splat(-2.25 * MID));
        let far = square.mul_add(L::splat(FAR), L::splat(-6.25 * FAR));
        // Even part and odd part of each mirrored pair.
        let outer = L::splat(2.5).mul_add(f.add(a), x.mul(f.sub(a)));
        let middle = L::splat(1.5).mul_add(e.add(b), x.mul(e.sub(b)));
        let inner = L::splat(0.5).mul_add(d.add(c), x.mul(d.sub(c)));
        let sum = near.mul(mid).mul(outer);
        let sum = near.mul(far).neg_mul_add(middle, sum);
        mid.mul(far).mul_add(inner, sum).store_at(out, place);
        number = number.add(L::splat(SLACK as f32));
        place += SLACK;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::LaneSet;

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
        super::read(set, &signal, &at, &mut wide);
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
}
