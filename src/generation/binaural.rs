//! Sums every arrival into a few buses an ear and filters each bus once.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at birth only. Takes ear signals with weights, gives two
//! ears of sound without latency.
//!
//! An ear's response to a direction is a weighted sum of shared filters ([`Hrtf`]), so the weights may be applied
//! before the filters: an arrival costs one multiplication a component and sample, and the filters cost the same for
//! one arrival as for a thousand.

use std::sync::Arc;

use crate::simd::F32x8;

use super::{CHUNK, Hrtf};

/// What one arrival adds to one group of an ear's buses.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contribution<'a> {
    /// The ear signal.
    pub(super) signal: &'a [f32],
    /// Weights one frame before the first.
    pub(super) weights: F32x8,
    /// Growth of the weights a frame.
    pub(super) step: F32x8,
}

/// Frames for which growing weights are added up before they are worked out afresh: roundings of a steady growth all go
/// the same way, and 32 of them stay below 2e-6 of the weight.
const RUN: usize = 32;

impl Contribution<'_> {
    /// Weights before the given frame.
    #[inline(always)]
    fn weights_before(&self, frame: usize) -> F32x8 {
        self.weights + self.step * F32x8::splat(frame as f32)
    }
}

/// The buses of both ears and the filters behind them.
#[derive(Debug)]
pub(super) struct Binaural {
    hrtf: Arc<Hrtf>,
    /// Frames of the past that the filters need.
    history: usize,
    /// Ear after ear, group after group: the past, then the present chunk.
    buses: Vec<F32x8>,
    /// Filtered frames, not yet summed over the lanes.
    filtered: Vec<F32x8>,
    /// Frames since something was added.
    quiet_frames: usize,
}

impl Binaural {
    pub(super) fn new(hrtf: Arc<Hrtf>) -> Self {
        let history = hrtf.taps() - 1;
        Self {
            history,
            buses: vec![F32x8::ZERO; 2 * hrtf.groups() * (history + CHUNK)],
            filtered: vec![F32x8::ZERO; CHUNK],
            quiet_frames: history,
            hrtf,
        }
    }

    /// Whether buses and filters hold nothing but silence.
    fn is_silent(&self) -> bool {
        self.quiet_frames >= self.history.max(1)
    }

    /// Adds one arrival to one group of an ear's buses; `moving` says whether the weights change.
    pub(super) fn add(&mut self, ear: usize, group: usize, a: &Contribution, moving: bool) {
        let bus = self.bus(ear, group, a.signal.len());
        if moving {
            let runs = bus.chunks_mut(RUN).zip(a.signal.chunks(RUN));
            for (run, (bus, signal)) in runs.enumerate() {
                let mut weights = a.weights_before(run * RUN);
                for (sum, &sample) in bus.iter_mut().zip(signal) {
                    weights += a.step;
                    *sum += weights * F32x8::splat(sample);
                }
            }
        } else {
            let weights = a.weights;
            for_each_frame(bus, [a.signal], |sum, [sample]| {
                *sum += weights * F32x8::splat(sample);
            });
        }
    }

    /// Adds two arrivals at once, which halves the traffic on the buses.
    pub(super) fn add_two(
        &mut self,
        ear: usize,
        group: usize,
        a: &Contribution,
        b: &Contribution,
        moving: bool,
    ) {
        let bus = self.bus(ear, group, a.signal.len());
        if moving {
            let signals = a.signal.chunks(RUN).zip(b.signal.chunks(RUN));
            for (run, (bus, (first, second))) in bus.chunks_mut(RUN).zip(signals).enumerate() {
                let mut of_a = a.weights_before(run * RUN);
                let mut of_b = b.weights_before(run * RUN);
                for (sum, (&first, &second)) in bus.iter_mut().zip(first.iter().zip(second)) {
                    of_a += a.step;
                    of_b += b.step;
                    *sum += of_a * F32x8::splat(first) + of_b * F32x8::splat(second);
                }
            }
        } else {
            let (of_a, of_b) = (a.weights, b.weights);
            for_each_frame(bus, [a.signal, b.signal], |sum, [first, second]| {
                *sum += of_a * F32x8::splat(first) + of_b * F32x8::splat(second);
            });
        }
    }

    fn bus(&mut self, ear: usize, group: usize, frames: usize) -> &mut [F32x8] {
        self.quiet_frames = 0;
        let length = self.history + CHUNK;
        let start = (ear * self.hrtf.groups() + group) * length + self.history;
        &mut self.buses[start..start + frames]
    }

