//! Wait-free handover between threads: an atomic box, a newest-value channel and a sequence lock.

pub(crate) mod atomic_box;
pub(crate) mod newest;
pub(crate) mod seqlock;
