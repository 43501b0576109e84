//! Sources rendered apart for a mixer of the app's own: the buses sum to the ordinary mix, each has its own source only, and
//! wrong calls are refused without harm.

use std::sync::Arc;

use foresound::runtime::{
    AffinityPolicy, BusStatus, Clip, Controller, Engine, EngineSchedule, EngineSettings, FrameTime,
    PlaySettings, Renderer,
};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, procedural};
use foresound::{Layout, SourceSettings};
use glam::Vec3;

/// Audio frames of a graphics frame; several chunks of generation, none of them whole.
const BLOCK: usize = 735;

fn settings(has_buses: bool, layout: Layout) -> EngineSettings {
    let mut settings = EngineSettings::default();
    settings.block_frames = 1024;
    settings.generation.max_sources = 5;
    settings.generation.layout = layout;
    settings.generation.channels = Some(layout.channels().max(2));
    settings.generation.limiter = false;
    settings.generation.source_buses = has_buses;
    settings.propagation.guide_rays = 128;
    settings.propagation.source_rays = 32;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    settings
}

fn doorway() -> (Arc<Scene>, [Vec3; 2], procedural::BenchmarkScene) {
    let layout = procedural::doorway();
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&layout.mesh, &table, &SceneSettings::default()).expect("commits");
    let positions = [layout.sources[0].1, layout.sources[1].1];
    (Arc::new(scene), positions, layout)
}

/// Noise of its own for each number.
fn noise(number: u32, samples: usize) -> Arc<[f32]> {
    let mut state = 0x9e37_79b9u32.wrapping_mul(number + 1);
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    (0..samples).map(|_| next()).collect()
}

/// An app's source: a signal of the app, and how much of it was played.
struct Voice {
    id: SourceId,
    signal: Arc<[f32]>,
    at: usize,
}

/// The outputs of a block: one of each voice, and the rest.
struct Buses {
    outputs: Vec<Vec<f32>>,
    statuses: Vec<BusStatus>,
}

impl Buses {
    fn sum(&self) -> Vec<f32> {
        let count = self.outputs[0].len();
        let sample = |n: usize| self.outputs.iter().map(|output| output[n]).sum();
        (0..count).map(sample).collect()
    }
}

fn render_buses(renderer: &mut Renderer, voices: &mut [Voice], is_paused: bool) -> Buses {
    let samples = renderer.channels() * BLOCK;
    assert_eq!(renderer.begin_block(BLOCK), BusStatus::Own);
    let (mut outputs, mut statuses) = (Vec::new(), Vec::new());
    for voice in voices {
        let mut output = vec![f32::NAN; samples];
        let dry = &voice.signal[voice.at..voice.at + BLOCK];
        let status = renderer.render_source(voice.id, dry, &mut output);
        // A source's sound begins with its first graphics frame, and rests in a pause.
        if status != BusStatus::UnknownSource && !is_paused {
            voice.at += BLOCK;
        }
        statuses.push(status);
        outputs.push(output);
    }
    let mut rest = vec![f32::NAN; samples];
    let (status, report) = renderer.render_reverb(&mut rest);
    assert_eq!((status, report.frames), (BusStatus::Own, BLOCK as u32));
    outputs.push(rest);
    Buses { outputs, statuses }
}

fn largest(samples: &[f32]) -> f32 {
    samples
        .iter()
        .fold(0.0, |most, sample| sample.abs().max(most))
}

