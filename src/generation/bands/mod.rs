//! Splitting a source into eight octave bands, and the correction of amplitudes between them.

pub(crate) mod band_correction;
pub(crate) mod band_filter;
pub(crate) mod crossover;
