//! Limits of computing time, and the quality control that keeps to them.
//!
//! The app sets a [`Budget`]; [`Governor`] measures every update and moves between [`QUALITY_LEVELS`]. Transitions are
//! ramped: ray and path counts move gradually, and a reflection order fades out before propagation drops it. Times are
//! arguments; no clock is read. Own.

mod governor;
mod quality_level;

pub use governor::{Governor, UpdateCost};
pub use quality_level::{ActiveQuality, LAST_QUALITY_LEVEL, QUALITY_LEVELS, QualityLevel};

use crate::error::{Error, Result};

/// Limits of computing time. The default has none.
///
/// ```
/// use foresound::{Budget, QualityChoice, QualityLevel};
///
/// let mut budget = Budget::default();
/// budget.core_share = Some(0.5); // half of one core for propagation and sound
/// budget.quality = QualityChoice::AtLeast(QualityLevel(1));
/// assert!(budget.check().is_ok());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Budget {
    /// Longest propagation update T_SPS in seconds, 0.0001 to 10; `None` is no limit.
    pub update_s: Option<f64>,
    /// Fraction of one core for propagation and sound together, 0.05 to 2; `None` is no limit. Pauses between updates
    /// come first, up to 0.1 s from start to start; then quality goes down. The synchronous schedule has no pauses.
    pub core_share: Option<f64>,
    /// Quality levels that may be used.
    pub quality: QualityChoice,
}

/// Quality levels that may be used: for thermal states, tests and menus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum QualityChoice {
    /// Any level, chosen by the budget.
    #[default]
    Free,
    /// This level or a higher number (less detail), chosen by the budget.
    AtLeast(QualityLevel),
    /// This level only.
    Exactly(QualityLevel),
}

/// Longest time in seconds between the starts of two updates that pauses may cause.
pub const MAX_UPDATE_SPACING_S: f64 = 0.1;

impl Budget {
    /// Checks all ranges.
    ///
    /// # Errors
    /// [`Error::Setting`] names a limit outside its range.
    pub fn check(&self) -> Result<()> {
        let range = |name: &str, value: Option<f64>, low: f64, high: f64| match value {
            Some(value) if !(low..=high).contains(&value) => {
                let problem = format!("{value} is outside {low} to {high}");
                let advice = "choose a limit in that range, or none";
                Err(Error::setting(name, problem, advice))
            }
            _ => Ok(()),
        };
        range("update_s", self.update_s, 1e-4, 10.0)?;
        range("core_share", self.core_share, 0.05, 2.0)?;
        match self.quality {
            QualityChoice::AtLeast(level) | QualityChoice::Exactly(level)
                if level.0 > LAST_QUALITY_LEVEL =>
            {
                let problem = format!("{} is no quality level", level.0);
                let advice = format!("choose 0 (full) to {LAST_QUALITY_LEVEL} (lowest)");
                Err(Error::setting("quality", problem, &advice))
            }
            _ => Ok(()),
        }
    }
}