/// A walk in the doorway with three sources of the app (one without a position), one that the engine plays, a change of gain, of
/// the layout, and of the scene, a removed source.
///
/// A bus sums other lists of voices in another order: with f32 each of the some thousand additions behind a sample is off by
/// 6e-8 of its partial sum at most, mostly with different signs. The bound is 1e-5 of the loudest sample, -100 dB.
#[test]
fn the_buses_sum_to_the_mix() {
    const FRAMES: usize = 90;
    let (scene, positions, layout) = doorway();
    for (channels, changed) in [
        (Layout::Binaural, Layout::Stereo),
        (Layout::Stereo, Layout::Binaural),
        (Layout::Surround51, Layout::Mono),
        (Layout::Ambisonics3, Layout::Ambisonics1),
    ] {
        let mut engines = [false, true].map(|has_buses| {
            let (mut controller, renderer) =
                Engine::new(settings(has_buses, channels)).expect("an engine");
            controller.set_scene(Arc::clone(&scene)).expect("accepted");
            (controller, renderer)
        });
        let add = |controller: &mut Controller| {
            let ids = [0, 1, 0, 1].map(|n| {
                let id = controller.add_source(positions[n] + 0.1 * Vec3::ONE);
                id.expect("a slot")
            });
            let mut flat = SourceSettings::default();
            flat.is_2d = true;
            controller.configure_source(ids[2], flat).expect("in range");
            let own: Arc<[f32]> = noise(3, 10_000);
            controller.play(ids[3], own, true).expect("is there");
            ids
        };
        let ids = engines.each_mut().map(|(controller, _)| add(controller));
        assert_eq!(ids[0], ids[1]);
        let ids = ids[0];
        let [(mixed, mix_renderer), (apart, bus_renderer)] = &mut engines;
        let mut voices: Vec<Voice> = (0..3)
            .map(|n| Voice {
                id: ids[n],
                signal: noise(n as u32, FRAMES * BLOCK),
                at: 0,
            })
            .collect();
        for voice in &voices {
            let clip = Clip::mono(voice.signal.to_vec());
            let play = PlaySettings::default();
            mixed.play_clip(voice.id, clip, play).expect("is there");
        }
        let (mut worst, mut loudest, mut own) = ((0.0f32, 0), 0.0f32, [0.0f32; 4]);
        for frame in 0..FRAMES {
            let ear = layout
                .walk
                .from
                .lerp(layout.walk.to, frame as f32 / FRAMES as f32);
            for controller in [&mut *mixed, &mut *apart] {
                match frame {
                    20 => controller
                        .fade_source_gain(ids[0], 0.3, 0.2)
                        .expect("is there"),
                    30 => controller.mute_source(ids[3], true).expect("is there"),
                    40 => controller.set_layout(changed).expect("has room"),
                    55 => controller.remove_source(ids[1]).expect("is there"),
                    60 => controller.mute_source(ids[3], false).expect("is there"),
                    70 => controller.set_scene(Arc::clone(&scene)).expect("accepted"),
                    80 => controller.pause(),
                    84 => controller.resume(),
                    _ => {}
                }
                let listener = ListenerPose::facing(ear, 0.02 * frame as f32);
                controller.tick(listener, &[]).expect("a good pose");
            }
            let mut mix = vec![0.0; mix_renderer.channels() * BLOCK];
            let report = mix_renderer.render(&mut mix);
            // The pause has faded out within its first block.
            let is_paused = (81..84).contains(&frame);
            let buses = render_buses(bus_renderer, &mut voices, is_paused);
            // The removed one fades out from other samples: the engine's own are gone.
            let is_fading = (55..58).contains(&frame);
            for (sum, mix) in buses.sum().iter().zip(&mix) {
                assert!(sum.is_finite());
                if !is_fading && (sum - mix).abs() > worst.0 {
                    worst = ((sum - mix).abs(), frame);
                }
                loudest = loudest.max(mix.abs());
            }
            for (own, output) in own.iter_mut().zip(&buses.outputs) {
                *own = own.max(largest(output));
            }
            if (10..55).contains(&frame) {
                assert!(report.voices > 0);
                use BusStatus::{Own, Shared};
                assert_eq!(buses.statuses, [Own, Own, Shared], "frame {frame}");
            }
        }
        let (off, at) = worst;
        assert!(
            off < 1e-5 * loudest,
            "{channels}: {off} of {loudest} in frame {at}"
        );
        // Two sources have buses; the one without a position and the rest are in the last one.
        assert!(
            own[0] > 0.01 * loudest && own[1] > 0.01 * loudest,
            "{own:?}"
        );
        assert!(own[2] == 0.0 && own[3] > 0.1 * loudest, "{own:?}");
    }
}

