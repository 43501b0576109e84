//! AVX2 with FMA and F16C: detection, [`Ymm`], prefetch.
//!
//! `unsafe` to call a function with target features from one without ([`enter_avx2`]).

mod doubles;
mod lanes;
mod prefetch;

pub(crate) use doubles::Ymm64;
pub(crate) use lanes::Ymm;
pub(crate) use prefetch::prefetch;

/// Proof that the machine has AVX2, FMA and F16C; every processor with AVX2 has the last.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Avx2(());

impl Avx2 {
    /// The proof, if the machine has both.
    pub(crate) fn detect() -> Option<Self> {
        let found = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        (found && is_x86_feature_detected!("f16c")).then_some(Self(()))
    }
}

/// Calls a safe function with the target features `avx2,fma,f16c`; takes an [`Avx2`] as proof that the machine has them.
macro_rules! enter_avx2 {
    ($proof:expr => $function:ident($($argument:expr),*)) => {{
        let _: $crate::simd::x86::Avx2 = $proof;
        // SAFETY: the function is safe but for its features, and `Avx2::detect` alone makes a proof.
        unsafe { $function($($argument),*) }
    }};
}

pub(crate) use enter_avx2;
