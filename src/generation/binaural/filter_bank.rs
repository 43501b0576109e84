//! Sums every arrival into a few buses an ear and filters each bus once, or into the channels of a layout.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at construction only. Input: ear signals with weights; output:
//! two ear signals, or channels, without latency.
//!
//! A lane of a bus is a channel of the output in all layouts but binaural: nothing follows the sum. In binaural sound an ear's response to a direction is a weighted sum of shared filters ([`Hrtf`]). The weights are applied before the
//! filters: an arrival costs one multiplication per component and sample, and the cost of the filters does not depend on
//! the number of arrivals.

use std::sync::Arc;

use crate::simd::{F32x8, LaneSet, Lanes, kernel};

use crate::generation::panning::direction_table::LANES;
use crate::generation::{CHUNK, Hrtf};

/// Contribution of one arrival to one group of an ear's buses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contribution<'a> {
    /// The ear signal.
    pub(crate) signal: &'a [f32],
    /// Weights at the end of the ramp.
    pub(crate) target: F32x8,
    /// Growth per frame during the ramp.
    pub(crate) growth: F32x8,
}

/// A ramp of weights.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ramp {
    /// Frames left before the first one; at least the number of frames added.
    pub(crate) left: u32,
    /// Frames per stretch, counted from the ramp's end. Each stretch has the weights of its middle.
    pub(crate) hold: u32,
}

impl Ramp {
    fn constant(frames: usize) -> Self {
        Self {
            left: frames as u32,
            hold: frames.max(1) as u32,
        }
    }
}

/// Arrivals added in one pass over the buses.
pub(crate) const BATCH: usize = 8;

impl Contribution<'static> {
    /// `frames` of silence with zero weights.
    pub(crate) fn silence(frames: usize) -> Self {
        static SILENT: [f32; CHUNK] = [0.0; CHUNK];
        Self {
            signal: &SILENT[..frames],
            target: F32x8::ZERO,
            growth: F32x8::ZERO,
        }
    }
}

/// The buses of the output and the filters of binaural sound. A clone shares the filters and has buses of its own.
#[derive(Debug, Clone)]
pub(crate) struct OutputBuses {
    set: LaneSet,
    ears: usize,
    groups: usize,
    /// Channels of a layout whose buses are not filtered.
    channels: Option<usize>,
    /// Ordered by group, then by tap.
    basis: Arc<[F32x8]>,
    taps: usize,
    /// Past frames that the filters read.
    history: usize,
    /// Ordered by ear, then by group; each bus is its history, then the present chunk.
    buses: Vec<F32x8>,
    /// Filtered frames of all groups before the sum over the lanes.
    filtered: Vec<F32x8>,
    /// Frames since the last addition.
    quiet_frames: usize,
}

impl OutputBuses {
    /// Buses that are the channels of a layout.
    pub(crate) fn of_channels(channels: usize) -> Self {
        let groups = channels.div_ceil(LANES);
        Self {
            set: LaneSet::best(),
            ears: 1,
            groups,
            channels: Some(channels),
            basis: Arc::new([]),
            taps: 1,
            history: 0,
            buses: vec![F32x8::ZERO; groups * CHUNK],
            filtered: Vec::new(),
            quiet_frames: 0,
        }
    }

    /// Buses of both ears before the filters of an HRTF set.
    pub(crate) fn binaural(hrtf: &Hrtf) -> Self {
        let (taps, groups) = (hrtf.taps(), hrtf.groups());
        let history = taps - 1;
        let mut basis = vec![F32x8::ZERO; groups * taps];
        for (group, basis) in basis.chunks_exact_mut(taps).enumerate() {
            for (tap, &value) in basis.iter_mut().zip(hrtf.basis(group)) {
                *tap = value;
            }
        }
        Self {
            set: LaneSet::best(),
            ears: 2,
            groups,
            channels: None,
            basis: basis.into(),
            taps,
            history,
            buses: vec![F32x8::ZERO; 2 * groups * (history + CHUNK)],
            filtered: vec![F32x8::ZERO; CHUNK],
            quiet_frames: history,
        }
    }

    /// Readings of an arrival.
    pub(crate) fn ears(&self) -> usize {
        self.ears
    }

    /// Frames until buses and filters are silent after the last addition.
    pub(crate) fn tail_frames(&self) -> usize {
        self.history
    }

    /// Whether buses and filters are silent.
    fn is_silent(&self) -> bool {
        self.quiet_frames >= self.history.max(1)
    }

    /// Adds arrivals of equal length to one group of an ear's buses; the weights are constant without a ramp.
    pub(crate) fn add(
        &mut self,
        ear: usize,
        group: usize,
        arrivals: &[Contribution; BATCH],
        ramp: Option<Ramp>,
    ) {
        self.quiet_frames = 0;
        let frames = arrivals[0].signal.len();
        let length = self.history + CHUNK;
        let start = (ear * self.groups + group) * length + self.history;
        let bus = &mut self.buses[start..start + frames];
        let ramp = ramp.unwrap_or(Ramp::constant(frames));
        add_arrivals(self.set, bus, arrivals, ramp);
    }

