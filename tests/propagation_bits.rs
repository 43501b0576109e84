//! The optimised update has the same bits as the unoptimised reference, on any number of threads.

#[path = "reference/plain_update.rs"]
#[expect(unreachable_pub, reason = "the oracle is shared by test crates")]
mod plain_update;

use std::sync::Arc;

use foresound::propagation::image_source::sequence::Sequence;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::runtime::Threads;
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourcePose, procedural,
};
use glam::{DVec3, Quat, Vec3};
use plain_update::{PlainPropagator, least_order};

fn commit(scene: &procedural::BenchmarkScene) -> Arc<Scene> {
    let settings = SceneSettings::default();
    Arc::new(Scene::commit(&scene.mesh, &MaterialTable::built_in(), &settings).expect("commits"))
}

fn poses(scene: &procedural::BenchmarkScene, count: usize) -> Vec<SourcePose> {
    let positions = scene.sources.iter().take(count).enumerate();
    positions
        .map(|(slot, (_, position))| SourcePose::at(SourceId::new(slot as u16, 0), *position))
        .collect()
}

/// Position on a walk at an update, 20 updates a second.
fn ear(scene: &procedural::BenchmarkScene, update: u32) -> ListenerPose {
    let share = 0.5 + 0.07 * update as f32 / scene.walk.from.distance(scene.walk.to);
    ListenerPose {
        position: scene.walk.from.lerp(scene.walk.to, share),
        ..ListenerPose::default()
    }
}

#[test]
fn the_update_has_the_bits_of_the_reference() {
    for name in procedural::NAMES {
        let benchmark = procedural::by_name(name).expect("a name of the list");
        let scene = commit(&benchmark);
        // More sources than use direct validation, and as few in between.
        let mut sources = poses(&benchmark, 4);
        let mut fast =
            Propagator::new(Arc::clone(&scene), PropagationSettings::default()).expect("settings");
        let mut plain = PlainPropagator::new(Arc::clone(&scene), PropagationSettings::default());
        let mut set = PathSet::default();
        for update in 0..8 {
            // Sources are added, removed and reordered.
            match update {
                3 => drop(sources.remove(1)),
                5 => sources.swap(0, 2),
                6 => sources.insert(0, poses(&benchmark, 6)[5]),
                _ => {}
            }
            let ear = ear(&benchmark, update);
            fast.update(&ear, &sources, 0.0, &mut set);
            let mut expected = plain.update(&ear, &sources);
            // The reference casts more rays.
            expected.rays = set.rays;
            assert!(set.paths.len() > 4, "{name} has paths");
            assert_eq!(set, expected, "{name}, update {update}");
        }
    }
}

#[test]
fn moving_parts_have_the_bits_of_the_reference() {
    let benchmark = procedural::doorway();
    let scene = commit(&benchmark);
    let all = poses(&benchmark, 4);
    let settings = PropagationSettings::default();
    let mut fast = Propagator::new(Arc::clone(&scene), settings).expect("settings");
    let mut plain = PlainPropagator::new(scene, settings);
    let size = Vec3::new(0.9, 2.0, 0.05);
    let mesh = procedural::shoebox(size, "wood_panel");
    let table = MaterialTable::built_in();
    let part = Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits");
    let part = Arc::new(part);
    let mut ids = Vec::new();
    let mut set = PathSet::default();
    for update in 0..14 {
        // A part is added in most updates; all rotate, through perpendicular to the walls, and one is removed.
        let pose = |id, n: usize| InstancePose {
            id,
            position: DVec3::new(9.0 + n as f64, 0.02, 1.0 + 0.4 * n as f64),
            rotation: Quat::from_rotation_y((update as f32 - 7.0) * 0.1 * n as f32),
        };
        for scene in [fast.scene_mut(), plain.scene_mut()] {
            let count = scene.instance_count();
            if update < 6 {
                let new = pose(InstanceId::default(), count);
                let id = scene
                    .add_instance(Arc::clone(&part), &new)
                    .expect("one more");
                ids.truncate(count);
                ids.push(id);
            }
            let moved: Vec<_> = ids.iter().enumerate().map(|(n, id)| pose(*id, n)).collect();
            scene.set_instance_poses(&moved);
            if update == 9 {
                scene.remove_instance(ids[2]).expect("is there");
            }
        }
        let ear = ear(&benchmark, update);
        // Few sources validate candidates directly, more cull by windows first.
        let sources = &all[..3 + update as usize % 2];
        fast.update(&ear, sources, 0.0, &mut set);
        let mut expected = plain.update(&ear, sources);
        expected.rays = set.rays;
        assert_eq!(set, expected, "update {update}");
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    for name in ["concert_hall", "doorway"] {
        let benchmark = procedural::by_name(name).expect("a name of the list");
        let scene = commit(&benchmark);
        let sources = poses(&benchmark, 7);
        let run = |count: usize| {
            let threads = Threads::start(count).expect("threads start");
            let settings = PropagationSettings::default();
            let mut propagator = Propagator::new(Arc::clone(&scene), settings).expect("settings");
            let update = |step| {
                let mut set = PathSet::default();
                propagator.update_with(&threads, &ear(&benchmark, step), &sources, 0.0, &mut set);
                set
            };
            (0..6).map(update).collect::<Vec<_>>()
        };
        let one = run(1);
        for count in [2, 3, 5] {
            assert_eq!(one, run(count), "{name} on {count} threads");
        }
    }
}

#[test]
fn canonical_is_the_least_order() {
    let benchmark = procedural::doorway();
    let scene = commit(&benchmark);
    let count = scene.surfaces().len() as u64;
    let mut seed = 1u64;
    for _ in 0..20_000 {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let surfaces: Vec<u32> = (0..1 + seed % 4)
            .map(|k| ((seed >> (8 + 12 * k)) % count) as u32)
            .collect();
        assert_eq!(
            Sequence::canonical(&scene, &surfaces),
            least_order(&scene, &surfaces),
            "seed {seed}: {surfaces:?}"
        );
    }
}
