//! Fork and join over threads that the caller owns.

/// Most threads of a [`Workers`].
pub const MOST_WORKERS: usize = 64;

/// Runs a job for every item of a list on several threads, and returns when all jobs have ended.
///
/// Items go to threads in any order. Jobs of propagation depend on their own item and on shared input only: the result is
/// the same for every number of threads.
///
/// ```
/// use foresound::paths::{Serial, Workers};
///
/// let mut squares = [0; 4];
/// Serial.for_each(&mut squares, |index, square| *square = index * index);
/// assert_eq!(squares, [0, 1, 4, 9]);
/// ```
pub trait Workers: Sync {
    /// Number of threads, the caller included; 1 to `MOST_WORKERS`.
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

    /// Calls `first` for every item of the first list and `second` for every item of the second, with the item's index in its
    /// own list. Items of the first list start first. Each thread has one element of `scratch`; jobs must not depend on
    /// its content.
    ///
    /// # Panics
    /// If `scratch` has fewer elements than there are threads; if a job panics, after all others have ended.
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

    /// Whether the caller no longer wants the result of the update under way. Each thread of the update asks before each job. Once
    /// true it stays so until the update returns, which it then does soon, without a result.
    fn is_interrupted(&self) -> bool {
        false
    }
}

/// Runs on the calling thread alone.
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
