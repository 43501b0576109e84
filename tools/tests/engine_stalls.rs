//! A device that stalls while the app continues: no sound is cut off.
//!
//! Independent of the machine: the app's clock counts ticks, and the test renders.

use std::sync::Arc;

use foresound::generation::GeneratorSettings;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::runtime::{AffinityPolicy, Controller, Engine, EngineSettings, FrameTime, Renderer};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, procedural};
use foresound_tools::clicks::{ClickDetector, smooth_loop};
use glam::Vec3;

const RATE_HZ: u32 = 44_100;
const FRAME_S: f64 = 1.0 / 60.0;
/// Audio frames of a graphics frame.
const FRAMES: usize = 735;

fn engine(slots: usize, sources: usize) -> (Controller, Renderer) {
    let mut settings = EngineSettings::default();
    settings.generation = GeneratorSettings::default();
    settings.generation.max_sources = slots;
    settings.generation.rate_hz = RATE_HZ;
    settings.propagation.guide_rays = 64;
    settings.propagation.source_rays = 16;
    settings.max_sources = Some(sources);
    settings.frame_time = FrameTime::Fixed(FRAME_S);
    settings.affinity = AffinityPolicy::System;
    let (mut controller, renderer) = Engine::new(settings).expect("an engine");
    let mesh = procedural::shoebox(Vec3::new(12.0, 4.0, 9.0), "concrete");
    let table = MaterialTable::built_in();
    let room = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("a room");
    controller.set_scene(Arc::new(room)).expect("a scene");
    (controller, renderer)
}

/// A pseudo-random number from 0 to 1.
fn dice(state: &mut u64) -> f32 {
    *state = mix(*state);
    unit(*state)
}

fn somewhere(state: &mut u64) -> Vec3 {
    Vec3::new(
        1.0 + 10.0 * dice(state),
        1.0 + 2.0 * dice(state),
        1.0 + 7.0 * dice(state),
    )
}

/// Adds, removes and moves sources while the device stalls in two of three quarters of a second; returns the output.
fn hear(slots: usize, sources: usize) -> ClickDetector {
    let (mut controller, mut renderer) = engine(slots, sources);
    let clip: Arc<[f32]> = smooth_loop(RATE_HZ).into();
    let mut detector = ClickDetector::new(RATE_HZ);
    let mut block = vec![0.0; 2 * FRAMES];
    let mut here: Vec<SourceId> = Vec::new();
    let mut state = 7;
    for frame in 0..3000 {
        if here.len() < sources && dice(&mut state) < 0.5 {
            let id = controller
                .add_source(somewhere(&mut state))
                .expect("room for it");
            controller
                .play(id, Arc::clone(&clip), true)
                .expect("is there");
            here.push(id);
        }
        if here.len() > sources / 2 && dice(&mut state) < 0.3 {
            let which = (dice(&mut state) * here.len() as f32) as usize;
            let id = here.swap_remove(which.min(here.len() - 1));
            controller.remove_source(id).expect("is there");
        }
        if frame % 15 == 0 && !here.is_empty() {
            let which = (dice(&mut state) * here.len() as f32) as usize;
            let id = here[which.min(here.len() - 1)];
            controller
                .move_source(id, somewhere(&mut state))
                .expect("is there");
        }
        let listener = ListenerPose::facing(Vec3::new(6.0, 1.6, 4.0), 0.0);
        controller.tick(listener, &[]).expect("good poses");
        let stalls = frame > 60 && frame / 15 % 3 != 0;
        if !stalls {
            renderer.render(&mut block);
            detector.push(&block);
        }
    }
    detector
}

#[test]
fn the_next_source_of_a_slot_waits_for_a_stalled_device() {
    let heard = hear(8, 8);
    assert!(heard.peak() > 0.02, "{}", heard.peak());
    assert_eq!(heard.clicks(), 0, "worst step {}", heard.worst());
}

#[test]
fn sources_sharing_slots_wait_for_a_stalled_device() {
    let heard = hear(8, 40);
    assert!(heard.peak() > 0.02, "{}", heard.peak());
    assert_eq!(heard.clicks(), 0, "worst step {}", heard.worst());
}
