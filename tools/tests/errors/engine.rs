//! Settings out of range, and engine calls with invalid handles, poses and samples.

use std::sync::Arc;

use foresound::extrapolation::PredictorKind;
use foresound::generation::{GeneratorSettings, Hrtf, Layout};
use foresound::runtime::{
    AffinityPolicy, Budget, DeviceOutput, Engine, EngineSettings, FrameTime, NullDevice,
    OfflineRenderer, OfflineSettings, PlaySettings, Poses, QualityChoice, QualityLevel, Schedule,
    SoundThread, Threads,
};
use foresound::scene::{
    DistanceCurve, DistanceTable, InstanceId, InstancePose, ListenerPose, MaterialTable, Scene,
    SceneSettings, SourceId, SourceMix, SourcePose,
};
use glam::{DVec3, Quat, Vec3};

use crate::Errors;
use crate::meshes::{commit, committed, room};

pub(crate) fn small() -> EngineSettings {
    let mut settings = EngineSettings::default();
    settings.generation = GeneratorSettings::default();
    settings.generation.rate_hz = 16_000;
    settings.generation.max_sources = 1;
    settings.generation.max_delay_s = 0.05;
    settings.hrtf = Some(hrtf());
    settings.affinity = AffinityPolicy::System;
    settings
}

fn hrtf() -> Arc<Hrtf> {
    Arc::new(Hrtf::omnidirectional(16_000).expect("an HRTF set"))
}

pub(crate) fn make(errors: &mut Errors) {
    settings(errors);
    offline(errors);
    at_work(errors);
}

fn settings(errors: &mut Errors) {
    let mut with = |what: &str, change: &dyn Fn(&mut EngineSettings)| {
        let mut settings = small();
        change(&mut settings);
        errors.of(what, Engine::new(settings).map(drop));
    };
    with("a block of one", &|s| s.block_frames = 1);
    with("no memory", &|s| s.max_memory_bytes = 1);
    with("no voices", &|s| s.generation.max_voices = 0);
    with("no distance", &|s| s.propagation.min_distance_m = 0.0);
    with("nine seconds", &|s| s.frame_time = FrameTime::Fixed(9.0));
    with("another HRTF set", &|s| s.generation.rate_hz = 48_000);
    with("a ceiling", &|s| s.generation.ceiling_db = 3.0);
    with("seventeen channels", &|s| s.generation.channels = Some(17));
    with("5.1 on two channels", &|s| {
        s.generation.layout = Layout::Surround51;
        s.generation.channels = Some(2);
    });
    with("no limit of time", &|s| {
        s.budget.update_s = Some(f64::NAN);
    });
    with("no quality level", &|s| {
        s.budget = {
            let mut budget = Budget::default();
            budget.quality = QualityChoice::AtLeast(QualityLevel(200));
            budget
        };
    });
    errors.of(
        "a limiter",
        foresound::generation::Limiter::new(16_000, 2, 3.0),
    );
    errors.of(
        "a limiter of no channels",
        foresound::generation::Limiter::new(16_000, 0, -1.0),
    );
    errors.of("no such layout", "9.1".parse::<Layout>());
    errors.of("no such HRTF set", Hrtf::builtin(8000));
    errors.of("no HRTF set", Hrtf::parse(b"no head", "an HRTF set"));
    errors.of("a rate of 1 Hz", Hrtf::omnidirectional(1));
    errors.of("no threads", Threads::start(0));
    let device = NullDevice::start(0, 0, AffinityPolicy::System, |_| ());
    errors.of("a device without frames", device);
}

fn offline(errors: &mut Errors) {
    let mut good = OfflineSettings::default();
    good.graphics_rate_hz = 50.0;
    good.block_frames = 64;
    good.schedule = Schedule::Synchronous;
    good.predictor = PredictorKind::Hold;
    good.generation = small().generation;
    let mut with = |what: &str, change: &dyn Fn(&mut OfflineSettings)| {
        let mut settings = good.clone();
        change(&mut settings);
        let renderer = OfflineRenderer::new(committed(&room()), hrtf(), settings);
        errors.of(what, renderer.map(drop));
    };
    with("no frames", &|s| s.graphics_rate_hz = 0.0);
    with("a block of one", &|s| s.block_frames = 1);
    with("a level of ages", &|s| {
        s.schedule = Schedule::Asynchronous {
            extrapolation_level: 5000,
            latency: foresound::runtime::Latency::default(),
        };
    });
    with("two listeners", &|s| s.generation.listeners = 2);
    let mut renderer = OfflineRenderer::new(committed(&room()), hrtf(), good).expect("settings");
    let mut frame = |what: &str, change: &dyn Fn(&mut Poses)| {
        let mut poses = Poses::default();
        poses
            .sources
            .push(SourcePose::at(SourceId::new(0, 0), Vec3::ONE));
        change(&mut poses);
        let mut silence = |_: usize, _: u64, samples: &mut [f32]| samples.fill(0.0);
        let rendered = renderer.next_frame(&poses, &mut silence, &mut |_| Ok(()));
        errors.of(what, rendered);
    };
    frame("a 2D source offline", &|poses| {
        poses.sources[0].settings.is_2d = true;
    });
    frame("an orientation offline", &|poses| {
        poses.sources[0].orientation = Quat::from_xyzw(f32::MAX, 0.0, 0.0, 0.0);
    });
    let first = renderer.set_output(Layout::Stereo, &hrtf());
    first.expect("two channels");
    let second = renderer.set_output(Layout::Mono, &hrtf());
    errors.of("a second output", second);
}

