//! More sources than slots: who has a slot of its own, who shares one, who is not heard. Own.
//!
//! Control side, once a tick; bounded by sources times slots. Propagation, extrapolation and generation see slots only, so
//! that their cost does not grow with the number of sources. The loudest have slots of their own; of the rest, neighbours
//! as the listener hears them share one, which stands where the loudest of them stands and plays them all, each at its own
//! level; the masked ones are silent and only keep their place in their sound.
//!
//! Smooth: nobody changes places without a clear reason nor sooner than [`DWELL_S`] after the last change, every change is
//! a cross-fade in the renderer, and a slot rests between two tenants ([`SlotRelease`]), so that what one has sent is not heard from
//! where the next stands. Nothing here depends on anything but poses, gains, times of ticks and how much was heard.

use glam::Vec3;

use crate::runtime::engine::audibility::{energy, is_audible};
use crate::runtime::engine::messages::{NO_SLOT, SourceRoute};
use crate::runtime::engine::slot_release::{PlaybackProgress, SlotRelease};
use crate::scene::{SourceId, SourcePose};

/// Of the slots, one in so many is shared.
const SLOTS_PER_SHARED: usize = 4;
/// Seconds that a source stays where it is at least.
const DWELL_S: f64 = 0.3;
/// Energy over that of a slot's tenant from which another takes its place: 3 dB.
const CLEARLY_LOUDER: f32 = 2.0;
/// Share of the way to another shared slot below which a source moves there.
const CLEARLY_NEARER: f32 = 0.5;
/// Way ([`apart`]) beyond which a source would rather have an empty shared slot: some 15 degrees.
const FAR: f32 = 0.07;
/// Way beyond which a shared slot without any nearer member goes to the loudest at once: a radian, as when all are moved to
/// another scene.
const LOST: f32 = 1.0;
/// Seconds in which a shared slot follows its loudest member, to 1/e.
const FOLLOW_S: f64 = 0.15;
/// Most that a member's level is raised because its slot stands farther away than it does.
const MAX_GAIN: f32 = 8.0;

/// One source as the app has it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VirtualSource {
    pub(crate) pose: SourcePose,
    pub(crate) gain: f32,
    /// Whether it has a sound at all.
    pub(crate) plays: bool,
}

/// Where a source is, by its own slot in the app's table.
#[derive(Debug, Clone, Copy)]
struct Assignment {
    id: SourceId,
    slot: Option<usize>,
    since_s: f64,
    audible: bool,
    energy: f32,
}

#[derive(Debug, Clone, Copy)]
struct RenderSlot {
    generation: u16,
    /// Who owns it; nobody owns a shared one.
    owner: Option<SourceId>,
    members: u32,
    release: SlotRelease,
    /// Where a shared one stands, and its loudest member's energy and place.
    position: Vec3,
    loudest: f32,
    target: Vec3,
    /// Way to its nearest member.
    nearest: f32,
}

/// The seating of one engine.
#[derive(Debug)]
pub(crate) struct SourceVirtualizer {
    assignments: Vec<Assignment>,
    slots: Vec<RenderSlot>,
    /// Slots before this one have owners.
    first_shared: usize,
    time_s: f64,
    progress: PlaybackProgress,
    /// How long slots rest, in seconds of audio.
    release_s: f64,
    /// Waiting for slots of their own, loudest first; scratch.
    waiting: Vec<usize>,
    pub(crate) masked: u32,
}

impl SourceVirtualizer {
    /// For this many sources and fewer slots, which rest for so many seconds of audio.
    pub(crate) fn new(sources: usize, slots: usize, release_s: f64) -> Self {
        let place = Assignment {
            id: SourceId::default(),
            slot: None,
            since_s: f64::NEG_INFINITY,
            audible: false,
            energy: 0.0,
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
            assignments: vec![place; sources],
            slots: vec![slot; slots],
            first_shared: slots - (slots / SLOTS_PER_SHARED).max(1),
            time_s: 0.0,
            progress: PlaybackProgress::default(),
            release_s,
            waiting: Vec::with_capacity(sources),
            masked: 0,
        }
    }

