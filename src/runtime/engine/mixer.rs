//! Mixes the samples of all sources into the slots of the generator.
//!
//! Audio side; wait-free, bounded by the number of sources; allocates in `new` only. A source that changes slots
//! cross-fades and changes again only after that; a source without a slot advances its samples silently. A source that
//! ends leaves a fade in its slot ([`ReleaseTails`]). Gains are smoothed ([`SmoothedGain`]).

use super::messages::{BED, NO_SLOT, SampleSourceChange, SourceRoute};
use super::smooth_gain::{CrossFade, SmoothedGain, mix_into};
use crate::runtime::engine::playback::PlayState;
use crate::runtime::engine::release_tails::{RELEASE_FRAMES, ReleaseTails};
use crate::runtime::engine::sample_source::SampleSource;
use crate::scene::SourceId;

/// Seconds of a cross-fade between two slots.
pub(super) const CROSS_FADE_S: f32 = 0.05;

/// State of one source.
#[derive(Default)]
struct MixerSource {
    /// Whether the last block mixed it into a slot.
    is_mixed: bool,
    samples: SampleSource,
    /// Source that `samples` belong to.
    owner: Option<SourceId>,
    /// Source of the graphics frame in use.
    current: Option<SourceId>,
    is_present: bool,
    gain: SmoothedGain,
    /// Gain of the newest frame, the one reached so far, and seconds left until it is reached.
    target_gain: f32,
    ramped_gain: f32,
    ramp_s: f32,
    play: PlayState,
    slot: u16,
    /// Slot of the newest frame, entered when the fade out of the previous one has ended.
    next_slot: u16,
    /// Position of the fade into `slot`, 0 to 1.
    fade: f32,
    /// The slot before, and the position of the fade out of it, 1 to 0.
    previous_slot: u16,
    previous_fade: f32,
}

impl MixerSource {
    /// Adds a fade of the next samples to the slots of the source.
    fn release(&mut self, tails: &mut ReleaseTails, bed: usize, now: u64) {
        if !std::mem::take(&mut self.is_mixed) {
            return;
        }
        let (mut samples, mut side) = ([0.0; RELEASE_FRAMES], [0.0; RELEASE_FRAMES]);
        let filled = self.samples.fill(&mut samples, &mut side, &self.play, now);
        let gain = |position: f32| {
            self.gain.value
                * CrossFade {
                    position,
                    slope: 0.0,
                }
                .gain(0)
        };
        for (slot, fade) in [
            (self.slot, self.fade),
            (self.previous_slot, self.previous_fade),
        ] {
            tails.add(slot, &samples, gain(fade));
            if filled.is_stereo && usize::from(slot) == bed {
                tails.add(slot + 1, &side, gain(fade));
            }
        }
    }

    /// The gain to reach after a block.
    fn advance_gain(&mut self, block_s: f32) -> f32 {
        let share = if self.ramp_s > block_s {
            block_s / self.ramp_s
        } else {
            1.0
        };
        self.ramped_gain += share * (self.target_gain - self.ramped_gain);
        self.ramp_s = (self.ramp_s - block_s).max(0.0);
        if self.ramp_s == 0.0 {
            self.ramped_gain = self.target_gain;
        }
        self.ramped_gain
    }
}

/// All sources, and the slots and the bed that they are mixed into.
pub(super) struct Mixer {
    sources: Vec<MixerSource>,
    block: usize,
    /// Slots of the generator; two more are the bed's middle and side.
    slots: usize,
    /// Audio frames mixed.
    now: u64,
    /// One block per slot.
    inputs: Vec<f32>,
    /// Whether a slot is not silent.
    active_slots: Vec<bool>,
    tails: ReleaseTails,
    scratch: Vec<f32>,
    side: Vec<f32>,
    rate_hz: f32,
}

impl Mixer {
    pub(super) fn new(sources: usize, slots: usize, block: usize, rate_hz: u32) -> Self {
        Self {
            sources: (0..sources).map(|_| MixerSource::default()).collect(),
            block,
            slots,
            now: 0,
            inputs: vec![0.0; (slots + 2) * block],
            active_slots: vec![false; slots + 2],
            tails: ReleaseTails::new(slots + 2),
            scratch: vec![0.0; block],
            side: vec![0.0; block],
            rate_hz: rate_hz as f32,
        }
    }

    /// Replaces the samples of a source and returns the old ones.
    pub(super) fn replace(&mut self, change: SampleSourceChange) -> SampleSource {
        let mut old = change.source;
        if let Some(source) = self.sources.get_mut(change.id.slot()) {
            source.release(&mut self.tails, self.slots, self.now);
            std::mem::swap(&mut source.samples, &mut old);
            source.owner = Some(change.id);
        }
        old
    }

