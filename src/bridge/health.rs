//! The budget of an engine, and how its load and the phone's temperature keep to it.

use super::enumeration::{EngineState, HintedThread, ThermalStatus};
use super::error::CallError;
use super::record::record;
use crate::runtime::{self, Budget, QualityChoice, QualityLevel, Statistics};

record! {
    /// Budget of an engine. Begin with FORESOUND_BUDGET_OPTIONS_INIT or foresound_budget_options_default, then change fields.
    pub struct BudgetOptions[size, zeros] {
        /// Finest quality level in use: 0 full detail to 5 the coarsest.
        pub quality_level: u32,
        /// 1: that level exactly, regardless of load and temperature; else 0.
        pub fixed: u32,
        /// 0.
        pub reserved: u32,
        /// Maximum duration of a propagation update in seconds, 0.0001 to 10; 0: no limit.
        pub update_s: f64,
        /// Maximum share of one core for propagation and sound together, 0.05 to 2; 0: no limit.
        pub core_share: f64,
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
        if self.reserved != 0 {
            return Err(CallError::bad(
                "reserved is not 0; begin with the initialiser",
            ));
        }
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
    pub struct EngineHealth[size, zeros] {
        /// State of the engine.
        pub state: EngineState,
        /// Quality level in use, 0 full detail to 5 the coarsest.
        pub quality_level: u32,
        /// Finest quality level allowed by the temperature; 0 if unknown.
        pub thermal_quality_level: u32,
        /// The system's thermal status.
        pub thermal_status: ThermalStatus,
        /// The system's thermal headroom: 1 is severe throttling; -1 if unknown.
        pub thermal_headroom: f32,
        /// Threads with a performance hint session, a sum of ForesoundHintedThread.
        pub hinted: u32,
        /// Sources without a slot in the newest tick, as nothing of them would be heard: they play nothing, are below -100 dB re
        /// full scale, or are masked, with less than a millionth (-60 dB) of the energy of all sources at the listener. 0 while
        /// there are as many slots as sources.
        pub unheard_sources: u32,
        /// Rays cast by the newest update.
        pub rays: u64,
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
    pub fn new(from: &Statistics, state: runtime::EngineState) -> Self {
        let hints = &from.device_hints;
        let hinted = [
            (hints.hints_propagation, HintedThread::Propagation),
            (hints.hints_sound, HintedThread::Audio),
        ];
        Self {
            size: size_of::<Self>() as u32,
            state: state.into(),
            quality_level: from.quality_level.0.into(),
            thermal_quality_level: hints.thermal_quality.0.into(),
            thermal_status: hints
                .reading
                .status
                .map_or(ThermalStatus::Unknown, |status| {
                    ThermalStatus(status.into())
                }),
            thermal_headroom: hints.reading.headroom.unwrap_or(-1.0),
            hinted: hinted
                .iter()
                .map(|(is, thread)| u32::from(*is) * thread.0)
                .sum(),
            unheard_sources: from.unheard_sources,
            rays: from.rays,
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

    fn budget(list: [f64; 5]) -> Result<Budget, CallError> {
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
        assert_eq!(budget([3.0, 0.0, 0.0, 0.02, 0.5]), Ok(wanted));
    }

    #[test]
    fn levels_and_limits_out_of_range_are_refused() {
        for list in [
            [300.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 2.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0, 0.0],
        ] {
            let error = budget(list).expect_err("out of range");
            assert_eq!(error.status, Status::BadArgument);
        }
        for wrong in [f64::NAN, -1.0, f64::INFINITY] {
            let limited = budget([0.0, 0.0, 0.0, wrong, 0.0]).expect("numbers");
            assert!(limited.check().is_err());
            assert!(budget([wrong, 0.0, 0.0, 0.0, 0.0]).is_err());
        }
    }
}
