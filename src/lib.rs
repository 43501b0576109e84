//! Foresound: real-time ray-traced sound for phones.
//!
//! Propagation finds exact paths through a triangle scene, extrapolation follows every path from one update to the
//! next, generation turns them into two ears of sound.

pub mod acoustics;
#[cfg(any(feature = "capi", feature = "jni", feature = "testing"))]
pub mod bridge;
pub mod error;
pub mod extrapolation;
pub mod generation;
pub mod geometry;
pub mod output;
pub mod propagation;
pub mod runtime;
pub mod scene;
pub mod simd;

pub use error::{Error, Result};
