//!

pub(crate) mod late_reverb;
pub(crate) mod late_sends;
