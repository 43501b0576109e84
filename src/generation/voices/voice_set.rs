//! All voices: which path has which, who starts, who fades, who is dropped.
//!
//! Audio side; wait-free, bounded by the numbers of paths and voices; allocates at birth only. Takes a frame's paths,
//! gives the buses every path's sound.
//!
//! Paths and living voices are both sorted by identity and are merged. A path without voice starts one, a voice without
//! path fades. A path whose delay jumps does both. A fade that is cut would click; so where many fade, the quieter of
//! those that start wait for a frame in which the fades are over, and are counted. There are twice as many voices as may
//! live, and beyond that a path waits too. Where blocks are to take alike time, voices start a few at a time, the loudest
//! first, as the fades end, and the frame waits for the last ([`VoiceSet::take_paths`], [`VoiceSet::start`]).

use crate::extrapolation::FramePath;
use crate::simd::{F32x8, LaneSet, prefetch};

use crate::generation::binaural::ear_ramps;
use crate::generation::binaural::ear_ramps::{EarPair, Moment, Motion, Ready, Weights};
use crate::generation::binaural::filter_bank::{Binaural, TOGETHER};
use crate::generation::delay::delay_line::{Ahead, DelayLine};
use crate::generation::delay::interpolation::{Intervals, SLACK};
use crate::generation::render_context::{Dropped, Surroundings, Tenant};
use crate::generation::voices::frame_plan::{FramePlan, Wanted};
use crate::generation::voices::pending_voices::{GOES_ON, Start, Starts};
use crate::generation::voices::voice::{Aim, Bench, INDEX_BITS, MAX_FRESH, Voice};
use crate::generation::{CHUNK, Hrtf};

/// Kinds of voices that are added to the buses together: with few components or in full detail, and each with weights
/// that rest or move slowly or with fast ones.
const KINDS: usize = 4;

/// Voices that may start besides a quarter of those that live, however many fade.
const ALWAYS_STARTS: usize = 64;

/// Voices between one that is pointed to new values and the one whose memory is asked for: what belongs to a voice is a dozen
/// lines of memory, and where no cache has them one voice's time is too short.
const ASKED_AHEAD: usize = 3;

/// The index of a voice that has not started yet.
const NONE: u32 = u32::MAX;

/// The voices and what belongs to them by index.
#[derive(Debug)]
pub(crate) struct VoiceSet {
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
    places: Vec<u64>,
    free: Vec<u32>,
    plan: FramePlan,
    starts: Starts,
    /// Voices that live or fade beyond which no voice of this frame starts that may wait.
    most_sounding: usize,
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
    /// [`NONE`] while it waits for its start.
    index: u32,
}

