//! Spans of time in which late energy is fitted: short ones early, longer ones late. Own.

use std::ops::Range;

/// Number of the spans in which a source's energy is known, and number of all: in the later ones it has the course of energy that begins
/// in the air.
pub(crate) const SPANS: usize = 16;
pub(crate) const LONG_SPANS: usize = 20;

/// Time steps of the scene's responses at which the spans end.
pub(crate) const SPAN_ENDS: [usize; LONG_SPANS] = [
    1, 2, 3, 4, 6, 8, 11, 15, 20, 26, 33, 41, 50, 60, 70, 80, 104, 136, 178, 232,
];

/// Time steps of a response.
pub(crate) const STEPS: usize = SPAN_ENDS[SPANS - 1];

/// Spans of a response in time steps, for the directions of what arrives and for where energy is late.
pub(crate) const DIRECTION_SPANS: [Range<usize>; 4] = [0..6, 6..16, 16..36, 36..STEPS];

/// The span of each time step in which a source's energy is known.
pub(crate) const SPAN_OF_STEP: [u8; STEPS] = {
    let (mut spans, mut step) = ([0; STEPS], 0);
    while step < spans.len() {
        while step >= SPAN_ENDS[spans[step] as usize] {
            spans[step] += 1;
        }
        step += 1;
    }
    spans
};
