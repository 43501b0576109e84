//! Chooses the tier, update by update.
//!
//! Down at once where an update takes too long for some time, up only when the tier above would fit with room to spare
//! and after a while; a step up that has to be taken back makes the next wait longer. So a load at the edge does not
//! make the detail swing.

use super::quality_level::{ActiveQuality, LAST_QUALITY_LEVEL, QualityLevel};
use super::{Budget, MAX_UPDATE_SPACING_S, QualityChoice};
use crate::propagation::PropagationSettings;

/// Share of a new time in the mean.
const WEIGHT: f64 = 0.25;

/// Most that a single time counts for, in means: an update that was held up once says nothing.
const OUTLIER: f64 = 3.0;

/// Mean over limit above which detail goes down, and updates in a row for which it has to be so.
const OVERLOAD_RATIO: f64 = 1.0;
const OVERLOAD_UPDATES: u32 = 3;

/// Share of the limit that the tier above has to fit into before detail goes up.
const HEADROOM_RATIO: f64 = 0.8;

/// What a tier costs of the one before it, until it has been measured.
const FIRST_RATIO: f64 = 0.6;

/// Seconds that a tier lasts at least before detail goes up, at first and at most.
const DWELL_S: (f64, f64) = (1.0, 32.0);

/// Seconds within which a step up that is taken back was a mistake.
const REVERT_S: f64 = 3.0;

/// Seconds that a glide from one tier to the next takes; farther ones are faster.
const TRANSITION_S: f64 = 0.5;

/// Seconds in which the highest mean is forgotten, to 1/e.
const PEAK_DECAY_S: f64 = 4.0;

/// Seconds after a glide until a tier's cost is known.
const SETTLED_S: f64 = 2.0;

/// Farthest that one update moves between tiers.
pub(super) const MAX_LEVEL_STEP: f64 = 0.25;

/// What an update has taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UpdateCost {
    /// Seconds the update took.
    pub update_s: f64,
    /// Seconds since the update before began, on the app's clock.
    pub since_last_s: f64,
    /// Share of a core that sound takes.
    pub sound_share: f64,
    /// Whether updates may be spaced out.
    pub may_pause: bool,
}

/// Chooses the tier. One for each propagation; control side.
#[derive(Debug, Clone)]
pub struct Governor {
    level: u8,
    /// Where detail is on its way to the tier.
    position: f64,
    mean_s: Option<f64>,
    /// The highest mean lately: what decides whether there is room.
    peak_s: f64,
    /// Cost of each tier over that of the one before.
    ratios: [f64; LAST_QUALITY_LEVEL as usize],
    overloaded_updates: u32,
    since_change_s: f64,
    /// Whether the last change was up.
    went_up: bool,
    dwell_s: f64,
    /// Tier and peak before the last change, to be compared with once that is settled.
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
    /// The tier in force, or on its way to be.
    pub fn quality_level(&self) -> QualityLevel {
        QualityLevel(self.level)
    }

    /// What is in force now.
    pub fn active_quality(&self, settings: &PropagationSettings, max_paths: usize) -> ActiveQuality {
        ActiveQuality::at(self.position, settings, max_paths)
    }

    /// Seconds to wait before the next update.
    pub fn pause_s(&self) -> f64 {
        self.pause_s
    }

    /// Forgets what updates took, for another scene takes other times; the tier stays.
    pub fn reset_costs(&mut self) {
        self.mean_s = None;
        self.peak_s = 0.0;
        self.overloaded_updates = 0;
        self.before = None;
    }

    /// Takes notice of an update.
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
            QualityChoice::Exactly(tier) => self.change(tier.0.min(LAST_QUALITY_LEVEL)),
            QualityChoice::Free => self.choose(limit_s, mean_s, 0),
            QualityChoice::AtLeast(tier) => {
                self.choose(limit_s, mean_s, tier.0.min(LAST_QUALITY_LEVEL))
            }
        }
        let way = f64::from(self.level) - self.position;
        if way != 0.0 {
            let step = (passed_s / TRANSITION_S * way.abs().max(1.0)).min(MAX_LEVEL_STEP);
            self.position += way.clamp(-step, step);
            self.peak_s = mean_s;
        }
    }

    /// Seconds that an update may take; sets the rest besides.
    fn limit(&mut self, budget: &Budget, spent: &UpdateCost, mean_s: f64) -> f64 {
        let mut limit_s = budget.update_s.unwrap_or(f64::INFINITY);
        self.pause_s = 0.0;
        if let Some(core_share) = budget.core_share {
            // Sound cannot be put off: what is left of the share is propagation's, and something always is.
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
            // On its way down already, it waits for what that brings, unless that cannot be enough.
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

    /// Learns what the last step was worth once it is settled.
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

    fn change(&mut self, tier: u8) {
        if tier != self.level {
            self.level = tier;
            self.since_change_s = 0.0;
            self.overloaded_updates = 0;
            self.went_up = false;
        }
    }
}

#[cfg(test)]
#[path = "governor_tests.rs"]
mod tests;
