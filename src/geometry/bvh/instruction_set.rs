//! [`InstructionSet`]: the traversal kernels of a tree.

/// Traversal kernels of a tree. All give the same answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstructionSet {
    /// The scalar reference, on every machine.
    Scalar,
    /// x86-64 with AVX2 and FMA: eight boxes, four triangles.
    Avx2,
    /// Every aarch64: four boxes, four triangles.
    Neon,
}

impl InstructionSet {
    /// All instruction sets, the fastest last.
    pub const ALL: [Self; 3] = [Self::Scalar, Self::Avx2, Self::Neon];

    /// The fastest of this machine.
    pub fn best() -> Self {
        let mut fastest_first = Self::ALL.into_iter().rev();
        fastest_first
            .find(|set| set.is_available())
            .unwrap_or(Self::Scalar)
    }

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        match self {
            Self::Scalar => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => crate::simd::x86::Avx2::detect().is_some(),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 => false,
            Self::Neon => cfg!(target_arch = "aarch64"),
        }
    }

    /// Its name in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Neon => "neon",
        }
    }

    /// The instruction set of a name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|set| set.name() == name)
    }
}
