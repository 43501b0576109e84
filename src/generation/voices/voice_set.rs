//! All voices: assignment to paths, starts, fades and drops.
//!
//! Audio side; wait-free, bounded by the numbers of paths and voices; allocates at construction only. Input: a frame's
//! paths; output: their contributions to the buses.
//!
//! Paths and active voices are sorted by identity and merged. A path without a voice starts one, a voice without a path
//! fades out, and a path whose delay jumps does both. A truncated fade would click: while many voices fade, the quieter new
//! paths wait for a later frame and are counted. The pool has twice as many voices as may be active; without a free voice
//! a path waits too. For even block times, voices start a few at a time, the loudest first, as the fades end
//! ([`VoiceSet::take_paths`], [`VoiceSet::start`]).

use std::ops::Range;

use crate::extrapolation::FramePath;
use crate::simd::{F32x8, LaneSet, prefetch};

use crate::generation::bands::air_filter::{AIR_DELAY, AIR_SCRATCH};
use crate::generation::binaural::ear_ramps;
use crate::generation::binaural::ear_ramps::{
    Arrival, EarPair, Weights, history_frames, past_frames,
};
use crate::generation::binaural::filter_bank::{BATCH, OutputBuses};
use crate::generation::delay::delay_line::{DelayLine, PrefetchWindow};
use crate::generation::delay::interpolation::{Intervals, SLACK};
use crate::generation::panning::direction_table::DirectionTable;
use crate::generation::ramp::ChunkSpan;
use crate::generation::render_context::{Dropped, RenderContext, SlotOwner};
use crate::generation::voices::frame_plan::FramePlan;
use crate::generation::voices::pending_voices::{CONTINUES, PendingVoice, PendingVoices};
use crate::generation::voices::voice::{INDEX_BITS, MAX_FRESH, Voice, VoiceScratch};

/// Kinds of voices that share batches: with eight or all components, times the frames for which weights are held. So what a voice adds
/// does not depend on the others.
const KINDS: usize = 2 * ear_ramps::HOLDS;

/// Voices that may start while others fade, besides a quarter of the active ones.
const MIN_STARTS: usize = 64;

/// Prefetch distance in voices: the dozen cache lines of a voice take longer to load than a voice takes to retarget.
const PREFETCH_DISTANCE: usize = 3;

/// Index of a voice that has not started yet.
const NONE: u32 = u32::MAX;

/// The voices and their pools, by index.
#[derive(Debug)]
pub(crate) struct VoiceSet {
    max_voices: usize,
    /// Readings of a voice, groups of buses a reading, those of quiet voices, and frames of history per voice.
    ears: usize,
    groups: usize,
    coarse_groups: usize,
    history: usize,
    voices: Vec<Voice>,
    histories: Vec<f32>,
    /// Frames of past of a signal that both ears share, and those of each voice.
    past: usize,
    pasts: Vec<f32>,
    targets: Vec<F32x8>,
    growths: Vec<F32x8>,
    /// Sorted by identity.
    active: Vec<ActiveVoice>,
    next_active: Vec<ActiveVoice>,
    fading: Vec<u32>,
    /// Active and fading voices by source and delay: neighbours read adjacent stretches of one delay line.
    order: Vec<u32>,
    sort_keys: Vec<u64>,
    free: Vec<u32>,
    plan: FramePlan,
    pending: PendingVoices,
    /// Most active and fading voices while pending ones start.
    max_sounding: usize,
    mixture: Vec<f32>,
    unfiltered: Vec<f32>,
    intervals: Box<Intervals>,
    /// Ear signals of a batch for each kind.
    ear_signals: [[EarPair; BATCH]; KINDS],
    set: LaneSet,
}

/// An active voice and the identity of its path, apart from [`Voice`]: the merge reads identities only.
#[derive(Debug, Clone, Copy)]
struct ActiveVoice {
    id: u64,
    /// [`NONE`] while it is pending.
    index: u32,
}

