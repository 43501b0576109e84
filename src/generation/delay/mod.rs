//! Delay lines of the sources and their fractional interpolation.

pub(crate) mod delay_line;
pub(crate) mod held;
pub(crate) mod interpolation;
