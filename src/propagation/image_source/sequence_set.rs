//! Sets of sequences in bounded memory.

use crate::propagation::image_source::sequence::Sequence;

/// Least number of table slots in use, a power of two.
const MIN_SLOTS: usize = 256;

/// A set of sequences in the order of insertion. A full set refuses and counts.
#[derive(Debug, Clone)]
pub struct SequenceSet {
    entries: Vec<Sequence>,
    /// Entry numbers plus one by hash, with linear probing; 0 is free.
    table: Vec<u32>,
    /// Slots of the table in use, a power of two. A small set touches little memory.
    in_use: usize,
    /// Most slots of the table.
    slots: usize,
    /// The occupied slots: the cost of clearing follows the number of entries.
    occupied: Vec<u32>,
    capacity: usize,
    refused: u64,
}

impl SequenceSet {
    /// An empty set with memory for `capacity` sequences.
    pub fn with_capacity(capacity: usize) -> Self {
        let mut set = Self::growing(capacity);
        set.entries.reserve(capacity);
        set.occupied.reserve(capacity);
        set.table.resize(set.slots, 0);
        set
    }

    /// An empty set of up to `capacity` sequences, whose memory doubles when it is needed.
    pub(crate) fn growing(capacity: usize) -> Self {
        let slots = (2 * capacity.max(1)).next_power_of_two();
        let in_use = slots.min(MIN_SLOTS);
        Self {
            entries: Vec::with_capacity(in_use / 2),
            table: vec![0; in_use],
            in_use,
            slots,
            occupied: Vec::with_capacity(in_use / 2),
            capacity,
            refused: 0,
        }
    }

    /// Removes all entries; the memory stays.
    pub fn clear(&mut self) {
        self.free_slots();
        // The next content is most likely as large.
        let wanted = (4 * self.entries.len()).next_power_of_two();
        self.in_use = wanted.max(MIN_SLOTS).min(self.table.len());
        self.entries.clear();
    }

    fn free_slots(&mut self) {
        for slot in self.occupied.drain(..) {
            self.table[slot as usize] = 0;
        }
    }

    /// The sequences in the order of insertion.
    pub fn entries(&self) -> &[Sequence] {
        &self.entries
    }

    /// Most sequences that the set holds.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// Insertions that a full set has refused since its creation.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Whether the set has a sequence.
    pub fn contains(&self, sequence: &Sequence) -> bool {
        self.contains_hashed(sequence, sequence.hash())
    }

    /// [`Self::contains`] for a sequence with a known hash.
    #[inline]
    pub(crate) fn contains_hashed(&self, sequence: &Sequence, hash: u64) -> bool {
        self.find(sequence, hash).is_ok()
    }

    /// Adds a sequence. Returns whether it is new and there was room.
    #[inline]
    pub fn insert(&mut self, sequence: Sequence) -> bool {
        self.insert_hashed(sequence, sequence.hash())
    }

    /// [`Self::insert`] for a sequence with a known hash, of which the low half counts.
    pub(crate) fn insert_hashed(&mut self, sequence: Sequence, hash: u64) -> bool {
        match self.find(&sequence, hash) {
            Ok(_) => false,
            Err(_) if self.entries.len() == self.capacity => {
                self.refused += 1;
                false
            }
            Err(slot) => {
                self.entries.push(sequence);
                self.table[slot] = self.entries.len() as u32;
                self.occupied.push(slot as u32);
                if 2 * self.entries.len() > self.in_use {
                    self.widen();
                }
                true
            }
        }
    }

    /// Doubles the part of the table in use, up to all of it.
    #[cold]
    fn widen(&mut self) {
        self.free_slots();
        self.in_use = (2 * self.in_use).min(self.slots);
        if self.table.len() < self.in_use {
            self.table.resize(self.in_use, 0);
        }
        let mask = self.in_use - 1;
        for (index, sequence) in self.entries.iter().enumerate() {
            let mut slot = sequence.hash() as usize & mask;
            while self.table[slot] != 0 {
                slot = (slot + 1) & mask;
            }
            self.table[slot] = index as u32 + 1;
            self.occupied.push(slot as u32);
        }
    }

    /// The entry's index, or the free slot for it. The part in use is about half full at most, so the probe ends.
    #[inline(always)]
    fn find(&self, sequence: &Sequence, hash: u64) -> Result<usize, usize> {
        let mask = self.in_use - 1;
        let mut slot = hash as usize & mask;
        loop {
            match self.table[slot] {
                0 => return Err(slot),
                found if self.entries[found as usize - 1] == *sequence => {
                    return Ok(found as usize - 1);
                }
                _ => slot = (slot + 1) & mask,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::rays::directions::mix;

    fn sequence(number: u64) -> Sequence {
        let mut sequence = Sequence::EMPTY;
        let bits = mix(number);
        for step in 0..1 + bits % 3 {
            sequence.push((bits >> (16 * step + 8)) as u32 % 50);
        }
        sequence
    }

    /// Few first, then more than the initial part of the table holds, then few again: the set equals a list.
    #[test]
    fn a_growing_table_equals_a_list() {
        grows_as_a_list(SequenceSet::with_capacity(3000));
        grows_as_a_list(SequenceSet::growing(3000));
    }

    fn grows_as_a_list(mut set: SequenceSet) {
        for (round, many) in [40, 6000, 900, 0, 200].into_iter().enumerate() {
            set.clear();
            let mut list: Vec<Sequence> = Vec::new();
            for number in 0..many {
                let next = sequence(10_000 * round as u64 + number);
                let is_new = !list.contains(&next);
                if is_new && list.len() < set.capacity() {
                    list.push(next);
                    assert!(set.insert(next), "{next:?}");
                } else {
                    assert!(!set.insert(next), "{next:?}");
                }
            }
            assert!(set.entries() == list, "round {round}");
            for (index, sequence) in list.iter().enumerate() {
                let found = set.find(sequence, sequence.hash());
                assert_eq!(found, Ok(index), "round {round}");
            }
            assert!(!set.contains(&Sequence::EMPTY), "round {round}");
        }
    }

    #[test]
    fn a_full_set_refuses_and_counts() {
        let mut set = SequenceSet::with_capacity(2);
        let numbers = [7, 8, 7, 9, 10].map(sequence);
        let inserted = numbers.map(|sequence| set.insert(sequence));
        assert_eq!(inserted, [true, true, false, false, false]);
        assert_eq!((set.entries(), set.refused()), (&numbers[..2], 2));
    }
}