    /// Adds the channels, or the filtered buses of both ears, to interleaved frames of `stride` channels, at least as many,
    /// and advances the buses.
    pub(crate) fn finish(&mut self, output: &mut [f32], stride: usize) {
        let length = self.history + CHUNK;
        let frames = output.len() / stride;
        if self.is_silent() {
            return;
        }
        if let Some(channels) = self.channels {
            for (group, bus) in self.buses.chunks_exact_mut(length).enumerate() {
                let first = group * LANES;
                let used = (channels - first).min(LANES);
                add_channels(&bus[..frames], &mut output[first..], stride, used);
                bus.fill(F32x8::ZERO);
            }
            self.quiet_frames += frames;
            return;
        }
        let ears = self.buses.chunks_exact_mut(self.groups * length);
        for (ear, buses) in ears.enumerate() {
            let filtered = &mut self.filtered[..frames];
            filtered.fill(F32x8::ZERO);
            let bases = self.basis.chunks_exact(self.taps);
            for (bus, basis) in buses.chunks_exact_mut(length).zip(bases) {
                filter(self.set, basis, bus, filtered);
                bus.copy_within(frames..frames + self.history, 0);
                bus[self.history..].fill(F32x8::ZERO);
            }
            let samples = output[ear..].iter_mut().step_by(stride);
            for (sample, lanes) in samples.zip(filtered) {
                *sample += lanes.sum();
            }
        }
        self.quiet_frames += frames;
    }
}

/// Adds the first `used` lanes of a bus to as many channels of interleaved frames.
fn add_channels(bus: &[F32x8], output: &mut [f32], stride: usize, used: usize) {
    for (frame, lanes) in output.chunks_mut(stride).zip(bus) {
        for (sample, lane) in frame.iter_mut().zip(&lanes.0[..used]) {
            *sample += lane;
        }
    }
}

kernel! {
    /// Adds arrivals to one group; the weights are constant within each stretch of the ramp.
    fn add_arrivals<L>(bus: &mut [F32x8], arrivals: &[Contribution; BATCH], ramp: Ramp) {
        let Ramp { left, hold } = ramp;
        let [a, b, c, d, e, f, g, h] = arrivals;
        let frames = bus.len();
        let (signal_a, signal_b) = (&a.signal[..frames], &b.signal[..frames]);
        let (signal_c, signal_d) = (&c.signal[..frames], &d.signal[..frames]);
        let (signal_e, signal_f) = (&e.signal[..frames], &f.signal[..frames]);
        let (signal_g, signal_h) = (&g.signal[..frames], &h.signal[..frames]);
        // Stretches are counted from the ramp's end.
        let mut stretch = left.saturating_sub(1) / hold;
        let mut start = 0;
        while start < frames {
            let to_come = L::splat((stretch * hold) as f32 + 0.5 * (hold - 1) as f32);
            let end = frames.min((left - stretch * hold) as usize);
            while start + 8 <= end
                && let Some(frames) = bus[start..end].first_chunk_mut::<8>()
            {
                // The sums of eight frames do not wait for each other.
                let mut sums = load_eight::<L>(frames);
                add_to_eight(&mut sums, weights(a, to_come), &signal_a[start..]);
                add_to_eight(&mut sums, weights(b, to_come), &signal_b[start..]);
                add_to_eight(&mut sums, weights(c, to_come), &signal_c[start..]);
                add_to_eight(&mut sums, weights(d, to_come), &signal_d[start..]);
                add_to_eight(&mut sums, weights(e, to_come), &signal_e[start..]);
                add_to_eight(&mut sums, weights(f, to_come), &signal_f[start..]);
                add_to_eight(&mut sums, weights(g, to_come), &signal_g[start..]);
                add_to_eight(&mut sums, weights(h, to_come), &signal_h[start..]);
                store_eight(sums, frames);
                start += 8;
            }
            while start < end {
                let sum = L::from_array(bus[start]);
                let sum = weights(a, to_come).mul_add(L::splat(signal_a[start]), sum);
                let sum = weights(b, to_come).mul_add(L::splat(signal_b[start]), sum);
                let sum = weights(c, to_come).mul_add(L::splat(signal_c[start]), sum);
                let sum = weights(d, to_come).mul_add(L::splat(signal_d[start]), sum);
                let sum = weights(e, to_come).mul_add(L::splat(signal_e[start]), sum);
                let sum = weights(f, to_come).mul_add(L::splat(signal_f[start]), sum);
                let sum = weights(g, to_come).mul_add(L::splat(signal_g[start]), sum);
                let sum = weights(h, to_come).mul_add(L::splat(signal_h[start]), sum);
                bus[start] = sum.to_array();
                start += 1;
            }
            stretch = stretch.saturating_sub(1);
        }
    }
}

