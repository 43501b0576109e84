//! The clock: monotonic, read without a system call where the system maps it (Linux and Android do).

use std::time::{Duration, Instant};

/// Now.
#[expect(
    clippy::disallowed_methods,
    reason = "runtime is where clocks are read; stages get none"
)]
#[inline]
pub(super) fn now() -> Instant {
    Instant::now()
}

/// Nanoseconds of a duration, as a number that an atomic can hold.
pub(super) fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
