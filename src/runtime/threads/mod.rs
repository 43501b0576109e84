//! Threads: placement and priority, worker pool, clock, floating-point mode.

pub mod affinity;
pub mod clock;
pub mod flush_to_zero;
pub(crate) mod interruption;
pub mod workers;
