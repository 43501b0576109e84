//!

pub(crate) mod newest;
pub(crate) mod seqlock;
pub(crate) mod slot;
