//! Reads a signal between its samples.
//!
//! Audio side; wait-free, bounded by the output's length; allocates nothing.
//!
//! Six points, third order (own; \[LAAKSO96\] for the kind), written about the middle of the interval so that weights come in
//! mirrored pairs. Constants and slopes are read exactly, whole samples are themselves, and readings are continuous where the
//! position passes one; what is free beyond that is fitted by least squares to tones up to 10 kHz at 44.1 kHz, weighted
//! by 1/f². What is read differs from a tone by less than −72 dB to 4 kHz, −56 dB to 8 kHz and −38 dB to 10 kHz, where
//! Lagrange's fifth order, which is half as much work again, differs by −76, −41 and −31 dB.

use crate::simd::{LaneSet, Lanes, Lanes16, kernel};

/// Samples needed before the one at or below the reading position.
pub(crate) const BEHIND: usize = 2;
/// Samples needed after the one at or below the reading position; a reader lags by this much to have them.
pub(crate) const AHEAD: usize = 3;

/// What the sums of the three mirrored pairs, from the outer to the inner, are multiplied by in the interval's middle, and
/// the slopes there of what their differences are multiplied by. At its ends all but the inner are nothing and that is a
/// half, which leaves no choice for the terms in x² and x³; sums of ½ and, times the nodes' distances, ½ make constants
/// and slopes exact.
const EVEN: [f32; 3] = [0.016_383, -0.110_806, 0.594_423];
const ODD: [f32; 3] = [0.006_270, -0.072_304, 1.185_562];

/// Weights of the six points around a position `fraction` behind the third.
fn weights(fraction: f32) -> [f32; 6] {
    let x = fraction - 0.5;
    // What is left of the middle's values, one there and nothing at the ends, and the inner pair's share.
    let to_ends = 4.0 * x * x;
    let (middle, slope) = (1.0 - to_ends, x * (1.0 - to_ends));
    let even = [
        EVEN[0] * middle,
        EVEN[1] * middle,
        EVEN[2] * middle + 0.5 * to_ends,
    ];
    let odd = [ODD[0] * slope, ODD[1] * slope, ODD[2] * slope + x * to_ends];
    [
        even[0] - odd[0],
        even[1] - odd[1],
        even[2] - odd[2],
        even[2] + odd[2],
        even[1] + odd[1],
        even[0] + odd[0],
    ]
}

/// Samples that a reader may touch, but not use, beyond the end of what it reads and of what it writes.
/// Moves with the lanes that are worked on at once.
pub(crate) const SLACK: usize = 16;

/// Where to read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading {
    /// Of the first sample, in frames from `signal[0]`.
    pub(crate) position: f64,
    /// Growth of the delay in frames a frame.
    pub(crate) glide: f64,
    /// Samples to write.
    pub(crate) count: usize,
    /// Samples of the signal that count.
    pub(crate) length: usize,
}

impl Reading {
    /// Windows' beginnings between the first and the last position, with room for rounding.
    fn span(&self) -> (i64, i64) {
        let last = self.position + (1.0 - self.glide) * (self.count as f64 - 1.0);
        let (low, high) = (self.position.min(last), self.position.max(last));
        let first = low as i64 - BEHIND as i64 - 2;
        (first, high as i64 - BEHIND as i64 + 2)
    }
}

/// Longest signal that [`Intervals`] has room for, with its slack.
pub(crate) const LONGEST: usize = 1280;

/// The polynomials of a signal's intervals: term by term what `1, x², x, x³` are multiplied by in the interval whose window
/// of six samples begins at each place, with `x` counted from the interval's middle.
#[derive(Debug, Clone)]
pub(crate) struct Intervals([[f32; LONGEST]; 4]);

impl Intervals {
    /// Room for them. Control side.
    pub(crate) fn new() -> Box<Self> {
        Box::new(Self([[0.0; LONGEST]; 4]))
    }
}

