//! The engine: the only threads, clocks and atomics.
