//! The numbers of a graphics frame are those that are rendered: each source's paths apart, what blocks it, its late reverb.

use std::sync::Arc;

use foresound::paths::{FrameNumbers, PathKind};
use foresound::runtime::{
    AffinityPolicy, Controller, Engine, EngineSchedule, EngineSettings, FrameTime, Renderer,
};
use foresound::scene::{ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, procedural};
use glam::Vec3;

const BLOCK: usize = 735;

fn engine(max_sources: usize, slots: usize) -> (Controller, Renderer) {
    let mut settings = EngineSettings::default();
    settings.generation.max_sources = slots;
    settings.max_sources = Some(max_sources);
    settings.propagation.guide_rays = 256;
    settings.propagation.source_rays = 64;
    settings.schedule = EngineSchedule::Synchronous;
    settings.affinity = AffinityPolicy::System;
    settings.frame_time = FrameTime::Fixed(1.0 / 60.0);
    Engine::new(settings).expect("an engine")
}

fn run(controller: &mut Controller, renderer: &mut Renderer, ear: Vec3, frames: usize) {
    let mut block = [0.0; 2 * BLOCK];
    for _ in 0..frames {
        let listener = ListenerPose::facing(ear, 0.3);
        controller.tick(listener, &[]).expect("a good pose");
        renderer.render(&mut block);
    }
}

#[test]
fn each_source_has_its_own_paths_of_the_present_poses() {
    let layout = procedural::doorway();
    let table = MaterialTable::built_in();
    let scene = Scene::commit(&layout.mesh, &table, &SceneSettings::default()).expect("commits");
    let speed_m_s = scene.speed_of_sound_m_s();
    let (mut controller, mut renderer) = engine(4, 4);
    controller.set_scene(Arc::new(scene)).expect("accepted");
    let positions = [layout.sources[0].1, layout.sources[1].1];
    let ids = positions.map(|position| controller.add_source(position).expect("a slot"));
    let removed = controller.add_source(Vec3::ONE).expect("a slot");
    controller.remove_source(removed).expect("is there");
    // Nothing is copied before somebody asks.
    run(&mut controller, &mut renderer, layout.walk.from, 3);
    let numbers = controller.frame_numbers();
    assert_eq!((numbers.tick(), numbers.sources().len()), (0, 0));
    let mut blocked = [0; 2];
    for step in 0..12 {
        let ear = layout.walk.from.lerp(layout.walk.to, step as f32 / 11.0);
        run(&mut controller, &mut renderer, ear, 4);
        let numbers = controller.frame_numbers();
        assert!(numbers.tick() >= 3 + 4 * step, "{}", numbers.tick());
        assert_eq!(numbers.sources().len(), 2);
        for (id, position) in ids.into_iter().zip(positions) {
            let own = numbers.source(id).expect("has a slot");
            let paths = numbers.paths(id);
            assert!(paths.len() > 4);
            assert!(paths.iter().all(|path| path.source == id));
            assert!(paths.is_sorted_by_key(|path| path.id));
            blocked[usize::from(own.occlusion > 0.0)] += 1;
            let nearest_s = f64::from(ear.distance(position)) / speed_m_s;
            for path in paths {
                assert!(path.delay_s > nearest_s - 1e-6);
                assert!((path.arrival.length() - 1.0).abs() < 1e-5);
                let straight = path.kind.is_straight();
                assert_eq!(
                    straight,
                    (path.delay_s - nearest_s).abs() < 1e-6 && path.order == 0
                );
                if straight {
                    let is_blocked = own.occlusion > 0.0;
                    assert_eq!(path.kind == PathKind::Transmitted, is_blocked);
                    assert_eq!(own.transmission != [1.0; 8], is_blocked);
                }
            }
            assert!(own.reverb_send[4] > 0.0 && own.reverb_delay_s > 0.0);
            assert!((0.05..20.0).contains(&own.decay_time_s[4]));
        }
        assert!(numbers.paths(removed).is_empty());
        // The late reverb by direction is all of it. Shares sum to 1 but for the rounding of twelve of them.
        let by_direction = numbers.reverb_energy_by_direction();
        for b in 0..8 {
            let sum: f32 = by_direction.iter().map(|bands| bands[b]).sum();
            let sends = numbers.sources().iter();
            let whole: f32 = sends.map(|own| own.reverb_send[b].powi(2)).sum();
            assert!((sum / whole - 1.0).abs() < 1e-5, "{sum} {whole}");
        }
    }
    assert!(blocked[0] > 0 && blocked[1] > 0, "{blocked:?}");
}

#[test]
fn sources_that_share_a_slot_share_its_paths() {
    let (mut controller, mut renderer) = engine(40, 8);
    let ids: Vec<SourceId> = (0..40u16)
        .map(|n| {
            let position = Vec3::new(f32::from(n % 7) - 3.0, 1.0, -2.0 - f32::from(n));
            let id = controller.add_source(position).expect("a handle");
            let tone: Vec<f32> = (0..441).map(|k| (k as f32 * 0.1).sin()).collect();
            controller.play(id, tone.into(), true).expect("is there");
            id
        })
        .collect();
    controller.frame_numbers();
    run(&mut controller, &mut renderer, Vec3::ZERO, 40);
    let numbers = controller.frame_numbers();
    let has_path = |id: &&SourceId| !numbers.paths(**id).is_empty();
    assert_eq!(ids.iter().filter(has_path).count(), numbers.sources().len());
    assert!(numbers.sources().len() > 8, "{}", numbers.sources().len());
    assert!(format!("{:?}", FrameNumbers::default()).contains("sources"));
}
