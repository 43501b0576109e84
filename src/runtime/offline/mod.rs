//! Offline rendering on a virtual clock: all stages in turn, on the caller's thread.

pub(crate) mod instances;
pub mod renderer;
pub mod schedule;
pub(crate) mod scheduled_propagation;
