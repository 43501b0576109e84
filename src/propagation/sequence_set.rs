//! Sets of sequences in fixed memory.

use super::sequence::Sequence;

/// A set of sequences that remembers the order of insertion. Its memory is fixed at creation: a full set refuses and
/// counts.
#[derive(Debug, Clone)]
pub struct SequenceSet {
    entries: Vec<Sequence>,
    table: Vec<u32>,
    /// The slots of the table in use, so that emptying a large set of few costs little.
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
            slots: Vec::with_capacity(capacity),
            capacity,
            refused: 0,
        }
    }

    /// Empties the set; the memory stays.
    pub fn clear(&mut self) {
        self.entries.clear();
        for slot in self.slots.drain(..) {
            self.table[slot as usize] = 0;
        }
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
        self.find(sequence).is_ok()
    }

    /// The place of a sequence in [`Self::entries`].
    pub fn place(&self, sequence: &Sequence) -> Option<usize> {
        self.find(sequence).ok()
    }

    /// Adds a sequence; gives whether it is new.
    pub fn insert(&mut self, sequence: Sequence) -> bool {
        match self.find(&sequence) {
            Ok(_) => false,
            Err(_) if self.entries.len() == self.capacity => {
                self.refused += 1;
                false
            }
            Err(slot) => {
                self.entries.push(sequence);
                self.table[slot] = self.entries.len() as u32;
                self.slots.push(slot as u32);
                true
            }
        }
    }

    /// The entry's index, or the free slot where it would go. The table is at most half full, so the probe ends.
    fn find(&self, sequence: &Sequence) -> Result<usize, usize> {
        let mask = self.table.len() - 1;
        let mut slot = sequence.hash() as usize & mask;
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
