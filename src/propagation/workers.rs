//! Who does the work: a small fork and join, so that the stage can be split over threads without owning one.

/// Most threads that work at once.
pub const MOST_WORKERS: usize = 64;

/// Something that runs a job for every item of a list, on as many threads as it has, and comes back when all are done.
///
/// Items are handed out in any order to any thread; a job that depends on nothing but its own item and what all of them
/// share gives the same result on every number of threads. [`crate::propagation`] has no other kind.
pub trait Workers {
    /// Threads that work at once, the caller among them; 1 to [`MOST_WORKERS`].
    fn count(&self) -> usize;

    /// Calls `job` once for every item, with the item's index.
    ///
    /// # Panics
    /// If a job panics, after all others have ended.
    ///
    /// # Real-time
    /// Implementations allocate nothing.
    fn for_each<T: Send>(&self, items: &mut [T], job: impl Fn(usize, &mut T) + Sync) {
        let nothing = &mut [(); MOST_WORKERS];
        let job = |index, item: &mut T, (): &mut ()| job(index, item);
        self.for_both((items, &mut [(); 0]), nothing, job, |_, (), ()| ());
    }

    /// The same for two lists that are worked off as one, the first one first: each item with its index in its own list.
    /// Every thread has one of `scratch` for itself: memory in which jobs leave nothing that matters.
    ///
    /// # Panics
    /// If there is less of `scratch` than threads; if a job panics, after all others have ended.
    ///
    /// # Real-time
    /// Implementations allocate nothing.
    fn for_both<A: Send, B: Send, S: Send>(
        &self,
        items: (&mut [A], &mut [B]),
        scratch: &mut [S],
        first: impl Fn(usize, &mut A, &mut S) + Sync,
        second: impl Fn(usize, &mut B, &mut S) + Sync,
    );
}

/// The calling thread, alone.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Serial;

impl Workers for Serial {
    fn count(&self) -> usize {
        1
    }

    fn for_both<A: Send, B: Send, S: Send>(
        &self,
        (a, b): (&mut [A], &mut [B]),
        scratch: &mut [S],
        first: impl Fn(usize, &mut A, &mut S) + Sync,
        second: impl Fn(usize, &mut B, &mut S) + Sync,
    ) {
        let scratch = &mut scratch[0];
        for (index, item) in a.iter_mut().enumerate() {
            first(index, item, scratch);
        }
        for (index, item) in b.iter_mut().enumerate() {
            second(index, item, scratch);
        }
    }
}
