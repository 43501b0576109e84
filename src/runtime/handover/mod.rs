//! Handover between threads: a wait-free atomic box and a newest-value channel; and a locked value for control threads.

pub(crate) mod atomic_box;
pub(crate) mod newest;
pub(crate) mod shared_value;
