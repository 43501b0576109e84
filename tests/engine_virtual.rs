//! The engine on a virtual clock.

use std::sync::Arc;

use foresound::extrapolation::PredictorKind;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::runtime::{EngineSchedule, EngineSettings, VirtualClock, VirtualEngine};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, procedural};
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

fn noise(seed: usize) -> Vec<f32> {
    let value = |n: u64| 0.2 * unit(mix((seed as u64) << 40 | n)) - 0.1;
    (0..44_100).map(value).collect()
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
            for (seed, id) in ids.iter().enumerate() {
                let clip = noise(seed).into();
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