/// Writes `signal(position + i (1 − glide))` to `out[i]` for every i below the count, for every reading of one signal.
///
/// The signal has to reach [`BEHIND`] before the first and [`AHEAD`] beyond the last position, and to be
/// [`BEHIND`] + [`AHEAD`] longer than the count, and at most [`LONGEST`] long. It and `outs` have [`SLACK`] more samples;
/// those of `outs` are spoiled.
///
/// A position that rounding carries over the edge of the signal is read from the polynomial of the last interval.
pub(crate) fn read<const READINGS: usize>(
    set: LaneSet,
    signal: &[f32],
    readings: &[Reading; READINGS],
    intervals: &mut Intervals,
    outs: [&mut [f32]; READINGS],
) {
    let mut span: Option<(i64, i64)> = None;
    for at in readings.iter().filter(|at| at.glide != 0.0) {
        let last = (at.length as i64 - (BEHIND + AHEAD + 1) as i64).max(0);
        let (low, high) = at.span();
        let (low, high) = (low.clamp(0, last), high.clamp(0, last));
        span = Some(span.map_or((low, high), |(l, h)| (l.min(low), h.max(high))));
    }
    if let Some((low, high)) = span {
        let (low, count) = (low as usize, (high + 1 - low) as usize);
        expand(set, &signal[low..], count, low, intervals);
    }
    for (at, out) in readings.iter().zip(outs) {
        if at.glide == 0.0 {
            rest(set, signal, at, out);
        } else {
            glide(set, intervals, at, out);
        }
    }
}

kernel! {
    /// Works out the polynomials of `count` intervals, of which the first's window begins the signal and whose place is
    /// `at`. Spoils up to fifteen more.
    ///
    /// At both ends of an interval the sum of its even terms is half the inner pair's sum and that of its odd ones half
    /// its difference, so that the terms in x² and x³ follow from the others.
    fn expand<L>(signal: &[f32], count: usize, at: usize, intervals: &mut Intervals) {
        let end = (at + count.next_multiple_of(SLACK)).min(LONGEST / SLACK * SLACK);
        let [e0, e2, o1, o3] = &mut intervals.0;
        let e = e0[at..end].as_chunks_mut::<SLACK>().0.iter_mut();
        let e = e.zip(e2[at..end].as_chunks_mut::<SLACK>().0);
        let o = o1[at..end].as_chunks_mut::<SLACK>().0.iter_mut();
        let o = o.zip(o3[at..end].as_chunks_mut::<SLACK>().0);
        let [even_a, even_b, even_c] = [Lanes16::splat(EVEN[0]), Lanes16::splat(EVEN[1]), Lanes16::splat(EVEN[2])];
        let [odd_a, odd_b, odd_c] = [Lanes16::splat(ODD[0]), Lanes16::splat(ODD[1]), Lanes16::splat(ODD[2])];
        let four = Lanes16::splat(4.0);
        let mut place = 0;
        for ((e0, e2), (o1, o3)) in e.zip(o) {
            let [first, second, third, fourth, fifth, sixth] = taps::<L>(signal, place);
            let (a, b, c) = (sixth.add(first), fifth.add(second), fourth.add(third));
            let middle = c.mul_add(even_c, b.mul_add(even_b, a.mul(even_a)));
            middle.store(e0);
            middle.neg_mul_add(four, c.add(c)).store(e2);
            let (a, b, c) = (sixth.sub(first), fifth.sub(second), fourth.sub(third));
            let slope = c.mul_add(odd_c, b.mul_add(odd_b, a.mul(odd_a)));
            slope.store(o1);
            c.sub(slope).mul(four).store(o3);
            place += SLACK;
        }
    }
}

kernel! {
    /// A reading at one fraction.
    fn rest<L>(signal: &[f32], at: &Reading, out: &mut [f32]) {
        let room = (at.length - BEHIND - AHEAD) as i64;
        let whole = at.position as i64;
        let start = whole - BEHIND as i64;
        let fraction = (at.position - whole as f64) as f32;
        let base = start.clamp(0, room - at.count as i64);
        let signal = &signal[base as usize..];
        read_steady::<L>(signal, fraction + (start - base) as f32, &mut out[..at.count + SLACK]);
    }
}

