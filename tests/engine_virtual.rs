//! The engine on a virtual clock.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use foresound::extrapolation::PredictorKind;
use foresound::runtime::{EngineSchedule, EngineSettings, VirtualClock, VirtualEngine};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, SourcePose, procedural};
use foresound::{GeometricSettings, SourceId};
use glam::Vec3;

const RATE_HZ: f64 = 74.6;

/// Graphics frames before sources play, in silence.
const LEAD_IN_FRAMES: u32 = 20;

/// An engine in the doorway scene with two sources.
fn engine(
    schedule: EngineSchedule,
    predictor: PredictorKind,
    delays: &[u32],
) -> (VirtualEngine, Vec<SourceId>) {
    let doorway = procedural::doorway();
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&doorway.mesh, &table, &SceneSettings::default()).expect("commits");
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = 2;
    settings.schedule = schedule;
    settings.predictor = predictor;
    let clock = VirtualClock {
        graphics_rate_hz: RATE_HZ,
        delays: delays.to_vec(),
    };
    let mut engine = VirtualEngine::new(settings, clock).expect("settings");
    let controller = engine.controller();
    controller.set_scene(Arc::new(scene)).expect("a scene");
    let ids = doorway.sources.iter().take(2);
    let ids = ids.map(|(_, position)| controller.add_source(*position).expect("a slot"));
    let ids = ids.collect();
    (engine, ids)
}

/// Speech of a source, 44.1 kHz.
fn voice(number: usize) -> Vec<f32> {
    let name = format!("assets/speech/voice{:02}.wav", number + 1);
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    let bytes = fs::read(file).expect("the repository has voices");
    // 44 bytes of header, then mono samples of 16 bits.
    let samples = bytes[44..].chunks_exact(2);
    let value = |b: &[u8]| f32::from(i16::from_le_bytes([b[0], b[1]])) / 32_768.0;
    samples.map(value).collect()
}

/// Sound of a listener's walk through the doorway.
fn walk(
    schedule: EngineSchedule,
    predictor: PredictorKind,
    delays: &[u32],
    frames: u32,
) -> Vec<f32> {
    let (mut engine, ids) = engine(schedule, predictor, delays);
    let along = procedural::doorway().walk;
    let direction = (along.to - along.from).normalize();
    let start = along.from.lerp(along.to, 0.3);
    let mut sound = Vec::new();
    for frame in 0..LEAD_IN_FRAMES + frames {
        if frame == LEAD_IN_FRAMES {
            for (number, id) in ids.iter().enumerate() {
                let clip = voice(number).into();
                engine.controller().play(*id, clip, true).expect("plays");
            }
            sound.clear();
        }
        let position: Vec3 = start + direction * (1.4 * engine.time_s()) as f32;
        let listener = ListenerPose::facing(position, 0.0);
        let result = engine.next_frame(listener, &[], |block| sound.extend_from_slice(block));
        result.expect("valid poses");
    }
    sound
}

const BEST: PredictorKind = PredictorKind::Geometric(GeometricSettings::FULL);

#[test]
fn the_same_walk_gives_the_same_bits() {
    let run = || walk(EngineSchedule::Asynchronous, BEST, &[7, 3, 12], 60);
    let bits = |sound: Vec<f32>| sound.into_iter().map(f32::to_bits).collect::<Vec<_>>();
    let first = bits(run());
    assert!(first.len() > 60_000);
    assert!(first == bits(run()));
}

/// The first update is used at once, each later one when its own delay has passed.
#[test]
fn updates_arrive_by_the_clock() {
    let (mut engine, _) = engine(EngineSchedule::Asynchronous, BEST, &[7, 3]);
    let mut arrivals = Vec::new();
    for frame in 0..30 {
        let listener = ListenerPose::facing(procedural::doorway().walk.standing, 0.0);
        let before = engine.controller().statistics().updates;
        let result = engine.next_frame(listener, &[], |_| ());
        result.expect("valid poses");
        if engine.controller().statistics().updates > before {
            arrivals.push(frame);
        }
    }
    assert_eq!(arrivals, [0, 8, 11, 18, 21, 28]);
}

/// Where nothing moves updates keep what the last ones have found, for the same sound.
#[test]
fn at_rest_no_rays_are_cast() {
    for schedule in [EngineSchedule::Asynchronous, EngineSchedule::Synchronous] {
        let (mut engine, _) = engine(schedule, BEST, &[3]);
        let standing = procedural::doorway().walk.standing;
        let mut rays = [0; 200];
        for (frame, rays) in rays.iter_mut().enumerate() {
            // The head turns, and walks in the end.
            let walked = 0.02 * frame.saturating_sub(180) as f32;
            let listener = ListenerPose::facing(standing + Vec3::X * walked, 0.01 * frame as f32);
            let result = engine.next_frame(listener, &[], |_| ());
            result.expect("valid poses");
            *rays = engine.controller().statistics().rays;
        }
        assert!(rays[..10].iter().all(|rays| *rays > 0), "{schedule:?}");
        assert!(rays[160..180].iter().all(|rays| *rays == 0), "{schedule:?}");
        assert!(rays[195..].iter().all(|rays| *rays > 0), "{schedule:?}");
    }
}

