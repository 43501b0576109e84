//! Where the stages meet: schedules, threads and atomics that drive them.

pub mod offline;
pub mod schedule;
pub mod workers;

pub use offline::{OfflineRenderer, OfflineReport, OfflineSettings};
pub use schedule::{Latency, Poses, Schedule};
pub use workers::{MOST_THREADS, Threads};
