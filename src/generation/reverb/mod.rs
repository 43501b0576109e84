//! The late reverb and the sends of the sources to it.

pub(crate) mod late_reverb;
pub(crate) mod late_sends;
