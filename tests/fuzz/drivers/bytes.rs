//! Numbers, valid and invalid, from a fuzzer's bytes. After the last byte, zeros.

/// Reads bytes from the front.
pub(crate) struct Bytes<'a>(pub(crate) &'a [u8]);

/// Edge cases of floating point.
const ODD: [f32; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN_POSITIVE,
    1e-42,
    1e30,
    -1e30,
    1e5,
    1e-5,
    0.5,
    10_000.0,
];

impl<'a> Bytes<'a> {
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else {
            return 0;
        };
        self.0 = rest;
        *first
    }

    pub(crate) fn word(&mut self) -> u32 {
        u32::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }

    pub(crate) fn long(&mut self) -> u64 {
        u64::from(self.word()) << 32 | u64::from(self.word())
    }

    /// A number below `most`.
    pub(crate) fn below(&mut self, most: usize) -> usize {
        usize::from(self.byte()) % most.max(1)
    }

    /// Mostly an ordinary number, sometimes an edge case, sometimes arbitrary bits.
    pub(crate) fn number(&mut self) -> f32 {
        match self.byte() {
            255 => f32::from_bits(self.word()),
            kind @ 240..=254 => ODD[usize::from(kind - 239)],
            tame => f32::from(i16::from_le_bytes([self.byte(), tame])) / 1024.0,
        }
    }

    pub(crate) fn numbers<const N: usize>(&mut self) -> [f32; N] {
        std::array::from_fn(|_| self.number())
    }

    pub(crate) fn take(&mut self, count: usize) -> &'a [u8] {
        let (first, rest) = self.0.split_at(count.min(self.0.len()));
        self.0 = rest;
        first
    }
}
