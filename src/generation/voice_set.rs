//! All voices: which path has which, who starts, who fades, who is dropped.
//!
//! Audio side; wait-free, bounded by the numbers of paths and voices; allocates at birth only. Takes a frame's paths,
//! gives the buses every path's sound.
//!
//! Paths and living voices are both sorted by identity and are merged. A path without voice starts one, a voice without
//! path fades. A path whose delay jumps does both. A fade that is cut would click; so where many fade, the quieter of
//! those that start wait for a frame in which the fades are over, and are counted. There are twice as many voices as may
//! live, and beyond that a path waits too.

use crate::extrapolation::FramePath;
use crate::simd::{F32x8, LaneSet, prefetch};

use super::arrival::{self, EarPair, Moment, Motion, Ready, Weights};
use super::binaural::{Binaural, TOGETHER};
use super::delay_line::{Ahead, DelayLine};
use super::frame_plan::FramePlan;
use super::interpolation::{Intervals, SLACK};
use super::surroundings::{Dropped, Surroundings, Tenant};
use super::voice::{Aim, Bench, MAX_FRESH, Voice};
use super::{CHUNK, Hrtf};

/// Kinds of voices that are added to the buses together: with few components or in full detail, and each with weights
/// that rest or move slowly or with fast ones.
const KINDS: usize = 4;

/// Voices that may start besides a quarter of those that live, however many fade.
const ALWAYS_STARTS: usize = 64;

/// The voices and what belongs to them by index.
#[derive(Debug)]
pub(super) struct VoiceSet {
    max_voices: usize,
    /// Groups of buses and frames of tail a voice.
    groups: usize,
    tail: usize,
    voices: Vec<Voice>,
    tails: Vec<f32>,
    targets: Vec<F32x8>,
    growths: Vec<F32x8>,
    /// Sorted by identity.
    living: Vec<Living>,
    next_living: Vec<Living>,
    fading: Vec<u32>,
    /// Both, by source and delay: neighbours read neighbouring stretches of one delay line.
    order: Vec<u32>,
    places: Vec<((usize, i64), u32)>,
    free: Vec<u32>,
    plan: FramePlan,
    mixture: Vec<f32>,
    intervals: Box<Intervals>,
    /// Of each kind of voices.
    ears: [[EarPair; TOGETHER]; KINDS],
    set: LaneSet,
}

/// A voice that lives and its path's identity: which of them go on is found without looking at them.
#[derive(Debug, Clone, Copy)]
struct Living {
    id: u64,
    index: u32,
}

impl VoiceSet {
    pub(super) fn new(max_voices: usize, max_fine: usize, hrtf: &Hrtf) -> Self {
        let pool = 2 * max_voices;
        let groups = hrtf.groups();
        let tail = tail_frames(hrtf);
        Self {
            max_voices,
            groups,
            tail,
            voices: vec![Voice::default(); pool],
            tails: vec![0.0; pool * tail],
            targets: vec![F32x8::ZERO; pool * 2 * groups],
            growths: vec![F32x8::ZERO; pool * 2 * groups],
            living: Vec::with_capacity(max_voices),
            next_living: Vec::with_capacity(max_voices),
            fading: Vec::with_capacity(pool),
            order: Vec::with_capacity(pool),
            places: Vec::with_capacity(pool),
            free: (0..pool as u32).rev().collect(),
            plan: FramePlan::new(max_voices, max_fine, groups),
            mixture: vec![0.0; tail + MAX_FRESH + SLACK],
            intervals: Intervals::new(),
            ears: std::array::from_fn(|_| arrival::ear_pairs()),
            set: LaneSet::best(),
        }
    }

    /// Voices that live or fade.
    pub(super) fn count(&self) -> usize {
        self.living.len() + self.fading.len()
    }

    /// Leaves a frame whose paths have been looked at.
    pub(super) fn forget_paths(&mut self) {
        self.plan.clear();
    }

    /// Looks at so many more of a frame's paths, sorted by identity, before [`Self::set_paths`] takes them over; gives
    /// whether all have been looked at.
    pub(super) fn prepare_paths(
        &mut self,
        paths: &[FramePath],
        tenants: &[Tenant],
        around: &Surroundings,
        most: usize,
    ) -> bool {
        self.plan.go_on(paths, tenants.len(), around, most)
    }

