//! Sequences that the guide rays of all rotations hit, and those of cells that the listener has left.
//!
//! Only some rotations have a ray through a small opening, so all of them are remembered. Rays of a rotation start at a point
//! that is the same all over a cell (`propagator/guide_origins.rs`): they are cast when the listener enters it, and what they hit
//! depends on its position and not on the number of updates. A sequence remains possible for some metres after the cell is
//! left. Own.

use glam::Vec3;

use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;
use crate::simd::prefetch;

/// Distance in metres that a listener may walk before a sequence is dropped which the last rotation that hit it has lost. The
/// rays cast on four metres are twice those of all rotations.
const KEPT_M: f32 = 4.0;

/// Updates of a listener for which such a sequence is kept after a change of the scene: four times the number of rotations.
pub(crate) const MAX_AGE: u64 = 4 * ROTATIONS;

/// Entries: those that are kept, and as many that one update may add before it drops others.
const ENTRIES: usize = 2 * DiscoveryHistory::CAPACITY;

/// Slots of the table, a power of two, at most half of them occupied.
const SLOTS: usize = 2 * ENTRIES;

/// Sequences between the one that is looked up and the one that is prefetched.
const AHEAD: usize = 8;

#[derive(Debug, Clone, Copy, Default)]
struct Entry {
    sequence: Sequence,
    /// The low half of its hash: no table has more slots.
    hash: u32,
}

impl Entry {
    /// Slot of the table at which a search for it begins.
    #[inline(always)]
    fn home(&self) -> usize {
        self.hash as usize % SLOTS
    }
}

/// What the rays of a rotation depend on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct GuideCast {
    pub(crate) origin: Vec3,
    pub(crate) scene_state: u64,
    pub(crate) rays: u32,
    pub(crate) depth: usize,
}

/// When and where rays are cast.
#[derive(Debug, Clone, Copy, Default)]
pub struct Visit {
    /// The update's number.
    pub update: u64,
    /// Position of the listener in local coordinates.
    pub listener: Vec3,
}

/// Sequences with the rotations whose rays hit them. Fixed memory.
#[derive(Debug)]
pub struct DiscoveryHistory {
    /// An entry keeps its number while it is in use.
    entries: Vec<Entry>,
    /// One bit for each rotation whose last rays hit the entry. Separate, since every update reads all of them.
    rotations: Vec<u16>,
    /// Of each entry the last update in which rays hit it or a rotation lost it, and the listener then.
    last_met: Vec<u64>,
    met_at: Vec<Vec3>,
    /// Of each entry the update that put it into the order.
    listed_in: Vec<u64>,
    /// The last rays of each rotation.
    casts: [Option<GuideCast>; ROTATIONS as usize],
    /// Numbers of unused entries.
    unused: Vec<u32>,
    /// Numbers of entries, the most recent first.
    order: Vec<u32>,
    /// Those that this update has hit, then the next order.
    next: Vec<u32>,
    /// Entry numbers plus one by hash, with linear probing; 0 is free.
    table: Vec<u32>,
}

impl Default for DiscoveryHistory {
    fn default() -> Self {
        Self {
            entries: vec![Entry::default(); ENTRIES],
            rotations: vec![0; ENTRIES],
            last_met: vec![0; ENTRIES],
            met_at: vec![Vec3::ZERO; ENTRIES],
            listed_in: vec![u64::MAX; ENTRIES],
            casts: [None; ROTATIONS as usize],
            unused: (0..ENTRIES as u32).rev().collect(),
            order: Vec::with_capacity(ENTRIES),
            next: Vec::with_capacity(ENTRIES),
            table: vec![0; SLOTS],
        }
    }
}

impl DiscoveryHistory {
    /// Most sequences that are kept, and that an update tries. In a concert hall sixteen rotations hit about 5,000.
    pub const CAPACITY: usize = 4096;

