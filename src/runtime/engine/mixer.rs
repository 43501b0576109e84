//! Mixes the samples of all sources into the slots of the generator.
//!
//! Audio side; wait-free, bounded by the number of sources; allocates in `new` only. A source that changes slots
//! cross-fades and changes again only after that; a source without a slot advances its samples silently. A source that
//! ends leaves a fade in its slot ([`ReleaseTails`]). Gains are smoothed ([`SmoothedGain`]). Where the app mixes sources itself,
//! it gives their samples one source at a time ([`Mixer::mix_apart`]); the others follow at the end of the block.

use super::messages::{BED, NO_SLOT, SampleSourceChange, SourceRoute};
use super::smooth_gain::{CrossFade, SmoothedGain, mix_into};
use crate::generation::Bed;
use crate::runtime::engine::clip_player::OTHERS;
use crate::runtime::engine::playback::PlayState;
use crate::runtime::engine::release_tails::{RELEASE_FRAMES, ReleaseTails};
use crate::runtime::engine::sample_source::{Filled, SampleSource};
use crate::runtime::engine::source_bus::{BusStatus, LastDry, MixedSource};
use crate::scene::SourceId;

/// Seconds of a cross-fade between two slots.
pub(super) const CROSS_FADE_S: f32 = 0.05;

/// Signals of sources without a position: middle and side, then those of a sound field.
const BED_SIGNALS: usize = 6;

/// Where the signals of a source go in a slot: of one with a position the first only.
fn places(slot: usize, bed: usize, signals: usize) -> std::ops::Range<usize> {
    match (slot == bed, signals) {
        (true, 4) => bed + 2..bed + 6,
        (true, signals) => bed..bed + signals,
        (false, _) => slot..slot + 1,
    }
}

/// State of one source.
#[derive(Default)]
struct MixerSource {
    /// Whether the last block mixed it into a slot.
    is_mixed: bool,
    /// Whether this block is mixed.
    is_done: bool,
    last_dry: LastDry,
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
    /// Whether this block has a part in the slot before.
    is_leaving: bool,
}

impl MixerSource {
    /// Adds a fade of the next samples to the slots of the source.
    fn release(&mut self, tails: &mut ReleaseTails, bed: usize, now: u64) {
        if !std::mem::take(&mut self.is_mixed) {
            return;
        }
        let mut signals = [[0.0; RELEASE_FRAMES]; 1 + OTHERS];
        let [first, others @ ..] = &mut signals;
        let others = others.each_mut().map(|other| &mut other[..]);
        let filled = self.samples.fill(first, others, &self.play, now);
        let gain = |position: f32| self.faded_gain(position);
        for (slot, fade) in [
            (self.slot, self.fade),
            (self.previous_slot, self.previous_fade),
        ] {
            let places = places(slot.into(), bed, filled.signals);
            for (place, samples) in places.zip(&signals) {
                tails.add(place as u16, samples, gain(fade));
            }
        }
    }

