//! Sequences that were valid in recent updates: a path persists without a ray that finds it again.

use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;

/// Sequences, each with the update in which it was last valid. Two sets alternate, whose memory grows with what is valid; a full
/// set drops later ones.
#[derive(Debug)]
pub(crate) struct ValidCache {
    current: SequenceSet,
    last_valid: Vec<u64>,
    next: SequenceSet,
    next_last_valid: Vec<u64>,
}

impl ValidCache {
    /// Room for `capacity` sequences.
    pub(crate) fn with_capacity(capacity: usize) -> Self {
        Self {
            current: SequenceSet::growing(capacity),
            last_valid: Vec::new(),
            next: SequenceSet::growing(capacity),
            next_last_valid: Vec::new(),
        }
    }

    /// Removes all sequences.
    pub(crate) fn clear(&mut self) {
        self.current.clear();
        self.last_valid.clear();
        self.next.clear();
        self.next_last_valid.clear();
    }

    /// The sequences of earlier updates.
    pub(crate) fn entries(&self) -> &[Sequence] {
        self.current.entries()
    }

    /// Stores a sequence that is valid in this update.
    pub(crate) fn insert(&mut self, sequence: Sequence, update: u64) {
        if self.next.insert(sequence) {
            self.next_last_valid.push(update);
        }
    }

    /// Ends an update: sequences that were not valid in it are dropped at an age of `max_age` updates.
    pub(crate) fn end_update(&mut self, update: u64, max_age: u64) {
        for (sequence, &last_valid) in self.current.entries().iter().zip(&self.last_valid) {
            if update - last_valid < max_age && self.next.insert(*sequence) {
                self.next_last_valid.push(last_valid);
            }
        }
        std::mem::swap(&mut self.current, &mut self.next);
        std::mem::swap(&mut self.last_valid, &mut self.next_last_valid);
        self.next.clear();
        self.next_last_valid.clear();
    }
}