/// Adds one tap of a filter to the sums of four frames.
#[inline(always)]
fn add_tap<L: Lanes>(sums: &mut [L; 4], input: [L; 4], tap: &F32x8) {
    let tap = L::from_array(*tap);
    sums[0] = input[0].mul_add(tap, sums[0]);
    sums[1] = input[1].mul_add(tap, sums[1]);
    sums[2] = input[2].mul_add(tap, sums[2]);
    sums[3] = input[3].mul_add(tap, sums[3]);
}

/// Weights of an arrival some frames before the ramp's end.
#[inline(always)]
fn weights<L: Lanes>(one: &Contribution, to_come: L) -> L {
    L::from_array(one.growth).neg_mul_add(to_come, L::from_array(one.target))
}

#[inline(always)]
fn load_eight<L: Lanes>(frames: &[F32x8; 8]) -> [L; 8] {
    let [a, b, c, d, e, f, g, h] = *frames;
    let (a, b, c, d) = (
        L::from_array(a),
        L::from_array(b),
        L::from_array(c),
        L::from_array(d),
    );
    let (e, f, g, h) = (
        L::from_array(e),
        L::from_array(f),
        L::from_array(g),
        L::from_array(h),
    );
    [a, b, c, d, e, f, g, h]
}

#[inline(always)]
fn store_eight<L: Lanes>(sums: [L; 8], frames: &mut [F32x8; 8]) {
    let [a, b, c, d, e, f, g, h] = sums;
    let (a, b, c, d) = (a.to_array(), b.to_array(), c.to_array(), d.to_array());
    let (e, f, g, h) = (e.to_array(), f.to_array(), g.to_array(), h.to_array());
    *frames = [a, b, c, d, e, f, g, h];
}

/// Adds weights times the first eight values of a signal, each to a sum of its own.
#[inline(always)]
fn add_to_eight<L: Lanes>(sums: &mut [L; 8], weights: L, signal: &[f32]) {
    let Some([a, b, c, d, e, f, g, h]) = signal.first_chunk() else {
        return;
    };
    sums[0] = weights.mul_add(L::splat(*a), sums[0]);
    sums[1] = weights.mul_add(L::splat(*b), sums[1]);
    sums[2] = weights.mul_add(L::splat(*c), sums[2]);
    sums[3] = weights.mul_add(L::splat(*d), sums[3]);
    sums[4] = weights.mul_add(L::splat(*e), sums[4]);
    sums[5] = weights.mul_add(L::splat(*f), sums[5]);
    sums[6] = weights.mul_add(L::splat(*g), sums[6]);
    sums[7] = weights.mul_add(L::splat(*h), sums[7]);
}

kernel! {
    /// Adds `Σ_tap basis[tap] · bus[now − tap]` to every frame of `out`, lane by lane.
    ///
    /// The bus begins `taps − 1` frames before the first output frame.
    pub(crate) fn filter<L>(basis: &[F32x8], bus: &[F32x8], out: &mut [F32x8]) {
        let taps = basis.len();
        let mut start = 0;
        while let Some([a, b, c, d]) = out[start..].first_chunk_mut() {
            let window = &bus[start..start + taps + 3];
            let mut sums = [L::splat(0.0); 4];
            let (mut in_a, mut in_b) = (L::from_array(window[0]), L::from_array(window[1]));
            let mut in_c = L::from_array(window[2]);
            // With four taps at once no input changes its register.
            let (inputs, last_inputs) = window[3..].as_chunks::<4>();
            let (first_taps, taps_by_four) = basis.as_rchunks::<4>();
            for (next, taps) in inputs.iter().zip(taps_by_four.iter().rev()) {
                let in_d = L::from_array(next[0]);
                add_tap(&mut sums, [in_a, in_b, in_c, in_d], &taps[3]);
                in_a = L::from_array(next[1]);
                add_tap(&mut sums, [in_b, in_c, in_d, in_a], &taps[2]);
                in_b = L::from_array(next[2]);
                add_tap(&mut sums, [in_c, in_d, in_a, in_b], &taps[1]);
                in_c = L::from_array(next[3]);
                add_tap(&mut sums, [in_d, in_a, in_b, in_c], &taps[0]);
            }
            for (next, tap) in last_inputs.iter().zip(first_taps.iter().rev()) {
                let in_d = L::from_array(*next);
                add_tap(&mut sums, [in_a, in_b, in_c, in_d], tap);
                (in_a, in_b, in_c) = (in_b, in_c, in_d);
            }
            let [sum_a, sum_b, sum_c, sum_d] = sums;
            *a = L::from_array(*a).add(sum_a).to_array();
            *b = L::from_array(*b).add(sum_b).to_array();
            *c = L::from_array(*c).add(sum_c).to_array();
            *d = L::from_array(*d).add(sum_d).to_array();
            start += 4;
        }
        for frame in start..out.len() {
            let mut sum = L::splat(0.0);
            for (value, tap) in bus[frame..frame + taps].iter().zip(basis.iter().rev()) {
                sum = L::from_array(*value).mul_add(L::from_array(*tap), sum);
            }
            out[frame] = L::from_array(out[frame]).add(sum).to_array();
        }
    }
}

#[cfg(test)]
#[path = "filter_bank_tests.rs"]
mod tests;
