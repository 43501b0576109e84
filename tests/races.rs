//! Concurrency: racing control threads, ten thousand engines started and stopped, threads that panic in turn. Sound
//! continues, the state reports failures, and no source is lost.
#![cfg(feature = "capi")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use foresound::bridge::engine::{self, ENGINES, PropagationOptions};
use foresound::bridge::enumeration::{self, Schedule};
use foresound::bridge::playback::{self, PlayOptions};
use foresound::bridge::sound::{RENDERERS, STREAMS, render, write_stream};
use foresound::bridge::{CallError, Options, Pose, Status, VERSION, clip, scenes};
use foresound::generation::{GeneratorSettings, Hrtf};
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, EngineState, FrameTime,
    NullDevice, Renderer, SoundThread,
};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, TriangleMesh, procedural,
};
use glam::Vec3;

/// Threads of an app that share one engine.
const CONTROL_THREADS: u64 = 8;

/// Calls of each of them.
const STEPS: u64 = 1500;

fn small() -> EngineSettings {
    let mut settings = EngineSettings::default();
    settings.generation = GeneratorSettings::default();
    settings.generation.rate_hz = 16_000;
    settings.generation.max_sources = 4;
    settings.generation.max_voices = 32;
    settings.generation.fine_voices = 8;
    settings.generation.max_delay_s = 0.05;
    settings.hrtf = Some(Arc::new(
        Hrtf::omnidirectional(16_000).expect("an HRTF set"),
    ));
    settings.propagation.guide_rays = 16;
    settings.propagation.source_rays = 8;
    settings.block_frames = 64;
    settings.max_paths = 64;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(0.01);
    settings
}

fn room(length_m: f32) -> TriangleMesh {
    procedural::shoebox(Vec3::new(length_m, 3.0, 5.0), "concrete")
}

fn hum() -> Arc<[f32]> {
    (0..1600).map(|n| 0.2 * (n as f32 * 0.1).sin()).collect()
}

