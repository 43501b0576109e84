//! Queue of the paths of a graphics frame without a voice yet.
//!
//! Audio side; wait-free, bounded by the number of paths; allocates at construction only. The start of a voice writes
//! uncached memory: a thousand starts take a block's time and are spread over several blocks.

/// A path without a voice yet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PendingVoice {
    /// Greater for louder paths; [`CONTINUES`] for a path whose previous voice fades out.
    pub(crate) rank: u64,
    /// Index in the frame's plan.
    pub(crate) index: u32,
    /// Position among the active voices.
    pub(crate) position: u32,
}

/// Rank of a path whose delay has jumped: it was audible before.
pub(crate) const CONTINUES: u64 = u64::MAX;

/// The pending voices.
#[derive(Debug)]
pub(crate) struct PendingVoices {
    /// In reverse order of their start.
    queue: Vec<PendingVoice>,
}

impl PendingVoices {
    /// Control side; allocates.
    pub(crate) fn new(most: usize) -> Self {
        Self {
            queue: Vec::with_capacity(most),
        }
    }

    /// Removes all.
    pub(crate) fn clear(&mut self) {
        self.queue.clear();
    }

    /// Adds a path; calls follow the order of the frame's plan.
    pub(crate) fn push(&mut self, start: PendingVoice) {
        self.queue.push(start);
    }

    /// Number of pending voices.
    pub(crate) fn len(&self) -> usize {
        self.queue.len()
    }

    /// Selects the order of the plan.
    pub(crate) fn in_order(&mut self) {
        self.queue.reverse();
    }

    /// Selects the order of falling ranks.
    pub(crate) fn loudest_first(&mut self) {
        let order = |start: &PendingVoice| (start.rank, std::cmp::Reverse(start.index));
        self.queue.sort_unstable_by_key(order);
    }

    /// Removes the next voice to start.
    pub(crate) fn pop(&mut self) -> Option<PendingVoice> {
        self.queue.pop()
    }

    /// Plan index of the next voice to start.
    pub(crate) fn following(&self) -> Option<u32> {
        self.queue.last().map(|start| start.index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loudest_start_first_and_equal_ones_in_order() {
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
            queue: starts.queue.clone(),
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
