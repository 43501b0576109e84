//! Ends a propagation update early whose result is no longer wanted.
//!
//! The app's thread asks for it, the propagation thread and its helpers see it before each job. One relaxed atomic: nothing waits
//! for it, and an update that misses it runs to its end.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::propagation::Workers;
use crate::runtime::threads::workers::Threads;

/// Whether the update under way is to end.
#[derive(Debug, Default)]
pub(crate) struct Interruption(AtomicBool);

impl Interruption {
    /// Asks the update under way to end.
    pub(crate) fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Forgets requests for earlier updates.
    pub(crate) fn clear(&self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

/// Threads whose jobs may be left out once an interruption is requested.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InterruptibleThreads<'a> {
    pub(crate) threads: &'a Threads,
    /// `None` for an update that runs to its end.
    pub(crate) interruption: Option<&'a Interruption>,
}

impl Workers for InterruptibleThreads<'_> {
    fn count(&self) -> usize {
        self.threads.count()
    }

    fn for_both<A: Send, B: Send, S: Send>(
        &self,
        items: (&mut [A], &mut [B]),
        scratch: &mut [S],
        first: impl Fn(usize, &mut A, &mut S) + Sync,
        second: impl Fn(usize, &mut B, &mut S) + Sync,
    ) {
        self.threads.for_both(items, scratch, first, second);
    }

    fn is_interrupted(&self) -> bool {
        let asked = |interruption: &Interruption| interruption.0.load(Ordering::Relaxed);
        self.interruption.is_some_and(asked)
    }
}
