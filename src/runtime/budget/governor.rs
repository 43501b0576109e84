//! Feedback control of the quality level, one step an update.
//!
//! Quality goes down as soon as the mean update time exceeds the limit for some updates in a row. It goes up only after
//! a dwell time, and only if the level above is expected to fit with headroom. A step up that is soon reverted doubles
//! the dwell time, which damps oscillation at the limit.

use super::quality_level::{ActiveQuality, LAST_QUALITY_LEVEL, QualityLevel};
use super::{Budget, MAX_UPDATE_SPACING_S, QualityChoice};
use crate::propagation::PropagationSettings;

/// Weight of a new update time in the exponential mean.
const WEIGHT: f64 = 0.25;

/// Cap of a single update time as a multiple of the mean, against outliers.
const OUTLIER: f64 = 3.0;

/// Ratio of mean to limit above which an update counts as overloaded, and overloaded updates in a row that lower
/// quality.
const OVERLOAD_RATIO: f64 = 1.0;
const OVERLOAD_UPDATES: u32 = 3;

/// Fraction of the limit into which the level above has to fit before quality goes up.
const HEADROOM_RATIO: f64 = 0.8;

/// Assumed cost of a level relative to the one before it, until measured.
const FIRST_RATIO: f64 = 0.6;

/// Initial and longest dwell time before quality goes up, in seconds.
const DWELL_S: (f64, f64) = (1.0, 32.0);

/// A step up that is reverted within this time, in seconds, doubles the dwell time.
const REVERT_S: f64 = 3.0;

/// Seconds of a transition from one level to the next; longer transitions are faster.
const TRANSITION_S: f64 = 0.5;

/// Time constant in seconds with which the peak of the mean decays.
const PEAK_DECAY_S: f64 = 4.0;

/// Seconds after a transition before the cost of a level is measured.
const SETTLED_S: f64 = 2.0;

/// Largest step of one update, in levels.
pub(super) const MAX_LEVEL_STEP: f64 = 0.25;

/// Cost of one update.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UpdateCost {
    /// Seconds the update took.
    pub update_s: f64,
    /// Seconds between the starts of the previous update and of this one, on the app's clock.
    pub since_last_s: f64,
    /// Fraction of a core used by sound.
    pub sound_share: f64,
    /// Whether pauses between updates are possible.
    pub may_pause: bool,
}

/// Controls the quality level of one propagator. Reads no clock; propagation side.
#[derive(Debug, Clone)]
pub struct Governor {
    level: u8,
    /// Current position between levels, moving towards `level`.
    position: f64,
    mean_s: Option<f64>,
    /// Decaying peak of the mean; decides whether quality may go up.
    peak_s: f64,
    /// Cost of each level relative to the one before.
    ratios: [f64; LAST_QUALITY_LEVEL as usize],
    overloaded_updates: u32,
    since_change_s: f64,
    /// Whether the last change was up.
    went_up: bool,
    dwell_s: f64,
    /// Level and peak before the last change, compared with the new peak once the transition has settled.
    before: Option<(u8, f64)>,
    pause_s: f64,
}

impl Default for Governor {
    fn default() -> Self {
        Self {
            level: 0,
            position: 0.0,
            mean_s: None,
            peak_s: 0.0,
            ratios: [FIRST_RATIO; LAST_QUALITY_LEVEL as usize],
            overloaded_updates: 0,
            since_change_s: 0.0,
            went_up: false,
            dwell_s: DWELL_S.0,
            before: None,
            pause_s: 0.0,
        }
    }
}

impl Governor {
    /// The level in force, or the target of the transition under way.
    pub fn quality_level(&self) -> QualityLevel {
        QualityLevel(self.level)
    }

    /// The settings in force now.
    pub fn active_quality(
        &self,
        settings: &PropagationSettings,
        max_paths: usize,
    ) -> ActiveQuality {
        ActiveQuality::at(self.position, settings, max_paths)
    }

    /// Seconds to pause before the next update.
    pub fn pause_s(&self) -> f64 {
        self.pause_s
    }

    /// Discards measured update times, for instance after a change of scene; the level stays.
    pub fn reset_costs(&mut self) {
        self.mean_s = None;
        self.peak_s = 0.0;
        self.overloaded_updates = 0;
        self.before = None;
    }