impl VoiceSet {
    pub(crate) fn new(max_voices: usize, max_fine: usize, table: &DirectionTable) -> Self {
        let pool = 2 * max_voices;
        let width = table.width();
        let history = history_frames(table);
        let past = past_frames(table);
        Self {
            max_voices,
            ears: table.ears(),
            groups: table.groups(),
            coarse_groups: table.coarse_groups(),
            history,
            voices: vec![Voice::default(); pool],
            histories: vec![0.0; pool * history],
            past,
            pasts: vec![0.0; pool * past],
            targets: vec![F32x8::ZERO; pool * width],
            growths: vec![F32x8::ZERO; pool * width],
            active: Vec::with_capacity(max_voices),
            next_active: Vec::with_capacity(max_voices),
            fading: Vec::with_capacity(pool),
            order: Vec::with_capacity(pool),
            sort_keys: Vec::with_capacity(pool),
            free: (0..pool as u32).rev().collect(),
            plan: FramePlan::new(max_voices, max_fine, table),
            pending: PendingVoices::new(max_voices),
            max_sounding: 0,
            mixture: vec![0.0; history + MAX_FRESH + SLACK],
            unfiltered: vec![0.0; MAX_FRESH + AIR_SCRATCH],
            intervals: Intervals::new(),
            ear_signals: std::array::from_fn(|_| ear_ramps::ear_pairs(past)),
            set: LaneSet::best(),
        }
    }

    /// Groups of all readings of a voice.
    fn width(&self) -> usize {
        self.ears * self.groups
    }

    /// Frames that a voice is heard after the end of its fade.
    pub(crate) fn tail_frames(&self) -> usize {
        self.history + 2 * AIR_DELAY
    }

    /// Active and fading voices.
    pub(crate) fn count(&self) -> usize {
        self.active.len() - self.pending.len() + self.fading.len()
    }

    /// Number of paths waiting for [`Self::start`].
    pub(crate) fn pending_count(&self) -> usize {
        self.pending.len()
    }

    /// Discards a prepared frame and the pending voices.
    pub(crate) fn discard_paths(&mut self) {
        self.plan.clear();
        if self.pending.len() > 0 {
            self.active.retain(|voice| voice.index != NONE);
            self.pending.clear();
        }
    }

    /// Plans up to `most` further paths of a frame, sorted by identity, for [`Self::set_paths`]; returns whether all are
    /// planned.
    pub(crate) fn prepare_paths(
        &mut self,
        paths: &[FramePath],
        context: &RenderContext,
        most: usize,
    ) -> bool {
        if self.pending.len() > 0 {
            self.discard_paths();
        }
        self.plan.resume(paths, context, most)
    }

    /// Applies a frame's paths and starts their voices.
    pub(crate) fn set_paths(
        &mut self,
        paths: &[FramePath],
        owners: &[SlotOwner],
        context: &RenderContext,
    ) -> Dropped {
        let sounding = self.count();
        let mut dropped = self.merge(paths, owners, context);
        let pending = self.pending.len();
        let first = self.start_threshold(paths, context.longest_s, sounding);
        self.pending.in_order();
        let mut started = 0;
        while let Some(start) = self.pending.pop() {
            started += u32::from(start.rank >= first && self.start_voice(start, owners, context));
        }
        dropped.late_starts += pending as u32 - started;
        if started < pending as u32 {
            self.active.retain(|voice| voice.index != NONE);
        }
        self.plan.clear();
        self.sort_voices();
        dropped
    }

    /// Applies a frame's paths that have voices; the others wait for [`Self::start`].
    pub(crate) fn take_paths(
        &mut self,
        paths: &[FramePath],
        owners: &[SlotOwner],
        context: &RenderContext,
    ) -> Dropped {
        let active = self.active.len();
        let dropped = self.merge(paths, owners, context);
        self.max_sounding = active.max(self.active.len()) + MIN_STARTS;
        self.pending.loudest_first();
        if self.pending.len() == 0 {
            self.plan.clear();
        }
        self.sort_voices();
        dropped
    }

    /// Starts up to `most` pending voices, the loudest first; returns the number still pending.
    pub(crate) fn start(
        &mut self,
        most: usize,
        owners: &[SlotOwner],
        context: &RenderContext,
    ) -> usize {
        if self.pending.len() == 0 {
            return 0;
        }
        let room = self.max_sounding.saturating_sub(self.count());
        let mut started = 0;
        while started < most.min(room)
            && !self.free.is_empty()
            && let Some(start) = self.pending.pop()
        {
            self.start_voice(start, owners, context);
            started += 1;
        }
        if started > 0 {
            self.sort_voices();
        }
        if self.pending.len() == 0 {
            self.plan.clear();
        }
        self.pending.len()
    }

