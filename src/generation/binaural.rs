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
    /// Weights at the end of the ramp.
    pub(super) target: F32x8,
    /// Their growth a frame until then.
    pub(super) growth: F32x8,
}

/// A ramp of weights.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    /// Frames of it still to come before the first, at least as many as are added.
    pub(super) left: u32,
    /// Frames, counted from the ramp's end, for which weights stay as they are in the middle.
    pub(super) hold: u32,
}

/// Stretches after which growing weights are worked out afresh: roundings of a steady growth all go the same way, and 32
/// of them stay below 2e-6 of the weight.
const RUN: u32 = 32;

/// Arrivals added at once: their weights take half of the registers, and the buses are walked through once.
pub(super) const TOGETHER: usize = 8;

impl Contribution<'static> {
    /// Nothing, for `frames`.
    pub(super) fn silence(frames: usize) -> Self {
        static SILENT: [f32; CHUNK] = [0.0; CHUNK];
        Self {
            signal: &SILENT[..frames],
            target: F32x8::ZERO,
            growth: F32x8::ZERO,
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

    /// Adds arrivals of the same length to one group of an ear's buses; without a ramp at weights that rest.
    pub(super) fn add(
        &mut self,
        ear: usize,
        group: usize,
        arrivals: &[Contribution; TOGETHER],
        ramp: Option<Ramp>,
    ) {
        let set = self.set;
        let frames = arrivals[0].signal.len();
        let bus = self.bus(ear, group, frames);
        let resting = Ramp {
            left: frames as u32,
            hold: frames.max(1) as u32,
        };
        add_arrivals(set, bus, arrivals, ramp.unwrap_or(resting));
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
    /// Adds arrivals whose weights are held for a stretch of the ramp each.
    fn add_arrivals<L>(bus: &mut [F32x8], arrivals: &[Contribution; TOGETHER], ramp: Ramp) {
        let [a, b, c, d, e, f, g, h] = arrivals;
        let frames = bus.len();
        let (of_a, of_b) = (&a.signal[..frames], &b.signal[..frames]);
        let (of_c, of_d) = (&c.signal[..frames], &d.signal[..frames]);
        let (of_e, of_f) = (&e.signal[..frames], &f.signal[..frames]);
        let (of_g, of_h) = (&g.signal[..frames], &h.signal[..frames]);
        let Ramp { left, hold } = ramp;
        let growths = L::splat(hold as f32);
        let steps: [F32x8; TOGETHER] = [
            growths.mul(L::of(a.growth)).give(),
            growths.mul(L::of(b.growth)).give(),
            growths.mul(L::of(c.growth)).give(),
            growths.mul(L::of(d.growth)).give(),
            growths.mul(L::of(e.growth)).give(),
            growths.mul(L::of(f.growth)).give(),
            growths.mul(L::of(g.growth)).give(),
            growths.mul(L::of(h.growth)).give(),
        ];
        let mut start = 0;
        while start < frames {
            // Stretches are counted from the ramp's end.
            let first = (left - 1 - start as u32) / hold;
            let to_come = (first * hold) as f32 + 0.5 * (hold - 1) as f32;
            let to_come = L::splat(to_come);
            let mut wa = L::of(a.growth).neg_mul_add(to_come, L::of(a.target));
            let mut wb = L::of(b.growth).neg_mul_add(to_come, L::of(b.target));
            let mut wc = L::of(c.growth).neg_mul_add(to_come, L::of(c.target));
            let mut wd = L::of(d.growth).neg_mul_add(to_come, L::of(d.target));
            let mut we = L::of(e.growth).neg_mul_add(to_come, L::of(e.target));
            let mut wf = L::of(f.growth).neg_mul_add(to_come, L::of(f.target));
            let mut wg = L::of(g.growth).neg_mul_add(to_come, L::of(g.target));
            let mut wh = L::of(h.growth).neg_mul_add(to_come, L::of(h.target));
            let mut stretch = first;
            loop {
                let end = frames.min((left - stretch * hold) as usize);
                for frame in start..end {
                    let sum = wa.mul_add(L::splat(of_a[frame]), L::of(bus[frame]));
                    let sum = wb.mul_add(L::splat(of_b[frame]), sum);
                    let sum = wc.mul_add(L::splat(of_c[frame]), sum);
                    let sum = wd.mul_add(L::splat(of_d[frame]), sum);
                    let sum = we.mul_add(L::splat(of_e[frame]), sum);
                    let sum = wf.mul_add(L::splat(of_f[frame]), sum);
                    let sum = wg.mul_add(L::splat(of_g[frame]), sum);
                    bus[frame] = wh.mul_add(L::splat(of_h[frame]), sum).give();
                }
                start = end;
                if start == frames || stretch == 0 || first - stretch == RUN - 1 {
                    break;
                }
                stretch -= 1;
                wa = wa.add(L::of(steps[0]));
                wb = wb.add(L::of(steps[1]));
                wc = wc.add(L::of(steps[2]));
                wd = wd.add(L::of(steps[3]));
                we = we.add(L::of(steps[4]));
                wf = wf.add(L::of(steps[5]));
                wg = wg.add(L::of(steps[6]));
                wh = wh.add(L::of(steps[7]));
            }
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
