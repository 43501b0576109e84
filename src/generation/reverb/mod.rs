//! The late reverb: a feedback delay network and its sends.

pub(crate) mod late_reverb;
pub(crate) mod late_sends;
