//! Asking for memory ahead of its use.
//!
//! `unsafe` because the intrinsic takes a pointer; it only hints, whatever the pointer.

use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

/// Asks for the line of memory that a value begins in.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    // SAFETY: a prefetch neither reads nor writes as far as a program can see, and the pointer is a reference's.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) };
}
