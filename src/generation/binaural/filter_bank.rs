//! Sums every arrival into a few buses an ear and filters each bus once.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at birth only. Takes ear signals with weights, gives two
//! ears of sound without latency.
//!
//! An ear's response to a direction is a weighted sum of shared filters ([`Hrtf`]), so the weights may be applied
//! before the filters: an arrival costs one multiplication a component and sample, and the filters cost the same for
//! one arrival as for a thousand.

use crate::simd::{F32x8, LaneSet, Vector, kernel};

use crate::generation::{CHUNK, Hrtf};

/// What one arrival adds to one group of an ear's buses, or to a pair of them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contribution<'a, Lanes = F32x8> {
    /// The ear signal.
    pub(crate) signal: &'a [f32],
    /// Weights at the end of the ramp.
    pub(crate) target: Lanes,
    /// Their growth a frame until then.
    pub(crate) growth: Lanes,
}

/// Two groups side by side.
pub(crate) type Pair = [F32x8; 2];

/// A ramp of weights.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ramp {
    /// Frames of it still to come before the first, at least as many as are added.
    pub(crate) left: u32,
    /// Frames, counted from the ramp's end, for which weights stay as they are in the middle.
    pub(crate) hold: u32,
}

impl Ramp {
    fn resting(frames: usize) -> Self {
        Self {
            left: frames as u32,
            hold: frames.max(1) as u32,
        }
    }
}

/// Stretches after which growing weights are worked out afresh: roundings of a steady growth all go the same way, and 32
/// of them stay below 2e-6 of the weight.
const RUN: u32 = 32;

/// Arrivals added at once: their weights take half of the registers, and the buses are walked through once.
pub(crate) const TOGETHER: usize = 8;

impl<Lanes> Contribution<'static, Lanes> {
    /// Nothing, for `frames`; `zero` are weights of nothing.
    pub(crate) fn silence(frames: usize, zero: Lanes) -> Self
    where
        Lanes: Copy,
    {
        static SILENT: [f32; CHUNK] = [0.0; CHUNK];
        Self {
            signal: &SILENT[..frames],
            target: zero,
            growth: zero,
        }
    }
}

/// The buses of both ears and the filters behind them.
#[derive(Debug)]
pub(crate) struct Binaural {
    set: LaneSet,
    groups: usize,
    /// Pairs of groups, the last of which may have one.
    pairs: usize,
    /// Tap after tap of pair after pair.
    basis: Vec<Pair>,
    taps: usize,
    /// Frames of the past that the filters need.
    history: usize,
    /// Ear after ear, pair after pair: the past, then the present chunk.
    buses: Vec<Pair>,
    /// Filtered frames, not yet summed over the lanes; of both groups of a pair, or of all groups in the first.
    filtered: Vec<Pair>,
    /// Frames since something was added.
    quiet_frames: usize,
}

impl Binaural {
    pub(crate) fn new(hrtf: &Hrtf) -> Self {
        let (taps, groups) = (hrtf.taps(), hrtf.groups());
        let (history, pairs) = (taps - 1, groups.div_ceil(2));
        let mut basis = vec![[F32x8::ZERO; 2]; pairs * taps];
        for group in 0..groups {
            let pair = &mut basis[group / 2 * taps..][..taps];
            for (both, &tap) in pair.iter_mut().zip(hrtf.basis(group)) {
                both[group % 2] = tap;
            }
        }
        Self {
            set: LaneSet::best(),
            groups,
            pairs,
            basis,
            taps,
            history,
            buses: vec![[F32x8::ZERO; 2]; 2 * pairs * (history + CHUNK)],
            filtered: vec![[F32x8::ZERO; 2]; CHUNK],
            quiet_frames: history,
        }
    }

    /// Whether buses and filters hold nothing but silence.
    fn is_silent(&self) -> bool {
        self.quiet_frames >= self.history.max(1)
    }

    /// Whether a pair of groups is added to as fast as one of them.
    pub(crate) fn adds_pairs(&self) -> bool {
        self.set.has_wide()
    }

    /// Adds arrivals of the same length to one group of an ear's buses; without a ramp at weights that rest.
    pub(crate) fn add(
        &mut self,
        ear: usize,
        group: usize,
        arrivals: &[Contribution; TOGETHER],
        ramp: Option<Ramp>,
    ) {
        let set = self.set;
        let frames = arrivals[0].signal.len();
        let bus = self.bus(ear, group / 2, frames);
        let ramp = ramp.unwrap_or(Ramp::resting(frames));
        add_arrivals(set, bus, group % 2, arrivals, ramp);
    }