/// Signal to noise of the estimate's best multiple, in dB, over both ears.
fn si_snr_db(reference: &[f32], estimate: &[f32]) -> f64 {
    let product = |a: &[f32], b: &[f32]| -> f64 {
        let each = a.iter().zip(b);
        each.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
    };
    let energy = product(reference, reference);
    let scale = product(reference, estimate) / energy;
    let noise = product(estimate, estimate) - scale * scale * energy;
    10.0 * (scale * scale * energy / noise.max(1e-30)).log10()
}

/// The asynchronous engine with default settings sounds like the synchronous one, at the paper's highest level.
#[test]
fn asynchrony_is_inaudible() {
    let default = EngineSettings::default().predictor;
    let reference = walk(EngineSchedule::Synchronous, PredictorKind::Hold, &[], 150);
    let snr_db = |predictor| {
        let schedule = EngineSchedule::Asynchronous;
        si_snr_db(&reference, &walk(schedule, predictor, &[13], 150))
    };
    let [found_db, held_db] = [default, PredictorKind::Hold].map(snr_db);
    println!("{found_db:.2} dB, hold {held_db:.2} dB");
    assert!(found_db >= 25.0, "{found_db} dB");
    assert!(
        held_db < 15.0,
        "hold has {held_db} dB: the walk asks nothing of a predictor"
    );
}

/// Graphics frames from frame 40 on in which updates arrive, with their extrapolation levels, until frame 100. Listener and source
/// are so many metres aside, by graphics frames since frame 40.
fn updates(
    listener_m: impl Fn(f32) -> f32,
    source_m: impl Fn(f32) -> f32,
) -> impl Iterator<Item = (u32, u32)> {
    let (mut engine, ids) = engine(
        EngineSchedule::Asynchronous,
        PredictorKind::default(),
        &[13],
    );
    let doorway = procedural::doorway();
    let start = doorway.walk.from.lerp(doorway.walk.to, 0.3);
    let aside = (doorway.walk.to - doorway.walk.from).normalize();
    let (mut before, mut updates) = (0, Vec::new());
    for frame in 0..100 {
        let since = frame as f32 - 40.0;
        let listener = ListenerPose::facing(start + aside * listener_m(since), 0.0);
        let source = SourcePose::at(ids[0], doorway.sources[0].1 + aside * source_m(since));
        engine
            .next_frame(listener, &[source], |_| ())
            .expect("valid poses");
        let statistics = engine.controller().statistics();
        if frame >= 40 && statistics.updates > before {
            updates.push((frame - 40, statistics.extrapolation_level));
        }
        before = statistics.updates;
    }
    updates.into_iter()
}

/// Graphics frames from a step of so many metres in graphics frame 40 to the arrival of the next update, and its extrapolation
/// level; `None` without one in 60 frames.
fn next_update(listener_m: f32, source_m: f32) -> Option<(u32, u32)> {
    let step = |by_m: f32| move |since: f32| if since >= 0.0 { by_m } else { 0.0 };
    updates(step(listener_m), step(source_m)).next()
}

/// L = 12: an update takes thirteen graphics frames, an urgent one for two sources 0.12 of that, two frames: L = 1. A graphics
/// frame is taken by the first block after its tick.
#[test]
fn an_urgent_update_follows_a_jump_and_takes_its_own_time() {
    for (listener_m, source_m) in [(2.0, 0.0), (0.0, 2.0), (2.0, 2.0)] {
        let (frames, level) = next_update(listener_m, source_m).expect("an update");
        assert!((2..=3).contains(&frames), "{frames} graphics frames");
        assert_eq!(level, 1, "{listener_m} m, {source_m} m");
    }
}

/// An update under way is not dropped for a step that may be motion.
#[test]
fn a_step_is_no_jump() {
    let (_, level) = next_update(0.1, 0.1).expect("an update");
    assert_eq!(level, 12);
}

/// [`updates`] after frame 40 while the listener alone moves.
fn updates_on_the_way(way_m: impl Fn(f32) -> f32) -> Vec<(u32, u32)> {
    let after = |(frame, _): &(u32, u32)| *frame > 0;
    updates(way_m, |_| 0.0).filter(after).collect()
}

