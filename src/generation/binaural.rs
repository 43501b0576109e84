//! Sums every arrival into a few buses an ear and filters each bus once.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at birth only. Takes ear signals with weights, gives two
//! ears of sound without latency.
//!
//! An ear's response to a direction is a weighted sum of shared filters ([`Hrtf`]), so the weights may be applied
//! before the filters: an arrival costs one multiplication a component and sample, and the filters cost the same for
//! one arrival as for a thousand.

use std::sync::Arc;

use crate::simd::{F32x8, LaneSet, kernel};

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

/// Arrivals added at once: their weights and growths fill the registers, and the buses are walked through once.
pub(super) const TOGETHER: usize = 4;

impl Contribution<'static> {
    /// Nothing, for `frames`.
    pub(super) fn silence(frames: usize) -> Self {
        static SILENT: [f32; CHUNK] = [0.0; CHUNK];
        Self {
            signal: &SILENT[..frames],
            weights: F32x8::ZERO,
            step: F32x8::ZERO,
        }
    }
}

/// The buses of both ears and the filters behind them.
#[derive(Debug)]
pub(super) struct Binaural {
    set: LaneSet,
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
            set: LaneSet::best(),
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

    /// Adds arrivals of the same length to one group of an ear's buses; `moving` says whether any weight changes.
    pub(super) fn add(
        &mut self,
        ear: usize,
        group: usize,
        arrivals: &[Contribution; TOGETHER],
        moving: bool,
    ) {
        let set = self.set;
        let bus = self.bus(ear, group, arrivals[0].signal.len());
        if moving {
            add_moving(set, bus, arrivals);
        } else {
            add_steady(set, bus, arrivals);
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
                filter(self.set, self.hrtf.basis(group), bus, filtered);
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

kernel! {
    /// Adds arrivals whose weights rest.
    fn add_steady<L>(bus: &mut [F32x8], arrivals: &[Contribution; TOGETHER]) {
        let [a, b, c, d] = arrivals;
        let frames = bus.len();
        let (of_a, of_b) = (&a.signal[..frames], &b.signal[..frames]);
        let (of_c, of_d) = (&c.signal[..frames], &d.signal[..frames]);
        let (wa, wb) = (L::of(a.weights), L::of(b.weights));
        let (wc, wd) = (L::of(c.weights), L::of(d.weights));
        for frame in 0..frames {
            let sum = wa.mul_add(L::splat(of_a[frame]), L::of(bus[frame]));
            let sum = wb.mul_add(L::splat(of_b[frame]), sum);
            let sum = wc.mul_add(L::splat(of_c[frame]), sum);
            bus[frame] = wd.mul_add(L::splat(of_d[frame]), sum).give();
        }
    }
}

kernel! {
    /// Adds arrivals whose weights grow.
    fn add_moving<L>(bus: &mut [F32x8], arrivals: &[Contribution; TOGETHER]) {
        let [a, b, c, d] = arrivals;
        let frames = bus.len();
        let (of_a, of_b) = (&a.signal[..frames], &b.signal[..frames]);
        let (of_c, of_d) = (&c.signal[..frames], &d.signal[..frames]);
        let (step_a, step_b) = (L::of(a.step), L::of(b.step));
        let (step_c, step_d) = (L::of(c.step), L::of(d.step));
        let mut start = 0;
        while start < frames {
            let end = frames.min(start + RUN);
            let before = L::splat(start as f32);
            let mut wa = step_a.mul_add(before, L::of(a.weights));
            let mut wb = step_b.mul_add(before, L::of(b.weights));
            let mut wc = step_c.mul_add(before, L::of(c.weights));
            let mut wd = step_d.mul_add(before, L::of(d.weights));
            for frame in start..end {
                wa = wa.add(step_a);
                wb = wb.add(step_b);
                wc = wc.add(step_c);
                wd = wd.add(step_d);
                let sum = wa.mul_add(L::splat(of_a[frame]), L::of(bus[frame]));
                let sum = wb.mul_add(L::splat(of_b[frame]), sum);
                let sum = wc.mul_add(L::splat(of_c[frame]), sum);
                bus[frame] = wd.mul_add(L::splat(of_d[frame]), sum).give();
            }
            start = end;
        }
    }
}

kernel! {
    /// Adds `Σ_tap basis[tap] · bus[now − tap]` to every frame of `out`, lane by lane.
    ///
    /// The bus begins a filter's length less one before the first frame.
    fn filter<L>(basis: &[F32x8], bus: &[F32x8], out: &mut [F32x8]) {
        let taps = basis.len();
        let mut start = 0;
        while let Some([a, b, c, d]) = out[start..].first_chunk_mut() {
            let zero = L::splat(0.0);
            let (mut sum_a, mut sum_b, mut sum_c, mut sum_d) = (zero, zero, zero, zero);
            let window = &bus[start..start + taps + 3];
            let (mut in_a, mut in_b) = (L::of(window[0]), L::of(window[1]));
            let mut in_c = L::of(window[2]);
            for (&next, &tap) in window[3..].iter().zip(basis.iter().rev()) {
                let (in_d, tap) = (L::of(next), L::of(tap));
                sum_a = in_a.mul_add(tap, sum_a);
                sum_b = in_b.mul_add(tap, sum_b);
                sum_c = in_c.mul_add(tap, sum_c);
                sum_d = in_d.mul_add(tap, sum_d);
                (in_a, in_b, in_c) = (in_b, in_c, in_d);
            }
            *a = L::of(*a).add(sum_a).give();
            *b = L::of(*b).add(sum_b).give();
            *c = L::of(*c).add(sum_c).give();
            *d = L::of(*d).add(sum_d).give();
            start += 4;
        }
        for frame in start..out.len() {
            let mut sum = L::splat(0.0);
            for (&value, &tap) in bus[frame..frame + taps].iter().zip(basis.iter().rev()) {
                sum = L::of(value).mul_add(L::of(tap), sum);
            }
            out[frame] = L::of(out[frame]).add(sum).give();
        }
    }
}

#[cfg(test)]
#[path = "binaural_tests.rs"]
mod tests;