    /// Whether no rotation has been cast.
    pub(crate) fn is_empty(&self) -> bool {
        self.casts.iter().all(Option::is_none)
    }

    /// Whether the rays of a rotation have to be cast. Of those that a change of the scene has overtaken only the one in turn is.
    pub(crate) fn is_due(&self, rotation: usize, cast: &GuideCast, is_in_turn: bool) -> bool {
        let Some(last) = self.casts[rotation] else {
            return true;
        };
        last.origin != cast.origin
            || last.rays < cast.rays
            || last.depth < cast.depth
            || is_in_turn && last.scene_state != cast.scene_state
    }

    /// Replaces what the rays of a rotation have hit.
    pub(crate) fn begin_rotation(&mut self, visit: Visit, rotation: usize, cast: GuideCast) {
        self.casts[rotation] = Some(cast);
        let bit = 1 << rotation;
        for (entry, rotations) in self.rotations.iter_mut().enumerate() {
            if *rotations & bit != 0 {
                *rotations &= !bit;
                self.last_met[entry] = visit.update;
                self.met_at[entry] = visit.listener;
            }
        }
    }

    /// Adds sequences that rays have hit in this update: of a rotation, or of `None` if its rays are not all cast or those of
    /// another listener.
    pub fn add(&mut self, visit: Visit, rotation: Option<usize>, met: &[Sequence]) {
        let bit = rotation.map_or(0, |rotation| 1 << rotation);
        for (index, sequence) in met.iter().enumerate() {
            self.prefetch(met, index);
            let Some(entry) = self.put(sequence) else {
                break;
            };
            let index = entry as usize;
            self.last_met[index] = visit.update;
            self.met_at[index] = visit.listener;
            self.rotations[index] |= bit;
            if std::mem::replace(&mut self.listed_in[index], visit.update) != visit.update {
                self.next.push(entry);
            }
        }
    }

    /// Adds the sequences that were added in this update to `guide`, and others up to `limit`, the most recent first; each has
    /// up to `depth` surfaces. A sequence that no rotation hits any more is kept for `max_age` updates.
    pub fn merge(
        &mut self,
        scene: &Scene,
        visit: Visit,
        (changed_in, max_age): (u64, u64),
        (limit, depth): (usize, usize),
        guide: &mut SequenceSet,
    ) {
        let update = visit.update;
        let mut order = std::mem::take(&mut self.order);
        order.retain(|entry| self.listed_in[*entry as usize] != update);
        self.next
            .iter()
            .for_each(|entry| self.store(scene, *entry, depth, guide));
        for entry in &order {
            if guide.entries().len() >= limit {
                break;
            }
            self.store(scene, *entry, depth, guide);
        }
        let is_hit = |history: &Self, entry: u32| history.rotations[entry as usize] != 0;
        let hit = order.iter().filter(|entry| is_hit(self, **entry)).count();
        let mut left = Self::CAPACITY.saturating_sub(self.next.len() + hit);
        for entry in order.drain(..) {
            let is_hit = is_hit(self, entry);
            let is_possible = || {
                let last_met = self.last_met[entry as usize];
                let is_near = self.met_at[entry as usize].distance(visit.listener) <= KEPT_M;
                is_near && (last_met >= changed_in || update - last_met < max_age)
            };
            if self.next.len() < Self::CAPACITY && (is_hit || left > 0 && is_possible()) {
                left -= usize::from(!is_hit);
                self.next.push(entry);
            } else {
                self.remove(entry);
            }
        }
        while self.next.len() > Self::CAPACITY {
            let last = self.next.pop();
            last.into_iter().for_each(|entry| self.remove(entry));
        }
        self.order = std::mem::replace(&mut self.next, order);
    }

