//! The built-in HRTF sets: KEMAR (\[GARDNER95\]), baked; origin and terms in assets/PROVENANCE.md.

use crate::error::{Error, Result};

use crate::generation::Hrtf;

impl Hrtf {
    /// The built-in set for a sample rate. Control side; allocates.
    ///
    /// Range: 44,100 or 48,000 Hz.
    ///
    /// Errors: [`Error::Setting`] for any other rate.
    pub fn builtin(rate_hz: u32) -> Result<Self> {
        match rate_hz {
            44_100 => Self::parse(
                include_bytes!("../../../assets/hrtf/kemar_44100.hrtf"),
                "kemar_44100.hrtf",
            ),
            48_000 => Self::parse(
                include_bytes!("../../../assets/hrtf/kemar_48000.hrtf"),
                "kemar_48000.hrtf",
            ),
            _ => Err(Error::setting(
                "rate_hz",
                format!("there is no built-in HRTF set for {rate_hz} Hz"),
                "use 44100 or 48000, or load a set baked for this rate",
            )),
        }
    }
}
