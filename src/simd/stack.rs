//! A stack of a fixed size that is not cleared before use.
//!
//! `unsafe` for one reason: places that were never written are never read, which the compiler cannot know. Clearing them
//! would cost a ray as much as several boxes. Nor can it know that a height is never more than there are places.

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
    /// At most `N`.
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

    /// Takes values from the top until one will do.
    #[inline(always)]
    pub(crate) fn pop_first(&mut self, will_do: impl Fn(&T) -> bool) -> Option<T> {
        while self.height > 0 {
            self.height -= 1;
            // SAFETY: the height begins at nought and is raised to `N` at most, so below it there are places.
            let place = unsafe { self.places.get_unchecked(self.height) };
            // SAFETY: the height is raised over places just written alone.
            let value = unsafe { place.assume_init() };
            if will_do(&value) {
                return Some(value);
            }
        }
        None
    }

    /// Takes the top.
    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<T> {
        self.pop_first(|_| true)
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
        assert_eq!(stack.pop_first(|_| true), None);
        stack.push_downwards(4, || next.next().unwrap_or(0));
        assert_eq!(stack.pop_first(|value| value % 2 == 1), Some(13));
        assert_eq!(stack.pop_first(|value| *value < 10), None);
        assert_eq!(stack.pop(), None);
    }
}
