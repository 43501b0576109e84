//! The engine's two halves on one thread: handles, poses, samples and states.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use foresound::Error;
use foresound::extrapolation::PredictorKind;
use foresound::generation::GeneratorSettings;
use foresound::propagation::PropagationSettings;
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, EngineState, FrameTime,
    Renderer,
};
use foresound::scene::{
    Directivity, ListenerPose, MaterialTable, Scene, SceneSettings, SourceExtent, SourceId,
    SourcePose, procedural,
};
use glam::{Quat, Vec3};

fn settings() -> EngineSettings {
    let mut settings = EngineSettings::default();
    settings.generation = GeneratorSettings::default();
    settings.generation.max_sources = 4;
    settings.propagation.guide_rays = 64;
    settings.propagation.source_rays = 16;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(0.01);
    settings
}

fn room() -> Arc<Scene> {
    let mesh = procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "acoustic_ceiling");
    let table = MaterialTable::built_in();
    Arc::new(Scene::commit(&mesh, &table, &SceneSettings::default()).expect("a room"))
}

fn inside(scene: &Scene) -> Vec3 {
    (scene.report().bounds_min + scene.report().bounds_max) / 2.0
}

fn hum() -> Arc<[f32]> {
    (0..4410)
        .map(|n| 0.2 * (n as f32 * 0.1).sin())
        .collect::<Vec<_>>()
        .into()
}

/// Ticks and renders; returns the peak of the last block.
fn run(controller: &mut Controller, renderer: &mut Renderer, at: Vec3, frames: usize) -> f32 {
    let mut block = [0.0; 882];
    for _ in 0..frames {
        let listener = ListenerPose::facing(at, 0.3);
        controller.tick(listener, &[]).expect("a good pose");
        renderer.render(&mut block);
        assert!(block.iter().all(|s| s.is_finite()));
    }
    block.iter().fold(0.0, |most, s| most.max(s.abs()))
}

/// Voices wait for fades, which do not advance while nothing is rendered.
#[test]
fn a_pause_during_a_change_of_all_paths_ends() {
    let scene = room();
    let at = inside(&scene);
    for frames in 0..5 {
        let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
        controller.set_scene(Arc::clone(&scene)).expect("accepted");
        let mut ids = Vec::new();
        for turn in 0..2 {
            for id in ids.drain(..) {
                controller.remove_source(id).expect("is there");
            }
            for n in 0..4 {
                let position = at + Vec3::new(1.0 + 0.1 * n as f32, 0.2 * turn as f32, -0.5);
                let id = controller.add_source(position).expect("a slot");
                controller.play(id, hum(), true).expect("is there");
                ids.push(id);
            }
            let before_pause = if turn == 0 { 30 } else { frames };
            run(&mut controller, &mut renderer, at, before_pause);
        }
        controller.pause();
        assert_eq!(run(&mut controller, &mut renderer, at, 30), 0.0);
        controller.resume();
        let loud = run(&mut controller, &mut renderer, at, 30);
        assert!(loud > 0.01, "{loud} after {frames} frames");
    }
}

#[test]
fn a_source_is_heard_muted_paused_and_removed() {
    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let id = controller.add_source(Vec3::X).expect("a slot");
    controller.play(id, hum(), true).expect("is there");
    let loud = run(&mut controller, &mut renderer, Vec3::ZERO, 30);
    assert!(loud > 0.01, "{loud} in open air");
    let scene = room();
    let at = inside(&scene);
    controller.set_scene(Arc::clone(&scene)).expect("accepted");
    controller
        .move_source(id, at + Vec3::X)
        .expect("a valid position");
    assert!(run(&mut controller, &mut renderer, at, 30) > 0.01);
    assert!(controller.statistics().paths > 6);

    controller.pause();
    assert_eq!(controller.state(), EngineState::Paused);
    assert_eq!(run(&mut controller, &mut renderer, at, 3), 0.0);
    controller.resume();
    assert!(run(&mut controller, &mut renderer, at, 3) > 0.01);

    controller.mute_source(id, true).expect("is there");
    run(&mut controller, &mut renderer, at, 400);
    let muted = run(&mut controller, &mut renderer, at, 1);
    assert!(muted < 1e-3, "{muted} when muted");
    controller.mute_source(id, false).expect("is there");
    assert!(run(&mut controller, &mut renderer, at, 5) > 0.01);
    controller.remove_source(id).expect("is there");
    run(&mut controller, &mut renderer, at, 400);
    assert!(run(&mut controller, &mut renderer, at, 1) < 1e-3);
}