    /// Retargets voices to the frame, fades those without a path, and lists the paths without a voice.
    fn merge(
        &mut self,
        paths: &[FramePath],
        owners: &[SlotOwner],
        context: &RenderContext,
    ) -> Dropped {
        if self.pending.len() > 0 {
            self.discard_paths();
        }
        self.plan.resume(paths, context, usize::MAX);
        self.next_active.clear();
        let mut old = 0;
        for number in 0..self.plan.len() {
            let (request, _) = self.plan.get(number);
            let id = request.id;
            while let Some(voice) = self.active.get(old)
                && voice.id < id
            {
                self.fade(voice.index, context);
                old += 1;
            }
            let held = self.active.get(old).filter(|voice| voice.id == id);
            let held = held.map(|voice| voice.index);
            old += usize::from(held.is_some());
            self.prefetch_active(old + PREFETCH_DISTANCE);
            let continued = held.filter(|&index| self.retarget(index, number, owners, context));
            if continued.is_none() {
                let position = self.next_active.len() as u32;
                self.pending.push(PendingVoice {
                    rank: held.map_or(request.rank, |_| CONTINUES),
                    index: number as u32,
                    position,
                });
            }
            let index = continued.unwrap_or(NONE);
            self.next_active.push(ActiveVoice { id, index });
        }
        while let Some(voice) = self.active.get(old) {
            self.fade(voice.index, context);
            old += 1;
        }
        std::mem::swap(&mut self.active, &mut self.next_active);
        self.plan.dropped()
    }

    /// Sorts all voices for rendering.
    fn sort_voices(&mut self) {
        let voices = &self.voices;
        let active = self.active.iter().map(|voice| voice.index);
        let active = active.filter(|&index| index != NONE);
        let all = active.chain(self.fading.iter().copied());
        self.sort_keys.clear();
        self.sort_keys
            .extend(all.map(|index| voices[index as usize].sort_key() | u64::from(index)));
        self.sort_keys.sort_unstable();
        self.order.clear();
        let index = |key: &u64| (key % (1 << INDEX_BITS)) as u32;
        self.order.extend(self.sort_keys.iter().map(index));
    }

    /// Prefetches an active voice.
    fn prefetch_active(&self, position: usize) {
        if let Some(voice) = self.active.get(position) {
            self.prefetch_voice(voice.index);
        }
    }

    /// Prefetches a voice and its weights.
    fn prefetch_voice(&self, index: u32) {
        self.voices[index as usize].prefetch();
        let width = self.width();
        let first = index as usize * width;
        for pool in [&self.targets, &self.growths] {
            for pair in pool[first..first + width].iter().step_by(2) {
                prefetch(pair);
            }
        }
    }

    /// Least rank of a path that may start a voice in this frame; `sounding` voices were active or fading before it.
    /// When all paths change, the quieter new ones wait until the old ones have faded: otherwise some blocks would render
    /// twice as many voices.
    fn start_threshold(&mut self, paths: &[FramePath], longest_s: &[f64], sounding: usize) -> u64 {
        let requested = paths.len().min(self.max_voices);
        let before = &self.next_active;
        let most = requested.max(before.len());
        let free = (most + most / 4 + MIN_STARTS).saturating_sub(sounding);
        let continued = self.active.len() - self.pending.len();
        if requested <= continued + free {
            return 0;
        }
        let ids = before.iter().map(|voice| voice.id);
        let (mut old, mut kept) = (ids.peekable(), 0);
        for path in paths {
            while old.next_if(|&id| id < path.id.0).is_some() {}
            kept += usize::from(old.next_if_eq(&path.id.0).is_some());
        }
        if requested <= kept + free {
            return 0;
        }
        self.plan.ranking.threshold(paths, longest_s, kept + free)
    }

