//! Slow oracles in `f64`, written apart from the crate, and synthetic data.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "each test uses the oracle it needs"
)]

pub mod boundary_elements;
pub mod crossover;
pub mod dft;
pub mod generators;
#[path = "../../tools/src/validate/oracles/shoebox.rs"]
pub mod shoebox;
pub mod synthetic_hrtf;
#[path = "../../tools/src/validate/oracles/visibility.rs"]
pub mod visibility;
#[path = "../../tools/src/validate/oracles/wedge.rs"]
pub mod wedge;