kernel! {
    /// A reading that moves.
    fn glide<L>(intervals: &Intervals, at: &Reading, out: &mut [f32]) {
        let room = (at.length - BEHIND - AHEAD) as i64;
        // Positions are positive but for rounding, where truncation and floor differ by less than one interval.
        let whole = at.position as i64;
        let start = whole - BEHIND as i64;
        let fraction = (at.position - whole as f64) as f32;
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
                base: base as usize,
            };
            // What a run spoils the next one writes anew.
            read_run::<L>(intervals, &run, &mut out[from..to + SLACK]);
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

/// Sixteen neighbours of each tap.
#[inline(always)]
fn taps<L: Lanes>(signal: &[f32], place: usize) -> [Lanes16<L>; 6] {
    const WINDOW: usize = SLACK + BEHIND + AHEAD;
    let window: &[f32; WINDOW] = signal[place..].first_chunk().unwrap_or(&[0.0; WINDOW]);
    let [from_a, from_b, from_c] = [&window[..16], &window[1..17], &window[2..18]];
    let [from_d, from_e, from_f] = [&window[3..19], &window[4..20], &window[5..21]];
    [
        load::<L>(from_a),
        load::<L>(from_b),
        load::<L>(from_c),
        load::<L>(from_d),
        load::<L>(from_e),
        load::<L>(from_f),
    ]
}

/// As many values as there are lanes; zeros if there are not as many.
#[inline(always)]
fn load<L: Lanes>(values: &[f32]) -> Lanes16<L> {
    match values.first_chunk() {
        Some(lanes) => Lanes16::load(lanes),
        None => Lanes16::splat(0.0),
    }
}

/// One fraction for all: a filter of six taps. Writes all of `out` but at most [`SLACK`] samples.
#[inline(always)]
fn read_steady<L: Lanes>(signal: &[f32], fraction: f32, out: &mut [f32]) {
    let [wa, wb, wc, wd, we, wf] = weights(fraction);
    let (wa, wb, wc) = (Lanes16::splat(wa), Lanes16::splat(wb), Lanes16::splat(wc));
    let (wd, we, wf) = (Lanes16::splat(wd), Lanes16::splat(we), Lanes16::splat(wf));
    let tiles = (out.len() - SLACK).div_ceil(SLACK);
    let mut place = 0;
    for out in &mut out.as_chunks_mut().0[..tiles] {
        let [a, b, c, d, e, f] = taps::<L>(signal, place);
        let outer = f.mul_add(wf, a.mul(wa));
        let middle = e.mul_add(we, b.mul(wb));
        let inner = d.mul_add(wd, c.mul(wc));
        outer.add(middle).add(inner).store(out);
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
    /// Where its window begins.
    base: usize,
}

/// So many tiles of a term from a place on.
#[inline(always)]
fn at(terms: &[f32; LONGEST], place: usize, tiles: usize) -> &[[f32; SLACK]] {
    &terms[place..].as_chunks().0[..tiles]
}

/// A fraction that moves. Writes all of `out` but at most [`SLACK`] samples.
#[inline(always)]
fn read_run<L: Lanes>(intervals: &Intervals, run: &Run, out: &mut [f32]) {
    let (offset, glide) = (Lanes16::splat(run.offset), Lanes16::splat(run.glide));
    let mut number = Lanes16::<L>::indices().add(Lanes16::splat(run.from as f32));
    let tiles = (out.len() - SLACK).div_ceil(SLACK);
    let [e0, e2, o1, o3] = &intervals.0;
    let (e0, e2) = (at(e0, run.base, tiles), at(e2, run.base, tiles));
    let (o1, o3) = (at(o1, run.base, tiles), at(o3, run.base, tiles));
    let out = &mut out.as_chunks_mut::<SLACK>().0[..tiles];
    for tile in 0..tiles {
        let x = number.neg_mul_add(glide, offset);
        let square = x.mul(x);
        let even = Lanes16::load(&e2[tile]).mul_add(square, Lanes16::load(&e0[tile]));
        let odd = Lanes16::load(&o3[tile]).mul_add(square, Lanes16::load(&o1[tile]));
        odd.mul_add(x, even).store(&mut out[tile]);
        number = number.add(Lanes16::splat(SLACK as f32));
    }
}

#[cfg(test)]
#[path = "interpolation_tests.rs"]
mod tests;
