//! Stacks of a fixed size that are not cleared before use.
//!
//! `unsafe` for two reasons: places that were never written are never read, which the compiler cannot know (clearing them
//! would cost a ray as much as several boxes), and a pile's top is a pointer, so that a value is read and the top moved by one
//! instruction.

use std::marker::PhantomData;
use std::mem::MaybeUninit;

/// The same pointer, of which the compiler forgets where it comes from. It would count places from the bottom up again, and
/// it would keep what it has loaded from there for later, in registers that every ray would have to save.
#[inline(always)]
pub(super) fn forgotten<T>(pointer: *mut T) -> *mut T {
    #[cfg(all(target_arch = "aarch64", not(miri)))]
    {
        let mut pointer = pointer;
        // SAFETY: not an instruction, but a register that it might have changed.
        unsafe {
            std::arch::asm!("/* {0} */", inout(reg) pointer, options(pure, nomem, nostack, preserves_flags));
        }
        pointer
    }
    #[cfg(not(all(target_arch = "aarch64", not(miri))))]
    pointer
}

/// Room for `N` values. Apart from the stack, so that the stack's top can be a register.
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

    /// Takes the top.
    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<T> {
        if self.height == 0 {
            return None;
        }
        self.height -= 1;
        // SAFETY: the height begins at nought and is raised to `N` at most, so below it there are places.
        let place = unsafe { self.places.get_unchecked(self.height) };
        // SAFETY: the height is raised over places just written alone.
        Some(unsafe { place.assume_init() })
    }
}

/// Something to go to later.
#[derive(Clone, Copy)]
pub(crate) struct Waiting {
    /// What it is kept or left by: the lower the sooner.
    pub(crate) entry: u32,
    /// Where it is.
    pub(crate) link: u32,
}

/// Up to `N - 1` that wait, on a floor that will do for every bound: looking for one ends there, without a look at the height.
pub(crate) struct Pile<'a, const N: usize> {
    /// Where the next is written: a place above the floor, or the end of the places. Those below are written.
    top: *mut Waiting,
    floor: *mut Waiting,
    places: PhantomData<&'a mut Places<Waiting, N>>,
}

impl<'a, const N: usize> Pile<'a, N> {
    /// Of none.
    #[inline(always)]
    pub(crate) fn over(places: &'a mut Places<Waiting, N>) -> Self {
        const { assert!(N > 0, "there must be a place for the floor") };
        places.0[0].write(Waiting { entry: 0, link: 0 });
        let floor: *mut Waiting = places.0.as_mut_ptr().cast();
        Self {
            // SAFETY: after the floor's place comes another or the end.
            top: unsafe { forgotten(floor).add(1) },
            floor,
            places: PhantomData,
        }
    }

    /// How many bytes of places are above the top.
    #[inline(always)]
    fn room(&self) -> usize {
        // SAFETY: there are `N` places from the floor on.
        let end = unsafe { self.floor.add(N) };
        end.addr() - self.top.addr()
    }

    /// Puts one on top; a full one forgets it.
    #[inline(always)]
    pub(crate) fn push(&mut self, waiting: Waiting) {
        if self.room() != 0 {
            // SAFETY: the top is no end, so it is a place, which is borrowed as long as the pile lives.
            unsafe { self.top.write(waiting) };
            // SAFETY: after a place comes another or the end.
            self.top = unsafe { self.top.add(1) };
        }
    }

    /// Puts a number of them on top, the first the topmost; one without room for all forgets them.
    #[inline(always)]
    pub(crate) fn push_downwards(&mut self, count: usize, mut next: impl FnMut() -> Waiting) {
        if count * size_of::<Waiting>() <= self.room() {
            // SAFETY: so many places lie from the top to the end.
            let top = unsafe { self.top.add(count) };
            let mut place = top;
            while place != self.top {
                // SAFETY: it is above the old top, so there is one below.
                place = unsafe { place.sub(1) };
                // SAFETY: a place from the old top up and below the new one.
                unsafe { place.write(next()) };
            }
            self.top = top;
        }
    }

    /// Takes from the top until an entry is not beyond a bound.
    #[inline(always)]
    pub(crate) fn pop_up_to(&mut self, bound: u32) -> Option<Waiting> {
        let mut top = self.top;
        let first = loop {
            // SAFETY: the top is above the floor, which no bound is below, so that it is the last to be looked at.
            top = unsafe { top.sub(1) };
            // SAFETY: below the top places are written, the floor the first.
            let waiting = unsafe { top.read() };
            if waiting.entry <= bound {
                break waiting;
            }
        };
        let is_waiting = top != self.floor;
        // The floor stays.
        // SAFETY: it is a place, after which comes another or the end.
        self.top = unsafe { top.add(usize::from(!is_waiting)) };
        is_waiting.then_some(first)
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
        stack.push_if(3, true);
        stack.push_if(4, true);
        stack.push_if(5, true);
        stack.push_if(6, true);
        let taken: Vec<u32> = std::iter::from_fn(|| stack.pop()).collect();
        assert_eq!(taken, [5, 4, 3, 1]);
        assert_eq!(stack.pop(), None);
    }

    #[test]
    fn what_lies_beyond_a_bound_is_passed_over() {
        let mut places = Places::<Waiting, 5>::new();
        let mut pile = Pile::over(&mut places);
        assert!(pile.pop_up_to(0).is_none());
        let waiting = |entry| Waiting {
            entry,
            link: entry + 100,
        };
        pile.push(waiting(7));
        let mut next = [3, 9, 8].into_iter();
        pile.push_downwards(3, || waiting(next.next().unwrap_or(0)));
        pile.push(waiting(1));
        pile.push_downwards(1, || waiting(1));
        let mut pop = |bound| pile.pop_up_to(bound).map(|waiting| waiting.link);
        assert_eq!(pop(3), Some(103));
        assert_eq!(pop(7), Some(107));
        assert_eq!(pop(u32::MAX), None);
        assert_eq!(pop(0), None);
        pile.push(waiting(5));
        assert!(pile.pop_up_to(4).is_none());
        assert!(pile.pop_up_to(5).is_none());
    }
}