    /// Seats all sources of a graphics frame: what propagation and extrapolation see goes to `sources`, where each feed is
    /// mixed to `feeds`.
    pub(crate) fn assign(
        &mut self,
        guests: impl Iterator<Item = VirtualSource> + Clone,
        listener: Vec3,
        (time_s, heard): (f64, PlaybackProgress),
        sources: &mut Vec<SourcePose>,
        feeds: &mut Vec<SourceRoute>,
    ) {
        let passed_s = (time_s - self.time_s).max(0.0);
        (self.time_s, self.progress) = (time_s, heard);
        for slot in &mut self.slots {
            slot.release.advance(&heard, self.release_s);
        }
        self.update_audibility(guests.clone(), listener);
        self.assign_own_slots(guests.clone());
        self.assign_shared_slots(guests.clone(), listener);
        self.move_shared_slots(guests.clone(), listener, passed_s);
        self.write(guests, listener, sources, feeds);
        self.store_positions(sources);
    }

    /// Who is heard, and who has left.
    fn update_audibility(&mut self, guests: impl Iterator<Item = VirtualSource> + Clone, listener: Vec3) {
        let loudness = |guest: &VirtualSource| match guest.plays {
            true => energy(&guest.pose, guest.gain, listener),
            false => 0.0,
        };
        let all: f32 = guests.clone().map(|guest| loudness(&guest)).sum();
        let mut here = guests
            .map(|guest| (guest.pose.id, loudness(&guest)))
            .peekable();
        self.masked = 0;
        for number in 0..self.assignments.len() {
            let guest = here.next_if(|(id, _)| id.slot() == number);
            let place = self.assignments[number];
            let same = guest.is_some_and(|(id, _)| id == place.id);
            if !same {
                self.release(number);
                self.assignments[number].audible = false;
                self.assignments[number].since_s = f64::NEG_INFINITY;
            }
            let Some((id, energy)) = guest else { continue };
            let place = &mut self.assignments[number];
            (place.id, place.energy) = (id, energy);
            place.audible = is_audible(energy, all, place.audible);
            if !place.audible {
                self.masked += 1;
                self.release(number);
            }
        }
    }

    fn release(&mut self, number: usize) {
        let Some(slot) = self.assignments[number].slot.take() else {
            return;
        };
        let id = self.assignments[number].id;
        let slot = &mut self.slots[slot];
        slot.members = slot.members.saturating_sub(1);
        if slot.owner == Some(id) {
            slot.owner = None;
        }
        if slot.members == 0 {
            slot.release = SlotRelease::RemovedAt(self.progress.tick);
        }
    }

    fn occupy(&mut self, number: usize, slot: usize) {
        self.release(number);
        let place = &mut self.assignments[number];
        (place.slot, place.since_s) = (Some(slot), self.time_s);
        let is_own = slot < self.first_shared;
        let slot = &mut self.slots[slot];
        if slot.members == 0 {
            slot.generation = slot.generation.wrapping_add(1);
        }
        slot.members += 1;
        slot.owner = is_own.then_some(place.id);
    }

    fn is_free(&self, slot: usize) -> bool {
        let slot = &self.slots[slot];
        slot.members == 0 && slot.release == SlotRelease::Free
    }

    fn may_move(&self, number: usize) -> bool {
        self.time_s - self.assignments[number].since_s >= DWELL_S
    }

    /// The loudest who have none get what slots are free; the faintest owners make room for who is clearly louder.
    fn assign_own_slots(&mut self, guests: impl Iterator<Item = VirtualSource>) {
        self.waiting.clear();
        for guest in guests {
            let number = guest.pose.id.slot();
            let place = &self.assignments[number];
            let owns = place.slot.is_some_and(|slot| slot < self.first_shared);
            if place.audible && !owns && (place.slot.is_none() || self.may_move(number)) {
                self.waiting.push(number);
            }
        }
        let places = &self.assignments;
        self.waiting.sort_unstable_by(|&a, &b| {
            let louder = places[b].energy.total_cmp(&places[a].energy);
            louder.then(a.cmp(&b))
        });
        let mut next = 0;
        for slot in 0..self.first_shared {
            if next < self.waiting.len() && self.is_free(slot) {
                self.occupy(self.waiting[next], slot);
                next += 1;
            }
        }
        let Some(&loudest) = self.waiting.get(next) else {
            return;
        };
        // Slots at rest are as good as free: one owner at a time makes room.
        if (0..self.first_shared).any(|slot| self.slots[slot].members == 0) {
            return;
        }
        let owners = (0..self.first_shared).filter_map(|slot| self.slots[slot].owner);
        let faintest = owners
            .map(SourceId::slot)
            .filter(|&number| self.may_move(number))
            .min_by(|&a, &b| self.assignments[a].energy.total_cmp(&self.assignments[b].energy));
        if let Some(number) = faintest
            && self.assignments[loudest].energy > CLEARLY_LOUDER * self.assignments[number].energy
        {
            self.release(number);
        }
    }

