//! Spans of time in which late energy is fitted: short ones early, longer ones late. Own.

/// Number of the spans.
pub(crate) const SPANS: usize = 16;

/// Time steps of the scene's responses at which the spans end.
pub(crate) const SPAN_ENDS: [usize; SPANS] =
    [1, 2, 3, 4, 6, 8, 11, 15, 20, 26, 33, 41, 50, 60, 70, 80];

/// The span of each time step.
pub(crate) const SPAN_OF_STEP: [u8; SPAN_ENDS[SPANS - 1]] = {
    let (mut spans, mut step) = ([0; SPAN_ENDS[SPANS - 1]], 0);
    while step < spans.len() {
        while step >= SPAN_ENDS[spans[step] as usize] {
            spans[step] += 1;
        }
        step += 1;
    }
    spans
};
