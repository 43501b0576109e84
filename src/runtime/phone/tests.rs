//! Device hints on a scripted phone.

use super::fake::{Phone, phone, symbols};
use super::*;
use crate::runtime::budget::{Budget, LAST_QUALITY_LEVEL, QualityChoice, QualityLevel};

fn hints(level: u32) -> DeviceHints {
    phone(|p| *p = Phone::default());
    DeviceHints::new(DeviceHintsSettings {
        symbols: symbols(level),
        ..DeviceHintsSettings::default()
    })
}

fn least(hints: &mut DeviceHints, time_s: f64) -> u8 {
    match hints.limit_budget(Budget::default(), time_s).quality {
        QualityChoice::AtLeast(level) => level.0,
        QualityChoice::Free => 0,
        QualityChoice::Exactly(level) => panic!("{level:?} was not requested"),
    }
}

#[test]
fn an_old_system_has_no_functions() {
    assert!(symbols(29).thermal.is_none() && symbols(29).hints.is_none());
    let no_headroom = symbols(30).thermal.expect("is there");
    assert!(no_headroom.headroom.is_none() && symbols(30).hints.is_none());
    assert!(symbols(32).thermal.is_some_and(|t| t.headroom.is_some()));
    assert!(symbols(33).hints.is_some());
    // This host has no functions: hints have no effect.
    let mut here = DeviceHints::new(DeviceHintsSettings::default());
    let budget = Budget::default();
    assert_eq!(here.limit_budget(budget, 0.0), budget);
    here.report_update(0.01, &budget);
    assert_eq!(here.report(), DeviceHintsReport::default());
}

#[test]
fn quality_falls_before_throttling_and_recovers_slowly() {
    let mut hints = hints(31);
    let mut heat = |headroom: f32, time_s: f64| {
        phone(|p| p.headroom = headroom);
        least(&mut hints, time_s)
    };
    assert_eq!(heat(0.5, 0.0), 0);
    assert_eq!(heat(0.86, 1.0), 1);
    assert_eq!(heat(0.93, 2.0), 2);
    assert_eq!(heat(0.98, 3.0), 3);
    assert_eq!(heat(1.2, 4.0), 4);
    // One step back in ten seconds, and none within the hysteresis of a limit.
    assert_eq!(heat(0.5, 13.0), 4);
    assert_eq!(heat(0.5, 14.0), 3);
    assert_eq!(heat(0.5, 20.0), 3);
    assert_eq!(heat(0.5, 24.0), 2);
    assert_eq!(heat(0.9, 34.0), 2);
    assert_eq!(heat(0.86, 44.0), 1);
    assert_eq!(heat(0.82, 54.0), 1);
    assert_eq!(heat(0.5, 64.0), 0);
    let reads = phone(|p| p.reads);
    assert_eq!(reads, 13);
    drop(hints);
    assert_eq!(phone(|p| p.managers), 0);
}

#[test]
fn a_headroom_at_a_limit_does_not_oscillate() {
    let mut policy = ThermalPolicy::default();
    let mut changes = 0;
    for second in 0..600u32 {
        let before = policy.quality_level();
        let headroom = Some(0.92 + 0.02 * (f64::from(second) * 0.7).sin() as f32);
        let reading = ThermalReading {
            headroom,
            ..ThermalReading::default()
        };
        policy.observe(second.into(), reading);
        changes += u32::from(policy.quality_level() != before);
    }
    // At the first reading, and not afterwards.
    assert_eq!((changes, policy.quality_level()), (1, QualityLevel(2)));
}

#[test]
fn nan_headroom_is_ignored_and_the_status_suffices() {
    let mut hints = hints(31);
    let mut heat = |headroom: f32, status: i32, time_s: f64| {
        phone(|p| (p.headroom, p.status) = (headroom, status));
        least(&mut hints, time_s)
    };
    assert_eq!(heat(f32::NAN, 0, 0.0), 0);
    assert_eq!(heat(f32::NAN, -1, 1.0), 0);
    assert_eq!(heat(f32::NAN, 2, 2.0), 2);
    assert_eq!(heat(f32::NAN, 3, 3.0), 4);
    assert_eq!(heat(f32::INFINITY, 6, 4.0), LAST_QUALITY_LEVEL);
    // The last number expires after half a minute.
    let mut policy = ThermalPolicy::default();
    let mut see = |headroom, time_s| {
        let status = None;
        policy.observe(time_s, ThermalReading { headroom, status });
        policy.quality_level().0
    };
    assert_eq!(see(Some(0.95), 0.0), 2);
    assert_eq!(see(None, 29.0), 2);
    assert_eq!(see(None, 31.0), 1);
    assert_eq!(see(None, 41.0), 0);
}

