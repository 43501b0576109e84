//! Every source's sound into the slots of the generator, each at its own level.
//!
//! Audio side; wait-free, bounded by the number of sources; allocates at birth only. Where every source has a slot the
//! mixture is the source itself. A source that changes slots fades out of one while it fades into the other, and changes
//! again only after that; one in no slot keeps its place in its sound. What ends fades where it was heard ([`Afterglow`]).
//! Levels follow the frame's without a bend ([`Gain`]).

use super::messages::{FeedChange, FeedPlace, NO_SLOT};
use super::smooth_gain::{Fade, Gain, mix_into};
use crate::runtime::engine::release_tails::{AFTERGLOW_FRAMES, Afterglow};
use crate::runtime::engine::sample_source::Feed;
use crate::scene::SourceId;

/// Seconds of a cross-fade between two slots.
pub(super) const FADE_S: f32 = 0.05;

/// What the renderer knows of one source.
#[derive(Default)]
struct Seat {
    /// Whether the last block had it in a slot.
    sounds: bool,
    feed: Feed,
    /// Whose feed it is.
    owner: Option<SourceId>,
    /// Who is here in the graphics frame in use.
    tenant: Option<SourceId>,
    is_present: bool,
    gain: Gain,
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

impl Seat {
    /// Leaves what would have been heard next to the slots where it is heard.
    fn end(&mut self, afterglow: &mut Afterglow) {
        if !std::mem::take(&mut self.sounds) {
            return;
        }
        let mut samples = [0.0; AFTERGLOW_FRAMES];
        self.feed.fill(&mut samples);
        let gain = |place: f32| self.gain.value * Fade { place, growth: 0.0 }.share(0);
        afterglow.add(self.slot, &samples, gain(self.fade));
        afterglow.add(self.left, &samples, gain(self.left_fade));
    }
}

/// All sources and the slots that they are mixed into.
pub(super) struct Mixer {
    seats: Vec<Seat>,
    block: usize,
    /// One block a slot.
    inputs: Vec<f32>,
    /// Slots that something was mixed into.
    sounds: Vec<bool>,
    afterglow: Afterglow,
    scratch: Vec<f32>,
    rate_hz: f32,
}

impl Mixer {
    pub(super) fn new(sources: usize, slots: usize, block: usize, rate_hz: u32) -> Self {
        Self {
            seats: (0..sources).map(|_| Seat::default()).collect(),
            block,
            inputs: vec![0.0; slots * block],
            sounds: vec![false; slots],
            afterglow: Afterglow::new(slots),
            scratch: vec![0.0; block],
            rate_hz: rate_hz as f32,
        }
    }

    /// Gives a source another sound; the old one comes back.
    pub(super) fn change(&mut self, change: FeedChange) -> Feed {
        let mut old = change.feed;
        if let Some(seat) = self.seats.get_mut(change.id.slot()) {
            seat.end(&mut self.afterglow);
            std::mem::swap(&mut seat.feed, &mut old);
            seat.owner = Some(change.id);
        }
        old
    }

    /// Takes over a graphics frame's sources: those and no others are there.
    pub(super) fn place(&mut self, places: &[FeedPlace]) {
        for seat in &mut self.seats {
            seat.is_present = false;
        }
        for place in places {
            let Some(seat) = self.seats.get_mut(place.id.slot()) else {
                continue;
            };
            if seat.tenant != Some(place.id) {
                // Another source begins at its own gain.
                seat.end(&mut self.afterglow);
                seat.gain = Gain::at(place.gain);
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
            afterglow,
            scratch,
            rate_hz,
            ..
        } = self;
        let growth = 1.0 / (FADE_S * *rate_hz);
        let step = frames as f32 * growth;
        let scratch = &mut scratch[..frames];
        let mut starved = 0;
        sounds.fill(false);
        for seat in seats {
            let plays =
                seat.is_present && seat.owner == seat.tenant && !matches!(seat.feed, Feed::Silence);
            if !plays {
                seat.end(afterglow);
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
                seat.gain = Gain::at(seat.target);
                continue;
            }
            starved += seat.feed.fill(scratch);
            let from = seat.gain;
            let to = from.after(frames, seat.target, *rate_hz);
            let mut add = |slot: u16, fade: Fade| {
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
                add(seat.left, Fade { place, growth });
                seat.left_fade = (place - step).max(0.0);
            }
            if heard {
                let place = seat.fade;
                add(seat.slot, Fade { place, growth });
                seat.fade = (place + step).min(1.0);
            }
            seat.gain = to;
        }
        for (slot, sounds) in sounds.iter_mut().enumerate() {
            if afterglow.is_heard(slot) {
                let input = &mut inputs[slot * self.block..][..frames];
                if !std::mem::replace(sounds, true) {
                    input.fill(0.0);
                }
                afterglow.mix(slot, input);
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
