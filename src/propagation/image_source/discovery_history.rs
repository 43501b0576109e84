//! What guide rays have met in the last updates: sixteen rotations see more than one.
//!
//! A path through a small window is met by one ray in some rotations only. Since a sequence that was met stays one as long
//! as the listener is near, what the last updates have met is tried again where there is room for it: what is found
//! depends less on which rotation the turn has come to, so that few updates find nearly what many do. Own.

use crate::propagation::image_source::expansion::CANDIDATES;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;
use crate::simd::prefetch;

/// Updates for which a sequence is tried again that rays have met: as many as there are rotations at least.
const AGE_UPDATES: u64 = 4 * ROTATIONS;

/// Shelves: as many as are remembered, and as many that an update may add before others are cleared.
const SHELVES: usize = 2 * GuideMemory::MOST;

/// Slots of the table, a power of two: at most half of them are taken.
const SLOTS: usize = 2 * SHELVES;

/// Sequences between one that is looked up and one that is asked for.
const AHEAD: usize = 8;

/// A remembered sequence.
#[derive(Debug, Clone, Copy, Default)]
struct Shelf {
    sequence: Sequence,
    /// The slot of the table where a search for it begins.
    home: u32,
}

/// Sequences that guide rays have met, with the update in which they last did. Fixed memory.
#[derive(Debug)]
pub struct GuideMemory {
    /// Each stays on its shelf while it is remembered, so that an update moves numbers only.
    shelves: Vec<Shelf>,
    /// The update in which rays last met what is on each. Apart from them, since all are asked in every update.
    seen: Vec<u64>,
    /// Shelves that are empty.
    empty: Vec<u32>,
    /// Shelves in the order in which they are tried: what was met in the newest update first.
    order: Vec<u32>,
    /// The next order, while it is made.
    next: Vec<u32>,
    /// Shelves plus one by their sequences' hashes; 0 is none.
    table: Vec<u32>,
}

impl Default for GuideMemory {
    fn default() -> Self {
        Self {
            shelves: vec![Shelf::default(); SHELVES],
            seen: vec![0; SHELVES],
            empty: (0..SHELVES as u32).rev().collect(),
            order: Vec::with_capacity(Self::MOST),
            next: Vec::with_capacity(Self::MOST),
            table: vec![0; SLOTS],
        }
    }
}

impl GuideMemory {
    /// Sequences that an update tries at most where it is asked for more than its own poses need
    /// ([`crate::propagation::Propagator::set_nearby_radius`]); others try [`CANDIDATES`].
    pub const MOST: usize = 4096;

    /// Adds what is remembered to `guide`, which holds what rays have met now, and remembers that.
    pub fn turn(&mut self, scene: &Scene, update: u64, is_wide: bool, guide: &mut SequenceSet) {
        let met = guide.entries();
        let met = &met[..met.len().min(Self::MOST)];
        for (place, sequence) in met.iter().enumerate() {
            self.prefetch(met, place);
            let shelf = self.put(sequence, update);
            self.next.push(shelf);
        }
        let moves = scene.has_instances();
        let most = match is_wide {
            true => Self::MOST,
            false => CANDIDATES,
        };
        for &shelf in &self.order {
            if guide.entries().len() >= most {
                break;
            }
            // What was met now is there already.
            if self.seen[shelf as usize] != update {
                let sequence = &self.shelves[shelf as usize].sequence;
                guide.insert(match moves {
                    // What commutes depends on how instances stand.
                    true => Sequence::canonical(scene, sequence.surfaces()),
                    false => *sequence,
                });
            }
        }
        let mut order = std::mem::take(&mut self.order);
        for shelf in order.drain(..) {
            let seen = self.seen[shelf as usize];
            if seen == update {
                continue;
            }
            if update - seen < AGE_UPDATES && self.next.len() < Self::MOST {
                self.next.push(shelf);
            } else {
                self.clear(shelf);
            }
        }
        self.order = std::mem::replace(&mut self.next, order);
    }

