//! What a tree is walked with.

/// Lanes of a walk. Answers are the same with all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstructionSet {
    /// No lanes: the specification, everywhere.
    Scalar,
    /// Four lanes, every x86-64.
    Sse2,
    /// Eight lanes for boxes, four for triangles; x86-64 with AVX2 and FMA.
    Avx2,
    /// Four lanes, every aarch64.
    Neon,
}

impl InstructionSet {
    /// All there are, the best last.
    pub const ALL: [Self; 4] = [Self::Scalar, Self::Sse2, Self::Avx2, Self::Neon];

    /// The best this machine has.
    pub fn best() -> Self {
        let mut best = Self::Scalar;
        for set in Self::ALL {
            if set.is_available() {
                best = set;
            }
        }
        best
    }

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            Self::Sse2 => cfg!(target_arch = "x86_64"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => crate::simd::x86::Avx2::detect().is_some(),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 => false,
            Self::Neon => cfg!(target_arch = "aarch64"),
        }
    }

    /// Its name in small letters.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Sse2 => "sse2",
            Self::Avx2 => "avx2",
            Self::Neon => "neon",
        }
    }

    /// The one of a name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|set| set.name() == name)
    }
}
