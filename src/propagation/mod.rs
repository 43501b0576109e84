//! SPS: the sound propagation stage. Rays suggest surfaces, mirrored sources turn a list of surfaces into one exact
//! path, validation throws out what something blocks.
//!
//! Runs on one thread that the caller owns (none of its own), takes a committed [`crate::scene::Scene`] and poses,
//! gives a [`PathSet`].

pub mod path;

pub use path::{LateSource, MAX_ORDER, Path, PathId, PathSet};
