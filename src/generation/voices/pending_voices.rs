//! Paths of a graphics frame that have no voice yet.
//!
//! Audio side; wait-free, bounded by the number of paths; allocates at birth only. A voice's beginning writes memory that
//! nobody has asked for, so a thousand of them make a block of their own; here they wait for the blocks that have the time.

/// A path without voice.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start {
    /// The louder the greater; the greatest for one whose own voice has just been faded.
    pub(crate) rank: u64,
    /// Its number in the frame's plan.
    pub(crate) number: u32,
    /// Its place among the living.
    pub(crate) place: u32,
}

/// Rank of a path whose voice goes on elsewhere: it is missed while it waits.
pub(crate) const GOES_ON: u64 = u64::MAX;

/// Those that wait.
#[derive(Debug)]
pub(crate) struct Starts {
    /// In the order in which they begin, the first last.
    waiting: Vec<Start>,
}

impl Starts {
    /// Control side; allocates.
    pub(crate) fn new(most: usize) -> Self {
        Self {
            waiting: Vec::with_capacity(most),
        }
    }

    /// Forgets all.
    pub(crate) fn clear(&mut self) {
        self.waiting.clear();
    }

    /// One more, in the order of the frame's plan.
    pub(crate) fn push(&mut self, start: Start) {
        self.waiting.push(start);
    }

    /// How many wait.
    pub(crate) fn len(&self) -> usize {
        self.waiting.len()
    }

    /// They begin as the plan has them.
    pub(crate) fn in_order(&mut self) {
        self.waiting.reverse();
    }

    /// The loudest begin first.
    pub(crate) fn loudest_first(&mut self) {
        let order = |start: &Start| (start.rank, std::cmp::Reverse(start.number));
        self.waiting.sort_unstable_by_key(order);
    }

    /// The next to begin.
    pub(crate) fn pop(&mut self) -> Option<Start> {
        self.waiting.pop()
    }

    /// The number of the one after that.
    pub(crate) fn following(&self) -> Option<u32> {
        self.waiting.last().map(|start| start.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_loudest_begin_first_and_of_equals_the_first() {
        let mut starts = Starts::new(4);
        for (number, rank) in [3, GOES_ON, 7, 3].into_iter().enumerate() {
            let number = number as u32;
            starts.push(Start {
                rank,
                number,
                place: number,
            });
        }
        let mut sorted = Starts {
            waiting: starts.waiting.clone(),
        };
        sorted.loudest_first();
        starts.in_order();
        let numbers = |mut starts: Starts| -> Vec<u32> {
            std::iter::from_fn(|| starts.pop().map(|start| start.number)).collect()
        };
        assert_eq!(starts.following(), Some(0));
        assert_eq!(numbers(starts), [0, 1, 2, 3]);
        assert_eq!(numbers(sorted), [1, 2, 0, 3]);
    }
}
