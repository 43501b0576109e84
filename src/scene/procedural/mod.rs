//! Benchmark scenes made by code.