#[test]
fn a_stale_handle_is_an_error_and_never_another_source() {
    let (mut controller, _renderer) = Engine::new(settings()).expect("an engine");
    let mut stale = Vec::new();
    for round in 0..1000 {
        let id = controller.add_source(Vec3::X).expect("a slot");
        assert!(!stale.contains(&id), "round {round}");
        controller.remove_source(id).expect("is there");
        stale.push(id);
    }
    let present: Vec<SourceId> = (0..4)
        .map(|_| controller.add_source(Vec3::Y).expect("a slot"))
        .collect();
    let full = controller.add_source(Vec3::Y);
    assert!(matches!(full, Err(Error::Engine { .. })), "{full:?}");
    let elsewhere = SourceId::new(4000, 0);
    for &id in stale.iter().chain([&elsewhere]) {
        assert!(!present.contains(&id));
        let refusals = [
            controller.move_source(id, Vec3::ZERO),
            controller.mute_source(id, true),
            controller.set_source_gain(id, 1.0),
            controller.play(id, hum(), false),
            controller.stop(id),
            controller.remove_source(id),
            controller.stream(id, 10).map(drop),
        ];
        for refusal in refusals {
            assert!(
                matches!(refusal, Err(Error::StaleSource { .. })),
                "{refusal:?}"
            );
        }
    }
    assert_eq!(controller.source_count(), 4);
}

#[test]
fn an_invalid_pose_is_refused_and_the_last_valid_one_kept() {
    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let id = controller.add_source(Vec3::X).expect("a slot");
    controller.play(id, hum(), true).expect("is there");
    let good = ListenerPose::default();
    let mut block = [0.0; 882];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
        let position = Vec3::new(0.0, bad, 0.0);
        let lost = ListenerPose { position, ..good };
        let turned = ListenerPose {
            orientation: Quat::from_xyzw(0.0, 0.0, bad, 1.0),
            ..good
        };
        let pose = SourcePose::at(id, position);
        assert!(controller.tick(lost, &[]).is_err());
        assert!(bad == 1e30 || controller.tick(turned, &[]).is_err());
        assert!(controller.tick(good, &[pose]).is_err());
        assert!(controller.move_source(id, position).is_err());
        assert!(controller.add_source(position).is_err());
        assert!(controller.set_source_gain(id, bad).is_err());
        renderer.render(&mut block);
    }
    let invalid = ListenerPose {
        orientation: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0),
        ..good
    };
    assert!(controller.tick(invalid, &[]).is_err());
    assert!(run(&mut controller, &mut renderer, Vec3::ZERO, 20) > 0.01);
}

/// What is heard of a wide dipole whose orientation is set to `orientation`.
fn dipole(orientation: Quat) -> Vec<f32> {
    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let id = controller.add_source(Vec3::X).expect("a slot");
    controller.play(id, hum(), true).expect("is there");
    let mut pose = SourcePose {
        orientation,
        ..SourcePose::at(id, Vec3::new(0.5, 0.2, -3.0))
    };
    pose.settings.directivity = Directivity::even(1.0, 1.0);
    pose.settings.extent = SourceExtent::sphere(0.5);
    pose.settings.extent.semi_axes_m.x = 0.1;
    let mut block = vec![0.0; 882];
    for _ in 0..20 {
        let ticked = controller.tick(ListenerPose::default(), &[pose]);
        ticked.expect("a good pose");
        renderer.render(&mut block);
    }
    assert!(
        block.iter().any(|s| s.abs() > 1e-3),
        "{orientation} is silent"
    );
    block
}

#[test]
fn a_sources_orientation_is_normalised() {
    let turn = Quat::from_rotation_y(0.4);
    for (given, unit) in [
        (Quat::from_array([0.0; 4]), Quat::IDENTITY),
        (turn * 10.0, turn),
    ] {
        let pairs = dipole(given).into_iter().zip(dipole(unit));
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-5, "{given}: {worst}");
    }
    let (mut controller, _renderer) = Engine::new(settings()).expect("an engine");
    let id = controller.add_source(Vec3::X).expect("a slot");
    for bad in [f32::MAX, f32::INFINITY, f32::NAN, 1e-8] {
        let pose = SourcePose::at(id, Vec3::X).with_orientation([0.0, bad, 0.0, 0.0]);
        let refused = controller.tick(ListenerPose::default(), &[pose]);
        assert!(matches!(refused, Err(Error::Setting { .. })), "{bad}");
    }
}

