//! The engine on its threads: the audio side does not allocate, threads start and stop, devices disappear and return.
//!
//! Independent of the machine's speed: loops wait for events, not for time.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use foresound::extrapolation::PredictorKind;
use foresound::generation::{GeneratorSettings, Hrtf, Layout};
use foresound::propagation::rays::directions::{mix, unit};
use foresound::runtime::{
    AffinityPolicy, BusStatus, Clip, Engine, EngineSchedule, EngineSettings, EngineState,
    FrameTime, NullDevice, PlaySettings, SoundThread,
};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceExtent,
    SourceId, SourcePose, procedural,
};
use glam::{DAffine3, DVec3, Quat, Vec3};

#[path = "../tools/src/command_line/counting.rs"]
mod counting;

#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;

const SOURCES: usize = 8;

fn settings() -> EngineSettings {
    let mut settings = EngineSettings::default();
    settings.generation = GeneratorSettings::default();
    settings.generation.max_sources = SOURCES;
    settings.propagation.guide_rays = 128;
    settings.propagation.source_rays = 32;
    settings.affinity = AffinityPolicy::System;
    settings
}

fn room(length_m: f32) -> Arc<Scene> {
    let mesh = procedural::shoebox(Vec3::new(length_m, 3.0, 5.0), "concrete");
    let table = MaterialTable::built_in();
    Arc::new(Scene::commit(&mesh, &table, &SceneSettings::default()).expect("a room"))
}

#[test]
fn the_audio_side_neither_allocates_nor_frees() {
    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let done = Arc::new(AtomicBool::new(false));
    let blocks = Arc::new(AtomicU64::new(0));
    let (ended, heard) = (Arc::clone(&done), Arc::clone(&blocks));
    let audio = thread::spawn(move || {
        let mut block = vec![0.0; 2 * 256];
        let (mut operations, mut updates) = (0, 0);
        while !ended.load(Ordering::Relaxed) {
            let before = counting::operations();
            let report = renderer.render(&mut block);
            operations += counting::operations() - before;
            updates += report.updates;
            heard.fetch_add(1, Ordering::Relaxed);
        }
        (operations, updates)
    });
    let scenes = [room(6.0), room(9.0), room(20.0)];
    let clip: Arc<[f32]> = vec![0.1; 1000].into();
    let mut here: Vec<SourceId> = Vec::new();
    let mut writers = Vec::new();
    let (mut swaps, mut added, mut hung, mut layouts) = (0, 0, 0, 0);
    let omni = Arc::new(Hrtf::omnidirectional(44_100).expect("an HRTF set"));
    let part = room(0.5);
    let mut doors: Vec<InstanceId> = Vec::new();
    // At least 2000 graphics frames, and as many as bring 2000 blocks and 50 updates.
    let mut frame = 0u64;
    while frame < 2000
        || blocks.load(Ordering::Relaxed) < 2000
        || controller.statistics().updates < 50
    {
        let dice = mix(frame);
        let scene = &scenes[(dice % 3) as usize];
        let middle = (scene.report().bounds_min + scene.report().bounds_max) / 2.0;
        if dice.is_multiple_of(3) && here.len() < SOURCES {
            let id = controller.add_source(middle).expect("a slot");
            if dice.is_multiple_of(2) {
                let clip = match id.slot() % 4 {
                    2 => Clip::ambisonic(Arc::clone(&clip)),
                    _ => Clip::mono(Arc::clone(&clip)),
                };
                let looped = PlaySettings {
                    is_looped: true,
                    ..PlaySettings::default()
                };
                controller.play_clip(id, clip, looped).expect("is there");
            } else {
                let mut writer = controller.stream(id, 2000).expect("is there");
                writer.write(&clip);
                writers.push(writer);
            }
            here.push(id);
            added += 1;
        } else if dice.is_multiple_of(5) && !here.is_empty() {
            let id = here.swap_remove((dice >> 8) as usize % here.len());
            controller.remove_source(id).expect("is there");
        }
        let door = |id| InstancePose {
            id,
            position: (middle + Vec3::Z * unit(mix(dice))).as_dvec3(),
            rotation: Quat::from_rotation_y(frame as f32 * 0.03),
        };
        if dice.is_multiple_of(23) && doors.len() < 6 {
            let part = Arc::clone(&part);
            let id = controller.add_instance(part, &door(InstanceId::default()));
            doors.push(id.expect("one more door"));
            hung += 1;
        } else if dice.is_multiple_of(29) && !doors.is_empty() {
            let id = doors.swap_remove((dice >> 8) as usize % doors.len());
            controller.remove_instance(id).expect("is there");
        }
        for &id in &doors {
            controller.set_instance_pose(&door(id)).expect("rigid");
        }
        if dice.is_multiple_of(17) {
            controller.set_scene(Arc::clone(scene)).expect("accepted");
            swaps += 1;
        }
        controller.set_predictor(PredictorKind::ALL[(dice >> 16) as usize % 3]);
        // Layouts of both channels or fewer, and HRTF sets.
        if dice.is_multiple_of(13) {
            let layout = Layout::ALL[(dice >> 24) as usize % 3];
            controller.set_layout(layout).expect("two channels");
            layouts += 1;
        } else if dice.is_multiple_of(19) {
            let set = [None, Some(Arc::clone(&omni))][(dice >> 24) as usize % 2].clone();
            controller.set_hrtf(set).expect("of this rate");
        }
        match dice % 101 {
            0 => controller.pause(),
            1..20 => controller.resume(),
            _ => {}
        }
        let sway = Vec3::X * (frame as f32 * 0.05).sin();
        let moved: Vec<SourcePose> = here
            .iter()
            .map(|&id| {
                let mut pose = SourcePose::at(id, middle + sway);
                if id.slot() % 4 == 1 {
                    pose.settings.extent = SourceExtent::sphere(0.7);
                }
                pose.settings.is_2d = id.slot() % 4 == 2;
                pose
            })
            .collect();
        let listener = ListenerPose::facing(middle - sway, frame as f32 * 0.01);
        controller.tick(listener, &moved).expect("good poses");
        writers.retain(|writer| !writer.is_abandoned());
        frame += 1;
        thread::yield_now();
    }
    done.store(true, Ordering::Relaxed);
    let (operations, updates) = audio.join().expect("no panic");
    assert_eq!(operations, 0, "allocations and frees on the audio side");
    assert!(
        updates >= 50 && swaps > 20 && added > 100 && hung > 10 && layouts > 20,
        "{updates} {swaps} {added} {hung} {layouts}"
    );
}