    /// Takes over a frame's paths.
    pub(super) fn set_paths(
        &mut self,
        paths: &[FramePath],
        tenants: &[Tenant],
        around: &Surroundings,
    ) -> Dropped {
        let slots = tenants.len();
        self.plan.go_on(paths, slots, around, usize::MAX);
        let mut dropped = self.plan.dropped();
        let longest_s = around.max_delay / around.rate_hz;
        let first = self.first_to_start(paths, slots, longest_s);
        self.next_living.clear();
        let mut old = 0;
        for number in 0..self.plan.len() {
            let (wanted, _) = self.plan.get(number);
            let Some(path) = paths.get(wanted.place) else {
                break;
            };
            let id = path.id.0;
            while let Some(voice) = self.living.get(old)
                && voice.id < id
            {
                self.fade(voice.index, around);
                old += 1;
            }
            let held = self.living.get(old).filter(|voice| voice.id == id);
            let held = held.map(|voice| voice.index);
            old += usize::from(held.is_some());
            self.ask_for(old + 1);
            if held.is_none() && wanted.rank < first {
                dropped.starts += 1;
                continue;
            }
            match self.aim(path, number, held, tenants, around) {
                Some(index) => self.next_living.push(Living { id, index }),
                None => dropped.starts += 1,
            }
        }
        self.plan.clear();
        while let Some(voice) = self.living.get(old) {
            self.fade(voice.index, around);
            old += 1;
        }
        std::mem::swap(&mut self.living, &mut self.next_living);
        let voices = &self.voices;
        let living = self.living.iter().map(|voice| voice.index);
        let all = living.chain(self.fading.iter().copied());
        self.places.clear();
        self.places
            .extend(all.map(|index| (voices[index as usize].place(), index)));
        self.places.sort_unstable();
        self.order.clear();
        self.order.extend(self.places.iter().map(|place| place.1));
        dropped
    }

    /// Asks for the memory of a living voice that will be pointed to new values soon.
    fn ask_for(&self, place: usize) {
        let Some(voice) = self.living.get(place) else {
            return;
        };
        self.voices[voice.index as usize].ask_for();
        let width = 2 * self.groups;
        let first = voice.index as usize * width;
        for pool in [&self.targets, &self.growths] {
            for pair in pool[first..first + width].iter().step_by(2) {
                prefetch(pair);
            }
        }
    }

    /// The rank from which on a path without voice may start one in this frame. Where a whole set changes, the quieter of
    /// the new ones wait until the old ones have faded, so that no block has to render twice as many as the others.
    fn first_to_start(&mut self, paths: &[FramePath], slots: usize, longest_s: f64) -> u64 {
        let ids = self.living.iter().map(|voice| voice.id);
        let (mut old, mut kept) = (ids.peekable(), 0);
        for path in paths {
            while old.next_if(|&id| id < path.id.0).is_some() {}
            kept += usize::from(old.next_if_eq(&path.id.0).is_some());
        }
        let wanted = paths.len().min(self.max_voices);
        let most = wanted.max(self.living.len());
        let fading = self.fading.len() + self.living.len() - kept;
        let free = (most + most / 4 + ALWAYS_STARTS).saturating_sub(kept + fading);
        if wanted <= kept + free {
            return 0;
        }
        self.plan
            .ranking
            .threshold(paths, slots, longest_s, kept + free)
    }

    /// Points the voice a path has, or a new one, to what the plan has of it under a number; gives the voice's index, or
    /// none if all others still fade.
    fn aim(
        &mut self,
        path: &FramePath,
        number: usize,
        held: Option<u32>,
        tenants: &[Tenant],
        around: &Surroundings,
    ) -> Option<u32> {
        let (wanted, looked_up) = self.plan.get(number);
        let groups = wanted.groups;
        let aim = Aim {
            gain: wanted.gain,
            delay: path.delay_s * around.rate_hz,
            ears: wanted.ears,
        };
        let slot = path.source.slot();
        let tenant = tenants.get(slot).copied().unwrap_or(Tenant::NONE);
        if let Some(index) = held {
            let voice = &mut self.voices[index as usize];
            if voice.slot == slot
                && voice.tenant == tenant.bits
                && voice.can_glide_to(aim.delay, around.left, around.ramp)
            {
                voice.retarget(&aim, around.now, around.left, around.ramp);
                voice.groups = [groups.max(voice.groups[1]), groups];
                let mut weights = Weights {
                    target: of_voice(&mut self.targets, index, 2 * self.groups),
                    growth: of_voice(&mut self.growths, index, 2 * self.groups),
                };
                voice.motion = weights.retarget(looked_up, around.left, around.ramp);
                return Some(index);
            }
            self.fade(index, around);
        }
        let (_, looked_up) = self.plan.get(number);
        let index = self.free.pop()?;
        let voice = &mut self.voices[index as usize];
        voice.start(slot, tenant, &aim, around.now, around.ramp);
        voice.groups = [groups; 2];
        of_voice(&mut self.tails, index, self.tail).fill(0.0);
        let mut weights = Weights {
            target: of_voice(&mut self.targets, index, 2 * self.groups),
            growth: of_voice(&mut self.growths, index, 2 * self.groups),
        };
        weights.rest_at(looked_up);
        Some(index)
    }

