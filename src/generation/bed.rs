//! What reaches the output without propagation.

use crate::generation::sound_field::FIELD_SIGNALS;

/// Signals without a position, in front of the limiter. Each may be empty.
#[derive(Debug, Clone, Copy, Default)]
pub struct Bed<'a> {
    /// Heard as they are: the mean of left and right, and half their difference.
    pub stereo: [&'a [f32]; 2],
    /// A first-order sound field, fixed in the world: W, Y, Z, X in AmbiX form.
    pub field: [&'a [f32]; FIELD_SIGNALS],
}