#[test]
fn a_call_for_no_audio_frames_is_no_block() {
    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    run(&mut controller, &mut renderer, Vec3::ZERO, 2);
    let before = controller.statistics();
    for _ in 0..10 {
        // One sample is no frame of two channels.
        let report = renderer.render(&mut [0.0; 1]);
        assert_eq!((report.frames, report.missed_deadline), (0, false));
    }
    let after = controller.statistics();
    assert_eq!(after.blocks, before.blocks);
    assert_eq!(after.missed_deadlines, before.missed_deadlines);
    drop(controller);
    assert!(renderer.render(&mut []).controller_dropped);
}

#[test]
fn empty_clips_and_dry_streams_are_silence() {
    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let id = controller.add_source(Vec3::X).expect("a slot");
    for looped in [false, true] {
        let empty = Vec::new().into();
        controller.play(id, empty, looped).expect("is there");
        assert_eq!(run(&mut controller, &mut renderer, Vec3::ZERO, 5), 0.0);
    }
    assert!(controller.stream(id, 0).is_err());
    let mut writer = controller.stream(id, 4410).expect("is there");
    assert_eq!(writer.write(&hum()), 4410);
    assert!(run(&mut controller, &mut renderer, Vec3::ZERO, 9) > 0.01);
    run(&mut controller, &mut renderer, Vec3::ZERO, 5);
    assert!(controller.statistics().underrun_samples > 0);
    controller.stop(id).expect("is there");
    run(&mut controller, &mut renderer, Vec3::ZERO, 1);
    // The next tick frees returned samples.
    run(&mut controller, &mut renderer, Vec3::ZERO, 1);
    assert!(writer.is_abandoned());
}

#[test]
fn an_unused_clip_is_freed_by_the_controller() {
    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let clip = hum();
    for _ in 0..1000 {
        // The renderer does not run: waiting changes do not accumulate.
        let id = controller.add_source(Vec3::X).expect("a slot");
        controller.play(id, Arc::clone(&clip), true).expect("there");
        controller.remove_source(id).expect("is there");
    }
    assert!(Arc::strong_count(&clip) < 200);
    run(&mut controller, &mut renderer, Vec3::ZERO, 5);
    assert_eq!(Arc::strong_count(&clip), 1);
}

static PANIC: AtomicBool = AtomicBool::new(false);

fn panic_on_request(_: u64) {
    assert!(!PANIC.load(Ordering::Relaxed), "injected");
}

#[test]
fn propagation_restarts_after_a_panic() {
    for schedule in [EngineSchedule::Synchronous, EngineSchedule::Asynchronous] {
        let mut settings = settings();
        settings.schedule = schedule;
        settings.before_update = Some(panic_on_request);
        let (mut controller, mut renderer) = Engine::new(settings).expect("an engine");
        let scene = room();
        let at = inside(&scene);
        controller.set_scene(scene).expect("accepted");
        let id = controller.add_source(at + Vec3::X).expect("a slot");
        controller.play(id, hum(), true).expect("is there");
        while controller.statistics().paths < 6 {
            run(&mut controller, &mut renderer, at, 1);
        }
        PANIC.store(true, Ordering::Relaxed);
        while controller.state() != EngineState::PropagationFailed {
            run(&mut controller, &mut renderer, at, 1);
        }
        assert!(run(&mut controller, &mut renderer, at, 20) > 0.01);
        PANIC.store(false, Ordering::Relaxed);
        controller.restart().expect("starts");
        assert_eq!(controller.state(), EngineState::Running);
        let before = controller.statistics().updates;
        while controller.statistics().updates < before + 3 {
            assert_eq!(controller.state(), EngineState::Running);
            run(&mut controller, &mut renderer, at, 1);
        }
    }
}

#[test]
fn either_half_may_be_dropped_first() {
    let (mut controller, renderer) = Engine::new(settings()).expect("an engine");
    drop(renderer);
    let id = controller.add_source(Vec3::X).expect("a slot");
    for _ in 0..300 {
        controller.play(id, hum(), true).expect("is there");
        controller
            .tick(ListenerPose::default(), &[])
            .expect("ticks on");
    }
    assert_eq!(controller.state(), EngineState::RendererGone);

    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let id = controller.add_source(Vec3::X).expect("a slot");
    controller.play(id, hum(), true).expect("is there");
    run(&mut controller, &mut renderer, Vec3::ZERO, 20);
    drop(controller);
    let mut block = [0.0; 882];
    let report = renderer.render(&mut block);
    assert!(report.controller_dropped);
    assert!(block.iter().any(|s| s.abs() > 0.01));
}

