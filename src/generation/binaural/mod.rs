//! From voices to two ears: HRTF weights, shared filters, and the late reverb as far arrivals.

pub(crate) mod ear_ramps;
pub(crate) mod far_field;
pub(crate) mod filter_bank;
pub(crate) mod hrtf;
#[cfg(feature = "builtin-hrtf")]
pub(crate) mod hrtf_builtin;