    /// Retargets a path's voice to the plan; if the delay jumps or the owner differs, fades it and returns false.
    fn retarget(
        &mut self,
        index: u32,
        number: usize,
        owners: &[SlotOwner],
        context: &RenderContext,
    ) -> bool {
        let (request, lookup) = self.plan.get(number);
        let slot = request.slot;
        let owner = owners.get(slot).copied().unwrap_or(SlotOwner::NONE);
        let width = self.width();
        let voice = &mut self.voices[index as usize];
        let is_same = voice.slot == slot && voice.owner == owner.bits;
        if !is_same || !voice.can_ramp_to(&request, context.left, context.ramp) {
            self.fade(index, context);
            return false;
        }
        voice.retarget(&request, context.now, context.left, context.ramp);
        voice.groups = [request.groups.max(voice.groups[1]), request.groups];
        let mut weights = weights_of(&mut self.targets, &mut self.growths, index, width);
        voice.rate = weights.retarget(self.set, lookup, context.left, context.ramp);
        true
    }

    /// Starts a voice; returns whether one was free.
    fn start_voice(
        &mut self,
        start: PendingVoice,
        owners: &[SlotOwner],
        context: &RenderContext,
    ) -> bool {
        let Some(index) = self.free.pop() else {
            return false;
        };
        if let (Some(&next), Some(_)) = (self.free.last(), self.pending.following()) {
            self.prefetch_voice(next);
            self.prefetch_history(next);
        }
        let (request, lookup) = self.plan.get(start.index as usize);
        let owner = owners.get(request.slot).copied().unwrap_or(SlotOwner::NONE);
        let voice = &mut self.voices[index as usize];
        voice.start(request.slot, owner, &request, context.now, context.ramp);
        voice.groups = [request.groups; 2];
        of_voice(&mut self.histories, index, self.history).fill(0.0);
        let width = self.width();
        let mut weights = weights_of(&mut self.targets, &mut self.growths, index, width);
        weights.rest_at(lookup);
        self.active[start.position as usize].index = index;
        true
    }

    fn prefetch_history(&self, index: u32) {
        for line in self.histories[index as usize * self.history..][..self.history].chunks(16) {
            prefetch(&line[0]);
        }
    }

    fn fade(&mut self, index: u32, context: &RenderContext) {
        self.voices[index as usize].fade(context.now, context.left, context.ramp, self.history);
        let width = self.width();
        let mut weights = weights_of(&mut self.targets, &mut self.growths, index, width);
        weights.stop(context.left);
        self.fading.push(index);
    }

    /// Adds a chunk of every voice to the buses in one pass over the delay lines. Calls `after_slot` for every slot in order, when the
    /// voices of its source are done: its delay line is in the cache.
    pub(crate) fn render(
        &mut self,
        lines: &[DelayLine],
        chunk: ChunkSpan,
        buses: &mut OutputBuses,
        after_slot: &mut impl FnMut(usize),
    ) {
        let after_last = self.render_range(0..self.order.len(), lines, chunk, buses, after_slot);
        (after_last..lines.len()).for_each(after_slot);
        for &index in &self.fading {
            self.voices[index as usize].advance_fade(chunk.frames);
        }
        self.remove_faded();
    }

    /// Adds a chunk of one source's voices to the buses. After the chunks of all sources call [`Self::remove_faded`].
    pub(crate) fn render_slot(
        &mut self,
        slot: usize,
        lines: &[DelayLine],
        chunk: ChunkSpan,
        buses: &mut OutputBuses,
    ) {
        let slot_of = |index: &u32| self.voices[*index as usize].slot;
        let first = self.order.partition_point(|index| slot_of(index) < slot);
        let end = self.order.partition_point(|index| slot_of(index) <= slot);
        if first == end {
            return;
        }
        self.render_range(first..end, lines, chunk, buses, &mut |_| ());
        for &index in &self.order[first..end] {
            self.voices[index as usize].advance_fade(chunk.frames);
        }
    }

    /// Frees the voices that have faded out.
    pub(crate) fn remove_faded(&mut self) {
        if self.fading.is_empty() {
            return;
        }
        let (voices, free) = (&self.voices, &mut self.free);
        let before = self.fading.len();
        self.fading.retain(|&index| {
            let is_over = voices[index as usize].is_over();
            if is_over {
                free.push(index);
            }
            !is_over
        });
        if self.fading.len() < before {
            self.order
                .retain(|&index| !voices[index as usize].is_over());
        }
    }

