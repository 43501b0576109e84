//! Every source's sound into the slots of the generator, each at its own level.
//!
//! Audio side; wait-free, bounded by the number of sources; allocates at birth only. Where every source has a slot the
//! mixture is the source itself. A source that changes slots fades out of one while it fades into the other, and changes
//! again only after that; one in no slot keeps its place in its sound. What ends fades where it was heard ([`ReleaseTails`]).
//! Levels follow the frame's without a bend ([`SmoothedGain`]).

use super::messages::{NO_SLOT, SampleSourceChange, SourceRoute};
use super::smooth_gain::{CrossFade, SmoothedGain, mix_into};
use crate::runtime::engine::release_tails::{RELEASE_FRAMES, ReleaseTails};
use crate::runtime::engine::sample_source::SampleSource;
use crate::scene::SourceId;

/// Seconds of a cross-fade between two slots.
pub(super) const CROSS_FADE_S: f32 = 0.05;

/// What the renderer knows of one source.
#[derive(Default)]
struct MixerSource {
    /// Whether the last block had it in a slot.
    is_mixed: bool,
    samples: SampleSource,
    /// Whose feed it is.
    owner: Option<SourceId>,
    /// Who is here in the graphics frame in use.
    current: Option<SourceId>,
    is_present: bool,
    gain: SmoothedGain,
    target_gain: f32,
    slot: u16,
    /// The slot it is to be in, which it goes to when it has left the one before.
    next_slot: u16,
    /// How far it has come in its slot, from 0 to 1.
    fade: f32,
    /// The slot before, and how far it is from having left it.
    previous_slot: u16,
    previous_fade: f32,
}

impl MixerSource {
    /// Leaves what would have been heard next to the slots where it is heard.
    fn release(&mut self, tails: &mut ReleaseTails) {
        if !std::mem::take(&mut self.is_mixed) {
            return;
        }
        let mut samples = [0.0; RELEASE_FRAMES];
        self.samples.fill(&mut samples);
        let gain = |place: f32| self.gain.value * CrossFade { place, growth: 0.0 }.gain(0);
        tails.add(self.slot, &samples, gain(self.fade));
        tails.add(self.previous_slot, &samples, gain(self.previous_fade));
    }
}

/// All sources and the slots that they are mixed into.
pub(super) struct Mixer {
    sources: Vec<MixerSource>,
    block: usize,
    /// One block a slot.
    inputs: Vec<f32>,
    /// Slots that something was mixed into.
    active_slots: Vec<bool>,
    tails: ReleaseTails,
    scratch: Vec<f32>,
    rate_hz: f32,
}

impl Mixer {
    pub(super) fn new(sources: usize, slots: usize, block: usize, rate_hz: u32) -> Self {
        Self {
            sources: (0..sources).map(|_| MixerSource::default()).collect(),
            block,
            inputs: vec![0.0; slots * block],
            active_slots: vec![false; slots],
            tails: ReleaseTails::new(slots),
            scratch: vec![0.0; block],
            rate_hz: rate_hz as f32,
        }
    }

    /// Gives a source another sound; the old one comes back.
    pub(super) fn replace(&mut self, change: SampleSourceChange) -> SampleSource {
        let mut old = change.source;
        if let Some(seat) = self.sources.get_mut(change.id.slot()) {
            seat.release(&mut self.tails);
            std::mem::swap(&mut seat.samples, &mut old);
            seat.owner = Some(change.id);
        }
        old
    }

    /// Takes over a graphics frame's sources: those and no others are there.
    pub(super) fn set_routes(&mut self, places: &[SourceRoute]) {
        for seat in &mut self.sources {
            seat.is_present = false;
        }
        for place in places {
            let Some(seat) = self.sources.get_mut(place.id.slot()) else {
                continue;
            };
            if seat.current != Some(place.id) {
                // Another source begins at its own gain.
                seat.release(&mut self.tails);
                seat.gain = SmoothedGain::at(place.gain);
                (seat.slot, seat.fade) = (place.slot, 1.0);
                seat.previous_fade = 0.0;
            }
            seat.next_slot = place.slot;
            seat.current = Some(place.id);
            seat.is_present = true;
            seat.target_gain = place.gain;
        }
    }

    /// Mixes the next audio frames, a block at most; gives the number of samples that streams owe.
    pub(super) fn mix(&mut self, frames: usize) -> u32 {
        let Self {
            sources: seats,
            inputs,
            active_slots: sounds,
            tails,
            scratch,
            rate_hz,
            ..
        } = self;
        let growth = 1.0 / (CROSS_FADE_S * *rate_hz);
        let step = frames as f32 * growth;
        let scratch = &mut scratch[..frames];
        let mut starved = 0;
        sounds.fill(false);
        for seat in seats {
            let plays = seat.is_present
                && seat.owner == seat.current
                && !matches!(seat.samples, SampleSource::Silence);
            if !plays {
                seat.release(tails);
                continue;
            }
            if seat.slot != seat.next_slot && seat.previous_fade == 0.0 {
                (seat.previous_slot, seat.previous_fade) = (seat.slot, seat.fade);
                (seat.slot, seat.fade) = (seat.next_slot, 0.0);
            }
            let heard = seat.slot != NO_SLOT;
            seat.is_mixed = heard || seat.previous_fade > 0.0;
            if !seat.is_mixed {
                starved += seat.samples.skip(frames);
                seat.gain = SmoothedGain::at(seat.target_gain);
                continue;
            }
            starved += seat.samples.fill(scratch);
            let from = seat.gain;
            let to = from.after(frames, seat.target_gain, *rate_hz);
            let mut add = |slot: u16, fade: CrossFade| {
                let slot = usize::from(slot);
                if let Some(sounds) = sounds.get_mut(slot) {
                    let input = &mut inputs[slot * self.block..][..frames];
                    if !std::mem::replace(sounds, true) {
                        input.fill(0.0);
                    }
                    mix_into(input, scratch, [from, to], fade);
                }
            };
            if seat.previous_fade > 0.0 {
                let place = seat.previous_fade;
                let growth = -growth;
                add(seat.previous_slot, CrossFade { place, growth });
                seat.previous_fade = (place - step).max(0.0);
            }
            if heard {
                let place = seat.fade;
                add(seat.slot, CrossFade { place, growth });
                seat.fade = (place + step).min(1.0);
            }
            seat.gain = to;
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
        starved
    }

    /// The mixtures, a slice a slot; empty where nothing sounds. Gives the number of slots.
    pub(super) fn inputs<'a>(&'a self, frames: usize, inputs: &mut [&'a [f32]]) -> usize {
        let blocks = self.inputs.chunks(self.block);
        for ((place, block), sounds) in inputs.iter_mut().zip(blocks).zip(&self.active_slots) {
            *place = if *sounds { &block[..frames] } else { &[] };
        }
        self.active_slots.len()
    }
}

#[cfg(test)]
#[path = "mixer_tests.rs"]
mod tests;
