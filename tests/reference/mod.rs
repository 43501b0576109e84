//! Slow oracles in `f64`, written apart from the crate.
#![allow(dead_code, reason = "each test uses the oracle it needs")]

pub mod shoebox;
pub mod visibility;
pub mod wedge;
