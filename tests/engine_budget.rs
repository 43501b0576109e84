//! Forced quality levels, more sources than slots, and traces. On a virtual clock: the frame time is fixed and propagation
//! runs within each tick.

use std::sync::Arc;

use foresound::generation::GeneratorSettings;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::runtime::budget::{LAST_QUALITY_LEVEL, QUALITY_LEVELS};
use foresound::runtime::trace::{SpanKind, Track};
use foresound::runtime::{
    AffinityPolicy, Budget, Controller, Engine, EngineSchedule, EngineSettings, FrameTime,
    QualityChoice, QualityLevel, Renderer, TraceLog,
};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};
use glam::Vec3;

/// Audio frames of a graphics frame of 10 ms.
const AUDIO_FRAMES: usize = 441;

fn settings(slots: usize) -> EngineSettings {
    let mut settings = EngineSettings::default();
    settings.generation = GeneratorSettings::default();
    settings.generation.max_sources = slots;
    settings.propagation.guide_rays = 256;
    settings.propagation.source_rays = 32;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(0.01);
    settings
}

fn room() -> (Arc<Scene>, Vec3) {
    let mesh = procedural::shoebox(Vec3::new(9.0, 4.0, 7.0), "acoustic_ceiling");
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("a room");
    let middle = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
    (Arc::new(scene), middle)
}

/// Angle from one sample of [`hum`] to the next.
const HUM_TURN: f32 = std::f32::consts::TAU * 70.0 / 4410.0;

/// A seamless loop of a 700 Hz sine.
fn hum(gain: f32) -> Arc<[f32]> {
    (0..4410)
        .map(|n| gain * (n as f32 * HUM_TURN).sin())
        .collect()
}

/// Ticks and renders; returns the peak and the largest part of the second differences that a [`hum`] does not have, whatever its level
/// and phase: a step is its own.
fn run(
    controller: &mut Controller,
    renderer: &mut Renderer,
    at: Vec3,
    frames: usize,
    last: &mut [f32; 2],
) -> [f32; 2] {
    let mut block = [0.0; 2 * AUDIO_FRAMES];
    let mut largest = [0.0f32; 2];
    let hum_factor = 2.0 * HUM_TURN.cos();
    for _ in 0..frames {
        let listener = ListenerPose::facing(at, 0.3);
        controller.tick(listener, &[]).expect("a good pose");
        renderer.render(&mut block);
        for sample in block.iter().step_by(2) {
            let difference = sample - hum_factor * last[1] + last[0];
            largest = [
                largest[0].max(sample.abs()),
                largest[1].max(difference.abs()),
            ];
            *last = [last[1], *sample];
        }
    }
    largest
}

#[test]
fn forced_quality_levels_drop_paths_without_a_click() {
    let (mut controller, mut renderer) = Engine::new(settings(1)).expect("an engine");
    let (scene, at) = room();
    controller.set_scene(scene).expect("accepted");
    let id = controller
        .add_source(at + Vec3::new(2.0, 0.3, 1.0))
        .expect("a slot");
    controller.play(id, hum(0.2), true).expect("is there");
    let mut last = [0.0; 2];
    run(&mut controller, &mut renderer, at, 100, &mut last);
    let steady = run(&mut controller, &mut renderer, at, 100, &mut last);
    let paths = controller.statistics().paths;
    assert!(paths > 60, "{paths}");
    for level in [LAST_QUALITY_LEVEL, 2, 4, 0] {
        let mut budget = Budget::default();
        budget.quality = QualityChoice::Exactly(QualityLevel(level));
        controller.set_budget(budget).expect("in range");
        // Two seconds: half a second for the transition and half a second for the path cache.
        let moving = run(&mut controller, &mut renderer, at, 200, &mut last);
        let statistics = controller.statistics();
        assert_eq!(statistics.quality_level, QualityLevel(level));
        // In a rectangular room half of the rays find all paths; fewer orders do not.
        match QUALITY_LEVELS[usize::from(level)].skipped_orders {
            0 => assert_eq!(statistics.paths, paths),
            _ => assert!(statistics.paths < paths, "{} paths", statistics.paths),
        }
        // Fewer paths may be louder. A step of a third of a hundredth of the sound is none that is heard.
        let (step, before) = (moving[1] / moving[0], steady[1] / steady[0]);
        assert!(
            step < 3e-3,
            "a step of {step} of the peak to level {level}, {before} before"
        );
    }
}

#[test]
fn a_budget_out_of_range_is_refused_and_the_old_one_kept() {
    let (mut controller, _renderer) = Engine::new(settings(1)).expect("an engine");
    let mut wrong = Budget::default();
    wrong.update_s = Some(-1.0);
    assert!(controller.set_budget(wrong).is_err());
    assert_eq!(controller.settings().budget, Budget::default());
    let engine = Engine::new({
        let mut settings = settings(1);
        settings.budget = wrong;
        settings
    });
    assert!(engine.is_err());
}

/// An app with many sources that circle around their first positions.
struct Crowd {
    controller: Controller,
    renderer: Renderer,
    here: Vec<SourceId>,
    middle: Vec3,
}

impl Crowd {
    fn new(sources: usize, slots: usize) -> Self {
        let mut settings = settings(slots);
        settings.max_sources = Some(sources);
        let (mut controller, renderer) = Engine::new(settings).expect("an engine");
        let (scene, middle) = room();
        controller.set_scene(scene).expect("accepted");
        let clip = hum(0.002);
        let here = (0..sources)
            .map(|_| {
                let id = controller.add_source(middle).expect("a slot");
                controller.play(id, Arc::clone(&clip), true).expect("there");
                id
            })
            .collect();
        Self {
            controller,
            renderer,
            here,
            middle,
        }
    }

