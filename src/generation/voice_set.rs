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

use super::arrival::{self, EarPair, Moment, Ready, Weights};
use super::binaural::{Binaural, TOGETHER};
use super::delay_line::{Ahead, DelayLine};
use super::interpolation::{Intervals, SLACK};
use super::ranking::{self, Ranking};
use super::surroundings::{Dropped, Surroundings, Tenant};
use super::voice::{Aim, Bench, MAX_FRESH, Voice};
use super::{CHUNK, Hrtf};

/// Voices that may start besides a quarter of those that live, however many fade.
const ALWAYS_STARTS: usize = 64;

/// The voices and what belongs to them by index.
#[derive(Debug)]
pub(super) struct VoiceSet {
    max_voices: usize,
    max_fine: usize,
    /// Groups of buses and frames of tail a voice.
    groups: usize,
    tail: usize,
    voices: Vec<Voice>,
    tails: Vec<f32>,
    targets: Vec<F32x8>,
    growths: Vec<F32x8>,
    /// Indices, sorted by identity.
    living: Vec<u32>,
    next_living: Vec<u32>,
    fading: Vec<u32>,
    /// Both, by source and delay: neighbours read neighbouring stretches of one delay line.
    order: Vec<u32>,
    free: Vec<u32>,
    ranking: Ranking,
    looked_up: Vec<F32x8>,
    mixture: Vec<f32>,
    intervals: Box<Intervals>,
    /// Of voices with few components, and of those in full detail.
    ears: [[EarPair; TOGETHER]; 2],
    set: LaneSet,
}

/// A path that gets a voice, whose weights have been looked up.
struct Wanted<'a> {
    path: &'a FramePath,
    /// Ear delays in frames.
    ears: [f32; 2],
    /// Groups of buses it is worth.
    groups: usize,
}

impl VoiceSet {
    pub(super) fn new(max_voices: usize, max_fine: usize, hrtf: &Hrtf) -> Self {
        let pool = 2 * max_voices;
        let groups = hrtf.groups();
        let tail = tail_frames(hrtf);
        Self {
            max_voices,
            max_fine,
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
            free: (0..pool as u32).rev().collect(),
            ranking: Ranking::new(max_voices.max(max_fine)),
            looked_up: vec![F32x8::ZERO; 2 * groups],
            mixture: vec![0.0; tail + MAX_FRESH + SLACK],
            intervals: Intervals::new(),
            ears: [arrival::ear_pairs(), arrival::ear_pairs()],
            set: LaneSet::best(),
        }
    }

    /// Voices that live or fade.
    pub(super) fn count(&self) -> usize {
        self.living.len() + self.fading.len()
    }

    /// Takes over a frame's paths, sorted by identity.
    pub(super) fn set_paths(
        &mut self,
        paths: &[FramePath],
        tenants: &[Tenant],
        around: &Surroundings,
    ) -> Dropped {
        let mut dropped = Dropped::default();
        let slots = tenants.len();
        let longest_s = around.max_delay / around.rate_hz;
        let keep = self
            .ranking
            .threshold(paths, slots, longest_s, self.max_voices);
        let fine = if self.max_fine >= self.max_voices {
            keep
        } else {
            self.ranking
                .threshold(paths, slots, longest_s, self.max_fine)
        };
        let first = self.first_to_start(paths, slots, longest_s);
        self.next_living.clear();
        let mut old = 0;
        let mut last_id = None;
        let find = |path: &FramePath| around.hrtf.find(around.to_head * path.arrival);
        let mut following = paths.first().map(find);
        for (index, path) in paths.iter().enumerate() {
            let next = paths.get(index + 1).map(find);
            let Some(corners) = std::mem::replace(&mut following, next) else {
                break;
            };
            let id = path.id.0;
            if !ranking::is_sound(path, slots) || last_id.is_some_and(|last| id <= last) {
                dropped.paths += 1;
                continue;
            }
            last_id = Some(id);
            if path.delay_s > longest_s {
                dropped.delays += 1;
                continue;
            }
            let rank = ranking::rank(path, index);
            if rank < keep {
                dropped.paths += 1;
                continue;
            }
            while let Some(&voice) = self.living.get(old)
                && self.voices[voice as usize].id < id
            {
                self.fade(voice, around);
                old += 1;
            }
            let held = self
                .living
                .get(old)
                .copied()
                .filter(|&voice| self.voices[voice as usize].id == id);
            old += usize::from(held.is_some());
            if held.is_none() && rank < first {
                dropped.starts += 1;
                continue;
            }
            let groups = if rank >= fine { self.groups } else { 1 };
            let ears = around.hrtf.blend(&corners, groups, &mut self.looked_up);
            let wanted = Wanted { path, ears, groups };
            match self.aim(&wanted, held, tenants, around) {
                Some(voice) => self.next_living.push(voice),
                None => dropped.starts += 1,
            }
        }
        while let Some(&voice) = self.living.get(old) {
            self.fade(voice, around);
            old += 1;
        }
        std::mem::swap(&mut self.living, &mut self.next_living);
        self.order.clear();
        self.order.extend(self.living.iter().chain(&self.fading));
        let voices = &self.voices;
        self.order
            .sort_unstable_by_key(|&index| voices[index as usize].place());
        dropped
    }

