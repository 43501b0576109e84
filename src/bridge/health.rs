//! The budget of an engine, and how its load and the phone's temperature keep to it.

use super::error::CallError;
use super::record::record;
use crate::runtime::{Budget, EngineState, QualityChoice, QualityLevel, Statistics};

record! {
    /// Budget of an engine. Fill it with the defaults, then change fields.
    pub struct BudgetOptions[size] {
        /// Finest quality level in use: 0 full detail to 5 the coarsest.
        pub quality_level: u32,
        /// 1: that level exactly, regardless of load and temperature; else 0.
        pub fixed: u32,
        /// Maximum duration of a propagation update in seconds, 0.0001 to 10; 0: no limit.
        pub update_s: f64,
        /// Maximum share of one core for propagation and sound together, 0.05 to 2; 0: no limit.
        pub core_share: f64,
    }
}

impl Default for BudgetOptions {
    fn default() -> Self {
        Self {
            size: size_of::<Self>() as u32,
            quality_level: 0,
            fixed: 0,
            update_s: 0.0,
            core_share: 0.0,
        }
    }
}

impl BudgetOptions {
    /// The engine's budget.
    ///
    /// # Errors
    /// `Status::BadArgument` for a level or choice out of range. The engine checks the other
    /// ranges.
    pub fn budget(&self) -> Result<Budget, CallError> {
        let level = self.quality_level;
        let finest = u8::try_from(level)
            .map(QualityLevel)
            .map_err(|_| CallError::bad(format!("quality_level: {level} is outside 0 to 5")))?;
        let tiers = match (self.fixed, finest) {
            (0, QualityLevel(0)) => QualityChoice::Free,
            (0, level) => QualityChoice::AtLeast(level),
            (1, level) => QualityChoice::Exactly(level),
            (other, _) => return Err(CallError::bad(format!("fixed: {other} is not 0 or 1"))),
        };
        // The engine refuses NaN.
        let limit = |value: f64| (value != 0.0).then_some(value);
        Ok(Budget {
            update_s: limit(self.update_s),
            core_share: limit(self.core_share),
            quality: tiers,
        })
    }
}

record! {
    /// Load of an engine and temperature of the phone.
    #[derive(Default)]
    pub struct EngineHealth {
        /// 0 running, 1 paused, 2 propagation failed (restart), 3 the renderer was closed (create another engine).
        pub state: u32,
        /// Quality level in use, 0 full detail to 5 the coarsest.
        pub quality_level: u32,
        /// Finest quality level allowed by the temperature; 0 if unknown.
        pub thermal_quality_level: u32,
        /// The system's thermal status: 0 none, 1 light, 2 moderate, 3 severe, 4 critical, 5 emergency, 6 shutdown; -1 if
        /// unknown.
        pub thermal_status: i32,
        /// The system's thermal headroom: 1 is severe throttling; -1 if unknown.
        pub thermal_headroom: f32,
        /// Threads with a performance hint session, a sum of bits: 1 propagation, 2 sound.
        pub hinted: u32,
        /// Sources that louder ones mask, if there are more sources than slots.
        pub unheard_sources: u32,
        /// Rays cast by the newest update.
        pub rays: u32,
        /// Share of one core used by sound.
        pub sound_share: f64,
        /// Duration of the newest update in seconds.
        pub propagation_s: f64,
        /// Time between graphics frames in seconds.
        pub graphics_frame_s: f64,
    }
}

impl EngineHealth {
    /// From the engine's statistics.
    pub fn new(from: &Statistics, state: EngineState) -> Self {
        let manners = &from.device_hints;
        Self {
            state: state as u32,
            quality_level: from.quality_level.0.into(),
            thermal_quality_level: manners.thermal_quality.0.into(),
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
}

#[cfg(test)]
mod tests {
    use super::super::{Status, record::Record};
    use super::*;

    fn budget(list: [f64; 4]) -> Result<Budget, CallError> {
        BudgetOptions::from_list("budget", &list)?.budget()
    }

    #[test]
    fn zeros_are_no_limit() {
        assert_eq!(BudgetOptions::default().budget(), Ok(Budget::default()));
        let wanted = Budget {
            update_s: Some(0.02),
            core_share: Some(0.5),
            quality: QualityChoice::AtLeast(QualityLevel(3)),
        };
        assert_eq!(budget([3.0, 0.0, 0.02, 0.5]), Ok(wanted));
    }

    #[test]
    fn levels_and_limits_out_of_range_are_refused() {
        for list in [[300.0, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0]] {
            let error = budget(list).expect_err("out of range");
            assert_eq!(error.status, Status::BadArgument);
        }
        for wrong in [f64::NAN, -1.0, f64::INFINITY] {
            let limited = budget([0.0, 0.0, wrong, 0.0]).expect("numbers");
            assert!(limited.check().is_err());
            assert!(budget([wrong, 0.0, 0.0, 0.0]).is_err());
        }
    }
}
