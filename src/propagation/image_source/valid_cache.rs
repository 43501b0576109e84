//! Sequences that were valid not long ago, so that a path stays while no ray happens upon it again.

use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::sequence_set::SequenceSet;

/// Sequences with the update in which they last were valid. Two sets that take turns, in fixed memory.
#[derive(Debug)]
pub(crate) struct SequenceCache {
    now: SequenceSet,
    seen: Vec<u64>,
    next: SequenceSet,
    next_seen: Vec<u64>,
}

impl SequenceCache {
    /// Room for `capacity` sequences; later ones are not remembered.
    pub(crate) fn with_capacity(capacity: usize) -> Self {
        Self {
            now: SequenceSet::with_capacity(capacity),
            seen: Vec::with_capacity(capacity),
            next: SequenceSet::with_capacity(capacity),
            next_seen: Vec::with_capacity(capacity),
        }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.now.clear();
        self.seen.clear();
        self.next.clear();
        self.next_seen.clear();
    }

    /// What was remembered when the update began.
    pub(crate) fn entries(&self) -> &[Sequence] {
        self.now.entries()
    }

    /// Notes that a sequence is valid in this update.
    pub(crate) fn renew(&mut self, sequence: Sequence, update: u64) {
        if self.next.insert(sequence) {
            self.next_seen.push(update);
        }
    }

    /// Ends an update: what was not renewed stays until it is `most` updates old.
    pub(crate) fn turn(&mut self, update: u64, most: u64) {
        for (sequence, &seen) in self.now.entries().iter().zip(&self.seen) {
            if update - seen < most && self.next.insert(*sequence) {
                self.next_seen.push(seen);
            }
        }
        std::mem::swap(&mut self.now, &mut self.next);
        std::mem::swap(&mut self.seen, &mut self.next_seen);
        self.next.clear();
        self.next_seen.clear();
    }
}
