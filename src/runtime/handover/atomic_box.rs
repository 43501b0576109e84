//! An atomic optional box, exchanged between threads.
//!
//! Wait-free: one atomic exchange. `crossbeam_utils`' `AtomicCell` moves a box as an integer and loses the pointer's
//! provenance, which Miri rejects.
//!
//! Unsafe: converts a box to a raw pointer and back.

use std::ptr::null_mut;
use std::sync::atomic::{AtomicPtr, Ordering};

/// An atomic optional box.
pub(crate) struct AtomicBox<T> {
    pointer: AtomicPtr<T>,
}

impl<T: Send> AtomicBox<T> {
    /// With an initial value.
    pub(crate) fn new(value: Option<Box<T>>) -> Self {
        Self {
            pointer: AtomicPtr::new(value.map_or(null_mut(), Box::into_raw)),
        }
    }

    /// Replaces the content and returns the old one.
    pub(crate) fn swap(&self, value: Option<Box<T>>) -> Option<Box<T>> {
        let value = value.map_or(null_mut(), Box::into_raw);
        own(self.pointer.swap(value, Ordering::AcqRel))
    }

    /// Takes the content.
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
        drop(own(*self.pointer.get_mut()));
    }
}

/// The box of a pointer that was taken out of an [`AtomicBox`].
fn own<T>(pointer: *mut T) -> Option<Box<T>> {
    // SAFETY: the pointer came from `Box::into_raw` and leaves the atomic once: by an exchange, or in `drop`.
    (!pointer.is_null()).then(|| unsafe { Box::from_raw(pointer) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn a_value_is_taken_once_or_freed() {
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
