//!

pub(crate) mod delay_line;
pub(crate) mod interpolation;
