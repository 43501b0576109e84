//! Asking for memory ahead of its use.
//!
//! `unsafe` because there is no stable intrinsic for it, so it takes an instruction.

/// Asks for the line of memory that a value begins in.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    #[cfg(not(miri))]
    // SAFETY: the instruction only hints; it writes nothing, touches no flags and no stack, and faults at no address.
    unsafe {
        core::arch::asm!(
            "prfm pldl1keep, [{place}]",
            place = in(reg) std::ptr::from_ref(value),
            options(readonly, nostack, preserves_flags),
        );
    }
    #[cfg(miri)]
    let _not_asked = value;
}
