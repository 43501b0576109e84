//! Binaural rendering: HRTF sets, ear ramps, the filter bank and the plane waves of the late reverb.

pub(crate) mod baked_set;
pub(crate) mod ear_ramps;
pub(crate) mod far_field;
pub(crate) mod field_filters;
pub(crate) mod filter_bank;
pub(crate) mod hrtf;
#[cfg(feature = "builtin-hrtf")]
pub(crate) mod hrtf_builtin;