    /// Asks for what sequences further on in the list will be looked up in: shelves lie in no order that they come in.
    #[inline(always)]
    fn prefetch(&self, met: &[Sequence], place: usize) {
        if let Some(sequence) = met.get(place + 2 * AHEAD) {
            prefetch(&self.table[sequence.hash() as usize % SLOTS]);
        }
        if let Some(sequence) = met.get(place + AHEAD) {
            let shelf = self.table[sequence.hash() as usize % SLOTS].wrapping_sub(1) as usize;
            if let (Some(shelf), Some(seen)) = (self.shelves.get(shelf), self.seen.get(shelf)) {
                prefetch(shelf);
                prefetch(seen);
            }
        }
    }

    /// The shelf of a sequence that was met now.
    fn put(&mut self, sequence: &Sequence, update: u64) -> u32 {
        let home = sequence.hash() as usize % SLOTS;
        let mut slot = home;
        while let Some(shelf) = self.table[slot].checked_sub(1) {
            if self.shelves[shelf as usize].sequence == *sequence {
                self.seen[shelf as usize] = update;
                return shelf;
            }
            slot = (slot + 1) % SLOTS;
        }
        // At most as many are remembered, and as many added, as half of the shelves.
        let shelf = self.empty.pop().unwrap_or_default();
        self.table[slot] = shelf + 1;
        self.shelves[shelf as usize] = Shelf {
            sequence: *sequence,
            home: home as u32,
        };
        self.seen[shelf as usize] = update;
        shelf
    }

    /// Forgets what is on a shelf, and moves what a search would not find beyond the gap.
    fn clear(&mut self, shelf: u32) {
        let mut gap = self.shelves[shelf as usize].home as usize;
        while self.table[gap] != shelf + 1 {
            gap = (gap + 1) % SLOTS;
        }
        let mut slot = gap;
        loop {
            slot = (slot + 1) % SLOTS;
            let Some(other) = self.table[slot].checked_sub(1) else {
                break;
            };
            let home = self.shelves[other as usize].home as usize;
            let from_home = slot.wrapping_sub(home) % SLOTS;
            if from_home >= slot.wrapping_sub(gap) % SLOTS {
                self.table[gap] = other + 1;
                gap = slot;
            }
        }
        self.table[gap] = 0;
        self.empty.push(shelf);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use glam::Vec3;

    use super::*;
    use crate::propagation::rays::directions::mix;
    use crate::scene::{MaterialTable, SceneSettings, procedural};

    fn room() -> Scene {
        let mesh = procedural::shoebox(Vec3::new(4.0, 2.5, 3.0), "concrete");
        Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
            .expect("commits")
    }

    /// Surfaces in the order in which they come, for none commute.
    fn sequence(surfaces: &[u32]) -> Sequence {
        let mut sequence = Sequence::NONE;
        surfaces.iter().for_each(|surface| sequence.push(*surface));
        sequence
    }

    /// A plain list remembers the same in the same order, past age and capacity.
    #[test]
    fn the_newest_come_first_and_the_oldest_go() {
        let scene = room();
        let mut memory = GuideMemory::default();
        let mut plain: Vec<(Sequence, u64)> = Vec::new();
        let mut seed = 5;
        for update in 0..150 {
            let mut guide = SequenceSet::with_capacity(3 * GuideMemory::MOST);
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
            let is_wide = update % 3 == 0;
            let most = match is_wide {
                true => GuideMemory::MOST,
                false => CANDIDATES,
            };
            let old = plain.iter().filter(|(s, _)| !is_met.contains(s));
            let room = most.saturating_sub(met.len());
            let added = old.clone().take(room).map(|(s, _)| *s);
            let expected: Vec<Sequence> = met.iter().copied().chain(added).collect();
            let young = old.filter(|(_, seen)| update - seen < AGE_UPDATES);
            let new = met.iter().map(|s| (*s, update));
            plain = new.chain(young.copied()).take(GuideMemory::MOST).collect();
            memory.turn(&scene, update, is_wide, &mut guide);
            assert!(guide.entries() == expected, "update {update}");
        }
        assert!(plain.len() < 800, "what is old has gone");
    }
}