#[test]
fn the_system_is_read_once_a_second() {
    let mut hints = hints(31);
    for update in 0..1000 {
        least(&mut hints, 0.01 * f64::from(update));
    }
    assert_eq!(phone(|p| p.reads), 10);
}

#[test]
fn heat_limits_a_budget_but_not_a_fixed_level() {
    let mut hints = hints(31);
    phone(|p| p.headroom = 0.93);
    let mut within_limit = |quality| {
        let budget = Budget {
            update_s: Some(0.02),
            quality,
            ..Budget::default()
        };
        let after = hints.limit_budget(budget, 0.0);
        assert_eq!(after.update_s, Some(0.02));
        after.quality
    };
    assert_eq!(
        within_limit(QualityChoice::Free),
        QualityChoice::AtLeast(QualityLevel(2))
    );
    let (one, four) = (QualityLevel(1), QualityLevel(4));
    assert_eq!(
        within_limit(QualityChoice::AtLeast(one)),
        QualityChoice::AtLeast(QualityLevel(2))
    );
    assert_eq!(
        within_limit(QualityChoice::AtLeast(four)),
        QualityChoice::AtLeast(four)
    );
    assert_eq!(
        within_limit(QualityChoice::Exactly(one)),
        QualityChoice::Exactly(one)
    );
}

#[test]
fn updates_and_blocks_are_reported_with_their_targets() {
    let mut hints = hints(33);
    let free = Budget::default();
    let limited = Budget {
        update_s: Some(0.01),
        ..free
    };
    hints.report_update(0.005, &free);
    hints.report_update(0.006, &free);
    hints.report_update(0.007, &limited);
    // Without a sound thread nothing is reported.
    hints.report_sound(SoundLoad::default(), 0.0);
    assert!(hints.is_sound_report_due(0.0));
    let load = SoundLoad {
        thread: 77,
        block_s: 0.001,
        duration_s: 0.005,
    };
    hints.report_sound(load, 1.0);
    assert!(!hints.is_sound_report_due(1.04) && hints.is_sound_report_due(1.06));
    let report = hints.report();
    assert!(report.hints_propagation && report.hints_sound);
    let seen = phone(|p| p.clone());
    assert_eq!(seen.sessions, 2);
    assert_eq!(seen.threads, [this_thread(), 77]);
    assert_eq!(seen.targets_ns, [33_333_333, 10_000_000, 2_500_000]);
    assert_eq!(
        seen.reports_ns,
        [5_000_000, 6_000_000, 7_000_000, 1_000_000]
    );
    // Another thread has another session.
    hints.reset_thread();
    hints.report_update(0.005, &free);
    let other = SoundLoad { thread: 78, ..load };
    hints.report_sound(other, 2.0);
    let seen = phone(|p| p.clone());
    assert_eq!((seen.sessions, seen.threads.len()), (2, 4));
    assert_eq!(seen.threads[3], 78);
    drop(hints);
    assert_eq!(phone(|p| p.sessions), 0);
}

#[test]
fn a_refusing_session_is_closed_for_good() {
    let mut hints = hints(33);
    phone(|p| p.refuses = true);
    let budget = Budget::default();
    for _ in 0..3 {
        hints.report_update(0.005, &budget);
        hints.reset_thread();
    }
    let seen = phone(|p| p.clone());
    assert_eq!((seen.sessions, seen.reports_ns.len()), (0, 1));
    assert!(!hints.report().hints_propagation);
}

#[test]
fn reported_times_are_clamped_to_the_systems_range() {
    let mut hints = hints(33);
    for elapsed_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        hints.report_update(elapsed_s, &Budget::default());
    }
    let reported = phone(|p| p.reports_ns.clone());
    assert_eq!(reported, [1_000, 1_000, 1_000, 10_000_000_000]);
}

#[test]
fn a_phone_without_managers_and_hints_turned_off_do_nothing() {
    phone(|p| {
        *p = Phone {
            has_no_manager: true,
            ..Phone::default()
        }
    });
    let settings = DeviceHintsSettings {
        symbols: symbols(33),
        ..DeviceHintsSettings::default()
    };
    let off = DeviceHintsSettings {
        thermal: false,
        hints: false,
        ..settings
    };
    for settings in [settings, off] {
        let mut hints = DeviceHints::new(settings);
        assert_eq!(least(&mut hints, 0.0), 0);
        hints.report_update(0.005, &Budget::default());
        assert_eq!(hints.report(), DeviceHintsReport::default());
        phone(|p| {
            *p = Phone {
                headroom: 2.0,
                ..Phone::default()
            }
        });
    }
    assert_eq!(phone(|p| (p.reads, p.sessions)), (0, 0));
}
