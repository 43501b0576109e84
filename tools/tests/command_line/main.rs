//! The command line as its users meet it.

mod harness;
mod refusals;
mod rendering;
mod reports;
mod scenes;
