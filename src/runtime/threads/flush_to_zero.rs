//! Flushes subnormal numbers to zero while a guard lives.
//!
//! Any thread; wait-free. Decaying signals end in subnormal numbers, which cost a processor up to a hundred times as much
//! as others (about 150 cycles per microcode assist by Intel's manual). The mode belongs to a thread: a guard sets it and
//! restores the previous one. Rust guarantees results for the default mode only; the difference is that a subnormal reads
//! as zero, on which no stage depends. On processors other than x86-64 and AArch64, and under Miri, a guard has no effect.

#[cfg(all(not(miri), any(target_arch = "x86_64", target_arch = "aarch64")))]
use std::arch::asm;
use std::marker::PhantomData;

/// Flushes subnormal numbers of this thread to zero while it exists.
pub struct FlushToZero {
    #[cfg(all(not(miri), any(target_arch = "x86_64", target_arch = "aarch64")))]
    before: Mode,
    /// Not `Send`: the mode belongs to the thread.
    thread: PhantomData<*const ()>,
}

#[cfg(all(not(miri), target_arch = "x86_64"))]
type Mode = u32;
#[cfg(all(not(miri), target_arch = "aarch64"))]
type Mode = u64;

/// MXCSR: bit 15 flushes results, bit 6 takes subnormal operands as zero.
#[cfg(all(not(miri), target_arch = "x86_64"))]
const FLUSH: Mode = 1 << 15 | 1 << 6;
/// FPCR: bit 24, FZ, does both.
#[cfg(all(not(miri), target_arch = "aarch64"))]
const FLUSH: Mode = 1 << 24;

impl FlushToZero {
    /// Sets the mode on this thread.
    pub fn begin() -> Self {
        #[cfg(all(not(miri), any(target_arch = "x86_64", target_arch = "aarch64")))]
        let before = {
            let before = read();
            write(before | FLUSH);
            before
        };
        Self {
            #[cfg(all(not(miri), any(target_arch = "x86_64", target_arch = "aarch64")))]
            before,
            thread: PhantomData,
        }
    }
}

/// Whether this thread flushes subnormal numbers.
pub(crate) fn flushes() -> bool {
    #[cfg(all(not(miri), any(target_arch = "x86_64", target_arch = "aarch64")))]
    return read() & FLUSH == FLUSH;
    #[cfg(any(miri, not(any(target_arch = "x86_64", target_arch = "aarch64"))))]
    false
}

impl Drop for FlushToZero {
    fn drop(&mut self) {
        #[cfg(all(not(miri), any(target_arch = "x86_64", target_arch = "aarch64")))]
        write(self.before);
    }
}

#[cfg(all(not(miri), target_arch = "x86_64"))]
fn read() -> Mode {
    let mut mode: Mode = 0;
    // SAFETY: stores four bytes to a local of four bytes; SSE is part of x86-64.
    unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut mode, options(nostack, preserves_flags)) };
    mode
}

#[cfg(all(not(miri), target_arch = "x86_64"))]
fn write(mode: Mode) {
    // SAFETY: loads four bytes from a local of four bytes; callers pass a mode that was read, with flush bits that
    // every x86-64 processor has, so no reserved bit is set and no exception unmasked.
    unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const mode, options(nostack, preserves_flags)) };
}

#[cfg(all(not(miri), target_arch = "aarch64"))]
fn read() -> Mode {
    let mode: Mode;
    // SAFETY: reads a register that user code may read.
    unsafe { asm!("mrs {}, fpcr", out(reg) mode, options(nomem, nostack, preserves_flags)) };
    mode
}

#[cfg(all(not(miri), target_arch = "aarch64"))]
fn write(mode: Mode) {
    // SAFETY: writes a register that user code may write; callers pass a mode that was read, with FZ set or as it was.
    unsafe { asm!("msr fpcr, {}", in(reg) mode, options(nostack, preserves_flags)) };
}

#[cfg(all(test, not(miri), any(target_arch = "x86_64", target_arch = "aarch64")))]
mod tests {
    use super::FlushToZero;
    use std::hint::black_box;

    fn halved() -> f32 {
        black_box(black_box(f32::MIN_POSITIVE) * black_box(0.5))
    }

    #[test]
    fn a_guard_flushes_and_restores() {
        assert!(halved() > 0.0);
        assert!(!super::flushes());
        let outer = FlushToZero::begin();
        assert!(super::flushes());
        assert!(black_box(halved().to_bits()) == 0);
        drop(FlushToZero::begin());
        assert!(black_box(halved().to_bits()) == 0);
        drop(outer);
        assert!(black_box(halved().to_bits()) != 0);
    }
}