/// A block whose sources are rendered apart, with wrong calls and blocks that nobody ends.
#[test]
fn sources_are_rendered_apart_without_allocation() {
    let mut settings = settings();
    settings.generation.source_buses = true;
    settings.generation.listeners = 2;
    settings.schedule = EngineSchedule::Synchronous;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    let (mut controller, mut renderer) = Engine::new(settings).expect("an engine");
    controller.set_scene(room(6.0)).expect("accepted");
    let ids: Vec<SourceId> = (0..4)
        .map(|n| {
            controller
                .add_source(Vec3::new(n as f32, 1.0, 2.0))
                .expect("a slot")
        })
        .collect();
    let (dry, mut bus) = (vec![0.1; 256], vec![0.0; 2 * 256]);
    let mut both = vec![0.0; 2 * 2 * 256];
    let (mut operations, mut own) = (0, 0);
    for frame in 0..200 {
        if frame == 100 {
            controller.remove_source(ids[0]).expect("is there");
        }
        if frame % 50 == 49 {
            let layout = Layout::ALL[frame / 50 % 3];
            controller.set_layout(layout).expect("two channels");
        }
        let listener = ListenerPose::facing(Vec3::new(3.0, 1.5, 2.0), frame as f32 * 0.02);
        controller.tick(listener, &[]).expect("a good pose");
        let before = counting::operations();
        for block in 0..3 {
            renderer.begin_block(256);
            for id in &ids[..3] {
                let status = renderer.render_source(*id, &dry, &mut bus);
                own += u32::from(status == BusStatus::Own);
            }
            renderer.render_source(ids[1], &dry[1..], &mut bus);
            if block > 0 {
                renderer.render_reverb(&mut bus[block - 1..]);
            }
        }
        renderer.render_listeners(&mut both);
        operations += counting::operations() - before;
        let other = ListenerPose::facing(Vec3::new(2.0, 1.5, 1.0 + 0.01 * frame as f32), 0.0);
        controller.set_listener(1, other).expect("a good pose");
    }
    assert_eq!(operations, 0);
    assert!(both.iter().any(|sample| *sample != 0.0));
    assert!(own > 1000, "{own}");
}