/// One source's bus has the same bits whatever the others play.
#[test]
fn a_bus_holds_its_own_source_only() {
    let (scene, positions, layout) = doorway();
    let mut outputs = Vec::new();
    for level in [0.0, 1.0] {
        let (mut controller, mut renderer) =
            Engine::new(settings(true, Layout::Binaural)).expect("an engine");
        controller.set_scene(Arc::clone(&scene)).expect("accepted");
        let ids = positions.map(|position| controller.add_source(position).expect("a slot"));
        let other: Vec<f32> = noise(1, 40 * BLOCK).iter().map(|s| s * level).collect();
        let mut voices = [(ids[0], noise(0, 40 * BLOCK)), (ids[1], other.into())]
            .map(|(id, signal)| Voice { id, signal, at: 0 });
        let mut heard = [Vec::new(), Vec::new(), Vec::new()];
        for frame in 0..40 {
            let ear = layout.walk.from.lerp(layout.walk.to, frame as f32 / 40.0);
            let listener = ListenerPose::facing(ear, 0.0);
            controller.tick(listener, &[]).expect("a good pose");
            let buses = render_buses(&mut renderer, &mut voices, false);
            for (heard, output) in heard.iter_mut().zip(buses.outputs) {
                heard.extend(output);
            }
        }
        outputs.push(heard);
    }
    let [quiet, loud] = [&outputs[0], &outputs[1]];
    assert!(largest(&quiet[0]) > 0.01);
    assert_eq!(quiet[0], loud[0]);
    assert_eq!(largest(&quiet[1]), 0.0);
    assert!(largest(&loud[1]) > 0.01);
    // The late reverb is one bus for both.
    assert!(largest(&quiet[2]) > 1e-4 && quiet[2] != loud[2]);
}

/// More sources than slots: those that share one are in the last bus, and no sound is lost or doubled.
#[test]
fn sources_that_share_a_slot_are_in_the_last_bus() {
    const SOURCES: usize = 20;
    const FRAMES: usize = 80;
    let mut engines = [false, true].map(|has_buses| {
        let mut settings = settings(has_buses, Layout::Stereo);
        settings.max_sources = Some(SOURCES);
        settings.generation.max_sources = 8;
        Engine::new(settings).expect("an engine")
    });
    let mut voices = Vec::new();
    for n in 0..SOURCES {
        let signal = noise(n as u32, FRAMES * BLOCK);
        let position = Vec3::new(n as f32 - 10.0, 0.5, -2.0 - (n % 5) as f32);
        let [id, same] = engines
            .each_mut()
            .map(|(controller, _)| controller.add_source(position).expect("a handle"));
        assert_eq!(id, same);
        let clip = Clip::mono(signal.to_vec());
        let [(mixed, _), _] = &mut engines;
        mixed
            .play_clip(id, clip, PlaySettings::default())
            .expect("is there");
        voices.push(Voice { id, signal, at: 0 });
    }
    let [(mixed, mix_renderer), (apart, bus_renderer)] = &mut engines;
    let (mut worst, mut loudest) = (0.0f32, 0.0f32);
    let mut last = Vec::new();
    for frame in 0..FRAMES {
        let ear = Vec3::X * (frame as f32 * 0.2 - 8.0);
        for controller in [&mut *mixed, &mut *apart] {
            let listener = ListenerPose::facing(ear, 0.0);
            controller.tick(listener, &[]).expect("a good pose");
        }
        let mut mix = vec![0.0; 2 * BLOCK];
        mix_renderer.render(&mut mix);
        let buses = render_buses(bus_renderer, &mut voices, false);
        for (sum, mix) in buses.sum().iter().zip(&mix) {
            worst = worst.max((sum - mix).abs());
            loudest = loudest.max(mix.abs());
        }
        last = buses.statuses;
    }
    assert!(worst < 1e-5 * loudest, "{worst} of {loudest}");
    let count = |status| last.iter().filter(|own| **own == status).count();
    // Six slots of eight have one source each.
    assert!((1..=6).contains(&count(BusStatus::Own)), "{last:?}");
    assert!(count(BusStatus::Shared) >= 2, "{last:?}");
}

