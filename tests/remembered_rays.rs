//! Cached hits of source rays are valid until the source or the scene changes: casting again changes no bit, and every
//! change of a dependency discards them.

#[path = "reference/plain_update.rs"]
#[expect(unreachable_pub, reason = "the oracle is shared by test crates")]
mod plain_update;

use std::sync::Arc;

use foresound::propagation::diffuse::next_event::SHADOW_RAYS;
use foresound::propagation::diffuse::{
    LateEstimator, ListenerField, RayScratch, SceneField, SourceRays, VisibilityCells,
};
use foresound::propagation::rays::directions::{lattice, rotation};
use foresound::propagation::{LateEnergy, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    Directivity, InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings,
    SourceId, SourcePose, procedural,
};
use glam::{DVec3, Quat, Vec3};
use plain_update::PlainPropagator;

fn doorway() -> (procedural::BenchmarkScene, Arc<Scene>) {
    let benchmark = procedural::doorway();
    let settings = SceneSettings::default();
    let scene = Scene::commit(&benchmark.mesh, &MaterialTable::built_in(), &settings);
    (benchmark, Arc::new(scene.expect("commits")))
}

fn ear(scene: &procedural::BenchmarkScene, update: u32) -> ListenerPose {
    ListenerPose {
        position: scene
            .walk
            .from
            .lerp(scene.walk.to, 0.3 + 0.01 * update as f32),
        ..ListenerPose::default()
    }
}

/// An update with cached rays has the bits of the reference, which casts all of them: at rest, when a source moves, when
/// a part is added, moves, rests and is removed, and when a scene replaces another.
#[test]
fn an_update_with_cached_rays_has_the_bits_of_one_without() {
    let (benchmark, scene) = doorway();
    let settings = PropagationSettings {
        guide_rays: 256,
        source_rays: 32,
        ..PropagationSettings::default()
    };
    let mut fast = Propagator::new(Arc::clone(&scene), settings).expect("settings");
    let mut plain = PlainPropagator::new(scene, settings);
    let positions = benchmark.sources.iter().take(2).enumerate();
    let mut sources: Vec<SourcePose> = positions
        .map(|(slot, (_, position))| SourcePose::at(SourceId::new(slot as u16, 0), *position))
        .collect();
    let mesh = procedural::shoebox(Vec3::new(0.9, 2.0, 0.05), "wood_panel");
    let part = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default());
    let part = Arc::new(part.expect("commits"));
    let pose = |id, turn: f32| InstancePose {
        id,
        position: benchmark.walk.from.as_dvec3(),
        rotation: Quat::from_rotation_y(turn),
    };
    let (mut door, mut before) = (InstanceId::default(), None);
    let (mut set, mut rays) = (PathSet::default(), Vec::new());
    for update in 0..112 {
        match update {
            // At rest, one source a step aside; then both rest.
            24 => sources[1].position.x += 0.25,
            40 => {
                before = Some(Scene::clone(fast.scene()));
                for scene in [fast.scene_mut(), plain.scene_mut()] {
                    let new = pose(InstanceId::default(), 0.2);
                    door = scene.add_instance(Arc::clone(&part), &new).expect("one");
                }
            }
            // Set again to the same pose.
            60 => assert_eq!(fast.scene_mut().set_instance_poses(&[pose(door, 0.2)]), 0),
            64 => {
                for scene in [fast.scene_mut(), plain.scene_mut()] {
                    assert_eq!(scene.set_instance_poses(&[pose(door, 0.9)]), 1);
                }
            }
            // The scene from before the door was added.
            82 => {
                let before = before.take().expect("was kept");
                *plain.scene_mut() = before.clone();
                *fast.scene_mut() = before;
            }
            _ => {}
        }
        let ear = ear(&benchmark, update % 40);
        fast.update(&ear, &sources, 0.0, &mut set);
        let mut expected = plain.update(&ear, &sources);
        expected.rays = set.rays;
        // From the update in which the field follows a change until all rays are cast again, the late energy is without what the
        // change contradicts, which the reference does not look for.
        if [40, 64, 82]
            .iter()
            .any(|change| (change + 4..change + 20).contains(&update))
        {
            expected.late.clone_from(&set.late);
            expected.late_groups = set.late_groups;
        }
        assert_eq!(set, expected, "update {update}");
        rays.push(set.rays);
    }
    // Rays of all sources were cast in sixteen updates after each change, those of the first four rotations again if the late
    // field's patches have followed since, and no others.
    let mean = |range: std::ops::Range<usize>| {
        let count = range.len() as u64;
        rays[range].iter().sum::<u64>() / count
    };
    for (all, none) in [
        (0..16, 16..24),
        (40..56, 56..64),
        // In update 80 the listener jumps back, and all bounces are visited again.
        (64..80, 81..82),
        (82..98, 98..112),
    ] {
        let (all, none) = (mean(all), mean(none));
        // Two sources of 32 rays, four bounces each at least.
        assert!(none + 2 * 32 * 4 < all, "{none} rays at rest, {all} before");
    }
}