    fn fade(&mut self, index: u32, around: &Surroundings) {
        self.voices[index as usize].fade(around.now, around.left, around.ramp, self.tail);
        let mut weights = Weights {
            target: of_voice(&mut self.targets, index, 2 * self.groups),
            growth: of_voice(&mut self.growths, index, 2 * self.groups),
        };
        weights.stop(around.left);
        self.fading.push(index);
    }

    /// Adds a chunk of every voice to the buses: all of them in one walk through the delay lines, those of a kind by
    /// eights.
    pub(super) fn render(&mut self, lines: &[DelayLine], moment: Moment, binaural: &mut Binaural) {
        let resting = usize::from(moment.left == 0);
        let mut waiting = [[0; TOGETHER]; KINDS];
        let mut counts = [0; KINDS];
        for place in 0..self.order.len() {
            let index = self.order[place];
            let ahead = self.look_ahead(place + 1, lines, moment.frames);
            let voice = &mut self.voices[index as usize];
            let Some(line) = lines.get(voice.slot) else {
                continue;
            };
            let is_fine = voice.groups[resting] == self.groups;
            let is_fast = voice.motion == Motion::Fast && moment.left > 0;
            let kind = usize::from(is_fine) + 2 * usize::from(is_fast);
            let count = &mut counts[kind];
            let bench = Bench {
                tail: of_voice(&mut self.tails, index, self.tail),
                mixture: &mut self.mixture,
                intervals: &mut self.intervals,
                ears: &mut self.ears[kind][*count],
                ahead,
            };
            if !voice.render(self.set, line, moment, bench) {
                continue;
            }
            waiting[kind][*count] = index;
            *count += 1;
            if *count == TOGETHER {
                *count = 0;
                self.add(&waiting[kind], kind, moment, binaural);
            }
        }
        for kind in 0..KINDS {
            let rest = &waiting[kind][..counts[kind]];
            if !rest.is_empty() {
                self.add(rest, kind, moment, binaural);
            }
        }
        if self.fading.is_empty() {
            return;
        }
        let (voices, free) = (&mut self.voices, &mut self.free);
        let before = self.fading.len();
        self.fading.retain(|&index| {
            let fade_left = &mut voices[index as usize].fade_left;
            *fade_left = fade_left.saturating_sub(moment.frames as u32);
            if *fade_left == 0 {
                free.push(index);
            }
            *fade_left > 0
        });
        if self.fading.len() < before {
            self.order
                .retain(|&index| !voices[index as usize].is_over());
        }
    }

    /// Asks for what belongs to the voice that is rendered at a place, and gives what that will read.
    fn look_ahead<'a>(&self, place: usize, lines: &'a [DelayLine], frames: usize) -> Ahead<'a> {
        if let Some(&after) = self.order.get(place + 1) {
            let after = after as usize;
            self.voices[after].ask_for();
            for line in self.tails[after * self.tail..][..self.tail].chunks(16) {
                prefetch(&line[0]);
            }
        }
        let Some(&index) = self.order.get(place) else {
            return Ahead::default();
        };
        let before = place.checked_sub(1).map(|before| self.order[before]);
        let before = before.map(|before| &self.voices[before as usize]);
        self.voices[index as usize].ahead(lines, frames, before)
    }

    /// Adds rendered voices of a kind, whose ear signals lie in its first buffers.
    fn add(&self, waiting: &[u32], kind: usize, moment: Moment, binaural: &mut Binaural) {
        let is_fine = kind % 2 == 1;
        let groups = if is_fine { self.groups } else { 1 };
        let arrivals = std::array::from_fn(|n| {
            let index = *waiting.get(n)? as usize;
            let place = index * 2 * self.groups;
            Some(Ready {
                ears: &self.ears[kind][n],
                target: &self.targets[place..][..2 * self.groups],
                growth: &self.growths[place..][..2 * self.groups],
                motion: self.voices[index].motion,
            })
        });
        arrival::add(binaural, &arrivals, groups, moment);
    }
}

/// Frames of its mixture that a voice keeps: the longest ear delay, the interpolator and rounding, and enough for the
/// shortest stretch mixed in a chunk.
pub(super) fn tail_frames(hrtf: &Hrtf) -> usize {
    (hrtf.max_delay().ceil() as usize + 12)
        .max(CHUNK / 4 + 16)
        .next_multiple_of(8)
}

/// The part of a pool that belongs to one voice.
fn of_voice<T>(pool: &mut [T], index: u32, width: usize) -> &mut [T] {
    &mut pool[index as usize * width..][..width]
}
