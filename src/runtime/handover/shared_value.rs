//! A small value behind a lock: written by control threads and by a thread that starts, read by any control thread.

#![expect(
    clippy::disallowed_types,
    reason = "control threads; the audio side stores once, before its first block"
)]

use std::sync::{Mutex, PoisonError};

/// A shared value. Not for the audio side while it renders.
#[derive(Default)]
pub(crate) struct SharedValue<T>(Mutex<T>);

impl<T: Copy> SharedValue<T> {
    pub(crate) fn store(&self, value: T) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = value;
    }

    pub(crate) fn load(&self) -> T {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
