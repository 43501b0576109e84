//! A stack of a fixed size that is not cleared before use.
//!
//! `unsafe` for one reason: places that were never written are never read, which the compiler cannot know. Clearing them
//! would cost a ray as much as several boxes.

use std::mem::MaybeUninit;

/// Up to `N` values.
pub(crate) struct Stack<T, const N: usize> {
    /// Those below `height` are written.
    places: [MaybeUninit<T>; N],
    height: usize,
}

impl<T: Copy, const N: usize> Stack<T, N> {
    /// Empty.
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self {
            places: [const { MaybeUninit::uninit() }; N],
            height: 0,
        }
    }

    /// Writes a value on top, which stays if `counts`; a full stack forgets it.
    #[inline(always)]
    pub(crate) fn push_if(&mut self, value: T, counts: bool) {
        if let Some(place) = self.places.get_mut(self.height) {
            place.write(value);
            self.height += usize::from(counts);
        }
    }

    /// Takes the top.
    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<T> {
        let top = self.height.checked_sub(1)?;
        self.height = top;
        let place = self.places.get(top)?;
        // SAFETY: places below the height are written: only `push_if` raises it, by the place it has just written.
        Some(unsafe { place.assume_init() })
    }
}