/// Direct sound at many edges has more paths than updates of one path.
#[test]
fn small_updates_near_edges_need_no_allocation() {
    let mut settings = settings();
    settings.max_paths = 1;
    settings.generation.listeners = 2;
    settings.schedule = EngineSchedule::Synchronous;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    let (mut controller, mut renderer) = Engine::new(settings).expect("an engine");
    let mut mesh = procedural::shoebox(Vec3::new(9.0, 3.0, 9.0), "concrete");
    for n in 0..25 {
        let at = DVec3::new(2.0 + f64::from(n % 5), 0.0, 2.0 + f64::from(n / 5));
        let pillar = procedural::shoebox(Vec3::new(0.2, 2.5, 0.2), "concrete");
        let placed = mesh.append(&pillar, &DAffine3::from_translation(at));
        placed.expect("a good mesh");
    }
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("a scene");
    controller.set_scene(Arc::new(scene)).expect("accepted");
    let position = |n: usize| Vec3::new(1.5 + 0.8 * n as f32, 1.0, 8.0);
    let ids: Vec<SourceId> = (0..SOURCES)
        .map(|n| controller.add_source(position(n)).expect("a slot"))
        .collect();
    let mut block = vec![0.0; 2 * 735];
    let (mut operations, mut most) = (0, 0);
    for frame in 0..60 {
        let at = Vec3::new(1.5 + 0.1 * frame as f32, 1.5, 1.0);
        let listener = ListenerPose::facing(at, 0.0);
        controller.set_listener(1, listener).expect("a good pose");
        controller.tick(listener, &[]).expect("a good pose");
        let before = counting::operations();
        renderer.render(&mut block);
        operations += counting::operations() - before;
        let numbers = controller.frame_numbers();
        let paths = ids.iter().map(|id| numbers.paths(*id).len());
        most = most.max(paths.sum());
    }
    assert_eq!(operations, 0);
    // The direct ones, and three candidates of the predictor for each path of an update.
    assert!(most > 3 + SOURCES, "{most}");
}

#[test]
fn the_counter_counts() {
    let before = counting::operations();
    drop(std::hint::black_box(Box::new(5)));
    assert_eq!(counting::operations() - before, 2);
}

#[test]
fn an_engine_starts_and_stops_two_hundred_times() {
    for round in 0..200 {
        let mut small = settings();
        small.generation = GeneratorSettings::default();
        small.generation.max_sources = 1;
        small.generation.max_voices = 16;
        small.generation.fine_voices = 4;
        small.generation.max_delay_s = 0.1;
        small.max_paths = 64;
        let (mut controller, mut renderer) = Engine::new(small).expect("an engine");
        if round % 2 == 0 {
            let ticked = controller.tick(ListenerPose::default(), &[]);
            ticked.expect("a good pose");
        }
        renderer.render(&mut [0.0; 128]);
        if round % 3 == 0 {
            drop(renderer);
            assert_eq!(controller.state(), EngineState::RendererGone);
        } else {
            drop(controller);
            assert!(renderer.render(&mut [0.0; 128]).controller_dropped);
        }
    }
}

#[test]
fn a_sound_thread_renders_ahead_and_returns_the_renderer() {
    let (mut controller, renderer) = Engine::new(settings()).expect("an engine");
    let id = controller.add_source(Vec3::X).expect("a slot");
    let clip: Arc<[f32]> = (0..1000).map(|n| (n as f32 * 0.1).sin()).collect();
    controller.play(id, clip, true).expect("is there");
    let ticked = controller.tick(ListenerPose::default(), &[]);
    ticked.expect("a good pose");
    assert!(SoundThread::start(Engine::new(settings()).expect("an engine").1, 0).is_err());
    let (sound, mut output) = SoundThread::start(renderer, 2).expect("a thread");
    assert_eq!(output.latency_frames(), 512);
    let mut block = [0.0; 200];
    let mut loudest = 0.0f32;
    while loudest < 0.01 {
        output.read(&mut block);
        loudest = block.iter().fold(loudest, |most, s| most.max(s.abs()));
        thread::yield_now();
    }
    let mut renderer = sound.stop().expect("did not panic");
    assert!(renderer.render(&mut block).frames == 100);
    // The thread has ended: the ring runs empty.
    let missing = (0..20).map(|_| output.read(&mut block)).sum::<usize>();
    assert!(missing >= 2000 - 512);
}

#[test]
fn a_null_device_calls_back_until_it_is_stopped() {
    let (_controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let calls = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&calls);
    let device = NullDevice::start(44_100, 64, AffinityPolicy::System, move |block| {
        renderer.render(block);
        counted.fetch_add(1, Ordering::Relaxed);
    });
    let device = device.expect("a thread");
    while calls.load(Ordering::Relaxed) < 10 {
        thread::yield_now();
    }
    let report = device.stop();
    assert!(report.blocks >= 10 && report.missed <= report.blocks);
    assert!(NullDevice::start(0, 64, AffinityPolicy::System, |_| {}).is_err());
}