    /// Everybody else to the nearest shared slot.
    fn assign_shared_slots(&mut self, guests: impl Iterator<Item = VirtualSource>, listener: Vec3) {
        for guest in guests {
            let number = guest.pose.id.slot();
            let place = self.assignments[number];
            let owns = place.slot.is_some_and(|slot| slot < self.first_shared);
            if !place.audible || owns {
                continue;
            }
            let from = guest.pose.position;
            let shared = self.first_shared..self.slots.len();
            let way = |slot: usize| perceptual_distance(from, self.slots[slot].position, listener);
            let nearest = shared
                .clone()
                .filter(|&slot| self.slots[slot].members > 0)
                .min_by(|&a, &b| way(a).total_cmp(&way(b)));
            let better = match (place.slot, nearest) {
                (Some(_), _) if !self.may_move(number) => None,
                (Some(now), Some(slot)) => {
                    (slot != now && way(slot) < CLEARLY_NEARER * way(now)).then_some(slot)
                }
                (_, Some(slot)) if way(slot) < FAR => Some(slot),
                (None, nearest) => shared.clone().find(|&slot| self.is_free(slot)).or(nearest),
                (Some(_), None) => None,
            };
            if let Some(slot) = better {
                if self.slots[slot].members == 0 {
                    self.slots[slot].position = from;
                }
                self.occupy(number, slot);
            }
        }
    }

    /// Shared slots go where their loudest member is.
    fn move_shared_slots(
        &mut self,
        guests: impl Iterator<Item = VirtualSource>,
        listener: Vec3,
        passed_s: f64,
    ) {
        for slot in &mut self.slots {
            (slot.loudest, slot.nearest) = (0.0, f32::INFINITY);
        }
        for guest in guests {
            let place = &self.assignments[guest.pose.id.slot()];
            if let Some(slot) = place.slot.filter(|&slot| slot >= self.first_shared) {
                let slot = &mut self.slots[slot];
                let way = perceptual_distance(guest.pose.position, slot.position, listener);
                slot.nearest = slot.nearest.min(way);
                if place.energy > slot.loudest {
                    (slot.loudest, slot.target) = (place.energy, guest.pose.position);
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
        guests: impl Iterator<Item = VirtualSource> + Clone,
        listener: Vec3,
        sources: &mut Vec<SourcePose>,
        feeds: &mut Vec<SourceRoute>,
    ) {
        sources.clear();
        feeds.clear();
        for guest in guests.clone() {
            let slot = self.assignments[guest.pose.id.slot()].slot;
            let gain = match slot {
                Some(slot) if slot >= self.first_shared => {
                    let at = self.slots[slot].position;
                    guest.gain * distance_gain(guest.pose.position, at, listener)
                }
                _ => guest.gain,
            };
            feeds.push(SourceRoute {
                id: guest.pose.id,
                slot: slot.map_or(NO_SLOT, |slot| slot as u16),
                gain,
            });
        }
        for (number, slot) in self.slots.iter().enumerate() {
            if slot.members == 0 && slot.release == SlotRelease::Free {
                continue;
            }
            let id = SourceId::new(number as u16, slot.generation);
            let owner = slot
                .owner
                .and_then(|owner| guests.clone().find(|guest| guest.pose.id == owner));
            sources.push(match owner {
                Some(guest) => SourcePose { id, ..guest.pose },
                None => SourcePose::at(id, slot.position),
            });
        }
    }

    /// Where owners stand is where their slots rest when they have left.
    fn store_positions(&mut self, sources: &[SourcePose]) {
        for pose in sources {
            if let Some(slot) = self.slots.get_mut(pose.id.slot()) {
                slot.position = pose.position;
            }
        }
    }
}

/// How far apart two places are to the listener's ears: the square of an angle in radians and of half a ratio of
/// distances in nepers.
fn perceptual_distance(a: Vec3, b: Vec3, listener: Vec3) -> f32 {
    let (a, b) = (a - listener, b - listener);
    let turn = a.normalize_or(Vec3::NEG_Z) - b.normalize_or(Vec3::NEG_Z);
    let ratio = (a.length().max(0.3) / b.length().max(0.3)).ln();
    turn.length_squared() + 0.25 * ratio * ratio
}

/// Gain of a source that is played from another place, so that it is as loud as from its own.
fn distance_gain(own: Vec3, at: Vec3, listener: Vec3) -> f32 {
    let distance_m = |place: Vec3| place.distance(listener).max(0.3);
    (distance_m(at) / distance_m(own)).min(MAX_GAIN)
}

#[cfg(test)]
#[path = "source_virtualization_tests.rs"]
mod tests;