/// A source that is removed while the app still plays it ends without a click.
#[test]
fn a_removed_source_fades_out() {
    let (mut controller, mut renderer) =
        Engine::new(settings(true, Layout::Mono)).expect("an engine");
    let id = controller.add_source(Vec3::NEG_Z).expect("a slot");
    let tone: Vec<f32> = (0..40 * BLOCK).map(|n| (0.02 * n as f32).sin()).collect();
    let mut voices = [Voice {
        id,
        signal: tone.into(),
        at: 0,
    }];
    let mut sound: Vec<f32> = Vec::new();
    for frame in 0..40 {
        if frame == 20 {
            controller.remove_source(id).expect("is there");
        }
        controller
            .tick(ListenerPose::default(), &[])
            .expect("a good pose");
        let buses = render_buses(&mut renderer, &mut voices, false);
        sound.extend(buses.sum().iter().step_by(2));
        let is_known = buses.statuses[0] == BusStatus::Own;
        assert!(
            is_known == (frame < 20) || frame < 3,
            "frame {frame}: {:?}",
            buses.statuses
        );
    }
    let step = |part: &[f32]| {
        let steps = part.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        steps.fold(0.0f32, f32::max)
    };
    // The fade of 256 frames adds at most 1.5 / 256 a frame to the steps of the tone, 0.02 a frame, at an amplitude of 1.4.
    let steady = step(&sound[10 * BLOCK..18 * BLOCK]);
    assert!(steady > 0.01);
    assert!(
        step(&sound[18 * BLOCK..]) < 1.4 * steady,
        "{} and {steady}",
        step(&sound[18 * BLOCK..])
    );
    assert_eq!(largest(&sound[30 * BLOCK..]), 0.0);
}

#[test]
fn wrong_calls_are_refused_and_sound_goes_on() {
    let (scene, positions, layout) = doorway();
    let (mut controller, mut renderer) =
        Engine::new(settings(true, Layout::Stereo)).expect("an engine");
    controller.set_scene(scene).expect("accepted");
    let id = controller.add_source(positions[0]).expect("a slot");
    let listener = ListenerPose::facing(layout.walk.from, 0.0);
    let dry = noise(0, 1024);
    let (mut bus, mut rest) = (vec![1.0; 2 * BLOCK], vec![1.0; 2 * BLOCK]);
    // Without a block.
    assert_eq!(
        renderer.render_source(id, &dry[..BLOCK], &mut bus),
        BusStatus::WrongOrder
    );
    assert_eq!(renderer.render_reverb(&mut rest).0, BusStatus::WrongOrder);
    assert_eq!(largest(&bus) + largest(&rest), 0.0);
    assert_eq!(renderer.begin_block(0), BusStatus::WrongSize);
    assert_eq!(renderer.begin_block(1025), BusStatus::WrongSize);
    let mut heard = 0.0f32;
    for frame in 0..40 {
        controller.tick(listener, &[]).expect("a good pose");
        assert_eq!(renderer.begin_block(BLOCK), BusStatus::Own);
        bus.fill(1.0);
        let wrong = [
            renderer.render_source(id, &dry[..BLOCK - 1], &mut bus),
            renderer.render_source(id, &dry[..BLOCK], &mut bus[..2 * BLOCK - 1]),
        ];
        assert_eq!(wrong, [BusStatus::WrongSize; 2]);
        let unknown = renderer.render_source(SourceId::new(77, 3), &dry[..BLOCK], &mut bus);
        assert_eq!(unknown, BusStatus::UnknownSource);
        assert_eq!(largest(&bus), 0.0);
        let status = renderer.render_source(id, &dry[..BLOCK], &mut bus);
        heard = heard.max(largest(&bus));
        if frame > 3 {
            assert_eq!(status, BusStatus::Own);
            assert!(largest(&bus) > 0.0);
            let again = renderer.render_source(id, &dry[..BLOCK], &mut bus);
            assert_eq!(again, BusStatus::WrongOrder);
            assert_eq!(largest(&bus), 0.0);
        }
        // Every third block ends wrongly or not at all.
        match frame % 3 {
            0 => assert_eq!(renderer.render_reverb(&mut rest).0, BusStatus::Own),
            1 => assert_eq!(
                renderer.render_reverb(&mut rest[1..]).0,
                BusStatus::WrongSize
            ),
            _ => {}
        }
    }
    assert!(heard > 0.01);
    assert_eq!(controller.statistics().blocks, 40);
    // The ordinary call renders the same engine: the source is silent, its reverb is not.
    renderer.render(&mut rest);
    assert!(largest(&rest) > 0.0);
    assert_eq!(controller.statistics().blocks, 41);
    let (_controller, mut without) =
        Engine::new(settings(false, Layout::Stereo)).expect("an engine");
    assert_eq!(without.begin_block(BLOCK), BusStatus::Off);
    assert_eq!(
        without.render_source(id, &dry[..BLOCK], &mut bus),
        BusStatus::Off
    );
    assert_eq!(without.render_reverb(&mut rest).0, BusStatus::Off);
}
