//! The governor on a virtual clock with a cost model of updates.

use super::*;
use crate::propagation::PropagationQuality;

const PATHS: usize = 2048;

fn settings() -> PropagationSettings {
    PropagationSettings::default()
}

/// Cost model: seconds of an update at a quality. A tenth of the work does not depend on it.
fn cost_s(full_s: f64, quality: &PropagationQuality) -> f64 {
    let full = PropagationQuality::full(&settings());
    let rays = f64::from(quality.guide_rays) / f64::from(full.guide_rays);
    let depth = (quality.depth as f64 + 1.0) / (full.depth as f64 + 1.0);
    full_s * (0.1 + 0.6 * rays * depth + 0.3 / quality.late_interval as f64 * rays)
}

struct Simulation {
    governor: Governor,
    budget: Budget,
    time_s: f64,
    busy_s: f64,
    changes: u32,
    sound_share: f64,
}

impl Simulation {
    fn new(budget: Budget) -> Self {
        budget.check().expect("in range");
        Self {
            governor: Governor::default(),
            budget,
            time_s: 0.0,
            busy_s: 0.0,
            changes: 0,
            sound_share: 0.0,
        }
    }

    /// Runs updates for some seconds; an update takes `full_s` at full quality.
    fn run(&mut self, seconds: f64, full_s: impl Fn(f64) -> f64) {
        let end_s = self.time_s + seconds;
        let mut last_s = self.time_s;
        while self.time_s < end_s {
            let since_last_s = self.time_s - last_s;
            last_s = self.time_s;
            let quality = self.governor.active_quality(&settings(), PATHS);
            let update_s = cost_s(full_s(self.time_s), &quality.propagation);
            let before = self.governor.clone();
            let spent = UpdateCost {
                update_s,
                since_last_s,
                sound_share: self.sound_share,
                may_pause: true,
            };
            self.governor.observe(&self.budget, &spent);
            assert!((self.governor.position - before.position).abs() <= MAX_LEVEL_STEP + 1e-12);
            self.changes += u32::from(self.governor.quality_level() != before.quality_level());
            self.time_s += update_s + self.governor.pause_s();
            self.busy_s += update_s;
        }
    }

    fn update_s(&self, full_s: f64) -> f64 {
        cost_s(
            full_s,
            &self.governor.active_quality(&settings(), PATHS).propagation,
        )
    }
}

fn within(update_s: f64) -> Budget {
    Budget {
        update_s: Some(update_s),
        ..Budget::default()
    }
}

#[test]
fn quality_is_full_without_a_limit() {
    let mut simulation = Simulation::new(Budget::default());
    simulation.run(10.0, |_| 0.5);
    assert_eq!(
        (
            simulation.governor.quality_level(),
            simulation.governor.pause_s()
        ),
        (QualityLevel(0), 0.0)
    );
    assert_eq!(simulation.changes, 0);
}

#[test]
fn quality_falls_under_overload_and_recovers() {
    let mut simulation = Simulation::new(within(0.010));
    simulation.run(5.0, |_| 0.008);
    assert_eq!(simulation.governor.quality_level(), QualityLevel(0));
    simulation.run(5.0, |_| 0.030);
    assert!(
        simulation.update_s(0.030) <= 0.010,
        "{:?}",
        simulation.governor
    );
    let low = simulation.governor.quality_level();
    assert!(low > QualityLevel(0));
    simulation.run(60.0, |_| 0.004);
    assert_eq!(simulation.governor.quality_level(), QualityLevel(0));
}

#[test]
fn quality_follows_a_load_step_within_two_seconds() {
    let mut simulation = Simulation::new(within(0.010));
    simulation.run(3.0, |_| 0.009);
    simulation.run(2.0, |_| 0.045);
    assert!(
        simulation.update_s(0.045) <= 0.010,
        "{:?}",
        simulation.governor
    );
}

#[test]
fn occasional_slow_updates_change_nothing() {
    let mut simulation = Simulation::new(within(0.010));
    simulation.run(60.0, |time_s| {
        if (time_s + 0.5) % 1.0 < 0.006 {
            0.5
        } else {
            0.005
        }
    });
    assert_eq!(
        (simulation.governor.quality_level(), simulation.changes),
        (QualityLevel(0), 0)
    );
}

