//! Misuse by the app: the engine returns an error or continues, and its output stays finite. On one thread, without a clock.

use std::sync::Arc;

use foresound::Error;
use foresound::extrapolation::PredictorKind;
use foresound::generation::GeneratorSettings;
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, EngineState, FrameTime,
    Renderer,
};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};
use glam::{Quat, Vec3};

fn settings(schedule: EngineSchedule) -> EngineSettings {
    let mut settings = EngineSettings::default();
    settings.generation = GeneratorSettings::default();
    settings.generation.max_sources = 4;
    settings.max_sources = Some(12);
    settings.propagation.guide_rays = 64;
    settings.propagation.source_rays = 16;
    settings.schedule = schedule;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(0.01);
    settings
}

fn rooms() -> Vec<Arc<Scene>> {
    let room = |length_m: f32| {
        let mesh = procedural::shoebox(Vec3::new(length_m, 3.0, 5.0), "concrete");
        let table = MaterialTable::built_in();
        Arc::new(Scene::commit(&mesh, &table, &SceneSettings::default()).expect("a room"))
    };
    [4.0, 6.0, 15.0].map(room).to_vec()
}

fn noise() -> Arc<[f32]> {
    (0..4410u32)
        .map(|n| 0.1 * (n as f32 * n as f32).sin())
        .collect()
}

fn render(renderer: &mut Renderer) -> f32 {
    let mut block = [0.0; 882];
    renderer.render(&mut block);
    assert!(
        block
            .iter()
            .all(|sample| sample.is_finite() && sample.abs() <= 1.0)
    );
    block
        .iter()
        .fold(0.0, |most, sample| most.max(sample.abs()))
}

fn tick(controller: &mut Controller) {
    let listener = ListenerPose::facing(Vec3::new(2.0, 1.5, 2.0), 0.3);
    controller.tick(listener, &[]).expect("a good pose");
}

#[test]
fn a_thousand_sources_are_added_and_removed_between_two_blocks() {
    let engine = Engine::new(settings(EngineSchedule::Synchronous));
    let (mut controller, mut renderer) = engine.expect("an engine");
    controller.set_scene(rooms()[0].clone()).expect("accepted");
    let clip = noise();
    let mut here: Vec<SourceId> = Vec::new();
    for round in 0..30u32 {
        for number in 0..1000u32 {
            if here.len() == 12 || (number % 3 == 2 && !here.is_empty()) {
                let id = here.remove(number as usize % here.len());
                controller.remove_source(id).expect("is there");
            } else {
                let position = Vec3::new(1.0, 1.0, (number % 4) as f32);
                let id = controller.add_source(position).expect("a slot");
                controller.play(id, Arc::clone(&clip), true).expect("there");
                here.push(id);
            }
            if number % 100 == round % 100 {
                tick(&mut controller);
            }
        }
        tick(&mut controller);
        render(&mut renderer);
    }
    // Samples follow their sources.
    for _ in 0..40 {
        tick(&mut controller);
        render(&mut renderer);
    }
    assert!(render(&mut renderer) > 0.0);
    for id in here.drain(..) {
        controller.remove_source(id).expect("is there");
    }
    drop(controller);
    drop(renderer);
    assert_eq!(Arc::strong_count(&clip), 1, "the clip is freed");
}

#[test]
fn scene_and_predictor_change_in_every_frame() {
    for schedule in [EngineSchedule::Synchronous, EngineSchedule::Asynchronous] {
        let (mut controller, mut renderer) = Engine::new(settings(schedule)).expect("an engine");
        let id = controller
            .add_source(Vec3::new(1.0, 1.0, 1.0))
            .expect("a slot");
        controller.play(id, noise(), true).expect("is there");
        let rooms = rooms();
        let mut loudest = 0.0f32;
        for frame in 0..200 {
            controller
                .set_scene(rooms[frame % 3].clone())
                .expect("accepted");
            controller.set_predictor(PredictorKind::ALL[frame % 3]);
            tick(&mut controller);
            loudest = loudest.max(render(&mut renderer));
        }
        assert!(loudest > 0.0);
        assert_eq!(controller.state(), EngineState::Running);
        drop(controller);
        drop(renderer);
        assert!(rooms.iter().all(|room| Arc::strong_count(room) == 1));
    }
}

#[test]
fn invalid_poses_are_refused_and_the_last_valid_ones_rendered() {
    let engine = Engine::new(settings(EngineSchedule::Synchronous));
    let (mut controller, mut renderer) = engine.expect("an engine");
    let id = controller
        .add_source(Vec3::new(1.0, 1.0, 1.0))
        .expect("a slot");
    controller.play(id, noise(), true).expect("is there");
    for _ in 0..10 {
        tick(&mut controller);
        render(&mut renderer);
    }
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
        for position in [Vec3::new(bad, 0.0, 0.0), Vec3::splat(bad)] {
            let listener = ListenerPose::facing(position, 0.0);
            let refused = controller.tick(listener, &[]);
            assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
            let good = ListenerPose::facing(Vec3::new(2.0, 1.5, 2.0), 0.0);
            let refused = controller.tick(good, &[SourcePose::at(id, position)]);
            assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
        }
        let turned = SourcePose {
            orientation: Quat::from_xyzw(bad, 0.0, 0.0, 1.0),
            ..SourcePose::at(id, Vec3::ONE)
        };
        let good = ListenerPose::facing(Vec3::new(2.0, 1.5, 2.0), 0.0);
        // Any finite quaternion becomes an orientation.
        assert!(bad == f32::MAX || controller.tick(good, &[turned]).is_err());
        assert!(render(&mut renderer) > 0.0);
    }
    let far = SourcePose::at(id, Vec3::splat(9e5));
    let good = ListenerPose::facing(Vec3::new(2.0, 1.5, 2.0), 0.0);
    controller.tick(good, &[far]).expect("finite");
    render(&mut renderer);
}

#[test]
fn blocks_of_any_length_are_filled() {
    let engine = Engine::new(settings(EngineSchedule::Synchronous));
    let (mut controller, mut renderer) = engine.expect("an engine");
    let id = controller.add_source(Vec3::ONE).expect("a slot");
    controller.play(id, noise(), true).expect("is there");
    for frames in [0usize, 1, 2, 3, 255, 257, 4096, 10_000] {
        tick(&mut controller);
        let mut block = vec![f32::NAN; 2 * frames];
        let report = renderer.render(&mut block);
        assert_eq!(report.frames as usize, frames);
        assert!(block.iter().all(|sample| sample.is_finite()));
    }
    // Half an audio frame is silence.
    let mut odd = [f32::NAN; 7];
    renderer.render(&mut odd);
    assert!(odd.iter().all(|sample| sample.is_finite()));
}
