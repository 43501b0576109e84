//! An update that the caller interrupts leaves its result as it was and later updates right.

#![expect(
    clippy::disallowed_methods,
    reason = "the test waits for the propagation thread"
)]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use foresound::glam::Vec3;
use foresound::propagation::{Path, PathSet, PropagationSettings, Propagator, Serial, Workers};
use foresound::runtime::{
    AffinityPolicy, Engine, EngineSettings, FrameTime, VirtualClock, VirtualEngine,
};
use foresound::scene::procedural;
use foresound::{ListenerPose, MaterialTable, Result, Scene, SceneSettings, SourceId, SourcePose};

/// Updates until all ray rotations are cast.
const ROTATIONS: usize = 20;

/// One thread that is interrupted after some jobs.
struct Interrupted {
    jobs: AtomicUsize,
    most: usize,
}

impl Workers for Interrupted {
    fn count(&self) -> usize {
        1
    }

    fn for_both<A: Send, B: Send, S: Send>(
        &self,
        items: (&mut [A], &mut [B]),
        scratch: &mut [S],
        first: impl Fn(usize, &mut A, &mut S) + Sync,
        second: impl Fn(usize, &mut B, &mut S) + Sync,
    ) {
        let counted = || self.jobs.fetch_add(1, Ordering::Relaxed);
        let first = |index, item: &mut A, own: &mut S| {
            first(index, item, own);
            counted();
        };
        let second = |index, item: &mut B, own: &mut S| {
            second(index, item, own);
            counted();
        };
        Serial.for_both(items, scratch, first, second);
    }

    fn is_interrupted(&self) -> bool {
        self.jobs.load(Ordering::Relaxed) >= self.most
    }
}

/// What a game hears of paths.
fn heard(paths: &[Path]) -> Vec<(u64, [u32; 8])> {
    let bits = |path: &Path| (path.id.0, path.amplitude.map(f32::to_bits));
    paths.iter().map(bits).collect()
}

#[test]
fn an_interrupted_update_changes_no_result() -> Result<()> {
    let benchmark = procedural::by_name("doorway").expect("a scene");
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&benchmark.mesh, &table, &SceneSettings::default())?;
    let mut propagator = Propagator::new(Arc::new(scene), PropagationSettings::default())?;
    let sources: Vec<SourcePose> = (0..)
        .zip(&benchmark.sources)
        .map(|(slot, (_, at))| SourcePose::at(SourceId::new(slot, 0), *at))
        .collect();
    let here = ListenerPose::facing(benchmark.walk.standing, 0.0);
    let there = ListenerPose::facing(benchmark.walk.standing + 0.3 * Vec3::X, 0.0);
    let mut result = PathSet::default();
    for _ in 0..ROTATIONS {
        propagator.update(&here, &sources, 0.0, &mut result);
    }
    let expected = heard(&result.paths);
    assert!(expected.len() > 20, "{} paths", expected.len());
    let mut interrupted = 0;
    for most in 0..200 {
        let workers = Interrupted {
            jobs: AtomicUsize::new(0),
            most,
        };
        propagator.update_with(&workers, &there, &sources, 0.1, &mut result);
        if !workers.is_interrupted() {
            break;
        }
        interrupted += 1;
        assert_eq!(
            heard(&result.paths),
            expected,
            "the result, after {most} jobs"
        );
        let mut after = PathSet::default();
        propagator.update(&here, &sources, 0.2, &mut after);
        assert_eq!(
            heard(&after.paths),
            expected,
            "the update after {most} jobs"
        );
    }
    assert!(interrupted > 10, "{interrupted} places of interruption");
    Ok(())
}

/// Whether updates wait, whether one does, its number, and how often an update of that number has begun.
static HOLD: AtomicBool = AtomicBool::new(false);
static IS_HELD: AtomicBool = AtomicBool::new(false);
static HELD: AtomicU64 = AtomicU64::new(u64::MAX);
static BEGINS: AtomicUsize = AtomicUsize::new(0);

fn hold_on_request(update: u64) {
    if HOLD.load(Ordering::Acquire) {
        HELD.store(update, Ordering::Release);
        IS_HELD.store(true, Ordering::Release);
    }
    let is_held = HELD.load(Ordering::Acquire) == update;
    BEGINS.fetch_add(usize::from(is_held), Ordering::AcqRel);
    while HOLD.load(Ordering::Acquire) {
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_jump_ends_the_update_under_way() -> Result<()> {
    let mut settings = EngineSettings::default();
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(0.01);
    settings.before_update = Some(hold_on_request);
    let (mut controller, mut renderer) = Engine::new(settings)?;
    let mesh = procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "brick");
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&mesh, &table, &SceneSettings::default())?;
    let middle = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    controller.set_scene(Arc::new(scene))?;
    controller.add_source(middle)?;
    let mut block = [0.0; 882];
    let mut tick = |x: f32| -> Result<u64> {
        controller.tick(ListenerPose::facing(middle + x * Vec3::X, 0.0), &[])?;
        renderer.render(&mut block);
        thread::sleep(Duration::from_millis(1));
        Ok(controller.statistics().updates)
    };
    while tick(-1.5)? < 4 {}
    HOLD.store(true, Ordering::Release);
    while !IS_HELD.load(Ordering::Acquire) {
        tick(-1.5)?;
    }
    let before = tick(-1.5)?;
    tick(1.5)?;
    HOLD.store(false, Ordering::Release);
    while tick(1.5)? < before + 2 {}
    // Its number is that of the first update for the new place.
    assert_eq!(BEGINS.load(Ordering::Acquire), 2);
    Ok(())
}

/// An update that lengthens a source's delay line is dropped like others.
#[test]
fn a_jump_drops_an_update_that_lengthens_a_delay_line() -> Result<()> {
    let mut engine =
        VirtualEngine::new(EngineSettings::default(), VirtualClock::at_level(60.0, 12))?;
    let mesh = procedural::shoebox(Vec3::new(150.0, 10.0, 20.0), "brick");
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&mesh, &table, &SceneSettings::default())?;
    let middle = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    engine.controller().set_scene(Arc::new(scene))?;
    engine.controller().add_source(middle - 60.0 * Vec3::X)?;
    let tick = |engine: &mut VirtualEngine, x: f32| -> Result<u64> {
        engine.tick(ListenerPose::facing(middle + x * Vec3::X, 0.0), &[])?;
        while engine.next_block().is_some() {}
        Ok(engine.controller().statistics().updates)
    };
    // When an update arrives the next one begins: after the second loop the first one with the far source, 0.35 s away.
    while tick(&mut engine, -60.0)? < 3 {}
    engine.controller().add_source(middle + 60.0 * Vec3::X)?;
    while tick(&mut engine, -60.0)? < 4 {}
    assert_eq!(tick(&mut engine, -60.0)?, 4);
    // Late energy at the new place takes two graphics frames, the rest of the update under way eleven.
    let mut frames = 1;
    while tick(&mut engine, -55.0)? < 5 {
        frames += 1;
    }
    assert!(frames <= 4, "{frames} graphics frames");
    Ok(())
}