/// A swinging door in a hall intersects few rays: they are not cast again while it swings. Other bounces represent them
/// all when one ray differs, so the late reverb may differ as much as between two random choices of rays: by four standard
/// deviations of that difference, which propagations with other seeds tell, band by band. When the door has rested, the bits
/// are the reference's.
#[test]
fn a_small_moving_part_has_few_rays_cast_again() {
    let mesh = procedural::shoebox(Vec3::new(30.0, 9.0, 20.0), "plaster");
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default());
    let scene = Arc::new(scene.expect("commits"));
    let settings = PropagationSettings {
        guide_rays: 64,
        ..PropagationSettings::default()
    };
    let mut fast = Propagator::new(Arc::clone(&scene), settings).expect("settings");
    let mut plain = PlainPropagator::new(Arc::clone(&scene), settings);
    let of_seed =
        |seed| PlainPropagator::new(Arc::clone(&scene), PropagationSettings { seed, ..settings });
    let mut others = [100, 101, 102].map(of_seed);
    let mesh = procedural::shoebox(Vec3::new(0.9, 2.0, 0.05), "wood_panel");
    let part = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default());
    let part = Arc::new(part.expect("commits"));
    let pose = |id, turn: f32| InstancePose {
        id,
        position: DVec3::new(12.0, 0.1, 8.0),
        rotation: Quat::from_rotation_y(turn),
    };
    let mut door = InstanceId::default();
    let scenes = others.iter_mut().map(PlainPropagator::scene_mut);
    for scene in scenes.chain([fast.scene_mut(), plain.scene_mut()]) {
        let here = pose(InstanceId::default(), 0.0);
        door = scene.add_instance(Arc::clone(&part), &here).expect("one");
    }
    let sources = [Vec3::new(9.0, 1.5, 6.0), Vec3::new(20.0, 2.0, 15.0)];
    let sources: Vec<SourcePose> = (0..)
        .zip(sources)
        .map(|(slot, position)| SourcePose::at(SourceId::new(slot, 0), position))
        .collect();
    let (mut set, mut rays) = (PathSet::default(), Vec::new());
    let (moves, rests) = (20..60, 60 + 2 * 16);
    let (mut farthest_db, mut squares, mut count) = ([0f32; 8], [0f64; 8], 0);
    let between_db = |a: &LateEnergy, b: &LateEnergy, band: usize| {
        10.0 * (a.total()[band] / b.total()[band]).log10()
    };
    for update in 0..100 {
        // As an app with frames of two updates moves it.
        if moves.contains(&update) && update % 2 == 0 {
            let scenes = others.iter_mut().map(PlainPropagator::scene_mut);
            for scene in scenes.chain([fast.scene_mut(), plain.scene_mut()]) {
                let turned = pose(door, 0.03 * (update - 19) as f32);
                assert_eq!(scene.set_instance_poses(&[turned]), 1);
            }
        }
        let ear = ListenerPose {
            position: Vec3::new(15.0, 1.7, 11.0),
            ..ListenerPose::default()
        };
        fast.update(&ear, &sources, 0.0, &mut set);
        let mut expected = plain.update(&ear, &sources);
        expected.rays = set.rays;
        rays.push(set.rays);
        let heard = others.iter_mut().filter(|_| moves.contains(&update));
        let mut choices: Vec<PathSet> = heard.map(|other| other.update(&ear, &sources)).collect();
        if update < 20 + 16 || update >= rests {
            assert_eq!(set, expected, "update {update}");
            continue;
        }
        for (late, expected) in set.late.iter().zip(&expected.late) {
            for (band, farthest_db) in farthest_db.iter_mut().enumerate() {
                *farthest_db = farthest_db.max(between_db(late, expected, band).abs());
            }
        }
        if !choices.is_empty() {
            choices.push(expected);
        }
        for (first, one) in choices.iter().enumerate() {
            for other in &choices[first + 1..] {
                for (late, expected) in one.late.iter().zip(&other.late) {
                    for (band, squares) in squares.iter_mut().enumerate() {
                        *squares += f64::from(between_db(late, expected, band)).powi(2);
                    }
                    count += 1;
                }
            }
        }
    }
    assert_eq!(count, 24 * 6 * 2, "updates, pairs of choices, sources");
    for band in 0..8 {
        let deviation_db = (squares[band] / f64::from(count)).sqrt();
        let off_db = f64::from(farthest_db[band]);
        assert!(
            off_db < 4.0 * deviation_db,
            "band {band}: {off_db} dB, {deviation_db} dB between random choices"
        );
    }
    let mean = |range: std::ops::Range<usize>| {
        let count = range.len() as u64;
        rays[range].iter().sum::<u64>() / count
    };
    let (all, moving) = (mean(20..36), mean(36..60));
    assert!(moving + 2 * 128 * 4 < all, "{moving} rays, {all} at first");
}

