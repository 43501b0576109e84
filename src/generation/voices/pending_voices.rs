//! Paths of a graphics frame that wait for a voice.
//!
//! Audio side; wait-free, bounded by the number of paths; allocates at birth only. A voice's start writes
//! memory that is not cached: a thousand starts cost a block of time, and are spread over several.

/// A path that waits for a voice.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PendingVoice {
    /// Greater for louder paths; [`CONTINUES`] for a path whose own voice has just been faded.
    pub(crate) rank: u64,
    /// Its index in the frame's plan.
    pub(crate) index: u32,
    /// Its position among the active voices.
    pub(crate) position: u32,
}

/// Rank of a path whose delay has jumped: it was audible before.
pub(crate) const CONTINUES: u64 = u64::MAX;

/// The pending voices.
#[derive(Debug)]
pub(crate) struct PendingVoices {
    /// In reverse order of their start.
    waiting: Vec<PendingVoice>,
}

impl PendingVoices {
    /// Control side; allocates.
    pub(crate) fn new(most: usize) -> Self {
        Self {
            waiting: Vec::with_capacity(most),
        }
    }

    /// Removes all.
    pub(crate) fn clear(&mut self) {
        self.waiting.clear();
    }

    /// Adds one, in the order of the frame's plan.
    pub(crate) fn push(&mut self, start: PendingVoice) {
        self.waiting.push(start);
    }

    /// Their number.
    pub(crate) fn len(&self) -> usize {
        self.waiting.len()
    }

    /// Starts them in the order of the plan.
    pub(crate) fn in_order(&mut self) {
        self.waiting.reverse();
    }

    /// Starts the loudest first.
    pub(crate) fn loudest_first(&mut self) {
        let order = |start: &PendingVoice| (start.rank, std::cmp::Reverse(start.index));
        self.waiting.sort_unstable_by_key(order);
    }

    /// Removes the next to start.
    pub(crate) fn pop(&mut self) -> Option<PendingVoice> {
        self.waiting.pop()
    }

    /// The plan index of the one after that.
    pub(crate) fn following(&self) -> Option<u32> {
        self.waiting.last().map(|start| start.index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loudest_begin_first_and_of_equals_the_first() {
        let mut starts = PendingVoices::new(4);
        for (index, rank) in [3, CONTINUES, 7, 3].into_iter().enumerate() {
            let index = index as u32;
            starts.push(PendingVoice {
                rank,
                index,
                position: index,
            });
        }
        let mut sorted = PendingVoices {
            waiting: starts.waiting.clone(),
        };
        sorted.loudest_first();
        starts.in_order();
        let numbers = |mut starts: PendingVoices| -> Vec<u32> {
            std::iter::from_fn(|| starts.pop().map(|start| start.index)).collect()
        };
        assert_eq!(starts.following(), Some(0));
        assert_eq!(numbers(starts), [0, 1, 2, 3]);
        assert_eq!(numbers(sorted), [1, 2, 0, 3]);
    }
}
