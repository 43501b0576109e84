//! A budget that holds: how much the engine may spend, and what it gives up to keep to it.
//!
//! The app says what may be spent ([`Budget`]); [`Governor`] looks at every update's time and moves between tiers
//! ([`QUALITY_LEVELS`]), from full detail to the least that is worth hearing. No clock is read here: times come in as numbers, so
//! that a test can drive it. What changes is ramped: rays and paths glide from tier to tier, and an order of reflections
//! has faded before propagation stops looking for it. Own.

mod governor;
mod quality_level;

pub use governor::{Governor, UpdateCost};
pub use quality_level::{ActiveQuality, LAST_QUALITY_LEVEL, QUALITY_LEVELS, QualityLevel};

use crate::error::{Error, Result};

/// What the engine may spend. The default is without limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Budget {
    /// Longest time of a propagation update, T_SPS, in seconds, 0.0001 to 10; `None` is no limit.
    pub update_s: Option<f64>,
    /// Share of one core that propagation and sound may use together, 0.05 to 2; `None` is no limit. Updates are spaced
    /// out first, to [`MAX_UPDATE_SPACING_S`]; what does not fit then is scaled down. The synchronous schedule cannot space
    /// out: its updates are the app's own time.
    pub core_share: Option<f64>,
    /// Which tiers may be used.
    pub quality: QualityChoice,
}

/// Which tiers may be used, whatever the budget says: for thermal states, tests and menus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum QualityChoice {
    /// As the budget needs.
    #[default]
    Free,
    /// As the budget needs, but with no more detail than this tier's.
    AtLeast(QualityLevel),
    /// This one.
    Exactly(QualityLevel),
}

/// Longest time between the beginnings of two updates that spacing out may bring about, in seconds.
pub const MAX_UPDATE_SPACING_S: f64 = 0.1;

impl Budget {
    /// Checks every range.
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
            QualityChoice::AtLeast(tier) | QualityChoice::Exactly(tier)
                if tier.0 > LAST_QUALITY_LEVEL =>
            {
                let problem = format!("{} is no tier", tier.0);
                let advice = format!("choose 0 (everything) to {LAST_QUALITY_LEVEL} (the least)");
                Err(Error::setting("tiers", problem, &advice))
            }
            _ => Ok(()),
        }
    }
}