#[test]
fn the_baseline_is_independent_of_the_number_of_threads() {
    let render = |tracing_threads: usize| {
        let mut settings = settings();
        settings.tracing_threads = tracing_threads;
        let (mut controller, mut renderer) = Engine::new(settings).expect("an engine");
        let scene = room();
        let at = inside(&scene);
        controller.set_scene(scene).expect("accepted");
        for position in [Vec3::X, Vec3::Z, -Vec3::X] {
            let id = controller.add_source(at + position).expect("a slot");
            controller.play(id, hum(), true).expect("is there");
        }
        let (mut block, mut sound) = ([0.0; 882], Vec::new());
        for frame in 0..40 {
            let walked = Vec3::Z * (frame as f32 * 0.02);
            let listener = ListenerPose::facing(at + walked, 0.3);
            controller.tick(listener, &[]).expect("a good pose");
            renderer.render(&mut block);
            sound.extend(block.map(f32::to_bits));
        }
        assert!(controller.statistics().paths > 20);
        sound
    };
    let alone = render(1);
    assert!(alone == render(2) && alone == render(3));
}

#[test]
fn predictor_schedule_and_rays_change_while_running() {
    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let scene = room();
    let at = inside(&scene);
    controller.set_scene(Arc::clone(&scene)).expect("accepted");
    let id = controller.add_source(at + Vec3::X).expect("a slot");
    controller.play(id, hum(), true).expect("is there");
    for round in 0..12 {
        controller.set_predictor(PredictorKind::ALL[round % PredictorKind::ALL.len()]);
        let schedule = match round % 3 {
            0 => EngineSchedule::Asynchronous,
            _ => EngineSchedule::Synchronous,
        };
        controller.set_schedule(schedule).expect("starts");
        let rays = PropagationSettings {
            guide_rays: 32 << (round % 4),
            ..controller.settings().propagation
        };
        controller.set_propagation(rays).expect("in range");
        let before = controller.statistics().updates;
        while controller.statistics().updates < before + 2 {
            run(&mut controller, &mut renderer, at, 1);
        }
    }
    assert!(run(&mut controller, &mut renderer, at, 5) > 0.01);
    let wrong = PropagationSettings {
        guide_rays: 0,
        ..PropagationSettings::default()
    };
    assert!(controller.set_propagation(wrong).is_err());
    assert_eq!(controller.statistics().extrapolation_level, 0);
}

#[test]
fn scenes_are_built_in_the_background_and_a_tick_returns_their_errors() {
    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let mesh = procedural::shoebox(Vec3::new(6.0, 3.0, 5.0), "acoustic_ceiling");
    let table = MaterialTable::built_in();
    let before = Arc::clone(controller.scene());
    controller
        .build_scene(mesh, table.clone(), SceneSettings::default())
        .expect("a thread");
    while controller.is_building() {
        run(&mut controller, &mut renderer, Vec3::ZERO, 1);
    }
    assert!(!Arc::ptr_eq(&before, controller.scene()));
    let invalid = foresound::scene::TriangleMesh::default();
    controller
        .build_scene(invalid, table, SceneSettings::default())
        .expect("a thread");
    let mut error = None;
    while controller.is_building() {
        error = controller.tick(ListenerPose::default(), &[]).err();
    }
    assert!(matches!(error, Some(Error::Mesh { .. })), "{error:?}");
}

#[test]
fn too_many_paths_are_trimmed_to_the_loudest() {
    let mut limited = settings();
    limited.max_paths = 5;
    let (mut controller, mut renderer) = Engine::new(limited).expect("an engine");
    let scene = room();
    let at = inside(&scene);
    controller.set_scene(scene).expect("accepted");
    let id = controller.add_source(at + Vec3::X).expect("a slot");
    controller.play(id, hum(), true).expect("is there");
    assert!(run(&mut controller, &mut renderer, at, 30) > 0.01);
    let statistics = controller.statistics();
    assert_eq!(statistics.paths, 5);
    assert!(statistics.trimmed_paths > 0);
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    type Set = fn(&mut EngineSettings);
    let cases: [(Set, &str); 5] = [
        (|s| s.block_frames = 0, "block_frames"),
        (|s| s.tracing_threads = 0, "tracing_threads"),
        (|s| s.max_paths = 0, "max_paths"),
        (|s| s.frame_time = FrameTime::Fixed(f64::NAN), "frame_time"),
        (|s| s.generation.max_sources = 0, "max_sources"),
    ];
    for (set, name) in cases {
        let mut settings = settings();
        set(&mut settings);
        let error = Engine::new(settings).err().expect("refused").to_string();
        assert!(error.starts_with(name), "{error}");
    }
}