/// Pseudo-random numbers (SplitMix64).
fn dice(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn pose(source: u32, x: f32) -> Pose {
    Pose {
        source,
        position_m: [x, 1.0, 1.5],
        orientation: [0.0, 0.0, 0.0, 1.0],
    }
}

/// One call of one control thread.
fn call(engine: u64, state: &mut u64, sources: &mut Vec<u32>) -> Result<(), Status> {
    let number = dice(state);
    let source = sources.first().copied().unwrap_or(number as u32);
    let x = 0.5 + (number >> 32) as f32 / u32::MAX as f32 * 3.0;
    let with = |act: &mut dyn FnMut(
        &mut engine::EngineControl,
    ) -> Result<(), foresound::bridge::CallError>| {
        ENGINES.with(engine, |engine| act(engine))
    };
    let done = match number % 12 {
        0 => with(&mut |s| {
            sources.push(s.add_source([x, 1.0, 1.0])?);
            Ok(())
        }),
        1 => {
            sources.retain(|other| *other != source);
            with(&mut |s| s.remove_source(source))
        }
        2 => clip::from_samples(&hum(), 1, 16_000, 16_000).and_then(|clip| {
            let options = PlayOptions {
                looped: 1,
                ..PlayOptions::default()
            };
            let played = playback::play(engine, source, clip, &options);
            drop(clip::CLIPS.remove(clip));
            played
        }),
        3 => engine::stream(engine, source, 100).and_then(|stream| {
            let wrote = write_stream(stream, &[0.1; 50]);
            drop(STREAMS.remove(stream));
            wrote.map(drop)
        }),
        4 => with(&mut |s| {
            Ok(s.controller()
                .mute_source(foresound::scene::SourceId::from_bits(source), x > 1.0)?)
        }),
        5 => with(&mut |s| {
            s.set_propagation(&PropagationOptions {
                guide_rays: 8 + (number >> 40) as u32 % 16,
                source_rays: 8,
                depth: 2,
                ..PropagationOptions::default()
            })
        }),
        6 => with(&mut |s| {
            s.controller().pause();
            s.controller().resume();
            Ok(())
        }),
        7 if number.is_multiple_of(5) => with(&mut |s| Ok(s.controller().restart()?)),
        8 => TriangleMesh::from_slices(
            &[[0.0; 3], [x, 0.0, 0.0], [0.0, 0.0, x], [0.0, x, 0.0]],
            &[0, 1, 2, 0, 1, 3],
            &[],
            &[],
        )
        .map_err(CallError::from)
        .and_then(|mesh| scenes::from_mesh(&mesh, None, &scenes::SceneOptions::default(), 0))
        .and_then(|scene| {
            let set = engine::set_scene(engine, scene);
            drop(scenes::SCENES.remove(scene));
            set
        }),
        _ => with(&mut |s| s.tick(pose(0, x).listener(), [pose(source, x)].into_iter())),
    };
    done.map_err(|error| error.status)
}

#[test]
fn eight_control_threads_share_an_engine() {
    for schedule in [Schedule::Asynchronous, Schedule::Synchronous] {
        let options = Options {
            rate_hz: 16_000,
            block_frames: 64,
            max_sources: 6,
            max_voices: 32,
            fine_voices: 8,
            max_paths: 64,
            guide_rays: 16,
            source_rays: 8,
            max_delay_s: 0.05,
            hrtf: enumeration::Hrtf::None,
            schedule,
            frame_s: 0.01,
            ..Options::default()
        };
        let (engine, renderer) = engine::create(VERSION, &options, None).expect("an engine");
        let running = AtomicBool::new(true);
        let [calls, failures] = [0, 0].map(|zero| Arc::new(AtomicU64::new(zero)));
        thread::scope(|scope| {
            scope.spawn(|| {
                let mut block = [0.0; 128];
                while running.load(Ordering::Relaxed) {
                    render(renderer, &mut block, 2).expect("no other thread renders");
                    assert!(block.iter().all(|s| s.is_finite() && s.abs() <= 1.0));
                    thread::yield_now();
                }
            });
            let controls: Vec<_> = (0..CONTROL_THREADS)
                .map(|number| {
                    let (calls, failures) = (Arc::clone(&calls), Arc::clone(&failures));
                    scope.spawn(move || {
                        let (mut state, mut sources) = (number, Vec::new());
                        for _ in 0..STEPS {
                            calls.fetch_add(1, Ordering::Relaxed);
                            if let Err(status) = call(engine, &mut state, &mut sources) {
                                // A source of another thread, no free slot, or a pose in a replaced scene.
                                assert!(
                                    matches!(
                                        status,
                                        Status::StaleSource | Status::State | Status::BadArgument
                                    ),
                                    "{status:?}"
                                );
                                failures.fetch_add(1, Ordering::Relaxed);
                            }
                        }
                        sources
                    })
                })
                .collect();
            let left: Vec<u32> = controls
                .into_iter()
                .flat_map(|control| control.join().expect("no panic"))
                .collect();
            running.store(false, Ordering::Relaxed);
            let (calls, failures) = (
                calls.load(Ordering::Relaxed),
                failures.load(Ordering::Relaxed),
            );
            assert_eq!(calls, CONTROL_THREADS * STEPS);
            assert!(failures < calls, "{failures} of {calls}");
            // Exactly the sources still held exist.
            let count = ENGINES.with(engine, |s| Ok(s.controller().source_count()));
            assert_eq!(count, Ok(left.len()));
            for source in left {
                ENGINES
                    .with(engine, |s| s.remove_source(source))
                    .expect("is there");
            }
        });
        drop(ENGINES.remove(engine));
        drop(RENDERERS.remove(renderer));
    }
}

fn tick(controller: &mut Controller, renderer: &mut Renderer) -> f32 {
    let mut block = [0.0; 320];
    let listener = ListenerPose::facing(Vec3::new(2.0, 1.5, 2.0), 0.3);
    controller.tick(listener, &[]).expect("a good pose");
    renderer.render(&mut block);
    assert!(block.iter().all(|s| s.is_finite() && s.abs() <= 1.0));
    block.iter().fold(0.0, |most, s| most.max(s.abs()))
}

#[test]
fn propagation_starts_and_stops_ten_thousand_times() {
    let (mut controller, mut renderer) = Engine::new(small()).expect("an engine");
    let id = controller.add_source(Vec3::ONE).expect("a slot");
    controller.play(id, hum(), true).expect("is there");
    let before = threads();
    for round in 0..5000 {
        for schedule in [EngineSchedule::Synchronous, EngineSchedule::Asynchronous] {
            controller.set_schedule(schedule).expect("starts");
        }
        if round % 500 == 0 {
            tick(&mut controller, &mut renderer);
        }
    }
    assert_eq!(controller.state(), EngineState::Running);
    assert!(
        (0..30)
            .map(|_| tick(&mut controller, &mut renderer))
            .fold(0.0, f32::max)
            > 0.0
    );
    drop(controller);
    // The helpers end with the synchronous schedule.
    assert!(
        threads() <= before + 1,
        "{} threads from {before}",
        threads()
    );
}

#[test]
fn a_thousand_engines_release_their_scene_and_clip() {
    let scene = Scene::commit(
        &room(4.0),
        &MaterialTable::built_in(),
        &SceneSettings::default(),
    );
    let (scene, clip) = (Arc::new(scene.expect("a room")), hum());
    for number in 0..1000 {
        let (mut controller, mut renderer) = Engine::new(small()).expect("an engine");
        controller.set_scene(Arc::clone(&scene)).expect("accepted");
        let id = controller.add_source(Vec3::ONE).expect("a slot");
        controller.play(id, Arc::clone(&clip), true).expect("there");
        match number % 3 {
            0 => drop(tick(&mut controller, &mut renderer)),
            1 => {
                let (thread, mut ring) = SoundThread::start(renderer, 2).expect("starts");
                ring.read(&mut [0.0; 64]);
                drop(controller);
                drop(thread.stop().expect("no panic"));
                continue;
            }
            _ => {}
        }
        // Drops either half first.
        if number % 2 == 0 {
            drop(renderer);
            assert_eq!(controller.state(), EngineState::RendererGone);
        }
    }
    assert_eq!(Arc::strong_count(&scene), 1);
    assert_eq!(Arc::strong_count(&clip), 1);
}

/// Number of threads of this process, if the system has it.
fn threads() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("Threads:"));
    line.and_then(|number| number.trim().parse().ok())
        .unwrap_or(0)
}

