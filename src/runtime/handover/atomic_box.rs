//! A place for one box, exchanged by any two threads.
//!
//! Wait-free: one atomic exchange. `crossbeam_utils`' `AtomicCell` would do the same, but takes a box through an integer,
//! whose pointer has no provenance any more: undefined by Rust's rules, as Miri says.
//!
//! Holds unsafe code: a box is taken apart into its pointer and put together again.

use std::ptr::null_mut;
use std::sync::atomic::{AtomicPtr, Ordering};

/// A place for one box or none. Only what may change threads can be put in, so that it may be shared.
pub(crate) struct AtomicBox<T> {
    place: AtomicPtr<T>,
}

impl<T: Send> AtomicBox<T> {
    /// With a box or without.
    pub(crate) fn new(value: Option<Box<T>>) -> Self {
        Self {
            place: AtomicPtr::new(value.map_or(null_mut(), Box::into_raw)),
        }
    }

    /// Puts a box or none in and gives what was there.
    pub(crate) fn swap(&self, value: Option<Box<T>>) -> Option<Box<T>> {
        let value = value.map_or(null_mut(), Box::into_raw);
        own(self.place.swap(value, Ordering::AcqRel))
    }

    /// Takes what is there.
    pub(crate) fn take(&self) -> Option<Box<T>> {
        self.swap(None)
    }
}

impl<T: Send> Default for AtomicBox<T> {
    fn default() -> Self {
        Self::new(None)
    }
}

impl<T> Drop for AtomicBox<T> {
    fn drop(&mut self) {
        drop(own(*self.place.get_mut()));
    }
}

/// The box of a pointer that was in a slot, and is not any more.
fn own<T>(place: *mut T) -> Option<Box<T>> {
    // SAFETY: what is in a slot came from `Box::into_raw` and leaves it once: by an exchange, or with the slot itself.
    (!place.is_null()).then(|| unsafe { Box::from_raw(place) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn what_is_put_in_comes_out_once_or_is_freed() {
        let counted = Arc::new(());
        let slot = AtomicBox::new(Some(Box::new(Arc::clone(&counted))));
        assert!(slot.take().is_some() && slot.take().is_none());
        assert!(slot.swap(Some(Box::new(Arc::clone(&counted)))).is_none());
        assert!(slot.swap(Some(Box::new(Arc::clone(&counted)))).is_some());
        assert_eq!(Arc::strong_count(&counted), 2);
        drop(slot);
        assert_eq!(Arc::strong_count(&counted), 1);
    }
}