fn at_work(errors: &mut Errors) {
    let mut surround = small();
    surround.generation.layout = Layout::Surround51;
    let (_controller, renderer) = Engine::new(surround).expect("an engine");
    let device = Box::new(foresound::device::NullOutput);
    let output = DeviceOutput::start(renderer, 2, device);
    errors.of("5.1 on a device", output.map(drop));
    let (mut controller, renderer) = Engine::new(small()).expect("an engine");
    let layout = controller.set_layout(Layout::Ambisonics3);
    errors.of("Ambisonics on two channels", layout);
    errors.of("no blocks ahead", SoundThread::start(renderer, 0).map(drop));
    let id = controller.add_source(Vec3::ONE).expect("a slot");
    errors.of("a second source", controller.add_source(Vec3::ONE));
    let (mut worn, _renderer) = Engine::new(small()).expect("an engine");
    for _ in 1..=SourceId::LAST_GENERATION {
        let id = worn.add_source(Vec3::ONE).expect("a slot");
        worn.remove_source(id).expect("is there");
    }
    errors.of("a source too many", worn.add_source(Vec3::ONE));
    let stale = SourceId::new(7, 7);
    errors.of("a stale source", controller.remove_source(stale));
    errors.of("a gain", controller.set_source_gain(id, -1.0));
    let other = ListenerPose::facing(Vec3::ONE, 0.0);
    errors.of("a second listener", controller.set_listener(1, other));
    let mut wrong = |what: &str, change: fn(&mut SourceMix)| {
        let mut settings = controller.source_settings(id).expect("is there");
        change(&mut settings.mix);
        errors.of(what, controller.configure_source(id, settings));
    };
    wrong("a strength", |mix| mix.occlusion = 2.0);
    wrong("a curve", |mix| {
        let (min_m, max_m) = (2.0, 1.0);
        mix.distance = DistanceCurve::Linear { min_m, max_m };
    });
    let mut settings = controller.source_settings(id).expect("is there");
    settings.extent.semi_axes_m.y = -1.0;
    errors.of("a size", controller.configure_source(id, settings));
    settings.extent = foresound::SourceExtent::sphere(1.0);
    settings.extent.points = 33;
    errors.of("many points", controller.configure_source(id, settings));
    errors.of(
        "three channels",
        foresound::Clip::with_channels(vec![0.0; 9], 3),
    );
    let clip = foresound::Clip::mono(vec![0.0; 8]);
    let mut play = |what: &str, settings: PlaySettings| {
        errors.of(what, controller.play_clip(id, clip.clone(), settings));
    };
    play(
        "a late start",
        PlaySettings {
            first_frame: 9,
            ..PlaySettings::default()
        },
    );
    let loop_frames = Some([3, 3]);
    play(
        "an empty loop",
        PlaySettings {
            loop_frames,
            ..PlaySettings::default()
        },
    );
    errors.of("a pitch", controller.set_source_pitch(id, 9.0));
    errors.of("a seek", controller.seek_source(id, 0));
    errors.of("a ramp", controller.fade_source_gain(id, 1.0, -1.0));
    let mut material = foresound::Material {
        name: "no such material".into(),
        absorption: [0.5; 8],
        scattering: [0.0; 8],
        transmission: [0.0; 8],
    };
    errors.of("no material", controller.set_material(&material));
    material.transmission = [0.6; 8];
    errors.of("too much passes", controller.set_material(&material));
    errors.of("no point", DistanceTable::new(&[]));
    errors.of("falling", DistanceTable::new(&[[2.0, 1.0], [1.0, 1.0]]));
    errors.of("a table's gain", DistanceTable::new(&[[2.0, -1.0]]));
    errors.of("not finite", controller.move_source(id, Vec3::NAN));
    errors.of("an empty stream", controller.stream(id, 0).map(drop));
    let flat = ListenerPose {
        orientation: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0),
        ..ListenerPose::default()
    };
    errors.of("no orientation", controller.tick(flat, &[]));
    let pose = SourcePose {
        orientation: Quat::from_xyzw(f32::NAN, 0.0, 0.0, 0.0),
        ..SourcePose::at(id, Vec3::ONE)
    };
    let ticked = controller.tick(ListenerPose::default(), &[pose]);
    errors.of("a source's orientation", ticked);
    let at = InstancePose::at(InstanceId::default(), DVec3::ONE);
    let removed = controller.remove_instance(InstanceId::default());
    errors.of("no instance", removed);
    let (table, settings) = (MaterialTable::built_in(), SceneSettings::default());
    let cancelled = Scene::commit_observed(&room(), &table, &settings, &mut |_| false);
    errors.of("a cancelled scene", cancelled);
    let mut scene = commit(&room(), &settings).expect("a scene");
    scene.add_instance(committed(&room()), &at).expect("a part");
    errors.of("a scene with parts", controller.set_scene(Arc::new(scene)));
}