static KILL: AtomicBool = AtomicBool::new(false);

fn killer(_: u64) {
    assert!(!KILL.load(Ordering::Relaxed), "injected");
}

/// Propagation panics repeatedly, in both schedules and while scenes are replaced and built; each time sound continues, the
/// state reports it, and a restart brings updates back.
#[test]
fn propagation_restarts_after_every_panic() {
    for schedule in [EngineSchedule::Asynchronous, EngineSchedule::Synchronous] {
        let mut settings = small();
        settings.schedule = schedule;
        settings.before_update = Some(killer);
        let (mut controller, mut renderer) = Engine::new(settings).expect("an engine");
        let id = controller.add_source(Vec3::ONE).expect("a slot");
        controller.play(id, hum(), true).expect("is there");
        for round in 0..20 {
            let table = MaterialTable::built_in();
            let mesh = room(4.0 + round as f32);
            controller
                .build_scene(mesh, table, SceneSettings::default())
                .expect("a thread");
            KILL.store(true, Ordering::Relaxed);
            while controller.state() != EngineState::PropagationFailed {
                tick(&mut controller, &mut renderer);
            }
            let loudest = (0..30).map(|_| tick(&mut controller, &mut renderer));
            assert!(loudest.fold(0.0, f32::max) > 0.0, "silent in round {round}");
            KILL.store(false, Ordering::Relaxed);
            controller.restart().expect("starts");
            let before = controller.statistics().updates;
            while controller.statistics().updates < before + 2 {
                assert_eq!(controller.state(), EngineState::Running);
                tick(&mut controller, &mut renderer);
            }
        }
    }
}

/// The thread that renders panics; the engine reports the missing renderer, and another engine works.
#[test]
fn a_panic_in_a_device_callback_leaves_other_engines_working() {
    for _ in 0..20 {
        let (mut controller, mut renderer) = Engine::new(small()).expect("an engine");
        let mut calls = 0;
        let device = NullDevice::start(16_000, 64, AffinityPolicy::System, move |block| {
            renderer.render(block);
            calls += 1;
            assert!(calls < 3, "injected");
        });
        let device = device.expect("a thread");
        let listener = ListenerPose::facing(Vec3::ONE, 0.0);
        while controller.state() != EngineState::RendererGone {
            controller.tick(listener, &[]).expect("a good pose");
            thread::yield_now();
        }
        // Counts of the panicked thread are lost.
        assert_eq!(device.stop().blocks, 0);
    }
}