#[test]
fn an_unattainable_limit_ends_at_the_last_level() {
    let mut simulation = Simulation::new(within(0.001));
    simulation.run(10.0, |_| 1.0);
    let changes = simulation.changes;
    assert_eq!(
        simulation.governor.quality_level(),
        QualityLevel(LAST_QUALITY_LEVEL)
    );
    simulation.run(60.0, |_| 1.0);
    assert_eq!(simulation.changes, changes);
}

/// At every load one level is kept: failed steps up become rare.
#[test]
fn a_load_at_the_limit_does_not_make_the_level_oscillate() {
    for tenths in 10..80 {
        let full_s = 0.001 * f64::from(tenths);
        let mut simulation = Simulation::new(within(0.010));
        simulation.run(60.0, |_| full_s);
        simulation.changes = 0;
        simulation.run(60.0, |time_s| full_s * (1.0 + 0.15 * (7.0 * time_s).sin()));
        assert!(
            simulation.changes <= 6,
            "{} changes in a minute at {full_s}",
            simulation.changes
        );
    }
}

#[test]
fn a_core_share_is_kept_by_pauses_before_quality_falls() {
    let share = |core_share: f64| Budget {
        core_share: Some(core_share),
        ..Budget::default()
    };
    let mut simulation = Simulation::new(share(0.5));
    simulation.sound_share = 0.1;
    simulation.run(10.0, |_| 0.010);
    assert_eq!(simulation.governor.quality_level(), QualityLevel(0));
    let used = simulation.busy_s / simulation.time_s;
    assert!((0.36..=0.41).contains(&used), "{used}");
    // 120 ms at full detail in a fifth of a core: an update may take 20 ms.
    let mut simulation = Simulation::new(share(0.2));
    simulation.run(20.0, |_| 0.120);
    assert!(simulation.governor.quality_level() > QualityLevel(0));
    (simulation.busy_s, simulation.time_s) = (0.0, 0.0);
    simulation.run(20.0, |_| 0.120);
    let used = simulation.busy_s / simulation.time_s;
    assert!(used <= 0.21, "{used}");
}

#[test]
fn quality_levels_can_be_forced_and_freed() {
    let mut simulation = Simulation::new(within(0.010));
    simulation.budget.quality = QualityChoice::Exactly(QualityLevel(3));
    simulation.run(4.0, |_| 0.001);
    assert_eq!(simulation.governor.quality_level(), QualityLevel(3));
    assert_eq!(simulation.governor.position, 3.0);
    simulation.budget.quality = QualityChoice::AtLeast(QualityLevel(1));
    simulation.run(60.0, |_| 0.001);
    assert_eq!(simulation.governor.quality_level(), QualityLevel(1));
    simulation.run(5.0, |_| 0.060);
    assert!(simulation.governor.quality_level() > QualityLevel(1));
    simulation.budget.quality = QualityChoice::Free;
    simulation.run(120.0, |_| 0.001);
    assert_eq!(simulation.governor.quality_level(), QualityLevel(0));
}

#[test]
fn equal_times_have_equal_levels() {
    let run = || {
        let mut simulation = Simulation::new(within(0.010));
        simulation.run(30.0, |time_s| 0.02 + 0.015 * time_s.sin());
        (simulation.governor.position.to_bits(), simulation.changes)
    };
    assert_eq!(run(), run());
}

#[test]
fn limits_out_of_range_are_refused_by_name() {
    let wrong = [
        (
            Budget {
                update_s: Some(0.0),
                ..Budget::default()
            },
            "update_s",
        ),
        (
            Budget {
                update_s: Some(f64::NAN),
                ..Budget::default()
            },
            "update_s",
        ),
        (
            Budget {
                core_share: Some(3.0),
                ..Budget::default()
            },
            "core_share",
        ),
        (
            Budget {
                quality: QualityChoice::Exactly(QualityLevel(LAST_QUALITY_LEVEL + 1)),
                ..Budget::default()
            },
            "quality",
        ),
    ];
    for (budget, name) in wrong {
        let error = budget.check().expect_err("refused").to_string();
        assert!(error.starts_with(name), "{error}");
    }
}
