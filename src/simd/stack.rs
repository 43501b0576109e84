//! A stack of a fixed size that is not cleared before use.
//!
//! `unsafe` for one reason: places that were never written are never read, which the compiler cannot know. Clearing them
//! would cost a ray as much as several boxes.

use std::mem::MaybeUninit;

/// Room for `N` values. Apart from the stack, so that the stack's height can be a register.
pub(crate) struct Places<T, const N: usize>([MaybeUninit<T>; N]);

impl<T: Copy, const N: usize> Places<T, N> {
    /// None of them written.
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self([const { MaybeUninit::uninit() }; N])
    }
}

/// Up to `N` values.
pub(crate) struct Stack<'a, T, const N: usize> {
    /// Those below `height` are written.
    places: &'a mut [MaybeUninit<T>; N],
    height: usize,
}

impl<'a, T: Copy, const N: usize> Stack<'a, T, N> {
    /// Empty.
    #[inline(always)]
    pub(crate) fn over(places: &'a mut Places<T, N>) -> Self {
        Self {
            places: &mut places.0,
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

    /// Puts a number of values on top, the first the topmost; a stack without room for all forgets them.
    #[inline(always)]
    pub(crate) fn push_downwards(&mut self, count: usize, mut next: impl FnMut() -> T) {
        if let Some(places) = self.places[self.height..].get_mut(..count) {
            for place in places.iter_mut().rev() {
                place.write(next());
            }
            self.height += count;
        }
    }

    /// Takes the top.
    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<T> {
        let top = self.height.checked_sub(1)?;
        self.height = top;
        let place = self.places.get(top)?;
        // SAFETY: places below the height are written: it begins at nought, and is raised over places just written alone.
        Some(unsafe { place.assume_init() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_value_comes_first_and_what_has_no_room_is_forgotten() {
        let mut places = Places::<u32, 4>::new();
        let mut stack = Stack::over(&mut places);
        stack.push_if(1, true);
        stack.push_if(2, false);
        let mut next = 10..;
        stack.push_downwards(2, || next.next().unwrap_or(0));
        stack.push_downwards(2, || 99);
        stack.push_if(3, true);
        stack.push_if(4, true);
        let taken: Vec<u32> = std::iter::from_fn(|| stack.pop()).collect();
        assert_eq!(taken, [3, 10, 11, 1]);
    }
}