impl VoiceSet {
    pub(crate) fn new(max_voices: usize, max_fine: usize, hrtf: &Hrtf) -> Self {
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
            starts: Starts::new(max_voices),
            most_sounding: 0,
            mixture: vec![0.0; tail + MAX_FRESH + SLACK],
            intervals: Intervals::new(),
            ears: std::array::from_fn(|_| ear_ramps::ear_pairs()),
            set: LaneSet::best(),
        }
    }

    /// Voices that live or fade.
    pub(crate) fn count(&self) -> usize {
        self.living.len() - self.starts.len() + self.fading.len()
    }

    /// Paths that wait for [`Self::start`].
    pub(crate) fn waiting(&self) -> usize {
        self.starts.len()
    }

    /// Leaves a frame whose paths have been looked at.
    pub(crate) fn forget_paths(&mut self) {
        self.plan.clear();
        if self.starts.len() > 0 {
            self.living.retain(|voice| voice.index != NONE);
            self.starts.clear();
        }
    }

    /// Looks at so many more of a frame's paths, sorted by identity, before [`Self::set_paths`] takes them over; gives
    /// whether all have been looked at.
    pub(crate) fn prepare_paths(
        &mut self,
        paths: &[FramePath],
        tenants: &[Tenant],
        around: &Surroundings,
        most: usize,
    ) -> bool {
        if self.starts.len() > 0 {
            self.forget_paths();
        }
        self.plan.go_on(paths, tenants.len(), around, most)
    }

    /// Takes over a frame's paths, all at once.
    pub(crate) fn set_paths(
        &mut self,
        paths: &[FramePath],
        tenants: &[Tenant],
        around: &Surroundings,
    ) -> Dropped {
        let sounding = self.count();
        let mut dropped = self.merge(paths, tenants, around);
        let waiting = self.starts.len();
        let longest_s = around.max_delay / around.rate_hz;
        let first = self.first_to_start(paths, tenants.len(), longest_s, sounding);
        self.starts.in_order();
        let mut started = 0;
        while let Some(start) = self.starts.pop() {
            started += u32::from(start.rank >= first && self.begin(start, tenants, around));
        }
        dropped.starts += waiting as u32 - started;
        if started < waiting as u32 {
            self.living.retain(|voice| voice.index != NONE);
        }
        self.plan.clear();
        self.arrange();
        dropped
    }

    /// Takes over a frame's paths as far as they have voices; the others wait for [`Self::start`].
    pub(crate) fn take_paths(
        &mut self,
        paths: &[FramePath],
        tenants: &[Tenant],
        around: &Surroundings,
    ) -> Dropped {
        let living = self.living.len();
        let dropped = self.merge(paths, tenants, around);
        self.most_sounding = living.max(self.living.len()) + ALWAYS_STARTS;
        self.starts.loudest_first();
        if self.starts.len() == 0 {
            self.plan.clear();
        }
        self.arrange();
        dropped
    }

    /// Starts up to so many of the voices that wait, the loudest first; gives how many still wait.
    pub(crate) fn start(
        &mut self,
        most: usize,
        tenants: &[Tenant],
        around: &Surroundings,
    ) -> usize {
        if self.starts.len() == 0 {
            return 0;
        }
        let room = self.most_sounding.saturating_sub(self.count());
        let mut started = 0;
        while started < most.min(room)
            && !self.free.is_empty()
            && let Some(start) = self.starts.pop()
        {
            self.begin(start, tenants, around);
            started += 1;
        }
        if started > 0 {
            self.arrange();
        }
        if self.starts.len() == 0 {
            self.plan.clear();
        }
        self.starts.len()
    }

    /// Points voices to what the frame asks of them, fades those whose paths are gone, and lists the paths that have none.
    fn merge(&mut self, paths: &[FramePath], tenants: &[Tenant], around: &Surroundings) -> Dropped {
        if self.starts.len() > 0 {
            self.forget_paths();
        }
        self.plan.go_on(paths, tenants.len(), around, usize::MAX);
        self.next_living.clear();
        let mut old = 0;
        for number in 0..self.plan.len() {
            let (wanted, _) = self.plan.get(number);
            let id = wanted.id;
            while let Some(voice) = self.living.get(old)
                && voice.id < id
            {
                self.fade(voice.index, around);
                old += 1;
            }
            let held = self.living.get(old).filter(|voice| voice.id == id);
            let held = held.map(|voice| voice.index);
            old += usize::from(held.is_some());
            self.ask_for(old + ASKED_AHEAD);
            let went_on = held.filter(|&index| self.go_on(index, number, tenants, around));
            if went_on.is_none() {
                let place = self.next_living.len() as u32;
                self.starts.push(Start {
                    rank: held.map_or(wanted.rank, |_| GOES_ON),
                    number: number as u32,
                    place,
                });
            }
            let index = went_on.unwrap_or(NONE);
            self.next_living.push(Living { id, index });
        }
        while let Some(voice) = self.living.get(old) {
            self.fade(voice.index, around);
            old += 1;
        }
        std::mem::swap(&mut self.living, &mut self.next_living);
        self.plan.dropped()
    }

    /// Puts all voices in the order in which they are rendered.
    fn arrange(&mut self) {
        let voices = &self.voices;
        let living = self.living.iter().map(|voice| voice.index);
        let living = living.filter(|&index| index != NONE);
        let all = living.chain(self.fading.iter().copied());
        self.places.clear();
        self.places
            .extend(all.map(|index| voices[index as usize].place() | u64::from(index)));
        self.places.sort_unstable();
        self.order.clear();
        let index = |place: &u64| (place % (1 << INDEX_BITS)) as u32;
        self.order.extend(self.places.iter().map(index));
    }

    /// Asks for the memory of a living voice that will be pointed to new values soon.
    fn ask_for(&self, place: usize) {
        if let Some(voice) = self.living.get(place) {
            self.ask_for_voice(voice.index);
        }
    }

    /// Asks for a voice and its weights.
    fn ask_for_voice(&self, index: u32) {
        self.voices[index as usize].ask_for();
        let width = 2 * self.groups;
        let first = index as usize * width;
        for pool in [&self.targets, &self.growths] {
            for pair in pool[first..first + width].iter().step_by(2) {
                prefetch(pair);
            }
        }
    }

    /// The rank from which on a path without voice may start one in this frame, of which `sounding` voices were there
    /// before it. Where a whole set changes, the quieter of the new ones wait until the old ones have faded, so that no
    /// block has to render twice as many as the others.
    fn first_to_start(
        &mut self,
        paths: &[FramePath],
        slots: usize,
        longest_s: f64,
        sounding: usize,
    ) -> u64 {
        let wanted = paths.len().min(self.max_voices);
        let before = &self.next_living;
        let most = wanted.max(before.len());
        let free = (most + most / 4 + ALWAYS_STARTS).saturating_sub(sounding);
        let went_on = self.living.len() - self.starts.len();
        if wanted <= went_on + free {
            return 0;
        }
        let ids = before.iter().map(|voice| voice.id);
        let (mut old, mut kept) = (ids.peekable(), 0);
        for path in paths {
            while old.next_if(|&id| id < path.id.0).is_some() {}
            kept += usize::from(old.next_if_eq(&path.id.0).is_some());
        }
        if wanted <= kept + free {
            return 0;
        }
        self.plan
            .ranking
            .threshold(paths, slots, longest_s, kept + free)
    }

    /// Points the voice that a path has to what the plan has of it under a number; or fades it and gives false, if that is
    /// no motion.
    fn go_on(
        &mut self,
        index: u32,
        number: usize,
        tenants: &[Tenant],
        around: &Surroundings,
    ) -> bool {
        let (wanted, looked_up) = self.plan.get(number);
        let slot = wanted.slot;
        let tenant = tenants.get(slot).copied().unwrap_or(Tenant::NONE);
        let voice = &mut self.voices[index as usize];
        let is_same = voice.slot == slot && voice.tenant == tenant.bits;
        if !is_same || !voice.can_glide_to(wanted.delay, around.left, around.ramp) {
            self.fade(index, around);
            return false;
        }
        voice.retarget(&aim(&wanted), around.now, around.left, around.ramp);
        voice.groups = [wanted.groups.max(voice.groups[1]), wanted.groups];
        let mut weights = Weights {
            target: of_voice(&mut self.targets, index, 2 * self.groups),
            growth: of_voice(&mut self.growths, index, 2 * self.groups),
        };
        voice.motion = weights.retarget(self.set, looked_up, around.left, around.ramp);
        true
    }

    /// Starts a voice; gives whether one was free.
    fn begin(&mut self, start: Start, tenants: &[Tenant], around: &Surroundings) -> bool {
        let Some(index) = self.free.pop() else {
            return false;
        };
        if let (Some(&next), Some(_)) = (self.free.last(), self.starts.following()) {
            self.ask_for_voice(next);
            self.ask_for_tail(next);
        }
        let (wanted, looked_up) = self.plan.get(start.number as usize);
        let tenant = tenants.get(wanted.slot).copied().unwrap_or(Tenant::NONE);
        let voice = &mut self.voices[index as usize];
        voice.start(wanted.slot, tenant, &aim(&wanted), around.now, around.ramp);
        voice.groups = [wanted.groups; 2];
        of_voice(&mut self.tails, index, self.tail).fill(0.0);
        let mut weights = Weights {
            target: of_voice(&mut self.targets, index, 2 * self.groups),
            growth: of_voice(&mut self.growths, index, 2 * self.groups),
        };
        weights.rest_at(looked_up);
        self.living[start.place as usize].index = index;
        true
    }

    fn ask_for_tail(&self, index: u32) {
        for line in self.tails[index as usize * self.tail..][..self.tail].chunks(16) {
            prefetch(&line[0]);
        }
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
    pub(crate) fn render(&mut self, lines: &[DelayLine], moment: Moment, binaural: &mut Binaural) {
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
            self.ask_for_voice(after);
            self.ask_for_tail(after);
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
        ear_ramps::add(binaural, &arrivals, groups, moment);
    }
}

/// Frames of its mixture that a voice keeps: the longest ear delay, the interpolator and rounding, and enough for the
/// shortest stretch mixed in a chunk.
pub(crate) fn tail_frames(hrtf: &Hrtf) -> usize {
    (hrtf.max_delay().ceil() as usize + 12)
        .max(CHUNK / 4 + 16)
        .next_multiple_of(8)
}

/// What the plan asks of a voice.
fn aim(wanted: &Wanted) -> Aim {
    Aim {
        gain: wanted.gain,
        delay: wanted.delay,
        ears: wanted.ears,
    }
}

/// The part of a pool that belongs to one voice.
fn of_voice<T>(pool: &mut [T], index: u32, width: usize) -> &mut [T] {
    &mut pool[index as usize * width..][..width]
}
