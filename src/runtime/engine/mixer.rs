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
    sounds: bool,
    feed: SampleSource,
    /// Whose feed it is.
    owner: Option<SourceId>,
    /// Who is here in the graphics frame in use.
    tenant: Option<SourceId>,
    is_present: bool,
    gain: SmoothedGain,
    target: f32,
    slot: u16,
    /// The slot it is to be in, which it goes to when it has left the one before.
    wanted: u16,
    /// How far it has come in its slot, from 0 to 1.
    fade: f32,
    /// The slot before, and how far it is from having left it.
    left: u16,
    left_fade: f32,
}

impl MixerSource {
    /// Leaves what would have been heard next to the slots where it is heard.
    fn end(&mut self, tails: &mut ReleaseTails) {
        if !std::mem::take(&mut self.sounds) {
            return;
        }
        let mut samples = [0.0; RELEASE_FRAMES];
        self.feed.fill(&mut samples);
        let gain = |place: f32| self.gain.value * CrossFade { place, growth: 0.0 }.share(0);
        tails.add(self.slot, &samples, gain(self.fade));
        tails.add(self.left, &samples, gain(self.left_fade));
    }
}

/// All sources and the slots that they are mixed into.
pub(super) struct Mixer {
    seats: Vec<MixerSource>,
    block: usize,
    /// One block a slot.
    inputs: Vec<f32>,
    /// Slots that something was mixed into.
    sounds: Vec<bool>,
    tails: ReleaseTails,
    scratch: Vec<f32>,
    rate_hz: f32,
}

impl Mixer {
    pub(super) fn new(sources: usize, slots: usize, block: usize, rate_hz: u32) -> Self {
        Self {
            seats: (0..sources).map(|_| MixerSource::default()).collect(),
            block,
            inputs: vec![0.0; slots * block],
            sounds: vec![false; slots],
            tails: ReleaseTails::new(slots),
            scratch: vec![0.0; block],
            rate_hz: rate_hz as f32,
        }
    }

    /// Gives a source another sound; the old one comes back.
    pub(super) fn change(&mut self, change: SampleSourceChange) -> SampleSource {
        let mut old = change.feed;
        if let Some(seat) = self.seats.get_mut(change.id.slot()) {
            seat.end(&mut self.tails);
            std::mem::swap(&mut seat.feed, &mut old);
            seat.owner = Some(change.id);
        }
        old
    }

    /// Takes over a graphics frame's sources: those and no others are there.
    pub(super) fn place(&mut self, places: &[SourceRoute]) {
        for seat in &mut self.seats {
            seat.is_present = false;
        }
        for place in places {
            let Some(seat) = self.seats.get_mut(place.id.slot()) else {
                continue;
            };
            if seat.tenant != Some(place.id) {
                // Another source begins at its own gain.
                seat.end(&mut self.tails);
                seat.gain = SmoothedGain::at(place.gain);
                (seat.slot, seat.fade) = (place.slot, 1.0);
                seat.left_fade = 0.0;
            }
            seat.wanted = place.slot;
            seat.tenant = Some(place.id);
            seat.is_present = true;
            seat.target = place.gain;
        }
    }

    /// Mixes the next audio frames, a block at most; gives the number of samples that streams owe.
    pub(super) fn mix(&mut self, frames: usize) -> u32 {
        let Self {
            seats,
            inputs,
            sounds,
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
                && seat.owner == seat.tenant
                && !matches!(seat.feed, SampleSource::Silence);
            if !plays {
                seat.end(tails);
                continue;
            }
            if seat.slot != seat.wanted && seat.left_fade == 0.0 {
                (seat.left, seat.left_fade) = (seat.slot, seat.fade);
                (seat.slot, seat.fade) = (seat.wanted, 0.0);
            }
            let heard = seat.slot != NO_SLOT;
            seat.sounds = heard || seat.left_fade > 0.0;
            if !seat.sounds {
                starved += seat.feed.skip(frames);
                seat.gain = SmoothedGain::at(seat.target);
                continue;
            }
            starved += seat.feed.fill(scratch);
            let from = seat.gain;
            let to = from.after(frames, seat.target, *rate_hz);
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
            if seat.left_fade > 0.0 {
                let place = seat.left_fade;
                let growth = -growth;
                add(seat.left, CrossFade { place, growth });
                seat.left_fade = (place - step).max(0.0);
            }
            if heard {
                let place = seat.fade;
                add(seat.slot, CrossFade { place, growth });
                seat.fade = (place + step).min(1.0);
            }
            seat.gain = to;
        }
        for (slot, sounds) in sounds.iter_mut().enumerate() {
            if tails.is_heard(slot) {
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
        for ((place, block), sounds) in inputs.iter_mut().zip(blocks).zip(&self.sounds) {
            *place = if *sounds { &block[..frames] } else { &[] };
        }
        self.sounds.len()
    }
}

#[cfg(test)]
#[path = "mixer_tests.rs"]
mod tests;