    /// Takes the cost of an update into account and moves the level by one step at most.
    pub fn observe(&mut self, budget: &Budget, spent: &UpdateCost) {
        let passed_s = spent.since_last_s.clamp(0.0, 1.0);
        self.since_change_s += passed_s;
        let mean_s = match self.mean_s {
            Some(mean_s) => {
                let update_s = spent.update_s.min(OUTLIER * mean_s);
                mean_s + WEIGHT * (update_s - mean_s)
            }
            None => spent.update_s,
        };
        self.mean_s = Some(mean_s);
        self.peak_s = mean_s.max(self.peak_s * (-passed_s / PEAK_DECAY_S).exp());
        let limit_s = self.limit(budget, spent, mean_s);
        match budget.quality {
            QualityChoice::Exactly(level) => self.change(level.0.min(LAST_QUALITY_LEVEL)),
            QualityChoice::Free => self.choose(limit_s, mean_s, 0),
            QualityChoice::AtLeast(level) => {
                self.choose(limit_s, mean_s, level.0.min(LAST_QUALITY_LEVEL))
            }
        }
        let distance = f64::from(self.level) - self.position;
        if distance != 0.0 {
            let step = (passed_s / TRANSITION_S * distance.abs().max(1.0)).min(MAX_LEVEL_STEP);
            self.position += distance.clamp(-step, step);
            self.peak_s = mean_s;
        }
    }

    /// Longest update in seconds within the budget; also sets the pause.
    fn limit(&mut self, budget: &Budget, spent: &UpdateCost, mean_s: f64) -> f64 {
        let mut limit_s = budget.update_s.unwrap_or(f64::INFINITY);
        self.pause_s = 0.0;
        if let Some(core_share) = budget.core_share {
            // Sound comes first; propagation gets the remainder, a tenth of the share at least.
            let share = (core_share - spent.sound_share).clamp(0.1 * core_share, 1.0);
            limit_s = limit_s.min(share * MAX_UPDATE_SPACING_S);
            if spent.may_pause && share < 1.0 {
                let rest_s = spent.update_s.max(mean_s) * (1.0 / share - 1.0);
                self.pause_s = rest_s.min(MAX_UPDATE_SPACING_S);
            }
        }
        limit_s
    }

    fn choose(&mut self, limit_s: f64, mean_s: f64, least: u8) {
        if self.level < least {
            self.change(least);
            return;
        }
        self.update_cost_ratio();
        let gliding = self.position != f64::from(self.level);
        self.overloaded_updates = if mean_s > OVERLOAD_RATIO * limit_s {
            self.overloaded_updates + 1
        } else {
            0
        };
        if self.overloaded_updates >= OVERLOAD_UPDATES && self.level < LAST_QUALITY_LEVEL {
            // During a transition down, wait for its effect unless the expected cost is still too high.
            let on_its_way = f64::from(self.level) - self.position;
            let expected_s = mean_s * self.mean_ratio().powf(on_its_way.max(0.0));
            if expected_s > OVERLOAD_RATIO * limit_s {
                if self.went_up && self.since_change_s < REVERT_S + TRANSITION_S {
                    self.dwell_s = (2.0 * self.dwell_s).min(DWELL_S.1);
                }
                self.before = (!gliding).then_some((self.level, self.peak_s));
                self.change(self.level + 1);
            }
            return;
        }
        let above = self.level.saturating_sub(1).max(least);
        if above == self.level || gliding || self.since_change_s < self.dwell_s {
            return;
        }
        let expected_s = self.peak_s / self.ratios[usize::from(above)];
        if expected_s < HEADROOM_RATIO * limit_s {
            self.before = Some((self.level, self.peak_s));
            self.change(above);
            self.went_up = true;
        } else if self.since_change_s > 2.0 * DWELL_S.1 {
            self.dwell_s = DWELL_S.0;
        }
    }

    fn mean_ratio(&self) -> f64 {
        self.ratios
            .iter()
            .product::<f64>()
            .powf(1.0 / f64::from(LAST_QUALITY_LEVEL))
    }

    /// Updates the cost ratio of the last step once the transition has settled.
    fn update_cost_ratio(&mut self) {
        let still = self.position == f64::from(self.level);
        let settled = still && self.since_change_s > TRANSITION_S + SETTLED_S;
        let Some((from, before_s)) = self.before.filter(|_| settled) else {
            return;
        };
        self.before = None;
        let ratio = match self.level.checked_sub(from) {
            Some(1) => self.peak_s / before_s,
            Some(_) => return,
            None => before_s / self.peak_s,
        };
        let step = usize::from(self.level.min(from));
        if ratio.is_finite() {
            self.ratios[step] = 0.5 * (self.ratios[step] + ratio.clamp(0.3, 0.95));
        }
    }

    fn change(&mut self, level: u8) {
        if level != self.level {
            self.level = level;
            self.since_change_s = 0.0;
            self.overloaded_updates = 0;
            self.went_up = false;
        }
    }
}

#[cfg(test)]
#[path = "governor_tests.rs"]
mod tests;
