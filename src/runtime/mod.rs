//! Where the stages meet: schedules, and later the threads, clocks and atomics that drive them.

mod lead;
pub mod offline;
pub mod schedule;

pub use offline::{OfflineRenderer, OfflineReport, OfflineSettings};
pub use schedule::{Latency, Poses, Schedule};