    /// Filters what was added and overwrites `frames` of each ear, then moves on by as many.
    pub(super) fn finish(&mut self, ears: [&mut [f32]; 2]) {
        let groups = self.hrtf.groups();
        let length = self.history + CHUNK;
        let frames = ears[0].len();
        if self.is_silent() {
            for out in ears {
                out.fill(0.0);
            }
            return;
        }
        for (out, buses) in ears
            .into_iter()
            .zip(self.buses.chunks_exact_mut(groups * length))
        {
            let filtered = &mut self.filtered[..frames];
            filtered.fill(F32x8::ZERO);
            for (group, bus) in buses.chunks_exact_mut(length).enumerate() {
                filter(self.hrtf.basis(group), bus, filtered);
                bus.copy_within(frames..frames + self.history, 0);
                bus[self.history..].fill(F32x8::ZERO);
            }
            for (frame, lanes) in out.iter_mut().zip(filtered) {
                *frame = lanes.sum();
            }
        }
        self.quiet_frames += frames;
    }
}

/// Visits every frame of a bus, four at a time: the compiler then keeps a bus's lanes together, where a plain loop makes
/// it transpose them to work on four frames at once.
#[inline(always)]
fn for_each_frame<const N: usize>(
    bus: &mut [F32x8],
    signals: [&[f32]; N],
    mut visit: impl FnMut(&mut F32x8, [f32; N]),
) {
    const TOGETHER: usize = 4;
    let mut frames = bus.chunks_exact_mut(TOGETHER);
    let mut start = 0;
    for four in &mut frames {
        let samples = signals.map(|signal| &signal[start..start + TOGETHER]);
        for (i, sum) in four.iter_mut().enumerate() {
            visit(sum, samples.map(|samples| samples[i]));
        }
        start += TOGETHER;
    }
    for sum in frames.into_remainder() {
        visit(sum, signals.map(|signal| signal[start]));
        start += 1;
    }
}

/// Adds `Σ_tap basis[tap] · bus[now − tap]` to every frame of `out`, lane by lane.
///
/// A function of its own: seen together with the sum over the lanes, the compiler transposes what it should not.
#[inline(never)]
fn filter(basis: &[F32x8], bus: &[F32x8], out: &mut [F32x8]) {
    const TOGETHER: usize = 4;
    let taps = basis.len();
    let mut frames = out.chunks_exact_mut(TOGETHER);
    let mut start = 0;
    for four in &mut frames {
        let [mut a, mut b, mut c, mut d] = [four[0], four[1], four[2], four[3]];
        let window = &bus[start..start + taps - 1 + TOGETHER];
        for (past, &tap) in window.windows(TOGETHER).zip(basis.iter().rev()) {
            a += tap * past[0];
            b += tap * past[1];
            c += tap * past[2];
            d += tap * past[3];
        }
        four.copy_from_slice(&[a, b, c, d]);
        start += TOGETHER;
    }
    for frame in frames.into_remainder() {
        for (&value, &tap) in bus[start..start + taps].iter().zip(basis.iter().rev()) {
            *frame += tap * value;
        }
        start += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::super::synthetic_hrtf;
    use super::*;

    #[test]
    fn weights_before_the_filters_are_weights_after_them() {
        let hrtf = Arc::new(Hrtf::parse(&synthetic_hrtf::bytes(48_000), "synthetic").unwrap());
        let mut binaural = Binaural::new(Arc::clone(&hrtf));
        let weights = F32x8([0.5, -2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let mut impulse = [0.0; CHUNK];
        impulse[0] = 1.0;
        let impulse = Contribution {
            signal: &impulse,
            weights,
            step: F32x8::ZERO,
        };
        binaural.add(1, 0, &impulse, false);
        let (mut left, mut right) = ([1.0; CHUNK], [1.0; CHUNK]);
        binaural.finish([&mut left, &mut right]);
        assert_eq!(left, [0.0; CHUNK]);
        for (tap, value) in right.iter().enumerate() {
            let basis = hrtf.basis(0)[tap];
            assert!((value - (0.5 * basis.0[0] - 2.0 * basis.0[1])).abs() < 1e-7);
        }
    }

    #[test]
    fn odd_chunks_filter_like_even_ones() {
        let hrtf = Arc::new(Hrtf::parse(&synthetic_hrtf::bytes(48_000), "synthetic").unwrap());
        let signal: Vec<f32> = (0..600).map(|i| ((i * i) as f32 * 0.37).sin()).collect();
        let mut results = Vec::new();
        for size in [128, 1, 7, 127] {
            let mut binaural = Binaural::new(Arc::clone(&hrtf));
            let mut whole = Vec::new();
            for part in signal.chunks(size) {
                let contribution = Contribution {
                    signal: part,
                    weights: F32x8::splat(0.7),
                    step: F32x8::ZERO,
                };
                binaural.add(0, 0, &contribution, false);
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
}
