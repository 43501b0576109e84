//! Memory prefetch.
//!
//! `unsafe` because there is no stable intrinsic: inline assembly.

/// Prefetches the cache line at the start of a value.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    #[cfg(not(miri))]
    // SAFETY: the instruction is a hint: it writes nothing, uses no flags and no stack, and faults at no address.
    unsafe {
        core::arch::asm!(
            "prfm pldl1keep, [{address}]",
            address = in(reg) std::ptr::from_ref(value),
            options(readonly, nostack, preserves_flags),
        );
    }
    #[cfg(miri)]
    let _ = value;
}
