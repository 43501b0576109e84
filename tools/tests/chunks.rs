//! Chunks of a world that come and go while sound runs: no click, and paths elsewhere keep their identity.

use std::collections::HashSet;
use std::sync::Arc;

use foresound::propagation::{PathId, PathSet, PropagationSettings, Propagator};
use foresound::runtime::{AffinityPolicy, Engine, EngineSchedule, EngineSettings, FrameTime};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourcePose, TriangleMesh, procedural,
};
use foresound_tools::clicks::{ClickDetector, smooth_loop};
use foresound_tools::cut::cut;
use glam::{DVec3, Vec3};

const RATE_HZ: u32 = 44_100;
const FRAMES: usize = 735;

fn commit(mesh: &TriangleMesh) -> Scene {
    Scene::commit(mesh, &MaterialTable::built_in(), &SceneSettings::default()).expect("commits")
}

/// A room of 40 m by 5 m by 12 m in eight chunks of 5 m, and a fixed part of a centimetre beside it.
fn corridor() -> (Scene, Vec<Arc<Scene>>) {
    let mesh = procedural::shoebox(Vec3::new(40.0, 5.0, 12.0), "brick");
    let planes: Vec<f64> = (1..8).map(|n| 5.0 * f64::from(n)).collect();
    let chunks = cut(&mesh, [&planes, &[], &[]]);
    let mut mark = procedural::shoebox(Vec3::splat(0.01), "wood");
    for vertex in &mut mark.vertices {
        *vertex -= 3.0;
    }
    let parts = chunks.iter().map(|chunk| Arc::new(commit(chunk)));
    (commit(&mark), parts.collect())
}

fn here() -> InstancePose {
    InstancePose::at(InstanceId::default(), DVec3::ZERO)
}

#[test]
fn chunks_come_and_go_without_a_click() {
    let (fixed, parts) = corridor();
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = 2;
    settings.generation.rate_hz = RATE_HZ;
    settings.propagation.guide_rays = 128;
    settings.propagation.source_rays = 16;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    let (mut controller, mut renderer) = Engine::new(settings).expect("an engine");
    controller.set_scene(Arc::new(fixed)).expect("a scene");
    let mut ids: Vec<InstanceId> = parts
        .iter()
        .map(|part| controller.add_joined_instance(Arc::clone(part), &here()))
        .map(|id| id.expect("is added"))
        .collect();
    let source = controller
        .add_source(Vec3::new(8.0, 1.5, 5.0))
        .expect("a slot");
    let clip: Arc<[f32]> = smooth_loop(RATE_HZ).into();
    controller.play(source, clip, true).expect("is there");
    let mut detector = ClickDetector::new(RATE_HZ);
    let mut block = vec![0.0; 2 * FRAMES];
    let (mut away, mut next) = (None, 0);
    for frame in 0..600 {
        // Every quarter of a second a chunk goes or comes back: the source's, the listener's and those of the reflections.
        if frame % 15 == 14 {
            match away.take() {
                None => {
                    controller.remove_instance(ids[next]).expect("is there");
                    away = Some(next);
                }
                Some(index) => {
                    let part = Arc::clone(&parts[index]);
                    ids[index] = controller
                        .add_joined_instance(part, &here())
                        .expect("is added");
                    next = (next + 1) % parts.len();
                }
            }
        }
        let walked = 0.02 * frame as f32;
        let listener = ListenerPose::facing(Vec3::new(12.0 + walked, 1.6, 7.0), 0.0);
        controller.tick(listener, &[]).expect("a good pose");
        renderer.render(&mut block);
        detector.push(&block);
    }
    assert!(detector.peak() > 1e-3, "nothing sounds");
    assert_eq!(
        detector.clicks(),
        0,
        "worst {} at {:?} s",
        detector.worst(),
        detector.first_click_s()
    );
}

#[test]
fn paths_elsewhere_keep_their_identity() {
    let (mut world, parts) = corridor();
    let mut ids = Vec::new();
    for part in &parts {
        ids.push(
            world
                .add_joined_instance(Arc::clone(part), &here())
                .expect("is added"),
        );
    }
    let mut propagator =
        Propagator::new(Arc::new(world), PropagationSettings::default()).expect("settings");
    let source = SourcePose::at(SourceId::new(0, 0), Vec3::new(3.0, 1.5, 5.0));
    let listener = ListenerPose::facing(Vec3::new(7.0, 1.6, 7.0), 0.0);
    let mut set = PathSet::default();
    let mut names = |propagator: &mut Propagator, below_m: f32| -> HashSet<PathId> {
        propagator.warm_up(&listener, &[source]);
        propagator.update(&listener, &[source], 0.0, &mut set);
        let short = set.paths.iter().filter(|path| path.length_m < below_m);
        short.map(|path| path.id).collect()
    };
    let before = names(&mut propagator, f32::INFINITY);
    // The chunk at the end begins at 35 m: no shorter path than 32 m and 28 m touches it.
    let near = names(&mut propagator, 60.0);
    assert!(near.len() > 20, "{} paths", near.len());
    propagator
        .scene_mut()
        .remove_instance(ids[7])
        .expect("is there");
    assert_eq!(names(&mut propagator, 60.0), near);
    propagator
        .scene_mut()
        .add_joined_instance(Arc::clone(&parts[7]), &here())
        .expect("is added");
    assert_eq!(names(&mut propagator, f32::INFINITY), before);
}