/// Every dependency of a rotation's rays has them cast again.
#[test]
fn a_change_of_any_dependency_has_rays_cast_again() {
    let (benchmark, scene) = doorway();
    let origin = scene.to_local(benchmark.sources[0].1);
    let listener = scene.to_local(benchmark.walk.from);
    let mut pose = SourcePose::at(SourceId::new(0, 0), benchmark.sources[0].1);
    pose.settings.directivity = Directivity::even(0.5, 1.0);
    let lattices = [32, 48].map(lattice);
    let mut viewpoints = [VisibilityCells::default(), VisibilityCells::default()];
    let field = SceneField::new(&scene, 128, &[origin.as_vec3(), listener.as_vec3()], &mut 0);
    let step = DVec3::splat(0.3);
    viewpoints[0].renew(&scene, listener.as_vec3(), 0);
    viewpoints[1].renew(&scene, (listener + step).as_vec3(), 0);
    let first = SourceRays {
        origin,
        offset: DVec3::ZERO,
        field: &field,
        pose,
        directions: &lattices[0],
        turn: rotation(0, 1),
        rotation: 0,
        depth: 4,
        scene_state: 0,
        poses_since: 0,
        fixed_since: 0,
    };
    let mut turned = first;
    turned.pose.orientation = Quat::from_rotation_y(1.0);
    let mut even = first;
    even.pose.settings.directivity = Directivity::default();
    let others = [
        turned,
        even,
        SourceRays {
            origin: origin + 0.01,
            ..first
        },
        SourceRays {
            directions: &lattices[1],
            ..first
        },
        SourceRays {
            turn: rotation(1, 1),
            ..first
        },
        SourceRays { depth: 3, ..first },
        SourceRays {
            scene_state: 1,
            poses_since: 1,
            ..first
        },
    ];
    let id = SourceId::new(0, 0);
    let trace_from = |estimator: &mut LateEstimator,
                      from: &SourceRays<'_>,
                      listener: DVec3,
                      viewpoints: &VisibilityCells| {
        let (mut scratch, mut rays) = (RayScratch::with_capacity(1024), 0);
        estimator.cast_rays(&scene, from, &mut scratch, &mut rays);
        estimator.test_visibility(&scene, [from.origin, listener], viewpoints, &mut rays);
        let mut heard = ListenerField::default();
        heard.renew(&scene, &field, listener.as_vec3(), viewpoints, 0);
        let late = estimator.estimate(&scene, &field, &heard, id);
        (
            late,
            estimator.sequences(from.rotation).collect::<Vec<_>>(),
            rays,
        )
    };
    let trace = |estimator: &mut LateEstimator, from: &SourceRays<'_>| {
        trace_from(estimator, from, listener, &viewpoints[0])
    };
    for (number, other) in others.iter().enumerate() {
        let mut estimator = LateEstimator::default();
        let cast = trace(&mut estimator, &first);
        let again = trace(&mut estimator, &first);
        assert_eq!((cast.0, &cast.1), (again.0, &again.1), "remembered");
        assert!(again.2 < cast.2, "{} rays after {}", again.2, cast.2);
        assert_eq!(again.2, 0, "a listener at rest casts none");
        let near = trace_from(&mut estimator, &first, listener + step, &viewpoints[1]).2;
        assert!(near <= SHADOW_RAYS as u64, "a step casts shadow rays only");
        let cast = trace(&mut estimator, other);
        let fresh = trace(&mut LateEstimator::default(), other);
        assert_eq!(cast, fresh, "change {number} casts all rays");
    }
}