    /// Adds a chunk of a range of [`Self::order`] to the buses, in batches of one kind. Calls `after_slot` for every slot below that of
    /// the range's last voice, and returns how many these are.
    fn render_range(
        &mut self,
        range: Range<usize>,
        lines: &[DelayLine],
        chunk: ChunkSpan,
        buses: &mut OutputBuses,
        after_slot: &mut impl FnMut(usize),
    ) -> usize {
        let mut slot = 0;
        let resting = usize::from(chunk.left == 0);
        let mut batches = [[0; BATCH]; KINDS];
        let mut counts = [0; KINDS];
        for position in range {
            let index = self.order[position];
            let prefetch_window = self.prefetch_next(position + 1, lines, chunk.frames);
            let voice = &mut self.voices[index as usize];
            while slot < voice.slot.min(lines.len()) {
                after_slot(slot);
                slot += 1;
            }
            let Some(line) = lines.get(voice.slot).filter(|_| !voice.is_over()) else {
                continue;
            };
            let is_fine = voice.groups[resting] == self.groups;
            let kind = usize::from(is_fine) + 2 * voice.rate.hold_index(chunk.left);
            let count = &mut counts[kind];
            let scratch = VoiceScratch {
                history: of_voice(&mut self.histories, index, self.history),
                past: of_voice(&mut self.pasts, index, self.past),
                mixture: &mut self.mixture,
                unfiltered: &mut self.unfiltered,
                intervals: &mut self.intervals,
                ears: &mut self.ear_signals[kind][*count],
                readings: self.ears,
                prefetch_window,
            };
            if !voice.render(self.set, line, chunk, scratch) {
                continue;
            }
            batches[kind][*count] = index;
            *count += 1;
            if *count == BATCH {
                *count = 0;
                self.add(&batches[kind], kind, chunk, buses);
            }
        }
        for kind in 0..KINDS {
            let rest = &batches[kind][..counts[kind]];
            if !rest.is_empty() {
                self.add(rest, kind, chunk, buses);
            }
        }
        slot
    }

    /// Prefetches the voice after the one at `position`; returns the delay-line stretch of the latter.
    fn prefetch_next<'a>(
        &self,
        position: usize,
        lines: &'a [DelayLine],
        frames: usize,
    ) -> PrefetchWindow<'a> {
        if let Some(&after) = self.order.get(position + 1) {
            self.prefetch_voice(after);
            self.prefetch_history(after);
        }
        let Some(&index) = self.order.get(position) else {
            return PrefetchWindow::default();
        };
        let before = position.checked_sub(1).map(|before| self.order[before]);
        let before = before.map(|before| &self.voices[before as usize]);
        self.voices[index as usize].prefetch_window(lines, frames, before)
    }

    /// Adds rendered voices of a kind; their ear signals are in its first buffers.
    fn add(&self, batch: &[u32], kind: usize, chunk: ChunkSpan, buses: &mut OutputBuses) {
        let is_fine = kind % 2 == 1;
        let groups = if is_fine {
            self.groups
        } else {
            self.coarse_groups
        };
        let width = self.width();
        let arrivals = std::array::from_fn(|n| {
            let index = *batch.get(n)? as usize;
            let position = index * width;
            let [left, right] = &self.ear_signals[kind][n];
            let ears: [&[f32]; 2] = match self.voices[index].shared_ears() {
                Some(delays) => delays.map(|delay| &left[self.past - delay as usize..]),
                None => [left, right],
            };
            Some(Arrival {
                ears,
                target: &self.targets[position..][..width],
                growth: &self.growths[position..][..width],
                rate: self.voices[index].rate,
            })
        });
        ear_ramps::add(buses, &arrivals, [groups, self.groups], chunk);
    }
}

/// One voice's part of the pools of weights.
fn weights_of<'a>(
    targets: &'a mut [F32x8],
    growths: &'a mut [F32x8],
    index: u32,
    width: usize,
) -> Weights<'a> {
    Weights {
        target: of_voice(targets, index, width),
        growth: of_voice(growths, index, width),
    }
}

/// The part of a pool that belongs to one voice.
fn of_voice<T>(pool: &mut [T], index: u32, width: usize) -> &mut [T] {
    &mut pool[index as usize * width..][..width]
}
