//! Sets of sequences in fixed memory.

use crate::propagation::image_source::sequence::Sequence;

/// Slots of the table that are in use at least, a power of two.
const FEWEST_SLOTS: usize = 256;

/// A set of sequences that remembers the order of insertion. Its memory is fixed at creation: a full set refuses and
/// counts.
#[derive(Debug, Clone)]
pub struct SequenceSet {
    entries: Vec<Sequence>,
    table: Vec<u32>,
    /// Slots of the table in use, a power of two: no more of it than what is in the set needs, so that little of it comes
    /// from far memory.
    in_use: usize,
    /// Those that are taken, so that emptying costs as much as there is.
    slots: Vec<u32>,
    capacity: usize,
    refused: u64,
}

impl SequenceSet {
    /// Room for `capacity` sequences.
    pub fn with_capacity(capacity: usize) -> Self {
        let slots = (2 * capacity.max(1)).next_power_of_two();
        Self {
            entries: Vec::with_capacity(capacity),
            table: vec![0; slots],
            in_use: slots.min(FEWEST_SLOTS),
            slots: Vec::with_capacity(capacity),
            capacity,
            refused: 0,
        }
    }

    /// Empties the set; the memory stays.
    pub fn clear(&mut self) {
        for slot in self.slots.drain(..) {
            self.table[slot as usize] = 0;
        }
        // As many will come next most likely.
        let wanted = (4 * self.entries.len()).next_power_of_two();
        self.in_use = wanted.max(FEWEST_SLOTS).min(self.table.len());
        self.entries.clear();
    }

    /// The sequences in the order of insertion.
    pub fn entries(&self) -> &[Sequence] {
        &self.entries
    }

    /// How many sequences there is room for.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// How many insertions a full set has refused since it was made.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Whether the set has a sequence.
    pub fn contains(&self, sequence: &Sequence) -> bool {
        self.find(sequence, sequence.hash()).is_ok()
    }

    /// The same of a sequence whose hash is known.
    #[inline]
    pub(crate) fn contains_hashed(&self, sequence: &Sequence, hash: u64) -> bool {
        self.find(sequence, hash).is_ok()
    }

    /// The place of a sequence in [`Self::entries`].
    pub fn place(&self, sequence: &Sequence) -> Option<usize> {
        self.find(sequence, sequence.hash()).ok()
    }

    /// Adds a sequence; gives whether it is new.
    #[inline]
    pub fn insert(&mut self, sequence: Sequence) -> bool {
        self.insert_hashed(sequence, sequence.hash())
    }

    /// The same of a sequence whose hash is known.
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
                self.slots.push(slot as u32);
                if 2 * self.entries.len() > self.in_use {
                    self.widen();
                }
                true
            }
        }
    }

    /// Takes more of the table into use.
    #[cold]
    fn widen(&mut self) {
        for slot in self.slots.drain(..) {
            self.table[slot as usize] = 0;
        }
        self.in_use = (2 * self.in_use).min(self.table.len());
        let mask = self.in_use - 1;
        for (number, sequence) in self.entries.iter().enumerate() {
            let mut slot = sequence.hash() as usize & mask;
            while self.table[slot] != 0 {
                slot = (slot + 1) & mask;
            }
            self.table[slot] = number as u32 + 1;
            self.slots.push(slot as u32);
        }
    }

    /// The entry's index, or the free slot where it would go. What is in use is about half full at most, so the probe ends.
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
        let mut sequence = Sequence::NONE;
        let bits = mix(number);
        for step in 0..1 + bits % 3 {
            sequence.push((bits >> (16 * step + 8)) as u32 % 50);
        }
        sequence
    }

    /// Few first, then more than the table in use begins with, then few again: a list says the same.
    #[test]
    fn a_table_that_widens_finds_what_a_list_does() {
        let mut set = SequenceSet::with_capacity(3000);
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
            for (place, sequence) in list.iter().enumerate() {
                assert_eq!(set.place(sequence), Some(place), "round {round}");
            }
            assert!(!set.contains(&Sequence::NONE), "round {round}");
        }
    }

    #[test]
    fn a_full_set_refuses_and_counts() {
        let mut set = SequenceSet::with_capacity(2);
        let numbers = [7, 8, 7, 9, 10].map(sequence);
        let taken = numbers.map(|sequence| set.insert(sequence));
        assert_eq!(taken, [true, true, false, false, false]);
        assert_eq!((set.entries(), set.refused()), (&numbers[..2], 2));
    }
}
