//! The split of signals into octave bands, and band gains.

pub(crate) mod air_filter;
pub(crate) mod band_correction;
pub(crate) mod band_filter;
pub(crate) mod crossover;
