//! Source virtualisation: assigns more sources than slots to own slots, shared slots or silence. Own.
//!
//! Control side, once a tick; bounded by sources times slots. Later stages process slots only, so their cost does not
//! grow with the number of sources. The loudest sources have slots of their own. The others share slots with their
//! perceptual neighbours; a shared slot is at the position of its loudest member and plays all members at their own
//! levels, with their distance curves and without the rest of their settings. Masked sources are silent and advance their samples.
//!
//! A source changes slots only for a clear gain and after [`DWELL_S`]; the renderer cross-fades. A slot is released
//! between two sources ([`SlotRelease`]), so the sound of one does not move to the position of the next. Deterministic.

use std::cmp::Ordering;

use glam::Vec3;

use crate::runtime::engine::audibility::{MIN_DISTANCE_M, energy, is_audible};
use crate::runtime::engine::messages::{BED, NO_SLOT, SourceRoute};
use crate::runtime::engine::playback::PlayState;
use crate::runtime::engine::slot_release::{PlaybackProgress, SlotRelease};
use crate::scene::{SourceId, SourcePose};

/// One slot of this many is shared.
const SLOTS_PER_SHARED: usize = 4;
/// Shortest stay of a source in a slot, in seconds.
const DWELL_S: f64 = 0.3;
/// Energy ratio from which a source replaces the owner of a slot: 3 dB.
const CLEARLY_LOUDER: f32 = 2.0;
/// Ratio of perceptual distances below which a source moves to the nearer shared slot.
const CLEARLY_NEARER: f32 = 0.5;
/// [`perceptual_distance`] beyond which a source prefers an empty shared slot: some 15 degrees.
const FAR: f32 = 0.07;
/// Perceptual distance of the nearest member beyond which a shared slot jumps to its loudest member: a radian, for
/// instance after a change of scene.
const LOST: f32 = 1.0;
/// Time constant in seconds with which a shared slot follows its loudest member.
const FOLLOW_S: f64 = 0.15;
/// Greatest gain of a member in a more distant slot.
const MAX_GAIN: f32 = 8.0;

/// Number of slots that have one source each: all, unless there are more sources than slots.
pub(crate) fn own_slots(sources: usize, slots: usize) -> usize {
    match sources > slots {
        true => first_shared(slots),
        false => slots,
    }
}

fn first_shared(slots: usize) -> usize {
    slots - (slots / SLOTS_PER_SHARED).max(1)
}

/// A source of the app.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VirtualSource {
    pub(crate) pose: SourcePose,
    pub(crate) gain: f32,
    /// Seconds in which the gain is reached.
    pub(crate) ramp_s: f32,
    /// Whether it has samples.
    pub(crate) plays: bool,
    pub(crate) play: PlayState,
}

impl VirtualSource {
    /// Whether it is heard without a position, and needs no slot.
    pub(crate) fn is_2d(&self) -> bool {
        self.pose.settings.is_2d
    }
}

/// Slot of a source.
#[derive(Debug, Clone, Copy)]
struct Assignment {
    id: SourceId,
    slot: Option<usize>,
    since_s: f64,
    audible: bool,
    energy: f32,
    priority: u8,
}

impl Assignment {
    /// Order in which sources get own slots: by priority, then by energy.
    fn cmp_importance(&self, other: &Self) -> Ordering {
        let by_priority = self.priority.cmp(&other.priority);
        by_priority.then(self.energy.total_cmp(&other.energy))
    }

