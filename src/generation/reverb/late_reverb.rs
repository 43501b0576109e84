//! The late reverb: a feedback delay network for each common decay.
//!
//! Audio side; wait-free, bounded by the chunk; allocates at construction only. Input: the sends ([`LateSends`]); output: the
//! signals of the plane waves of [`wave_directions`](crate::generation::reverb::wave_shares::wave_directions).

use crate::extrapolation::{FramePaths, LATE_GROUPS};

use crate::generation::delay::delay_line::DelayLine;
use crate::generation::ramp::ChunkSpan;
use crate::generation::reverb::late_sends::{LateSends, Receivers};
use crate::generation::reverb::mixing::{LINES, Rows};
use crate::generation::reverb::network::{BUSES, Network, NetworkScratch};
use crate::generation::reverb::shelf_filter::ShelfDesign;
use crate::generation::reverb::wave_shares::WaveShares;
use crate::generation::{BandCorrection, CHUNK};

/// The networks take turns: one graphics frame of so many designs a network's filters anew, which costs more than the rest of
/// its frame. Decays and directions change little within so many.
const DESIGN_EVERY: usize = 4;

/// All networks.
#[derive(Debug)]
pub(crate) struct LateReverb {
    design: ShelfDesign,
    shares: WaveShares,
    networks: [Network; LATE_GROUPS],
    scratch: NetworkScratch,
    sends: LateSends,
    /// Graphics frames so far.
    frames: usize,
    /// The waves in the chunk, summed over the networks.
    waves: Box<Rows>,
}

impl LateReverb {
    pub(crate) fn new(rate_hz: u32, max_sources: usize) -> Self {
        let networks = std::array::from_fn(|group| Network::new(rate_hz, group, LATE_GROUPS));
        let receivers = Receivers {
            rate_hz: rate_hz as f32,
            timings: networks.each_ref().map(Network::timing),
        };
        Self {
            design: ShelfDesign::new(f64::from(rate_hz)),
            shares: WaveShares::new(),
            networks,
            scratch: NetworkScratch::new(),
            sends: LateSends::new(receivers, max_sources),
            frames: 0,
            waves: Box::new([[0.0; CHUNK]; LINES]),
        }
    }

    /// Ramps to the groups and sends of a frame, with delays of at most `longest_s` by source slot; `left` frames of
    /// the last ramp remain.
    pub(crate) fn set_frame(
        &mut self,
        frame: &FramePaths,
        longest_s: &[f64],
        correction: &BandCorrection,
        left: u32,
        ramp: u32,
    ) {
        self.frames = self.frames.wrapping_add(1);
        for (group, network) in self.networks.iter_mut().enumerate() {
            let is_turn = self.frames.wrapping_add(group).is_multiple_of(DESIGN_EVERY);
            let is_used = frame
                .late
                .iter()
                .any(|send| usize::from(send.group) == group);
            if !is_turn && !network.is_silent() {
                network.keep_decay(left, ramp);
            } else if is_used || !network.is_silent() {
                let group = &frame.late_groups[group];
                network.set_frame(group, &self.design, &self.shares, left, ramp);
            }
        }
        self.sends
            .set_frame(frame, longest_s, correction, left, ramp);
    }

    /// Adds one source's sends for a chunk. Call for every source before [`Self::process`].
    pub(crate) fn collect(&mut self, slot: usize, line: &DelayLine, chunk: ChunkSpan) {
        self.sends.collect(slot, line, chunk);
    }

    /// Runs the networks for a chunk; returns the waves' signals, or `None` if all networks are silent.
    pub(crate) fn process(&mut self, left: u32, frames: usize) -> Option<&Rows> {
        for wave in self.waves.iter_mut() {
            wave[..frames].fill(0.0);
        }
        let mut is_audible = false;
        for (group, network) in self.networks.iter_mut().enumerate() {
            for bus in 0..BUSES {
                network.feed(bus, self.sends.bus(group, bus, frames));
            }
            is_audible |= network.process(left, frames, &mut self.scratch, &mut self.waves);
        }
        self.sends.clear();
        is_audible.then_some(&*self.waves)
    }
}

#[cfg(test)]
#[path = "late_reverb_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "burst_tests.rs"]
mod burst_tests;