    /// The same for a pair of groups, to the same bits.
    pub(crate) fn add_pair(
        &mut self,
        ear: usize,
        pair: usize,
        arrivals: &[Contribution<Pair>; TOGETHER],
        ramp: Option<Ramp>,
    ) {
        let set = self.set;
        let frames = arrivals[0].signal.len();
        let bus = self.bus(ear, pair, frames);
        let ramp = ramp.unwrap_or(Ramp::resting(frames));
        add_arrivals_to_pair(set, bus, arrivals, ramp);
    }

    fn bus(&mut self, ear: usize, pair: usize, frames: usize) -> &mut [Pair] {
        self.quiet_frames = 0;
        let length = self.history + CHUNK;
        let start = (ear * self.pairs + pair) * length + self.history;
        &mut self.buses[start..start + frames]
    }

    /// Filters what was added and overwrites `frames` of each ear, then moves on by as many.
    pub(crate) fn finish(&mut self, ears: [&mut [f32]; 2]) {
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
            .zip(self.buses.chunks_exact_mut(self.pairs * length))
        {
            let filtered = &mut self.filtered[..frames];
            filtered.fill([F32x8::ZERO; 2]);
            let bases = self.basis.chunks_exact(self.taps);
            for (number, (bus, basis)) in buses.chunks_exact_mut(length).zip(bases).enumerate() {
                let is_pair = 2 * number + 1 < self.groups;
                if is_pair && self.set.has_wide() {
                    filter_pair(self.set, basis, bus, filtered);
                } else {
                    filter(self.set, basis, bus, 0, filtered);
                    if is_pair {
                        filter(self.set, basis, bus, 1, filtered);
                    }
                }
                bus.copy_within(frames..frames + self.history, 0);
                bus[self.history..].fill([F32x8::ZERO; 2]);
            }
            for (frame, [lanes, others]) in out.iter_mut().zip(filtered) {
                *frame = (*lanes + *others).sum();
            }
        }
        self.quiet_frames += frames;
    }
}

kernel! {
    /// Adds arrivals to one group of a pair.
    fn add_arrivals<L>(
        bus: &mut [Pair],
        group: usize,
        arrivals: &[Contribution; TOGETHER],
        ramp: Ramp,
    ) {
        add_to::<L, 2>(bus, group, arrivals, ramp);
    }
}

kernel! {
    /// Adds arrivals to both groups of a pair.
    fn add_arrivals_to_pair<L, W>(
        bus: &mut [Pair],
        arrivals: &[Contribution<Pair>; TOGETHER],
        ramp: Ramp,
    ) {
        add_to::<W, 1>(bus.as_chunks_mut().0, 0, arrivals, ramp);
    }
}

kernel! {
    /// Filters one group of a pair, and adds it to the first.
    fn filter<L>(basis: &[Pair], bus: &[Pair], group: usize, out: &mut [Pair]) {
        filter_to::<L, 2>(basis, bus, group, out);
    }
}

kernel! {
    /// Filters both groups of a pair.
    fn filter_pair<L, W>(basis: &[Pair], bus: &[Pair], out: &mut [Pair]) {
        let (basis, bus) = (basis.as_chunks().0, bus.as_chunks().0);
        filter_to::<W, 1>(basis, bus, 0, out.as_chunks_mut().0);
    }
}