    /// Whether the source replaces the owner of a slot.
    fn displaces(&self, owner: &Self) -> bool {
        match self.priority.cmp(&owner.priority) {
            Ordering::Less => false,
            Ordering::Equal => self.energy > CLEARLY_LOUDER * owner.energy,
            Ordering::Greater => true,
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct RenderSlot {
    generation: u32,
    /// The only member; `None` for a shared slot.
    owner: Option<SourceId>,
    members: u32,
    release: SlotRelease,
    /// Position of a shared slot, energy and position of its loudest member.
    position: Vec3,
    loudest: f32,
    target: Vec3,
    /// Perceptual distance to its nearest member.
    nearest: f32,
}

/// Slot assignments of one engine.
#[derive(Debug)]
pub(crate) struct SourceVirtualizer {
    assignments: Vec<Assignment>,
    slots: Vec<RenderSlot>,
    /// Slots below this index are own, the others shared.
    first_shared: usize,
    time_s: f64,
    progress: PlaybackProgress,
    /// Release time of a slot, in seconds of audio.
    release_s: f64,
    /// Candidates for own slots, loudest first; scratch.
    waiting: Vec<usize>,
    pub(crate) masked: u32,
}

impl SourceVirtualizer {
    /// For `source_count` sources and fewer slots, released for `release_s` seconds of audio.
    pub(crate) fn new(source_count: usize, slots: usize, release_s: f64) -> Self {
        let assignment = Assignment {
            id: SourceId::default(),
            slot: None,
            since_s: f64::NEG_INFINITY,
            audible: false,
            energy: 0.0,
            priority: 0,
        };
        let slot = RenderSlot {
            generation: 0,
            owner: None,
            members: 0,
            release: SlotRelease::Free,
            position: Vec3::ZERO,
            loudest: 0.0,
            target: Vec3::ZERO,
            nearest: 0.0,
        };
        Self {
            assignments: vec![assignment; source_count],
            slots: vec![slot; slots],
            first_shared: first_shared(slots),
            time_s: 0.0,
            progress: PlaybackProgress::default(),
            release_s,
            waiting: Vec::with_capacity(source_count),
            masked: 0,
        }
    }

    /// Assigns all sources of a graphics frame; writes the poses of used slots and the routes of all sources.
    pub(crate) fn assign(
        &mut self,
        sources: impl Iterator<Item = VirtualSource> + Clone,
        listeners: &[Vec3],
        (time_s, progress): (f64, PlaybackProgress),
        slot_poses: &mut Vec<SourcePose>,
        routes: &mut Vec<SourceRoute>,
    ) {
        let passed_s = (time_s - self.time_s).max(0.0);
        (self.time_s, self.progress) = (time_s, progress);
        for slot in &mut self.slots {
            slot.release.advance(&progress, self.release_s);
        }
        self.update_audibility(sources.clone(), listeners);
        self.assign_own_slots(sources.clone());
        self.assign_shared_slots(sources.clone(), listeners);
        self.move_shared_slots(sources.clone(), listeners, passed_s);
        self.write(sources, listeners, slot_poses, routes);
        self.store_positions(slot_poses);
    }

    /// Updates energies and audibility, and releases the slots of removed and masked sources.
    fn update_audibility(
        &mut self,
        sources: impl Iterator<Item = VirtualSource> + Clone,
        listeners: &[Vec3],
    ) {
        let loudness = |source: &VirtualSource| match source.plays && !source.is_2d() {
            // What one of several listeners hears is heard.
            true => listeners
                .iter()
                .map(|listener| energy(&source.pose, source.gain, *listener))
                .fold(0.0, f32::max),
            false => 0.0,
        };
        let all: f32 = sources.clone().map(|source| loudness(&source)).sum();
        let mut present = sources.map(|source| (source, loudness(&source))).peekable();
        self.masked = 0;
        for index in 0..self.assignments.len() {
            let source = present.next_if(|(source, _)| source.pose.id.slot() == index);
            let assignment = self.assignments[index];
            let same = source.is_some_and(|(source, _)| source.pose.id == assignment.id);
            if !same {
                self.release(index);
                self.assignments[index].audible = false;
                self.assignments[index].since_s = f64::NEG_INFINITY;
            }
            let Some((source, energy)) = source else {
                continue;
            };
            let assignment = &mut self.assignments[index];
            (assignment.id, assignment.energy) = (source.pose.id, energy);
            assignment.priority = source.pose.settings.priority;
            assignment.audible = is_audible(energy, all, assignment.audible);
            if !assignment.audible {
                self.masked += u32::from(!source.is_2d());
                self.release(index);
            }
        }
    }

    fn release(&mut self, index: usize) {
        let Some(slot) = self.assignments[index].slot.take() else {
            return;
        };
        let id = self.assignments[index].id;
        let slot = &mut self.slots[slot];
        slot.members = slot.members.saturating_sub(1);
        if slot.owner == Some(id) {
            slot.owner = None;
        }
        if slot.members == 0 {
            slot.release = SlotRelease::RemovedAt(self.progress.tick);
        }
    }

    fn occupy(&mut self, index: usize, slot: usize) {
        self.release(index);
        let assignment = &mut self.assignments[index];
        (assignment.slot, assignment.since_s) = (Some(slot), self.time_s);
        let is_own = slot < self.first_shared;
        let slot = &mut self.slots[slot];
        if slot.members == 0 {
            slot.generation = slot.generation.wrapping_add(1);
        }
        slot.members += 1;
        slot.owner = is_own.then_some(assignment.id);
    }

    fn is_free(&self, slot: usize) -> bool {
        let slot = &self.slots[slot];
        slot.members == 0 && slot.release == SlotRelease::Free
    }

    fn may_move(&self, index: usize) -> bool {
        self.time_s - self.assignments[index].since_s >= DWELL_S
    }

    /// Assigns free own slots to the loudest sources without one; a clearly louder source displaces the least owner.
    /// Priority counts before loudness.
    fn assign_own_slots(&mut self, sources: impl Iterator<Item = VirtualSource>) {
        self.waiting.clear();
        for source in sources {
            let index = source.pose.id.slot();
            let assignment = &self.assignments[index];
            let owns = assignment.slot.is_some_and(|slot| slot < self.first_shared);
            if assignment.audible && !owns && (assignment.slot.is_none() || self.may_move(index)) {
                self.waiting.push(index);
            }
        }
        let assignments = &self.assignments;
        self.waiting.sort_unstable_by(|&a, &b| {
            let first = assignments[b].cmp_importance(&assignments[a]);
            first.then(a.cmp(&b))
        });
        let mut next = 0;
        for slot in 0..self.first_shared {
            if next < self.waiting.len() && self.is_free(slot) {
                self.occupy(self.waiting[next], slot);
                next += 1;
            }
        }
        let Some(&first) = self.waiting.get(next) else {
            return;
        };
        // A slot in release will be free soon: one owner at a time is displaced.
        if (0..self.first_shared).any(|slot| self.slots[slot].members == 0) {
            return;
        }
        let owners = (0..self.first_shared).filter_map(|slot| self.slots[slot].owner);
        let least = owners
            .map(SourceId::slot)
            .filter(|&index| self.may_move(index))
            .min_by(|&a, &b| self.assignments[a].cmp_importance(&self.assignments[b]));
        if let Some(index) = least
            && self.assignments[first].displaces(&self.assignments[index])
        {
            self.release(index);
        }
    }

    /// Assigns all other sources to the nearest shared slot.
    fn assign_shared_slots(
        &mut self,
        sources: impl Iterator<Item = VirtualSource>,
        listeners: &[Vec3],
    ) {
        for source in sources {
            let index = source.pose.id.slot();
            let assignment = self.assignments[index];
            let owns = assignment.slot.is_some_and(|slot| slot < self.first_shared);
            if !assignment.audible || owns {
                continue;
            }
            let from = source.pose.position;
            let shared = self.first_shared..self.slots.len();
            let distance =
                |slot: usize| perceptual_distance(from, self.slots[slot].position, listeners);
            let nearest = shared
                .clone()
                .filter(|&slot| self.slots[slot].members > 0)
                .min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            let better = match (assignment.slot, nearest) {
                (Some(_), _) if !self.may_move(index) => None,
                (Some(now), Some(slot)) => {
                    (slot != now && distance(slot) < CLEARLY_NEARER * distance(now)).then_some(slot)
                }
                (_, Some(slot)) if distance(slot) < FAR => Some(slot),
                (None, nearest) => shared.clone().find(|&slot| self.is_free(slot)).or(nearest),
                (Some(_), None) => None,
            };
            if let Some(slot) = better {
                if self.slots[slot].members == 0 {
                    self.slots[slot].position = from;
                }
                self.occupy(index, slot);
            }
        }
    }

    /// Moves shared slots towards their loudest members.
    fn move_shared_slots(
        &mut self,
        sources: impl Iterator<Item = VirtualSource>,
        listeners: &[Vec3],
        passed_s: f64,
    ) {
        for slot in &mut self.slots {
            (slot.loudest, slot.nearest) = (0.0, f32::INFINITY);
        }
        for source in sources {
            let assignment = &self.assignments[source.pose.id.slot()];
            if let Some(slot) = assignment.slot.filter(|&slot| slot >= self.first_shared) {
                let slot = &mut self.slots[slot];
                let distance = perceptual_distance(source.pose.position, slot.position, listeners);
                slot.nearest = slot.nearest.min(distance);
                if assignment.energy > slot.loudest {
                    (slot.loudest, slot.target) = (assignment.energy, source.pose.position);
                }
            }
        }
        let share = (1.0 - (-passed_s / FOLLOW_S).exp()) as f32;
        for slot in self.slots.iter_mut().filter(|slot| slot.loudest > 0.0) {
            let share = if slot.nearest > LOST { 1.0 } else { share };
            slot.position += share * (slot.target - slot.position);
        }
    }

    fn write(
        &self,
        sources: impl Iterator<Item = VirtualSource> + Clone,
        listeners: &[Vec3],
        slot_poses: &mut Vec<SourcePose>,
        routes: &mut Vec<SourceRoute>,
    ) {
        slot_poses.clear();
        routes.clear();
        for source in sources.clone() {
            let slot = self.assignments[source.pose.id.slot()].slot;
            let gain = match slot {
                Some(slot) if slot >= self.first_shared => {
                    let at = self.slots[slot].position;
                    let pose = &source.pose;
                    let listener = nearest(listeners, pose.position);
                    let curve = pose.settings.mix.distance;
                    let ratio = curve.ratio(pose.position.distance(listener), MIN_DISTANCE_M);
                    source.gain * ratio * distance_gain(pose.position, at, listener)
                }
                _ => source.gain,
            };
            routes.push(SourceRoute {
                id: source.pose.id,
                slot: match slot {
                    _ if source.is_2d() => BED,
                    None => NO_SLOT,
                    Some(slot) => slot as u16,
                },
                gain,
                ramp_s: source.ramp_s,
                play: source.play,
            });
        }
        for (index, slot) in self.slots.iter().enumerate() {
            if slot.members == 0 && slot.release == SlotRelease::Free {
                continue;
            }
            let id = SourceId::new(index as u16, slot.generation);
            let owner = slot
                .owner
                .and_then(|owner| sources.clone().find(|source| source.pose.id == owner));
            slot_poses.push(match owner {
                Some(source) => SourcePose { id, ..source.pose },
                None => SourcePose::at(id, slot.position),
            });
        }
    }

    /// Keeps the positions of owners, for the release of their slots.
    fn store_positions(&mut self, slot_poses: &[SourcePose]) {
        for pose in slot_poses {
            if let Some(slot) = self.slots.get_mut(pose.id.slot()) {
                slot.position = pose.position;
            }
        }
    }
}

/// Perceptual distance of two positions at the listener: angle in radians squared plus half the distance ratio in
/// nepers squared. Of several listeners the largest: neighbours are so for all.
fn perceptual_distance(a: Vec3, b: Vec3, listeners: &[Vec3]) -> f32 {
    let distance = |listener: &Vec3| {
        let (a, b) = (a - listener, b - listener);
        let turn = a.normalize_or(Vec3::NEG_Z) - b.normalize_or(Vec3::NEG_Z);
        let ratio = (a.length().max(0.3) / b.length().max(0.3)).ln();
        turn.length_squared() + 0.25 * ratio * ratio
    };
    listeners.iter().map(distance).fold(0.0, f32::max)
}

/// The listener nearest to a position.
fn nearest(listeners: &[Vec3], position: Vec3) -> Vec3 {
    let distance = |listener: &Vec3| listener.distance_squared(position);
    let by_distance = |a: &&Vec3, b: &&Vec3| distance(a).total_cmp(&distance(b));
    listeners
        .iter()
        .min_by(by_distance)
        .copied()
        .unwrap_or_default()
}

/// Gain that makes a source at another position as loud as at its own.
fn distance_gain(own: Vec3, at: Vec3, listener: Vec3) -> f32 {
    let distance_m = |position: Vec3| position.distance(listener).max(0.3);
    (distance_m(at) / distance_m(own)).min(MAX_GAIN)
}

#[cfg(test)]
#[path = "source_virtualization_tests.rs"]
mod tests;
