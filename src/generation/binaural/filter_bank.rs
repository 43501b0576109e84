//! Sums every arrival into a few buses an ear and filters each bus once, or into the channels of a layout.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at construction only. Input: ear signals with weights; output:
//! two ear signals, or channels, without latency.
//!
//! A lane of a bus is a channel of the output in all layouts but binaural: nothing follows the sum. In binaural sound an ear's response to a direction is a weighted sum of shared filters ([`Hrtf`]). The weights are applied before the
//! filters: an arrival costs one multiplication per component and sample, and the cost of the filters does not depend on
//! the number of arrivals.

use std::sync::Arc;

use crate::simd::{F32x8, LaneSet, kernel};

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

/// Stretches after which growing weights are recomputed: the rounding errors of a constant growth have one sign, and 32
/// of them stay below 2e-6 of the weight.
const MAX_INCREMENTS: u32 = 32;

/// Arrivals added in one pass over the buses: their weights take half of the registers.
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
        let [a, b, c, d, e, f, g, h] = arrivals;
        let frames = bus.len();
        let (signal_a, signal_b) = (&a.signal[..frames], &b.signal[..frames]);
        let (signal_c, signal_d) = (&c.signal[..frames], &d.signal[..frames]);
        let (signal_e, signal_f) = (&e.signal[..frames], &f.signal[..frames]);
        let (signal_g, signal_h) = (&g.signal[..frames], &h.signal[..frames]);
        let Ramp { left, hold } = ramp;
        let growths = L::splat(hold as f32);
        let steps: [F32x8; BATCH] = [
            growths.mul(L::from_array(a.growth)).to_array(),
            growths.mul(L::from_array(b.growth)).to_array(),
            growths.mul(L::from_array(c.growth)).to_array(),
            growths.mul(L::from_array(d.growth)).to_array(),
            growths.mul(L::from_array(e.growth)).to_array(),
            growths.mul(L::from_array(f.growth)).to_array(),
            growths.mul(L::from_array(g.growth)).to_array(),
            growths.mul(L::from_array(h.growth)).to_array(),
        ];
        let mut start = 0;
        while start < frames {
            // Stretches are counted from the ramp's end.
            let first = (left - 1 - start as u32) / hold;
            let to_come = (first * hold) as f32 + 0.5 * (hold - 1) as f32;
            let to_come = L::splat(to_come);
            let mut wa = L::from_array(a.growth).neg_mul_add(to_come, L::from_array(a.target));
            let mut wb = L::from_array(b.growth).neg_mul_add(to_come, L::from_array(b.target));
            let mut wc = L::from_array(c.growth).neg_mul_add(to_come, L::from_array(c.target));
            let mut wd = L::from_array(d.growth).neg_mul_add(to_come, L::from_array(d.target));
            let mut we = L::from_array(e.growth).neg_mul_add(to_come, L::from_array(e.target));
            let mut wf = L::from_array(f.growth).neg_mul_add(to_come, L::from_array(f.target));
            let mut wg = L::from_array(g.growth).neg_mul_add(to_come, L::from_array(g.target));
            let mut wh = L::from_array(h.growth).neg_mul_add(to_come, L::from_array(h.target));
            let mut stretch = first;
            loop {
                let end = frames.min((left - stretch * hold) as usize);
                for frame in start..end {
                    let sum = wa.mul_add(L::splat(signal_a[frame]), L::from_array(bus[frame]));
                    let sum = wb.mul_add(L::splat(signal_b[frame]), sum);
                    let sum = wc.mul_add(L::splat(signal_c[frame]), sum);
                    let sum = wd.mul_add(L::splat(signal_d[frame]), sum);
                    let sum = we.mul_add(L::splat(signal_e[frame]), sum);
                    let sum = wf.mul_add(L::splat(signal_f[frame]), sum);
                    let sum = wg.mul_add(L::splat(signal_g[frame]), sum);
                    bus[frame] = wh.mul_add(L::splat(signal_h[frame]), sum).to_array();
                }
                start = end;
                if start == frames || stretch == 0 || first - stretch == MAX_INCREMENTS - 1 {
                    break;
                }
                stretch -= 1;
                wa = wa.add(L::from_array(steps[0]));
                wb = wb.add(L::from_array(steps[1]));
                wc = wc.add(L::from_array(steps[2]));
                wd = wd.add(L::from_array(steps[3]));
                we = we.add(L::from_array(steps[4]));
                wf = wf.add(L::from_array(steps[5]));
                wg = wg.add(L::from_array(steps[6]));
                wh = wh.add(L::from_array(steps[7]));
            }
        }
    }
}

kernel! {
    /// Adds `Σ_tap basis[tap] · bus[now − tap]` to every frame of `out`, lane by lane.
    ///
    /// The bus begins `taps − 1` frames before the first output frame.
    pub(crate) fn filter<L>(basis: &[F32x8], bus: &[F32x8], out: &mut [F32x8]) {
        let taps = basis.len();
        let mut start = 0;
        while let Some([a, b, c, d]) = out[start..].first_chunk_mut() {
            let zero = L::splat(0.0);
            let (mut sum_a, mut sum_b, mut sum_c, mut sum_d) = (zero, zero, zero, zero);
            let window = &bus[start..start + taps + 3];
            let (mut in_a, mut in_b) = (L::from_array(window[0]), L::from_array(window[1]));
            let mut in_c = L::from_array(window[2]);
            for (next, tap) in window[3..].iter().zip(basis.iter().rev()) {
                let (in_d, tap) = (L::from_array(*next), L::from_array(*tap));
                sum_a = in_a.mul_add(tap, sum_a);
                sum_b = in_b.mul_add(tap, sum_b);
                sum_c = in_c.mul_add(tap, sum_c);
                sum_d = in_d.mul_add(tap, sum_d);
                (in_a, in_b, in_c) = (in_b, in_c, in_d);
            }
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
