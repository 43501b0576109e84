//! Instances in a running engine: audible, refused, removed, and kept across scenes.

use std::sync::Arc;

use foresound::Error;
use foresound::generation::GeneratorSettings;
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, FrameTime, Renderer,
};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, procedural,
};
use glam::{DVec3, Quat, Vec3};

fn settings() -> EngineSettings {
    let mut settings = EngineSettings::default();
    settings.generation = GeneratorSettings::default();
    settings.generation.max_sources = 2;
    settings.propagation.guide_rays = 64;
    settings.propagation.source_rays = 16;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(0.01);
    settings
}

fn commit(size: Vec3, material: &str) -> Arc<Scene> {
    let mesh = procedural::shoebox(size, material);
    let table = MaterialTable::built_in();
    Arc::new(Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits"))
}

/// Ticks and renders; returns the mean power of the last block.
fn run(controller: &mut Controller, renderer: &mut Renderer, at: Vec3) -> f32 {
    let mut block = [0.0; 882];
    for _ in 0..60 {
        controller
            .tick(ListenerPose::facing(at, 0.3), &[])
            .expect("a good pose");
        renderer.render(&mut block);
        assert!(block.iter().all(|s| s.is_finite()));
    }
    block.iter().map(|s| s * s).sum::<f32>() / block.len() as f32
}

#[test]
fn a_wall_blocks_sound_moves_away_and_is_removed() {
    let (mut controller, mut renderer) = Engine::new(settings()).expect("an engine");
    let voice = controller
        .add_source(Vec3::new(0.0, 1.5, 0.0))
        .expect("a slot");
    let noise: Arc<[f32]> = (0..44_100u32)
        .map(|n| (n.wrapping_mul(2_654_435_761) >> 8) as f32 / (1u32 << 24) as f32 - 0.5)
        .collect();
    controller.play(voice, noise, true).expect("is there");
    let at = Vec3::new(4.0, 1.5, 0.0);
    let free = run(&mut controller, &mut renderer, at);
    assert!(free > 1e-6, "{free} in open air");
    // Between source and listener, far away, and between them again at another position.
    let wall = commit(Vec3::new(0.3, 8.0, 8.0), "concrete");
    let pose = |id, x: f64| InstancePose::at(id, DVec3::new(x, -2.5, -4.0));
    let id = controller
        .add_instance(wall, &pose(InstanceId::default(), 2.0))
        .expect("a wall");
    assert_eq!(controller.instances(), [pose(id, 2.0)]);
    let behind = run(&mut controller, &mut renderer, at);
    assert!(
        behind < 0.1 * free,
        "{behind} behind a wall, {free} without"
    );
    controller
        .set_instance_pose(&pose(id, -900.0))
        .expect("rigid");
    let away = run(&mut controller, &mut renderer, at);
    assert!(
        away > 0.5 * free,
        "{away} with a wall far away, {free} without"
    );
    controller.set_instance_pose(&pose(id, 1.5)).expect("rigid");
    assert!(run(&mut controller, &mut renderer, at) < 0.1 * free);

    // An invalid pose changes nothing.
    for bad in [
        pose(id, f64::NAN),
        InstancePose {
            rotation: Quat::from_xyzw(0.0, 1.5, 0.0, 0.0),
            ..pose(id, -900.0)
        },
    ] {
        let refused = controller.set_instance_pose(&bad);
        assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
    }
    assert_eq!(controller.instances(), [pose(id, 1.5)]);
    assert!(run(&mut controller, &mut renderer, at) < 0.1 * free);

    // It keeps its pose in another scene, which must not have instances.
    let own = Arc::new(Scene::clone(controller.scene()));
    assert!(matches!(
        controller.set_scene(own),
        Err(Error::Setting { .. })
    ));
    let scene = commit(Vec3::new(400.0, 100.0, 400.0), "acoustic_ceiling");
    controller.set_scene(scene).expect("accepted");
    assert_eq!(controller.scene().instance_count(), 1);
    assert!(run(&mut controller, &mut renderer, at) < 0.1 * free);

    controller.remove_instance(id).expect("is there");
    let removed = run(&mut controller, &mut renderer, at);
    assert!(
        removed > 0.5 * free,
        "{removed} without the wall, {free} before"
    );
    for result in [
        controller.remove_instance(id),
        controller.set_instance_pose(&pose(id, 0.0)),
    ] {
        assert!(
            matches!(result, Err(Error::StaleInstance { .. })),
            "{result:?}"
        );
    }
    assert!(controller.instances().is_empty());
}