    /// Adds an entry of up to `depth` surfaces to a set.
    #[inline(always)]
    fn store(&self, scene: &Scene, entry: u32, depth: usize, set: &mut SequenceSet) {
        let Entry { sequence, hash } = &self.entries[entry as usize];
        if sequence.len() > depth {
            return;
        }
        match scene.has_instances() {
            true => set.insert(sequence.renewed(scene)),
            false => set.insert_hashed(*sequence, u64::from(*hash)),
        };
    }

    /// Prefetches slot and entry of sequences further on in the list.
    #[inline(always)]
    fn prefetch(&self, met: &[Sequence], index: usize) {
        if let Some(sequence) = met.get(index + 2 * AHEAD) {
            prefetch(&self.table[sequence.hash() as usize % SLOTS]);
        }
        if let Some(sequence) = met.get(index + AHEAD) {
            let entry = self.table[sequence.hash() as usize % SLOTS].wrapping_sub(1) as usize;
            let found = self.entries.get(entry).zip(self.last_met.get(entry));
            if let Some((entry, last_met)) = found {
                prefetch(entry);
                prefetch(last_met);
            }
        }
    }

    /// The entry of a sequence, a new one if it has none; `None` if no entry is unused.
    fn put(&mut self, sequence: &Sequence) -> Option<u32> {
        let hash = sequence.hash() as u32;
        let mut slot = hash as usize % SLOTS;
        while let Some(entry) = self.table[slot].checked_sub(1) {
            if self.entries[entry as usize].sequence == *sequence {
                return Some(entry);
            }
            slot = (slot + 1) % SLOTS;
        }
        let entry = self.unused.pop()?;
        self.table[slot] = entry + 1;
        self.entries[entry as usize] = Entry {
            sequence: *sequence,
            hash,
        };
        self.rotations[entry as usize] = 0;
        self.listed_in[entry as usize] = u64::MAX;
        Some(entry)
    }

