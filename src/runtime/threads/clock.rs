//! The monotonic clock (no system call on Linux and Android), and processor time of a thread (a system call).

use std::time::{Duration, Instant};

/// Now.
#[expect(
    clippy::disallowed_methods,
    reason = "runtime is where clocks are read; stages get none"
)]
#[inline]
pub(crate) fn now() -> Instant {
    Instant::now()
}

/// Nanoseconds of a duration, saturating.
pub(crate) fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// Processor time of the calling thread, if the system has it. A system call: not for the audio side.
#[cfg(any(target_os = "linux", target_os = "android"))]
pub fn thread_processor_time() -> Option<Duration> {
    // SAFETY: plain integers, for which zero is a value.
    let mut time: libc::timespec = unsafe { std::mem::zeroed() };
    // SAFETY: writes one structure of that type.
    let failed = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    let seconds = u64::try_from(time.tv_sec).ok().filter(|_| failed == 0)?;
    let nanoseconds = u32::try_from(time.tv_nsec).ok()?;
    Some(Duration::new(seconds, nanoseconds))
}

/// Not available on this system.
#[cfg(not(any(target_os = "linux", target_os = "android")))]
pub fn thread_processor_time() -> Option<Duration> {
    None
}
