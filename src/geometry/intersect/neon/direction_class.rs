//! Classes of ray directions for which kernels are compiled.

/// A class of directions: the longest axis and the sign along it. Kernels are compiled for each: then axes and the order of
/// planes along the longest axis are constants.
pub(crate) struct DirectionClass;

impl DirectionClass {
    /// The class of a direction, 0 to 5. Of equal components the first is the longest; a NaN is longer than all.
    #[inline(always)]
    pub(crate) fn of(direction: &[f32; 3]) -> u8 {
        // Without their signs the bits of floats have the order of their values.
        let [x, y, z] = direction.map(|component| component.to_bits() << 1);
        let (xy, longer) = if x >= y { (0, x) } else { (1, y) };
        let longest: u8 = if longer >= z { xy } else { 2 };
        2 * longest + u8::from(direction[usize::from(longest)].is_sign_negative())
    }

    /// The permuted axes, the longest last.
    pub(super) const fn axes(class: u8) -> [usize; 3] {
        match class / 2 {
            0 => [1, 2, 0],
            1 => [2, 0, 1],
            _ => [0, 1, 2],
        }
    }

    /// Whether the direction is negative along its longest axis.
    pub(super) const fn descends(class: u8) -> bool {
        class % 2 == 1
    }
}
