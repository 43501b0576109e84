//! Sequences that guide rays hit in recent updates: sixteen rotations find more than one.
//!
//! Only some rotations have a ray through a small opening. A sequence remains possible while the listener is near: recent
//! ones are tried again while there is capacity. The result then depends less on the present rotation, and few updates find
//! nearly as much as many. Own.

use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;
use crate::simd::prefetch;

/// Updates of a listener for which a sequence is kept after rays hit it: four times the number of rotations.
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
    /// Slot of the table at which a search for it begins.
    home: u32,
}

/// Sequences with the update in which guide rays last hit them. Fixed memory.
#[derive(Debug)]
pub struct DiscoveryHistory {
    /// An entry keeps its number while it is in use.
    entries: Vec<Entry>,
    /// Of each entry the last update that hit it. Separate, since every update reads all of them.
    last_met: Vec<u64>,
    /// Numbers of unused entries.
    unused: Vec<u32>,
    /// Numbers of entries, the most recent first.
    order: Vec<u32>,
    /// The next order while it is made.
    next: Vec<u32>,
    /// Entry numbers plus one by hash, with linear probing; 0 is free.
    table: Vec<u32>,
}

impl Default for DiscoveryHistory {
    fn default() -> Self {
        Self {
            entries: vec![Entry::default(); ENTRIES],
            last_met: vec![0; ENTRIES],
            unused: (0..ENTRIES as u32).rev().collect(),
            order: Vec::with_capacity(Self::CAPACITY),
            next: Vec::with_capacity(Self::CAPACITY),
            table: vec![0; SLOTS],
        }
    }
}

impl DiscoveryHistory {
    /// Most sequences that are kept, and that an update with nearby paths tries
    /// ([`crate::propagation::Propagator::set_nearby_radius`]).
    pub const CAPACITY: usize = 4096;

    /// Stores the sequences of `guide`, which rays hit in this update, and appends those of earlier ones, up to `depth`
    /// surfaces, while it has fewer than `limit`. A sequence is kept for `max_age` updates.
    pub fn merge(
        &mut self,
        scene: &Scene,
        (update, max_age): (u64, u64),
        (limit, depth): (usize, usize),
        guide: &mut SequenceSet,
    ) {
        let met = guide.entries();
        let met = &met[..met.len().min(Self::CAPACITY)];
        for (index, sequence) in met.iter().enumerate() {
            self.prefetch(met, index);
            let entry = self.put(sequence, update);
            self.next.push(entry);
        }
        for &entry in &self.order {
            if guide.entries().len() >= limit {
                break;
            }
            if self.last_met[entry as usize] != update {
                let sequence = &self.entries[entry as usize].sequence;
                if sequence.len() <= depth {
                    guide.insert(sequence.renewed(scene));
                }
            }
        }
        let mut order = std::mem::take(&mut self.order);
        for entry in order.drain(..) {
            let last_met = self.last_met[entry as usize];
            if last_met == update {
                continue;
            }
            if update - last_met < max_age && self.next.len() < Self::CAPACITY {
                self.next.push(entry);
            } else {
                self.remove(entry);
            }
        }
        self.order = std::mem::replace(&mut self.next, order);
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

    /// The entry of a sequence hit in this update.
    fn put(&mut self, sequence: &Sequence, update: u64) -> u32 {
        let home = sequence.hash() as usize % SLOTS;
        let mut slot = home;
        while let Some(entry) = self.table[slot].checked_sub(1) {
            if self.entries[entry as usize].sequence == *sequence {
                self.last_met[entry as usize] = update;
                return entry;
            }
            slot = (slot + 1) % SLOTS;
        }
        // At most half of the entries are kept and half are added: one is unused.
        let entry = self.unused.pop().unwrap_or_default();
        self.table[slot] = entry + 1;
        self.entries[entry as usize] = Entry {
            sequence: *sequence,
            home: home as u32,
        };
        self.last_met[entry as usize] = update;
        entry
    }

    /// Frees an entry and closes the gap in the table, without which a search would end early.
    fn remove(&mut self, entry: u32) {
        let mut gap = self.entries[entry as usize].home as usize;
        while self.table[gap] != entry + 1 {
            gap = (gap + 1) % SLOTS;
        }
        let mut slot = gap;
        loop {
            slot = (slot + 1) % SLOTS;
            let Some(other) = self.table[slot].checked_sub(1) else {
                break;
            };
            let home = self.entries[other as usize].home as usize;
            let from_home = slot.wrapping_sub(home) % SLOTS;
            if from_home >= slot.wrapping_sub(gap) % SLOTS {
                self.table[gap] = other + 1;
                gap = slot;
            }
        }
        self.table[gap] = 0;
        self.unused.push(entry);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use glam::Vec3;

    use super::*;
    use crate::propagation::image_source::expansion::MAX_CANDIDATES;
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

    /// Compares with a list, beyond age and capacity.
    #[test]
    fn recent_sequences_come_first_and_the_oldest_are_dropped() {
        let scene = room();
        let mut history = DiscoveryHistory::default();
        let mut plain: Vec<(Sequence, u64)> = Vec::new();
        let mut seed = 5;
        for update in 0..150 {
            let mut guide = SequenceSet::with_capacity(3 * DiscoveryHistory::CAPACITY);
            let many = match update < 80 {
                true => [3, 400, 900, 5000][(update % 4) as usize],
                false => 5,
            };
            for _ in 0..many {
                seed = mix(seed);
                let surfaces = [(seed >> 8) as u32 % 20_000, (seed >> 40) as u32 % 3];
                guide.insert(sequence(&surfaces[..1 + (seed & 1) as usize]));
            }
            let met: Vec<Sequence> = guide.entries().to_vec();
            let is_met: HashSet<Sequence> = met.iter().copied().collect();
            let nearby = update % 3 == 0;
            let most = match nearby {
                true => DiscoveryHistory::CAPACITY,
                false => MAX_CANDIDATES,
            };
            let old = plain.iter().filter(|(s, _)| !is_met.contains(s));
            let room = most.saturating_sub(met.len());
            let added = old.clone().take(room).map(|(s, _)| *s);
            let expected: Vec<Sequence> = met.iter().copied().chain(added).collect();
            let young = old.filter(|(_, seen)| update - seen < MAX_AGE);
            let new = met.iter().map(|s| (*s, update));
            plain = new
                .chain(young.copied())
                .take(DiscoveryHistory::CAPACITY)
                .collect();
            history.merge(&scene, (update, MAX_AGE), (most, MAX_ORDER), &mut guide);
            assert!(guide.entries() == expected, "update {update}");
        }
        assert!(plain.len() < 800, "old entries are dropped");
    }
}
