//! The late reverb and the sends of the sources to it.

mod history;
pub(crate) mod late_reverb;
pub(crate) mod late_sends;
pub(crate) mod mixing;
pub(crate) mod network;
mod send_grid;
mod shelf_filter;
mod shelves;
pub(crate) mod wave_shares;