    /// Sets the routes of a graphics frame; sources without a route end.
    pub(super) fn set_routes(&mut self, routes: &[SourceRoute]) {
        for source in &mut self.sources {
            source.is_present = false;
        }
        for route in routes {
            let Some(source) = self.sources.get_mut(route.id.slot()) else {
                continue;
            };
            let slot = match route.slot {
                BED => self.slots as u16,
                slot => slot,
            };
            if source.current != Some(route.id) {
                // A new source begins at its own gain, without a fade.
                source.release(&mut self.tails, self.slots, self.now);
                source.gain = SmoothedGain::at(route.gain);
                source.ramped_gain = route.gain;
                (source.slot, source.fade) = (slot, 1.0);
                source.previous_fade = 0.0;
            }
            source.next_slot = slot;
            source.current = Some(route.id);
            source.is_present = true;
            source.target_gain = route.gain;
            source.ramp_s = route.ramp_s;
            source.play = route.play;
        }
    }

    /// Mixes the next audio frames, a block at most; returns the number of samples missing in streams.
    pub(super) fn mix(&mut self, frames: usize) -> u32 {
        let Self {
            sources,
            inputs,
            active_slots: sounds,
            tails,
            scratch,
            side,
            rate_hz,
            now,
            slots: bed,
            ..
        } = self;
        let (bed, at) = (*bed, *now);
        *now += frames as u64;
        let block_s = frames as f32 / *rate_hz;
        let slope = 1.0 / (CROSS_FADE_S * *rate_hz);
        let step = frames as f32 * slope;
        let (scratch, side) = (&mut scratch[..frames], &mut side[..frames]);
        let mut underrun = 0;
        sounds.fill(false);
        for source in sources {
            let plays = source.is_present
                && source.owner == source.current
                && !matches!(source.samples, SampleSource::Silence);
            let target_gain = source.advance_gain(block_s);
            if !plays {
                source.release(tails, bed, at);
                continue;
            }
            if source.slot != source.next_slot && source.previous_fade == 0.0 {
                (source.previous_slot, source.previous_fade) = (source.slot, source.fade);
                (source.slot, source.fade) = (source.next_slot, 0.0);
            }
            let is_audible = source.slot != NO_SLOT;
            source.is_mixed = is_audible || source.previous_fade > 0.0;
            if !source.is_mixed {
                underrun += source.samples.skip(frames, &source.play, at);
                source.gain = SmoothedGain::at(target_gain);
                continue;
            }
            let filled = source.samples.fill(scratch, side, &source.play, at);
            underrun += filled.missing;
            let from = source.gain;
            let to = from.after(frames, target_gain, *rate_hz);
            let mut add_to = |slot: usize, samples: &[f32], fade: CrossFade| {
                if let Some(sounds) = sounds.get_mut(slot) {
                    let input = &mut inputs[slot * self.block..][..frames];
                    if !std::mem::replace(sounds, true) {
                        input.fill(0.0);
                    }
                    mix_into(input, samples, [from, to], fade);
                }
            };
            let mut add = |slot: u16, fade: CrossFade| {
                let slot = usize::from(slot);
                add_to(slot, scratch, fade);
                if filled.is_stereo && slot == bed {
                    add_to(slot + 1, side, fade);
                }
            };
            if source.previous_fade > 0.0 {
                let position = source.previous_fade;
                let slope = -slope;
                add(source.previous_slot, CrossFade { position, slope });
                source.previous_fade = (position - step).max(0.0);
            }
            if is_audible {
                let position = source.fade;
                add(source.slot, CrossFade { position, slope });
                source.fade = (position + step).min(1.0);
            }
            source.gain = to;
        }
        for (slot, sounds) in sounds.iter_mut().enumerate() {
            if tails.is_active(slot) {
                let input = &mut inputs[slot * self.block..][..frames];
                if !std::mem::replace(sounds, true) {
                    input.fill(0.0);
                }
                tails.mix(slot, input);
            }
        }
        underrun
    }

    /// Writes one slice per slot to `inputs`, empty for silence; returns the number of slots.
    pub(super) fn inputs<'a>(&'a self, frames: usize, inputs: &mut [&'a [f32]]) -> usize {
        for (slot, input) in inputs.iter_mut().enumerate().take(self.slots) {
            *input = self.input(slot, frames);
        }
        self.slots
    }

    /// The sources without a position: middle and side, empty for silence.
    pub(super) fn bed(&self, frames: usize) -> [&[f32]; 2] {
        [0, 1].map(|n| self.input(self.slots + n, frames))
    }

    fn input(&self, slot: usize, frames: usize) -> &[f32] {
        match self.active_slots[slot] {
            true => &self.inputs[slot * self.block..][..frames],
            false => &[],
        }
    }
}

#[cfg(test)]
#[path = "mixer_tests.rs"]
mod tests;
