//! A small value behind a lock, written and read by control threads.

#![expect(clippy::disallowed_types, reason = "control threads only")]

use std::sync::{Mutex, PoisonError};

/// A shared value. Not for the audio side.
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
