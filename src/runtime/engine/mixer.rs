//! Every source's sound into the slots of the generator, each at its own level.
//!
//! Audio side; wait-free, bounded by the number of sources; allocates at birth only. Where every source has a slot the
//! mixture is the source itself. A source that changes slots fades out of one while it fades into the other; one in no
//! slot keeps its place in its sound.

use super::feed::Feed;
use super::messages::{FeedChange, FeedPlace, NO_SLOT};
use crate::scene::SourceId;

/// Seconds of a cross-fade between two slots.
const FADE_S: f32 = 0.05;

/// Audio frames over which a sound fades that is taken away from under its source: long enough not to click, short enough
/// to be over before a slot has another tenant.
const TAIL_FRAMES: usize = 256;

/// The end of a sound that was taken away, faded to nothing.
struct Tail {
    samples: [f32; TAIL_FRAMES],
    /// How many of them have been heard; all of them if there is nothing.
    done: usize,
    slot: u16,
}

impl Default for Tail {
    fn default() -> Self {
        Self {
            samples: [0.0; TAIL_FRAMES],
            done: TAIL_FRAMES,
            slot: NO_SLOT,
        }
    }
}

impl Tail {
    /// Takes the next samples of a feed at a gain.
    fn take(&mut self, feed: &mut Feed, gain: f32, slot: u16) {
        feed.fill(&mut self.samples);
        for (n, sample) in self.samples.iter_mut().enumerate() {
            // From one to nothing without a bend at either end.
            let left = 1.0 - (n + 1) as f32 / TAIL_FRAMES as f32;
            *sample *= gain * left * left * (3.0 - 2.0 * left);
        }
        (self.done, self.slot) = (0, slot);
    }

    fn end(&mut self) {
        self.done = TAIL_FRAMES;
    }

    fn is_over(&self) -> bool {
        self.done == TAIL_FRAMES
    }
}

/// What the renderer knows of one source.
#[derive(Default)]
struct Seat {
    tail: Tail,
    /// Whether the last block had it in its slot.
    sounds: bool,
    feed: Feed,
    /// Whose feed it is.
    owner: Option<SourceId>,
    /// Who is here in the graphics frame in use.
    tenant: Option<SourceId>,
    is_present: bool,
    gain: f32,
    target: f32,
    slot: u16,
    /// Share of its gain that it has in its slot.
    fade: f32,
    /// The slot before, and the share of its gain that it still has there.
    left: u16,
    left_fade: f32,
}

/// All sources and the slots that they are mixed into.
pub(super) struct Mixer {
    seats: Vec<Seat>,
    block: usize,
    /// One block a slot.
    inputs: Vec<f32>,
    /// Slots that something was mixed into.
    sounds: Vec<bool>,
    scratch: Vec<f32>,
    fade_frames: f32,
}

impl Mixer {
    pub(super) fn new(sources: usize, slots: usize, block: usize, rate_hz: u32) -> Self {
        Self {
            seats: (0..sources).map(|_| Seat::default()).collect(),
            block,
            inputs: vec![0.0; slots * block],
            sounds: vec![false; slots],
            scratch: vec![0.0; block],
            fade_frames: FADE_S * rate_hz as f32,
        }
    }

    /// Gives a source another sound; the old one comes back.
    pub(super) fn change(&mut self, change: FeedChange) -> Feed {
        let mut old = change.feed;
        if let Some(seat) = self.seats.get_mut(change.id.slot()) {
            if std::mem::take(&mut seat.sounds) {
                seat.tail
                    .take(&mut seat.feed, seat.gain * seat.fade, seat.slot);
            }
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
                // Another source begins at its own gain, and without what its slot's last tenant had to say.
                seat.tail.end();
                seat.sounds = false;
                seat.gain = place.gain;
                (seat.slot, seat.fade) = (place.slot, 1.0);
                seat.left_fade = 0.0;
            } else if seat.slot != place.slot {
                (seat.left, seat.left_fade) = (seat.slot, seat.fade);
                (seat.slot, seat.fade) = (place.slot, 0.0);
            }
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
            scratch,
            ..
        } = self;
        let step = frames as f32 / self.fade_frames;
        let scratch = &mut scratch[..frames];
        let mut starved = 0;
        sounds.fill(false);
        for seat in seats {
            let plays =
                seat.is_present && seat.owner == seat.tenant && !matches!(seat.feed, Feed::Silence);
            let sounded = std::mem::take(&mut seat.sounds);
            if !plays && sounded {
                seat.tail
                    .take(&mut seat.feed, seat.gain * seat.fade, seat.slot);
            }
            if !seat.tail.is_over() {
                let slot = usize::from(seat.tail.slot);
                let rest = &seat.tail.samples[seat.tail.done..];
                let count = rest.len().min(frames);
                if let Some(sounds) = sounds.get_mut(slot) {
                    let input = &mut inputs[slot * self.block..][..frames];
                    if !std::mem::replace(sounds, true) {
                        input.fill(0.0);
                    }
                    for (sum, sample) in input.iter_mut().zip(rest) {
                        *sum += sample;
                    }
                }
                seat.tail.done += count;
            }
            if !plays {
                continue;
            }
            let heard = seat.slot != NO_SLOT;
            seat.sounds = heard;
            if !heard && seat.left_fade == 0.0 {
                starved += seat.feed.skip(frames);
                seat.gain = seat.target;
                continue;
            }
            starved += seat.feed.fill(scratch);
            let [from, to] = [seat.gain, seat.target];
            let mut add = |slot: u16, from: f32, to: f32| {
                let slot = usize::from(slot);
                if let Some(sounds) = sounds.get_mut(slot) {
                    let input = &mut inputs[slot * self.block..][..frames];
                    let first = !std::mem::replace(sounds, true);
                    mix_into(input, scratch, from, to, first);
                }
            };
            if seat.left_fade > 0.0 {
                let faded = (seat.left_fade - step).max(0.0);
                add(seat.left, from * seat.left_fade, to * faded);
                seat.left_fade = faded;
            }
            if heard {
                let risen = (seat.fade + step).min(1.0);
                add(seat.slot, from * seat.fade, to * risen);
                seat.fade = risen;
            }
            seat.gain = to;
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

/// Adds samples at a gain that goes from one value to another; the first ones are not added to what was there before.
fn mix_into(input: &mut [f32], samples: &[f32], from: f32, to: f32, first: bool) {
    if first {
        input.fill(0.0);
    }
    if from == 1.0 && to == 1.0 {
        for (sum, sample) in input.iter_mut().zip(samples) {
            *sum += sample;
        }
        return;
    }
    let step = (to - from) / input.len() as f32;
    for (n, (sum, sample)) in input.iter_mut().zip(samples).enumerate() {
        *sum += sample * (from + step * (n + 1) as f32);
    }
}

#[cfg(test)]
#[path = "mixer_tests.rs"]
mod tests;
