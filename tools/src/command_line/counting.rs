//! An allocator that counts the operations of each thread.
//!
//! Wait-free besides the system's allocator; operations are counted by thread, bytes altogether.
//! `tests/engine_realtime.rs` uses it too.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicIsize, Ordering};

/// Allocated bytes of the whole program that are not freed.
pub(crate) static LIVE: AtomicIsize = AtomicIsize::new(0);

thread_local! {
    static OPERATIONS: Cell<u64> = const { Cell::new(0) };
}

/// Allocations, reallocations and frees of this thread so far.
pub(crate) fn operations() -> u64 {
    OPERATIONS.get()
}

/// Counts an operation that allocates so many bytes, or frees them.
fn count(bytes: isize) {
    LIVE.fetch_add(bytes, Ordering::Relaxed);
    // A thread in destruction has no count any more.
    let _ = OPERATIONS.try_with(|operations| operations.set(operations.get() + 1));
}

/// The system's allocator, counted.
pub(crate) struct Counting;

// SAFETY: every call goes to the system's allocator with the caller's own arguments; counting touches no heap.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size().cast_signed());
        // SAFETY: the caller keeps `GlobalAlloc::alloc`'s contract, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-layout.size().cast_signed());
        // SAFETY: `pointer` came from `System` through this allocator with this layout, as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size().cast_signed());
        // SAFETY: the caller keeps the contract, which is the same.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size.cast_signed() - layout.size().cast_signed());
        // SAFETY: `pointer` came from `System` through this allocator with this layout, as the caller promises.
        unsafe { System.realloc(pointer, layout, size) }
    }
}
