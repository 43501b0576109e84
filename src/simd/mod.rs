//! Eight-lane `f32` and four-lane `f64` arithmetic and memory prefetch.
//!
//! - [`F32x8`]: eight numbers in an array, the storage format nearly everywhere;
//! - `F16x8`: eight numbers in half the memory, for delay lines;
//! - `Lanes`: the same eight numbers in vector registers, and `Lanes16`, two of them;
//! - `Doubles`: four `f64`, and `ComplexLanes`, complex numbers of them;
//! - `elementary`: functions of them;
//! - `kernel!`: a function written once over `Lanes` and compiled for every instruction set;
//! - `x86`, `neon`: the registers of each instruction set, by `core::arch`.
//!
//! Any thread; nothing here allocates or blocks.

pub(crate) mod doubles;
pub(crate) mod elementary;
pub(crate) mod f16x8;
mod f32x8;
pub(crate) mod kernel;
pub(crate) mod lanes;
#[cfg(target_arch = "aarch64")]
pub(crate) mod neon;
#[cfg(target_arch = "x86_64")]
pub(crate) mod x86;

pub(crate) use doubles::{ComplexLanes, Doubles};
pub(crate) use f16x8::F16x8;
pub use f32x8::F32x8;
pub(crate) use kernel::{LaneSet, kernel};
pub(crate) use lanes::{LANE_INDICES, Lanes, Lanes16};
#[cfg(target_arch = "aarch64")]
pub(crate) use neon::prefetch;
#[cfg(target_arch = "x86_64")]
pub(crate) use x86::prefetch;

/// Prefetches the cache line at the start of a value. This architecture has no implementation: no effect.
#[cfg(not(any(target_arch = "aarch64", target_arch = "x86_64")))]
#[inline(always)]
pub(crate) fn prefetch<T>(_value: &T) {}