/// Adds arrivals whose weights are held for a stretch of the ramp each to one place of so many of a bus.
#[inline(always)]
fn add_to<V: Vector, const SPAN: usize>(
    bus: &mut [[V::Memory; SPAN]],
    at: usize,
    arrivals: &[Contribution<V::Memory>; TOGETHER],
    ramp: Ramp,
) {
    let [a, b, c, d, e, f, g, h] = arrivals;
    let frames = bus.len();
    let (of_a, of_b) = (&a.signal[..frames], &b.signal[..frames]);
    let (of_c, of_d) = (&c.signal[..frames], &d.signal[..frames]);
    let (of_e, of_f) = (&e.signal[..frames], &f.signal[..frames]);
    let (of_g, of_h) = (&g.signal[..frames], &h.signal[..frames]);
    let Ramp { left, hold } = ramp;
    let growths = V::splat(hold as f32);
    let steps: [V::Memory; TOGETHER] = [
        growths.mul(V::of(a.growth)).give(),
        growths.mul(V::of(b.growth)).give(),
        growths.mul(V::of(c.growth)).give(),
        growths.mul(V::of(d.growth)).give(),
        growths.mul(V::of(e.growth)).give(),
        growths.mul(V::of(f.growth)).give(),
        growths.mul(V::of(g.growth)).give(),
        growths.mul(V::of(h.growth)).give(),
    ];
    let mut start = 0;
    while start < frames {
        // Stretches are counted from the ramp's end.
        let first = (left - 1 - start as u32) / hold;
        let to_come = (first * hold) as f32 + 0.5 * (hold - 1) as f32;
        let to_come = V::splat(to_come);
        let mut wa = V::of(a.growth).neg_mul_add(to_come, V::of(a.target));
        let mut wb = V::of(b.growth).neg_mul_add(to_come, V::of(b.target));
        let mut wc = V::of(c.growth).neg_mul_add(to_come, V::of(c.target));
        let mut wd = V::of(d.growth).neg_mul_add(to_come, V::of(d.target));
        let mut we = V::of(e.growth).neg_mul_add(to_come, V::of(e.target));
        let mut wf = V::of(f.growth).neg_mul_add(to_come, V::of(f.target));
        let mut wg = V::of(g.growth).neg_mul_add(to_come, V::of(g.target));
        let mut wh = V::of(h.growth).neg_mul_add(to_come, V::of(h.target));
        let mut stretch = first;
        loop {
            let end = frames.min((left - stretch * hold) as usize);
            for frame in start..end {
                let sum = wa.mul_add(V::splat(of_a[frame]), V::of(bus[frame][at]));
                let sum = wb.mul_add(V::splat(of_b[frame]), sum);
                let sum = wc.mul_add(V::splat(of_c[frame]), sum);
                let sum = wd.mul_add(V::splat(of_d[frame]), sum);
                let sum = we.mul_add(V::splat(of_e[frame]), sum);
                let sum = wf.mul_add(V::splat(of_f[frame]), sum);
                let sum = wg.mul_add(V::splat(of_g[frame]), sum);
                bus[frame][at] = wh.mul_add(V::splat(of_h[frame]), sum).give();
            }
            start = end;
            if start == frames || stretch == 0 || first - stretch == RUN - 1 {
                break;
            }
            stretch -= 1;
            wa = wa.add(V::of(steps[0]));
            wb = wb.add(V::of(steps[1]));
            wc = wc.add(V::of(steps[2]));
            wd = wd.add(V::of(steps[3]));
            we = we.add(V::of(steps[4]));
            wf = wf.add(V::of(steps[5]));
            wg = wg.add(V::of(steps[6]));
            wh = wh.add(V::of(steps[7]));
        }
    }
}

/// Adds `Σ_tap basis[tap] · bus[now − tap]` to the first place of every frame of `out`, lane by lane, from one place of the others.
///
/// The bus begins a filter's length less one before the first frame.
#[inline(always)]
fn filter_to<V: Vector, const SPAN: usize>(
    basis: &[[V::Memory; SPAN]],
    bus: &[[V::Memory; SPAN]],
    at: usize,
    out: &mut [[V::Memory; SPAN]],
) {
    let taps = basis.len();
    let mut start = 0;
    while let Some([a, b, c, d]) = out[start..].first_chunk_mut() {
        let zero = V::splat(0.0);
        let (mut sum_a, mut sum_b, mut sum_c, mut sum_d) = (zero, zero, zero, zero);
        let window = &bus[start..start + taps + 3];
        let (mut in_a, mut in_b) = (V::of(window[0][at]), V::of(window[1][at]));
        let mut in_c = V::of(window[2][at]);
        for (next, tap) in window[3..].iter().zip(basis.iter().rev()) {
            let (in_d, tap) = (V::of(next[at]), V::of(tap[at]));
            sum_a = in_a.mul_add(tap, sum_a);
            sum_b = in_b.mul_add(tap, sum_b);
            sum_c = in_c.mul_add(tap, sum_c);
            sum_d = in_d.mul_add(tap, sum_d);
            (in_a, in_b, in_c) = (in_b, in_c, in_d);
        }
        a[0] = V::of(a[0]).add(sum_a).give();
        b[0] = V::of(b[0]).add(sum_b).give();
        c[0] = V::of(c[0]).add(sum_c).give();
        d[0] = V::of(d[0]).add(sum_d).give();
        start += 4;
    }
    for frame in start..out.len() {
        let mut sum = V::splat(0.0);
        for (value, tap) in bus[frame..frame + taps].iter().zip(basis.iter().rev()) {
            sum = V::of(value[at]).mul_add(V::of(tap[at]), sum);
        }
        out[frame][0] = V::of(out[frame][0]).add(sum).give();
    }
}

#[cfg(test)]
#[path = "filter_bank_tests.rs"]
mod tests;
