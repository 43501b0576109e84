//!

pub(crate) mod atomic_box;
pub(crate) mod newest;
pub(crate) mod seqlock;