/// The listener begins to run: what is under way for its position of rest is dropped within four graphics frames, and a plain
/// update takes 0.66 of thirteen frames.
#[test]
fn a_plain_update_follows_a_fast_turn() {
    let start = |frame: f32| 5.0 / RATE_HZ as f32 * frame.max(0.0);
    let (frames, level) = updates_on_the_way(start)[0];
    assert!((9..=14).contains(&frames), "{frames} graphics frames");
    assert_eq!(level, 8);
    let walk = |frame: f32| 1.4 / RATE_HZ as f32 * frame.max(0.0);
    assert_eq!(updates_on_the_way(walk)[0].1, 12);
}

/// To and fro at 5 m/s, which no update foresees: after each one that is dropped a plain and a whole one arrive.
#[test]
fn updates_arrive_although_the_listener_turns_all_the_time() {
    let sway = |frame: f32| 5.0 / RATE_HZ as f32 * (frame.rem_euclid(12.0) - 6.0).abs();
    let updates = updates_on_the_way(sway);
    let whole = updates.iter().filter(|(_, level)| *level == 12).count();
    // Within 60 frames: at most thirteen that are dropped, nine and thirteen that arrive.
    assert!(updates.len() >= 3 && whole >= 1, "{updates:?}");
}

/// Every graphics frame puts the listener into the other room, and so replaces most voices: new ones wait until the old ones have
/// faded, which takes as long as a frame. The frames themselves are not late: at 25 a second each is committed before the next tick.
#[test]
fn frames_are_in_time_though_voices_wait_for_fades() {
    let doorway = procedural::doorway();
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&doorway.mesh, &table, &SceneSettings::default()).expect("commits");
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = 16;
    settings.schedule = EngineSchedule::Synchronous;
    let clock = VirtualClock {
        graphics_rate_hz: 25.0,
        delays: Vec::new(),
    };
    let mut engine = VirtualEngine::new(settings, clock).expect("settings");
    let controller = engine.controller();
    controller.set_scene(Arc::new(scene)).expect("a scene");
    for (_, position) in doorway.sources.iter().take(4) {
        controller.add_source(*position).expect("a slot");
    }
    let (mut late, mut paths) = (0, [0; 2]);
    for frame in 1..=40 {
        let rooms = [doorway.walk.from, doorway.walk.to];
        let listener = ListenerPose::facing(rooms[frame as usize % 2], 0.0);
        engine
            .next_frame(listener, &[], |_| ())
            .expect("valid poses");
        let controller = engine.controller();
        paths[frame as usize % 2] = controller.statistics().paths;
        late += u32::from(controller.frame_numbers().tick() < frame && frame > 10);
    }
    println!("{paths:?} paths, {late} frames late");
    assert!(paths.iter().sum::<u32>() > 300, "{paths:?}");
    assert_eq!(late, 0);
}

/// At 5 m/s no path may be extrapolated over the usual distance: what a frame takes would be twice the budget, and frames that
/// come late are the worst of it.
#[test]
fn frames_of_a_run_among_moving_sources_are_in_time() {
    const SPEED_M_S: f32 = 5.0;
    let hall = procedural::concert_hall();
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&hall.mesh, &table, &SceneSettings::default()).expect("commits");
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = 16;
    let clock = VirtualClock::at_level(RATE_HZ, 24);
    let mut engine = VirtualEngine::new(settings, clock).expect("settings");
    let controller = engine.controller();
    controller.set_scene(Arc::new(scene)).expect("a scene");
    let places = hall.sources.iter().take(16).map(|(_, place)| *place);
    let places: Vec<Vec3> = places.collect();
    let ids = places.iter().map(|place| controller.add_source(*place));
    let ids: Vec<SourceId> = ids.collect::<Result<_, _>>().expect("slots");
    let along = (hall.walk.to - hall.walk.from).normalize();
    let (mut late, mut counted) = (0, 0);
    for frame in 1..=220_u32 {
        let time_s = frame as f32 / RATE_HZ as f32;
        let sway = Vec3::X * (2.0 * time_s).sin();
        let sources = ids.iter().zip(&places);
        let sources: Vec<SourcePose> = sources
            .map(|(id, place)| SourcePose::at(*id, *place + sway))
            .collect();
        let listener = ListenerPose::facing(hall.walk.from + along * (SPEED_M_S * time_s), 0.0);
        engine
            .next_frame(listener, &sources, |_| ())
            .expect("valid poses");
        // The first frames show how much work there is.
        if frame > 60 {
            counted += 1;
            late += u32::from(engine.controller().frame_numbers().tick() < u64::from(frame));
        }
    }
    println!("{late} of {counted} frames late");
    assert!(late <= counted / 5, "{late} of {counted} frames late");
}
