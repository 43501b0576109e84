//! What an engine may spend, and how it and the phone bear it, as plain numbers.

use super::fault::{Fault, Status};
use super::numbers::Numbers;
use crate::runtime::{Budget, EngineState, QualityChoice, QualityLevel, Statistics};

/// How many numbers [`BudgetOptions`] is as a list.
pub const BUDGET_NUMBERS: usize = 4;
/// How many numbers [`EngineHealth`] is as a list.
pub const HEALTH_NUMBERS: usize = 11;

/// What an engine may spend. Fill it with the defaults first, then change what is to differ.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BudgetOptions {
    /// Bytes of this structure, as the caller knows it: what lies beyond takes its default.
    pub size: u32,
    /// Most detail: 0 everything to 5 the least.
    pub least_tier: u32,
    /// 1 holds that tier exactly, whatever the budget and the phone's heat say; else 0.
    pub fixed: u32,
    /// Not used; 0.
    pub reserved: u32,
    /// Longest time of a propagation update in seconds, 0.0001 to 10; 0 is no limit.
    pub update_s: f64,
    /// Share of one core for propagation and sound together, 0.05 to 2; 0 is no limit.
    pub core_share: f64,
}

impl Default for BudgetOptions {
    fn default() -> Self {
        Self {
            size: size_of::<Self>() as u32,
            least_tier: 0,
            fixed: 0,
            reserved: 0,
            update_s: 0.0,
            core_share: 0.0,
        }
    }
}

impl BudgetOptions {
    /// The engine's own budget; ranges are the engine's to check.
    ///
    /// # Errors
    /// [`Status::BadArgument`] for a tier or choice that is none.
    pub fn budget(&self) -> Result<Budget, Fault> {
        let bad = |text: String| Fault::new(Status::BadArgument, text);
        let tier = u8::try_from(self.least_tier)
            .map(QualityLevel)
            .map_err(|_| {
                bad(format!(
                    "least_tier: {} is no tier; give 0 to 5",
                    self.least_tier
                ))
            })?;
        let tiers = match (self.fixed, tier) {
            (0, QualityLevel(0)) => QualityChoice::Free,
            (0, tier) => QualityChoice::AtLeast(tier),
            (1, tier) => QualityChoice::Exactly(tier),
            (other, _) => return Err(bad(format!("fixed: {other} is no choice; give 0 or 1"))),
        };
        // What is not a number is not zero, and the engine refuses it.
        let limit = |value: f64| (value != 0.0).then_some(value);
        Ok(Budget {
            update_s: limit(self.update_s),
            core_share: limit(self.core_share),
            quality: tiers,
        })
    }

    /// From numbers in the order of the fields, without `size` and what is not used: how Java gives them.
    ///
    /// # Errors
    /// [`Status::BadArgument`] for another number of numbers, and for one that its field cannot hold.
    pub fn from_numbers(numbers: &[f64]) -> Result<Self, Fault> {
        let mut next = Numbers::new("budget", numbers, BUDGET_NUMBERS)?;
        Ok(Self {
            least_tier: next.count()?,
            fixed: next.count()?,
            update_s: next.number()?,
            core_share: next.number()?,
            ..Self::default()
        })
    }
}

/// How an engine bears its load, and the phone its heat.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EngineHealth {
    /// 0 running, 1 paused, 2 propagation has failed (restart), 3 the renderer was closed (make another engine).
    pub state: u32,
    /// Tier of detail in force, 0 everything to 5 the least.
    pub tier: u32,
    /// Least tier because of heat, 0 where the system says nothing.
    pub thermal_tier: u32,
    /// The system's thermal status: 0 none, 1 light, 2 moderate, 3 severe, 4 critical, 5 emergency, 6 shutdown; -1 where it
    /// says nothing.
    pub thermal_status: i32,
    /// The system's forecast of heat: 1 is severe throttling; -1 where it says nothing.
    pub thermal_headroom: f32,
    /// Threads whose work the system is told of (performance hints), a sum of bits: 1 propagation, 2 sound.
    pub hinted: u32,
    /// Sources that others mask, where there are more than slots.
    pub unheard_sources: u32,
    /// Most rays of the newest update, as they were cast.
    pub rays: u32,
    /// Share of a core that sound takes lately.
    pub sound_share: f64,
    /// Time of the newest update in seconds.
    pub propagation_s: f64,
    /// Time between the graphics frames that are heard, in seconds.
    pub graphics_frame_s: f64,
}

impl EngineHealth {
    /// From what the engine says.
    pub fn new(from: &Statistics, state: EngineState) -> Self {
        let manners = &from.device_hints;
        Self {
            state: state as u32,
            tier: from.quality_level.0.into(),
            thermal_tier: manners.thermal_quality.0.into(),
            thermal_status: manners.reading.status.map_or(-1, i32::from),
            thermal_headroom: manners.reading.headroom.unwrap_or(-1.0),
            hinted: u32::from(manners.hints_propagation) | u32::from(manners.hints_sound) << 1,
            unheard_sources: from.masked_sources,
            rays: u32::try_from(from.rays).unwrap_or(u32::MAX),
            sound_share: from.sound_share,
            propagation_s: from.propagation_s,
            graphics_frame_s: from.graphics_frame_s,
        }
    }

    /// All fields in their order, as numbers: how Java gets them.
    pub fn numbers(&self) -> [f64; HEALTH_NUMBERS] {
        [
            self.state.into(),
            self.tier.into(),
            self.thermal_tier.into(),
            self.thermal_status.into(),
            self.thermal_headroom.into(),
            self.hinted.into(),
            self.unheard_sources.into(),
            self.rays.into(),
            self.sound_share,
            self.propagation_s,
            self.graphics_frame_s,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_that_says_nothing_is_no_limit() {
        assert_eq!(BudgetOptions::default().budget(), Ok(Budget::default()));
        let numbers = [3.0, 0.0, 0.02, 0.5];
        let budget = BudgetOptions::from_numbers(&numbers).and_then(|o| o.budget());
        let wanted = Budget {
            update_s: Some(0.02),
            core_share: Some(0.5),
            quality: QualityChoice::AtLeast(QualityLevel(3)),
        };
        assert_eq!(budget, Ok(wanted));
    }

    #[test]
    fn tiers_and_choices_that_are_none_are_refused() {
        for numbers in [[300.0, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0]] {
            let budget = BudgetOptions::from_numbers(&numbers).and_then(|o| o.budget());
            assert_eq!(budget.expect_err("is none").status, Status::BadArgument);
        }
        for wrong in [f64::NAN, -1.0, f64::INFINITY] {
            let options = BudgetOptions {
                update_s: wrong,
                ..BudgetOptions::default()
            };
            assert!(options.budget().expect("has numbers").check().is_err());
            assert!(BudgetOptions::from_numbers(&[wrong, 0.0, 0.0, 0.0]).is_err());
        }
    }
}