    fn pose(&self, number: usize, time_s: f32) -> SourcePose {
        let dice = |k: u64| unit(mix((number as u64) << 8 | k)) - 0.5;
        let turn = 0.5 * time_s + number as f32;
        let circle = 0.5 * Vec3::new(turn.cos(), 0.0, turn.sin());
        let offset = Vec3::new(6.0 * dice(0), 2.0 * dice(1), 5.0 * dice(2));
        SourcePose::at(self.here[number], self.middle + offset + circle)
    }

    /// Returns the peak, the largest second difference and the greatest number of voices.
    fn run(&mut self, from: usize, frames: usize) -> (f32, f32, u32) {
        let mut block = [0.0; 2 * AUDIO_FRAMES];
        let (mut loudest, mut difference, mut voices) = (0.0f32, 0.0f32, 0);
        let mut last = [0.0; 2];
        for frame in from..from + frames {
            let time_s = frame as f32 * 0.01;
            let poses: Vec<SourcePose> = (0..self.here.len())
                .map(|number| self.pose(number, time_s))
                .collect();
            let listener = ListenerPose::facing(self.middle, 0.0);
            self.controller.tick(listener, &poses).expect("good poses");
            voices = voices.max(self.renderer.render(&mut block).voices);
            for sample in block.iter().step_by(2) {
                loudest = loudest.max(sample.abs());
                if frame > from {
                    difference = difference.max((sample - 2.0 * last[1] + last[0]).abs());
                }
                last = [last[1], *sample];
            }
        }
        (loudest, difference, voices)
    }
}

#[test]
fn many_sources_cost_as_much_as_their_slots() {
    let mut few = Crowd::new(8, 8);
    few.run(0, 20);
    let mut crowd = Crowd::new(256, 8);
    crowd.run(0, 20);
    let (loudest, difference, _) = crowd.run(20, 300);
    let (one, all) = (few.controller.statistics(), crowd.controller.statistics());
    // The number of rays depends on the positions of sources, not on their number, thirty-two times as large.
    assert!(
        all.rays < 2 * one.rays,
        "{} and {} rays",
        all.rays,
        one.rays
    );
    assert!(all.paths < 2 * one.paths.max(400), "{} paths", all.paths);
    assert!(loudest > 0.01 && loudest < 1.0, "{loudest}");
    // The second difference of a 700 Hz sine is 0.01 of it; a step of eight slots would be far above.
    assert!(
        difference < 0.02 * loudest,
        "second difference {difference} at {loudest}"
    );
    for id in crowd.here.drain(..) {
        crowd.controller.remove_source(id).expect("is there");
    }
    crowd.run(400, 100);
    assert_eq!(crowd.run(500, 1).2, 0, "voices without sources");
}

#[test]
fn more_sources_than_slots_are_an_error_only_above_the_maximum() {
    let (mut controller, _renderer) = Engine::new({
        let mut settings = settings(4);
        settings.max_sources = Some(5);
        settings
    })
    .expect("an engine");
    for _ in 0..5 {
        controller.add_source(Vec3::X).expect("a slot");
    }
    assert!(controller.add_source(Vec3::X).is_err());
    let mut wrong = settings(4);
    wrong.max_sources = Some(0);
    assert!(Engine::new(wrong).is_err());
}

#[test]
fn spans_of_threads_are_in_order_and_a_full_ring_counts_dropped_ones() {
    let (mut controller, mut renderer) = Engine::new({
        let mut settings = settings(1);
        settings.trace_spans = 64;
        settings
    })
    .expect("an engine");
    controller.add_source(Vec3::X).expect("a slot");
    let mut log = TraceLog::default();
    let mut last = [0.0; 2];
    for _ in 0..10 {
        run(&mut controller, &mut renderer, Vec3::ZERO, 4, &mut last);
        controller.collect_spans(&mut log);
    }
    assert_eq!(log.lost(), 0);
    let count = |track: Track, kind: SpanKind| {
        let is_it = |(t, span): &&(Track, _)| -> bool {
            let span: &foresound::runtime::trace::Span = span;
            *t == track && span.kind == kind
        };
        log.spans().iter().filter(is_it).count()
    };
    assert_eq!(count(Track::App, SpanKind::Tick), 40);
    assert_eq!(count(Track::Propagation, SpanKind::Update), 40);
    assert_eq!(count(Track::Sound, SpanKind::Block), 40);
    assert_eq!(count(Track::Sound, SpanKind::Direct), 40);
    assert_eq!(count(Track::Sound, SpanKind::Extrapolation), 40);
    // A block of 441 is rendered in parts of 256.
    assert_eq!(count(Track::Sound, SpanKind::Generation), 80);
    for track in [Track::App, Track::Propagation, Track::Sound] {
        let spans = log.spans().iter().filter(|(t, _)| *t == track);
        let ends = spans.map(|(_, span)| span.began_ns + span.duration_ns);
        assert!(ends.is_sorted(), "{track:?}");
    }
    run(&mut controller, &mut renderer, Vec3::ZERO, 100, &mut last);
    controller.collect_spans(&mut log);
    assert!(log.lost() > 0);
}