    /// The present gain at a position of a fade.
    fn faded_gain(&self, position: f32) -> f32 {
        let slope = 0.0;
        self.gain.value * CrossFade { position, slope }.gain(0)
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
    /// Slots of the generator; [`BED_SIGNALS`] more are the bed's.
    slots: usize,
    /// Slots below this index have one source each.
    own_slots: usize,
    /// Audio frames mixed, and those of the present block.
    now: u64,
    frames: usize,
    /// One block per slot.
    inputs: Vec<f32>,
    /// Whether a slot is not silent, and whether its input of this block is complete.
    active_slots: Vec<bool>,
    finished_slots: Vec<bool>,
    tails: ReleaseTails,
    scratch: Vec<f32>,
    others: [Vec<f32>; OTHERS],
    rate_hz: f32,
}

impl Mixer {
    /// For these numbers of sources and slots, of which the first `own_slots` have one source each.
    pub(super) fn new(
        sources: usize,
        [slots, own_slots]: [usize; 2],
        block: usize,
        rate_hz: u32,
    ) -> Self {
        Self {
            sources: (0..sources).map(|_| MixerSource::default()).collect(),
            block,
            slots,
            own_slots,
            now: 0,
            frames: 0,
            inputs: vec![0.0; (slots + BED_SIGNALS) * block],
            active_slots: vec![false; slots + BED_SIGNALS],
            finished_slots: vec![false; slots + BED_SIGNALS],
            tails: ReleaseTails::new(slots + BED_SIGNALS),
            scratch: vec![0.0; block],
            others: std::array::from_fn(|_| vec![0.0; block]),
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
        self.begin(frames);
        self.mix_rest()
    }

    /// Begins a block of audio frames, whose sources may be mixed apart.
    pub(super) fn begin(&mut self, frames: usize) {
        self.now += frames as u64;
        self.frames = frames;
        self.active_slots.fill(false);
        self.finished_slots.fill(false);
        for source in &mut self.sources {
            source.is_done = false;
        }
    }

    /// Mixes the sources of the block that were not mixed apart; returns the number of samples missing in streams.
    pub(super) fn mix_rest(&mut self) -> u32 {
        let mut underrun = 0;
        for index in 0..self.sources.len() {
            underrun += self.mix_source(index, None);
        }
        for slot in 0..self.active_slots.len() {
            self.finish_slot(slot);
        }
        underrun
    }

    /// Mixes one source of the block, and finishes the slots that it has alone. `dry` takes the place of its samples, which
    /// advance; without it they are mixed. A source that is gone fades out from `dry`.
    pub(super) fn mix_apart(&mut self, id: SourceId, dry: Option<&[f32]>) -> (MixedSource, u32) {
        let index = id.slot();
        let Some(source) = self.sources.get_mut(index) else {
            return (BusStatus::UnknownSource.into(), 0);
        };
        if !source.is_present || source.current != Some(id) {
            let last = std::mem::take(&mut source.last_dry);
            if let Some(dry) = dry.filter(|_| last.id == Some(id)) {
                release_dry(&mut self.tails, dry, last.slots);
            } else {
                source.last_dry = last;
            }
            return (BusStatus::UnknownSource.into(), 0);
        }
        if source.is_done {
            return (BusStatus::WrongOrder.into(), 0);
        }
        let underrun = self.mix_source(index, dry);
        let source = &self.sources[index];
        let own = |slot: u16| Some(usize::from(slot)).filter(|slot| *slot < self.own_slots);
        let previous = own(source.previous_slot).filter(|_| source.is_leaving);
        let slots = [own(source.slot), previous];
        for slot in slots.into_iter().flatten() {
            self.finish_slot(slot);
        }
        let status = match slots[0] {
            Some(_) => BusStatus::Own,
            None if self.sources[index].slot == NO_SLOT => BusStatus::Silent,
            None => BusStatus::Shared,
        };
        (MixedSource { status, slots }, underrun)
    }

    /// Adds the fades of sources that ended to a slot's input.
    fn finish_slot(&mut self, slot: usize) {
        if std::mem::replace(&mut self.finished_slots[slot], true) || !self.tails.is_active(slot) {
            return;
        }
        let input = &mut self.inputs[slot * self.block..][..self.frames];
        if !std::mem::replace(&mut self.active_slots[slot], true) {
            input.fill(0.0);
        }
        self.tails.mix(slot, input);
    }

    /// Mixes a source's block, once; returns the number of samples missing in a stream.
    fn mix_source(&mut self, index: usize, dry: Option<&[f32]>) -> u32 {
        let Self {
            sources,
            inputs,
            active_slots: sounds,
            tails,
            scratch,
            others,
            rate_hz,
            now,
            frames,
            slots: bed,
            ..
        } = self;
        let source = &mut sources[index];
        if std::mem::replace(&mut source.is_done, true) {
            return 0;
        }
        let (bed, frames) = (*bed, *frames);
        let at = *now - frames as u64;
        let block_s = frames as f32 / *rate_hz;
        let slope = 1.0 / (CROSS_FADE_S * *rate_hz);
        let step = frames as f32 * slope;
        let scratch = &mut scratch[..frames];
        let has_samples =
            source.owner == source.current && !matches!(source.samples, SampleSource::Silence);
        let plays = source.is_present && (dry.is_some() || has_samples);
        let target_gain = source.advance_gain(block_s);
        source.is_leaving = false;
        if !plays {
            source.release(tails, bed, at);
            return 0;
        }
        if source.slot != source.next_slot && source.previous_fade == 0.0 {
            (source.previous_slot, source.previous_fade) = (source.slot, source.fade);
            (source.slot, source.fade) = (source.next_slot, 0.0);
        }
        let is_audible = source.slot != NO_SLOT;
        source.is_leaving = source.previous_fade > 0.0;
        source.is_mixed = is_audible || source.is_leaving;
        if !source.is_mixed {
            let missing = source.samples.skip(frames, &source.play, at);
            source.gain = SmoothedGain::at(target_gain);
            return missing;
        }
        let filled = match dry {
            Some(dry) => {
                scratch.copy_from_slice(dry);
                // Its own samples are not heard: nothing of them has to fade.
                source.is_mixed = false;
                Filled {
                    missing: source.samples.skip(frames, &source.play, at),
                    signals: 1,
                }
            }
            None => {
                let rest = others.each_mut().map(|other| &mut other[..frames]);
                source.samples.fill(scratch, rest, &source.play, at)
            }
        };
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
            let signals = others.iter().map(|other| &other[..frames]);
            let signals = std::iter::once(&scratch[..]).chain(signals);
            for (place, samples) in places(slot.into(), bed, filled.signals).zip(signals) {
                add_to(place, samples, fade);
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
        source.last_dry = LastDry {
            id: source.current.filter(|_| dry.is_some()),
            slots: [
                (source.slot, source.faded_gain(source.fade)),
                (
                    source.previous_slot,
                    source.faded_gain(source.previous_fade),
                ),
            ],
        };
        filled.missing
    }

    /// Writes one slice per slot to `inputs`, empty for silence; returns the number of slots.
    pub(super) fn inputs<'a>(&'a self, frames: usize, inputs: &mut [&'a [f32]]) -> usize {
        for (slot, input) in inputs.iter_mut().enumerate().take(self.slots) {
            *input = self.input(slot, frames);
        }
        self.slots
    }

    /// The sources without a position, empty for silence.
    pub(super) fn bed(&self, frames: usize) -> Bed<'_> {
        let signal = |n: usize| self.input(self.slots + n, frames);
        Bed {
            stereo: [0, 1].map(signal),
            field: [2, 3, 4, 5].map(signal),
        }
    }

    /// A slot's input, empty for silence.
    pub(super) fn input(&self, slot: usize, frames: usize) -> &[f32] {
        match self.active_slots[slot] {
            true => &self.inputs[slot * self.block..][..frames],
            false => &[],
        }
    }
}

/// Adds the fade-out of a source whose samples are the app's: from its next block, of which there may be less than a fade.
fn release_dry(tails: &mut ReleaseTails, dry: &[f32], slots: [(u16, f32); 2]) {
    let mut samples = [0.0; RELEASE_FRAMES];
    let count = dry.len().min(RELEASE_FRAMES);
    for (n, (sample, dry)) in samples[..count].iter_mut().zip(dry).enumerate() {
        let is_whole = count == RELEASE_FRAMES;
        let share = 1.0 - (n + 1) as f32 / count as f32;
        *sample = if is_whole { *dry } else { dry * share };
    }
    for (slot, gain) in slots {
        tails.add(slot, &samples, gain);
    }
}

#[cfg(test)]
#[path = "mixer_tests.rs"]
mod tests;