    /// Frees an entry and closes the gap in the table, without which a search would end early.
    fn remove(&mut self, entry: u32) {
        let mut gap = self.entries[entry as usize].home();
        while self.table[gap] != entry + 1 {
            gap = (gap + 1) % SLOTS;
        }
        let mut slot = gap;
        loop {
            slot = (slot + 1) % SLOTS;
            let Some(other) = self.table[slot].checked_sub(1) else {
                break;
            };
            let home = self.entries[other as usize].home();
            let from_home = slot.wrapping_sub(home) % SLOTS;
            if from_home >= slot.wrapping_sub(gap) % SLOTS {
                self.table[gap] = other + 1;
                gap = slot;
            }
        }
        self.table[gap] = 0;
        self.rotations[entry as usize] = 0;
        self.unused.push(entry);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use glam::Vec3;

    use super::*;
    use crate::propagation::path::MAX_ORDER;
    use crate::propagation::rays::directions::mix;
    use crate::scene::{MaterialTable, SceneSettings, procedural};

    fn room() -> Scene {
        let mesh = procedural::shoebox(Vec3::new(4.0, 2.5, 3.0), "concrete");
        Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
            .expect("commits")
    }

    /// A sequence in the given order; its surfaces may be fictitious.
    fn sequence(surfaces: &[u32]) -> Sequence {
        let mut sequence = Sequence::EMPTY;
        surfaces.iter().for_each(|surface| sequence.push(*surface));
        sequence
    }

    /// Compares with a list, beyond age and capacity: rotations are cast again and again, some rays stand for none.
    #[test]
    fn sequences_stay_while_a_rotation_hits_them() {
        let scene = room();
        let mut history = DiscoveryHistory::default();
        // Sequences in their order with their rotations and the last update that hit them or lost one.
        let mut plain: Vec<(Sequence, u16, Visit)> = Vec::new();
        let mut seed = 5;
        for update in 0..200 {
            let many = match update < 80 {
                // An update adds as many as are kept, at most.
                true => [3, 400, 900, 4000][(update % 4) as usize],
                false => 5,
            };
            let rotation = match update % 5 {
                0 => None,
                _ => Some((mix(update) % 3) as usize),
            };
            let mut met: Vec<Sequence> = Vec::new();
            let mut is_met = HashSet::new();
            for _ in 0..many {
                seed = mix(seed);
                let surfaces = [(seed >> 8) as u32 % 20_000, (seed >> 40) as u32 % 3];
                let sequence = sequence(&surfaces[..1 + (seed & 1) as usize]);
                if is_met.insert(sequence) {
                    met.push(sequence);
                }
            }
            let bit = rotation.map_or(0, |rotation| 1 << rotation);
            // Half a metre an update, to and fro; the scene changes in some updates of the second half.
            let listener = Vec3::X * 0.5 * 40u64.abs_diff(update % 80) as f32;
            let visit = Visit { update, listener };
            let changed_in = update / 100 * (update / 7 * 7);
            for (_, rotations, last) in plain.iter_mut().filter(|(_, r, _)| r & bit != 0) {
                *rotations &= !bit;
                *last = visit;
            }
            let before = |s: &Sequence| plain.iter().find(|(old, ..)| old == s);
            let new = met.iter().map(|s| {
                let rotations = before(s).map_or(0, |(_, rotations, _)| *rotations);
                (*s, rotations | bit, visit)
            });
            let new: Vec<_> = new.collect();
            let old: Vec<_> = plain
                .iter()
                .filter(|(s, ..)| !is_met.contains(s))
                .copied()
                .collect();
            let limit = [DiscoveryHistory::CAPACITY, 1000][(update % 2) as usize];
            let room = limit.saturating_sub(new.len());
            let expected = new.iter().chain(old.iter().take(room));
            let expected: Vec<Sequence> = expected.map(|(s, ..)| *s).collect();

            let hit = old
                .iter()
                .filter(|(_, rotations, _)| *rotations != 0)
                .count();
            let mut left = DiscoveryHistory::CAPACITY.saturating_sub(new.len() + hit);
            plain = new;
            for entry in old {
                let last = entry.2;
                let is_young = last.update >= changed_in || update - last.update < MAX_AGE;
                let is_near = last.listener.distance(listener) <= KEPT_M;
                if entry.1 != 0 || is_young && is_near && left > 0 {
                    left -= usize::from(entry.1 == 0);
                    plain.push(entry);
                }
            }
            plain.truncate(DiscoveryHistory::CAPACITY);

            if let Some(rotation) = rotation {
                history.begin_rotation(visit, rotation, GuideCast::default());
            }
            history.add(visit, rotation, &met);
            let mut guide = SequenceSet::with_capacity(3 * DiscoveryHistory::CAPACITY);
            let limits = (limit, MAX_ORDER);
            history.merge(&scene, visit, (changed_in, MAX_AGE), limits, &mut guide);
            assert!(guide.entries() == expected, "update {update}");
        }
        assert!(plain.len() < 800, "old entries are dropped");
    }

    #[test]
    fn rays_are_due_in_another_cell_and_in_turn_after_a_change_of_the_scene() {
        let mut history = DiscoveryHistory::default();
        let cast = GuideCast {
            origin: Vec3::ONE,
            scene_state: 3,
            rays: 64,
            depth: 4,
        };
        assert!(history.is_due(2, &cast, false), "never cast");
        history.begin_rotation(Visit::default(), 2, cast);
        assert!(!history.is_due(2, &cast, true) && history.is_due(1, &cast, true));
        let origin = Vec3::ZERO;
        assert!(history.is_due(2, &GuideCast { origin, ..cast }, false));
        let changed = GuideCast {
            scene_state: 4,
            ..cast
        };
        assert!(history.is_due(2, &changed, true) && !history.is_due(2, &changed, false));
        let more = GuideCast { rays: 65, ..cast };
        let fewer = GuideCast { rays: 6, ..cast };
        assert!(history.is_due(2, &more, false) && !history.is_due(2, &fewer, true));
    }
}
