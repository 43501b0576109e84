//! Who does the work: a small fork and join, so that the stage can be split over threads without owning one.

/// Something that runs a job for every item of a list, on as many threads as it has, and comes back when all are done.
///
/// Items are handed out in any order to any thread; a job that depends on nothing but its own item and what all of them
/// share gives the same result on every number of threads. [`crate::propagation`] has no other kind.
pub trait Workers {
    /// Threads that work at once, the caller among them; at least 1.
    fn count(&self) -> usize;

    /// Calls `job` once for every item, with the item's index.
    ///
    /// # Panics
    /// If a job panics, after all others have ended.
    ///
    /// # Real-time
    /// Implementations allocate nothing.
    fn for_each<T: Send>(&self, items: &mut [T], job: impl Fn(usize, &mut T) + Sync) {
        self.for_both((items, &mut [(); 0]), job, |_, ()| ());
    }

    /// The same for two lists that are worked off as one, the first one first: each item with its index in its own list.
    ///
    /// # Panics
    /// If a job panics, after all others have ended.
    ///
    /// # Real-time
    /// Implementations allocate nothing.
    fn for_both<A: Send, B: Send>(
        &self,
        items: (&mut [A], &mut [B]),
        first: impl Fn(usize, &mut A) + Sync,
        second: impl Fn(usize, &mut B) + Sync,
    );
}

/// The calling thread, alone.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Serial;

impl Workers for Serial {
    fn count(&self) -> usize {
        1
    }

    fn for_both<A: Send, B: Send>(
        &self,
        (a, b): (&mut [A], &mut [B]),
        first: impl Fn(usize, &mut A) + Sync,
        second: impl Fn(usize, &mut B) + Sync,
    ) {
        for (index, item) in a.iter_mut().enumerate() {
            first(index, item);
        }
        for (index, item) in b.iter_mut().enumerate() {
            second(index, item);
        }
    }
}