/// Hits in the fixed scene are cached while parts move: rays among parts find the same hits as without the cache, and
/// another fixed scene has other hits.
#[test]
fn cached_rays_among_parts_find_the_same_hits_as_new_ones() {
    let commit = |size: Vec3, material: &str| {
        let mesh = procedural::shoebox(size, material);
        Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
            .expect("commits")
    };
    let part = Arc::new(commit(Vec3::new(0.8, 0.9, 0.6), "wood_panel"));
    let pose = |id, number: usize, step: usize| InstancePose {
        id,
        position: DVec3::new(
            0.6 + 0.9 * (number % 5) as f64,
            0.4 + 0.7 * (number / 5 % 2) as f64,
            0.7 + 0.8 * (number / 10) as f64 + 0.1 * step as f64,
        ),
        rotation: Quat::from_rotation_y((number + step) as f32),
    };
    let rooms = [Vec3::new(6.0, 3.0, 5.0), Vec3::new(6.5, 3.0, 5.0)];
    let mut kept = LateEstimator::default();
    let directions = lattice(128);
    for (turn, size) in rooms.into_iter().enumerate() {
        let mut scene = commit(size, "plaster");
        let at = |number| pose(InstanceId::default(), number, 0);
        let parts: Vec<InstanceId> = (0..20)
            .map(|number| {
                scene
                    .add_instance(Arc::clone(&part), &at(number))
                    .expect("room")
            })
            .collect();
        let (source, ear) = (Vec3::new(5.5, 2.5, 0.5), Vec3::new(3.0, 2.2, 4.6));
        let occupants = [source, ear].map(|position| scene.to_local(position).as_vec3());
        let field = SceneField::new(&scene, 128, &occupants, &mut 0);
        for step in 0..6 {
            let poses: Vec<InstancePose> = parts
                .iter()
                .enumerate()
                .map(|(number, &id)| pose(id, number, step))
                .collect();
            scene.set_instance_poses(&poses);
            let state = (10 * turn + step) as u64;
            let mut viewpoints = VisibilityCells::default();
            let at = scene.to_local(ear).as_vec3();
            viewpoints.renew(&scene, at, state);
            let mut heard = ListenerField::default();
            heard.renew(&scene, &field, at, &viewpoints, state);
            let from = SourceRays {
                origin: scene.to_local(source),
                offset: DVec3::ZERO,
                field: &field,
                pose: SourcePose::at(SourceId::new(0, 0), source),
                directions: &directions,
                turn: rotation(0, 1),
                rotation: 0,
                depth: 4,
                scene_state: state,
                // All of them change.
                poses_since: state,
                fixed_since: 10 * turn as u64,
            };
            let trace = |estimator: &mut LateEstimator| {
                let (mut scratch, mut rays) = (RayScratch::with_capacity(1024), 0);
                estimator.cast_rays(&scene, &from, &mut scratch, &mut rays);
                let ends = [from.origin, scene.to_local(ear)];
                estimator.test_visibility(&scene, ends, &viewpoints, &mut rays);
                let late = estimator.estimate(&scene, &field, &heard, SourceId::new(0, 0));
                (late, estimator.sequences(0).collect::<Vec<_>>(), rays)
            };
            let fresh = trace(&mut LateEstimator::default());
            assert_eq!(trace(&mut kept), fresh, "room {turn}, step {step}");
        }
    }
}