    /// The rank from which on a path without voice may start one in this frame. Where a whole set changes, the quieter of
    /// the new ones wait until the old ones have faded, so that no block has to render twice as many as the others.
    fn first_to_start(&mut self, paths: &[FramePath], slots: usize, longest_s: f64) -> u64 {
        let voices = &self.voices;
        let ids = self.living.iter().map(|&index| voices[index as usize].id);
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
        self.ranking.threshold(paths, slots, longest_s, kept + free)
    }

    /// Points the voice a path has, or a new one, to the path's values and the weights looked up; gives the voice's index,
    /// or none if all others still fade.
    fn aim(
        &mut self,
        wanted: &Wanted<'_>,
        held: Option<u32>,
        tenants: &[Tenant],
        around: &Surroundings,
    ) -> Option<u32> {
        let &Wanted { path, ears, groups } = wanted;
        let aim = Aim {
            gain: around.correction.gains(&path.amplitude),
            delay: path.delay_s * around.rate_hz,
            ears,
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
                voice.moving = weights.retarget(&self.looked_up, around.left, around.ramp);
                return Some(index);
            }
            self.fade(index, around);
        }
        let index = self.free.pop()?;
        let voice = &mut self.voices[index as usize];
        voice.start(path.id.0, slot, tenant, &aim, around.now, around.ramp);
        voice.groups = [groups; 2];
        of_voice(&mut self.tails, index, self.tail).fill(0.0);
        let mut weights = Weights {
            target: of_voice(&mut self.targets, index, 2 * self.groups),
            growth: of_voice(&mut self.growths, index, 2 * self.groups),
        };
        weights.rest_at(&self.looked_up);
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

    /// Adds a chunk of every voice to the buses: all of them in one walk through the delay lines, those in full detail
    /// and the others each by fours.
    pub(super) fn render(&mut self, lines: &[DelayLine], moment: Moment, binaural: &mut Binaural) {
        let resting = usize::from(moment.left == 0);
        let mut waiting = [[0; TOGETHER]; 2];
        let mut counts = [0; 2];
        for place in 0..self.order.len() {
            let index = self.order[place];
            let ahead = self.look_ahead(place + 1, lines, moment.frames);
            let voice = &mut self.voices[index as usize];
            let Some(line) = lines.get(voice.slot) else {
                continue;
            };
            let detail = usize::from(voice.groups[resting] == self.groups);
            let count = &mut counts[detail];
            let bench = Bench {
                tail: of_voice(&mut self.tails, index, self.tail),
                mixture: &mut self.mixture,
                intervals: &mut self.intervals,
                ears: &mut self.ears[detail][*count],
                ahead,
            };
            if !voice.render(self.set, line, moment, bench) {
                continue;
            }
            waiting[detail][*count] = index;
            *count += 1;
            if *count == TOGETHER {
                *count = 0;
                self.add(&waiting[detail], detail, moment, binaural);
            }
        }
        for detail in 0..2 {
            let rest = &waiting[detail][..counts[detail]];
            if !rest.is_empty() {
                self.add(rest, detail, moment, binaural);
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
            prefetch(&self.voices[after]);
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

    /// Adds rendered voices, in full detail or not, whose ear signals lie in the first buffers.
    fn add(&self, waiting: &[u32], detail: usize, moment: Moment, binaural: &mut Binaural) {
        let groups = if detail == 1 { self.groups } else { 1 };
        let arrivals = std::array::from_fn(|n| {
            let index = *waiting.get(n)? as usize;
            let place = index * 2 * self.groups;
            Some(Ready {
                ears: &self.ears[detail][n],
                target: &self.targets[place..][..2 * self.groups],
                growth: &self.growths[place..][..2 * self.groups],
                moving: self.voices[index].moving,
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
