//! Delay lines of a source, and reading them between samples.

pub(crate) mod delay_line;
pub(crate) mod interpolation;
