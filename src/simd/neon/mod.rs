//! NEON: [`TwoQuads`] and prefetch. Every aarch64 target of Rust has NEON.

mod doubles;
mod lanes;
mod prefetch;

pub(crate) use doubles::TwoPairs;
pub(crate) use lanes::TwoQuads;
pub(crate) use prefetch::prefetch;
