//! Slow, literal `f64` oracles and synthetic data for the tests.
#![allow(dead_code, unreachable_pub, reason = "every test uses its own part")]

pub mod crossover;
pub mod dft;
pub mod synthetic_hrtf;
