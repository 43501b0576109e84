//! Which way rays run, of which kernels know at compile time.

/// A ray's course, a number: its longest axis and along which axes it runs downwards; of shortened courses that is known of
/// the longest axis alone. Kernels are compiled for each, so that places in memory are known.
pub(crate) struct Course;

impl Course {
    /// Of a ray; of components as long as each other the first counts. 23 at most.
    #[inline(always)]
    pub(crate) fn of(direction: &[f32; 3]) -> u8 {
        let [x, y, z] = direction.map(f32::to_bits);
        // Signs are shifted in one by one, each by one instruction.
        [z, y, x]
            .iter()
            .fold(Self::longest(direction) as u32, |course, bits| {
                course << 1 | bits >> 31
            }) as u8
    }

    /// The same, shortened: 24 to 29.
    #[inline(always)]
    pub(crate) fn short(direction: &[f32; 3]) -> u8 {
        let longest = Self::longest(direction);
        24 + 2 * longest as u8 + u8::from(direction[longest].is_sign_negative())
    }

    /// Which component is longest. Without their signs the bits of numbers order as they do; one that is none is longer
    /// than all.
    #[inline(always)]
    fn longest(direction: &[f32; 3]) -> usize {
        let [x, y, z] = direction.map(|component| component.to_bits() << 1);
        let (xy, longer) = if x >= y { (0, x) } else { (1, y) };
        if longer >= z { xy } else { 2 }
    }

    /// The axes in turn, the longest the last.
    pub(super) const fn axes(course: u8) -> [usize; 3] {
        let longest = if course < 24 {
            course / 8
        } else {
            (course - 24) / 2
        };
        match longest {
            0 => [1, 2, 0],
            1 => [2, 0, 1],
            _ => [0, 1, 2],
        }
    }

    /// Whether it runs downwards along its longest axis.
    pub(super) const fn runs_down(course: u8) -> bool {
        if course < 24 {
            course >> (course / 8) & 1 == 1
        } else {
            course % 2 == 1
        }
    }

    /// Whether it runs downwards along a shorter axis, if that is known.
    pub(super) const fn side(course: u8, axis: usize) -> Option<bool> {
        if course < 24 {
            Some(course >> axis & 1 == 1)
        } else {
            None
        }
    }
}
