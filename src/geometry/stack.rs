//! Fixed-size stacks without initialisation, for tree traversal.
//!
//! `unsafe` for two reasons: elements above the top are uninitialised (clearing them would cost a ray as much as several
//! boxes), and the top of [`SentinelStack`] is a pointer: a pop reads a value and moves the top by one instruction.

use std::marker::PhantomData;
use std::mem::MaybeUninit;

/// Returns the pointer with its origin hidden from the optimiser. With a known origin the optimiser addresses elements by
/// index, and keeps loaded values in registers that every ray then has to save.
#[inline(always)]
pub(super) fn opaque_pointer<T>(pointer: *mut T) -> *mut T {
    #[cfg(all(target_arch = "aarch64", not(miri)))]
    {
        let mut pointer = pointer;
        // SAFETY: no instruction; the operand marks the register as changed.
        unsafe {
            std::arch::asm!("/* {0} */", inout(reg) pointer, options(pure, nomem, nostack, preserves_flags));
        }
        pointer
    }
    #[cfg(not(all(target_arch = "aarch64", not(miri))))]
    pointer
}

/// Storage for `N` values, apart from the stack: the stack's top stays in a register.
pub(super) struct StackStorage<T, const N: usize>([MaybeUninit<T>; N]);

impl<T: Copy, const N: usize> StackStorage<T, N> {
    /// All uninitialised.
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self([const { MaybeUninit::uninit() }; N])
    }
}

/// A stack of at most `N` values.
pub(super) struct Stack<'a, T, const N: usize> {
    /// Elements below `height` are initialised.
    elements: &'a mut [MaybeUninit<T>; N],
    /// At most `N`.
    height: usize,
}

impl<'a, T: Copy, const N: usize> Stack<'a, T, N> {
    /// An empty stack.
    #[inline(always)]
    pub(super) fn new(storage: &'a mut StackStorage<T, N>) -> Self {
        Self {
            elements: &mut storage.0,
            height: 0,
        }
    }

    /// Pushes a value if `keep`; without a branch on it. A full stack drops the value.
    #[inline(always)]
    pub(super) fn push_if(&mut self, value: T, keep: bool) {
        if let Some(element) = self.elements.get_mut(self.height) {
            element.write(value);
            self.height += usize::from(keep);
        }
    }

    /// Pops the top.
    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<T> {
        if self.height == 0 {
            return None;
        }
        self.height -= 1;
        // SAFETY: the height starts at 0 and never exceeds `N`.
        let element = unsafe { self.elements.get_unchecked(self.height) };
        // SAFETY: the height only rises past an element that was just written.
        Some(unsafe { element.assume_init() })
    }
}

/// A child to visit later.
#[derive(Clone, Copy)]
pub(super) struct PendingChild {
    /// Distance key at which the ray enters it.
    pub(super) entry: u32,
    /// Its link.
    pub(super) link: u32,
}

/// A stack of at most `N - 1` pending children above a sentinel that satisfies every bound: pop needs no empty check.
pub(super) struct SentinelStack<'a, const N: usize> {
    /// The next free element, above the sentinel, or the end. Elements below are initialised.
    top: *mut PendingChild,
    sentinel: *mut PendingChild,
    storage: PhantomData<&'a mut StackStorage<PendingChild, N>>,
}

impl<'a, const N: usize> SentinelStack<'a, N> {
    /// An empty stack.
    #[inline(always)]
    pub(super) fn new(storage: &'a mut StackStorage<PendingChild, N>) -> Self {
        const { assert!(N > 0, "the sentinel needs an element") };
        storage.0[0].write(PendingChild { entry: 0, link: 0 });
        let sentinel: *mut PendingChild = storage.0.as_mut_ptr().cast();
        Self {
            // SAFETY: another element or the end follows the sentinel.
            top: unsafe { opaque_pointer(sentinel).add(1) },
            sentinel,
            storage: PhantomData,
        }
    }

    /// Free bytes above the top.
    #[inline(always)]
    fn room(&self) -> usize {
        // SAFETY: there are `N` elements from the sentinel on.
        let end = unsafe { self.sentinel.add(N) };
        end.addr() - self.top.addr()
    }

    /// Pushes a child; a full stack drops it.
    #[inline(always)]
    pub(super) fn push(&mut self, child: PendingChild) {
        if self.room() != 0 {
            // SAFETY: the top is not the end, so it is an element; the storage is borrowed as long as the stack lives.
            unsafe { self.top.write(child) };
            // SAFETY: another element or the end follows an element.
            self.top = unsafe { self.top.add(1) };
        }
    }

    /// Pushes `count` children, the first on top; a stack without room for all drops them.
    #[inline(always)]
    pub(super) fn push_ordered(&mut self, count: usize, mut next: impl FnMut() -> PendingChild) {
        if count * size_of::<PendingChild>() <= self.room() {
            // SAFETY: at least `count` elements are free.
            let top = unsafe { self.top.add(count) };
            let mut element = top;
            while element != self.top {
                // SAFETY: it is above the old top.
                element = unsafe { element.sub(1) };
                // SAFETY: an element from the old top up and below the new one.
                unsafe { element.write(next()) };
            }
            self.top = top;
        }
    }

    /// Pops until an entry is not above a bound.
    #[inline(always)]
    pub(super) fn pop_within(&mut self, bound: u32) -> Option<PendingChild> {
        let mut top = self.top;
        let first = loop {
            // SAFETY: the top is above the sentinel, whose entry no bound is below: the loop ends there at the latest.
            top = unsafe { top.sub(1) };
            // SAFETY: elements below the top are initialised, from the sentinel on.
            let child = unsafe { top.read() };
            if child.entry <= bound {
                break child;
            }
        };
        let is_pending = top != self.sentinel;
        // The sentinel stays.
        // SAFETY: it is an element, followed by another or the end.
        self.top = unsafe { top.add(usize::from(!is_pending)) };
        is_pending.then_some(first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_value_comes_first_and_a_full_stack_drops() {
        let mut storage = StackStorage::<u32, 4>::new();
        let mut stack = Stack::new(&mut storage);
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
    fn pop_skips_entries_above_the_bound() {
        let mut storage = StackStorage::<PendingChild, 5>::new();
        let mut stack = SentinelStack::new(&mut storage);
        assert!(stack.pop_within(0).is_none());
        let child = |entry| PendingChild {
            entry,
            link: entry + 100,
        };
        stack.push(child(7));
        let mut next = [3, 9, 8].into_iter();
        stack.push_ordered(3, || child(next.next().unwrap_or(0)));
        stack.push(child(1));
        stack.push_ordered(1, || child(1));
        let mut pop = |bound| stack.pop_within(bound).map(|child| child.link);
        assert_eq!(pop(3), Some(103));
        assert_eq!(pop(7), Some(107));
        assert_eq!(pop(u32::MAX), None);
        assert_eq!(pop(0), None);
        stack.push(child(5));
        assert!(stack.pop_within(4).is_none());
        assert!(stack.pop_within(5).is_none());
    }
}
