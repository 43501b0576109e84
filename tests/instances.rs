//! Moving parts: results equal those of a scene committed with the parts at their poses, and keys are stable.

mod parts;

use std::sync::Arc;

use foresound::Error;
use foresound::extrapolation::{Extrapolator, FramePaths, PredictorKind};
use foresound::propagation::rays::directions::{mix, unit};
use foresound::propagation::{Path, PathSet, PropagationSettings, Propagator};
use foresound::runtime::Threads;
use foresound::scene::{InstanceId, InstancePose, ListenerPose, Scene, SourcePose, procedural};
use glam::{DVec3, Quat, Vec3};
use parts::*;

/// Two reflections, of which every sequence is tried, and one diffraction: for two a commit keeps the nearest pairs only
/// (`joined_edges` compares them).
fn exhaustive() -> PropagationSettings {
    PropagationSettings {
        depth: 2,
        diffraction_order: 1,
        // The late field is not compared.
        source_rays: 16,
        ..PropagationSettings::default()
    }
}

fn propagate(propagator: &mut Propagator, ear: &ListenerPose, sources: &[SourcePose]) -> PathSet {
    let mut set = PathSet::default();
    propagator.warm_up(ear, sources);
    propagator.update(ear, sources, 0.0, &mut set);
    set
}

#[test]
fn a_door_matches_a_scene_committed_with_it() {
    let (fixed, part) = (rooms(), door());
    let scene = commit(&fixed);
    let sources = [
        source(0, Vec3::new(4.8, 1.5, 3.2)),
        source(1, Vec3::new(12.6, 1.2, 2.6)),
        source(2, Vec3::new(10.4, 1.3, 2.3)),
    ];
    let mut moving = Propagator::new(scene, exhaustive()).expect("settings");
    let id = moving
        .scene_mut()
        .add_instance(commit(&part), &swung(InstanceId::default(), 0.0))
        .expect("a door");
    let mut in_the_door = 0;
    for (step, degrees) in [0.0, 7.5, 21.0, 33.0, 45.0, 58.5, 74.0, 86.0, 90.0]
        .into_iter()
        .enumerate()
    {
        let pose = swung(id, degrees);
        moving.scene_mut().set_instance_pose(&pose).expect("rigid");
        let fresh = commit(&joined(&fixed, &part, &pose));
        let mut fresh = Propagator::new(fresh, exhaustive()).expect("settings");
        // The last position is in the other room.
        for position in [
            Vec3::new(9.92, 1.65, 1.89),
            Vec3::new(11.3, 1.7, 4.4),
            Vec3::new(6.9, 1.6, 3.9),
        ] {
            let ear = ear(position + Vec3::X * 0.01 * step as f32);
            let found = propagate(&mut moving, &ear, &sources);
            let expected = propagate(&mut fresh, &ear, &sources);
            let missing = without(&expected.paths, &found.paths);
            let wrong = without(&found.paths, &expected.paths);
            assert!(
                missing.is_empty(),
                "{degrees}°, {position}: misses {missing:#?}"
            );
            assert!(wrong.is_empty(), "{degrees}°, {position}: adds {wrong:#?}");
            assert!(found.paths.len() > 20, "{}", found.paths.len());
            in_the_door += found
                .paths
                .iter()
                .filter(|p| p.surfaces().iter().any(moves))
                .count();
        }
    }
    assert!(in_the_door > 40, "{in_the_door} paths in the door");
}

#[test]
fn a_box_at_any_pose_matches_a_scene_committed_with_it() {
    let fixed = procedural::shoebox(Vec3::new(9.0, 4.0, 7.0), "concrete");
    let part = block(Vec3::new(-0.6, -0.4, -0.5), Vec3::new(0.6, 0.4, 0.5));
    let mut moving = Propagator::new(commit(&fixed), exhaustive()).expect("settings");
    let at = InstancePose::at(InstanceId::default(), DVec3::new(4.0, 1.5, 3.0));
    let id = moving
        .scene_mut()
        .add_instance(commit(&part), &at)
        .expect("a box");
    let sources = [source(0, Vec3::new(1.3, 1.4, 1.7))];
    for seed in 0..24u64 {
        let draw = |k: u64| unit(mix(seed << 8 | k));
        let axis = Vec3::new(draw(0) - 0.5, draw(1) - 0.5, draw(2) - 0.5).normalize();
        let position = Vec3::new(
            3.0 + 3.0 * draw(4),
            1.0 + 2.0 * draw(5),
            2.0 + 3.0 * draw(6),
        );
        let pose = InstancePose {
            id,
            position: position.as_dvec3(),
            rotation: Quat::from_axis_angle(axis, 6.0 * draw(3)),
        };
        moving.scene_mut().set_instance_pose(&pose).expect("rigid");
        let fresh = commit(&joined(&fixed, &part, &pose));
        let mut fresh = Propagator::new(fresh, exhaustive()).expect("settings");
        let ear = ear(Vec3::new(7.4, 1.7, 4.9));
        let found = propagate(&mut moving, &ear, &sources);
        let expected = propagate(&mut fresh, &ear, &sources);
        let missing = without(&expected.paths, &found.paths);
        let wrong = without(&found.paths, &expected.paths);
        assert!(missing.is_empty(), "seed {seed}: misses {missing:#?}");
        assert!(wrong.is_empty(), "seed {seed}: adds {wrong:#?}");
    }
}

#[test]
fn a_closed_door_attenuates_the_direct_path() {
    let mut rooms = Propagator::new(commit(&rooms()), exhaustive()).expect("settings");
    let open = swung(InstanceId::default(), 0.0);
    let id = rooms
        .scene_mut()
        .add_instance(commit(&door()), &open)
        .expect("a door");
    let sources = [source(0, Vec3::new(6.0, 1.5, 3.6))];
    let ear = ear(Vec3::new(10.2, 1.65, 3.55));
    let mut direct_at = |degrees| {
        let pose = swung(id, degrees);
        rooms.scene_mut().set_instance_pose(&pose).expect("rigid");
        let set = propagate(&mut rooms, &ear, &sources);
        let direct = set
            .paths
            .iter()
            .find(|path| path.is_direct() && path.diffraction_order == 0);
        direct.map_or(0.0, |path| path.amplitude[4])
    };
    let (open, closed) = (direct_at(10.0), direct_at(88.0));
    assert!(open > 0.2, "{open}: nothing blocks the path");
    assert!(
        closed < 0.2 * open,
        "{closed} through the door, {open} without"
    );
    assert_eq!(direct_at(10.0), open, "as before");
}

/// The path of one reflection in a door's broad side.
fn in_the_door(set: &PathSet) -> Option<&Path> {
    let moves =
        |path: &&Path| path.order == 1 && path.diffraction_order == 0 && moves(&path.surfaces[0]);
    set.paths.iter().find(moves)
}

#[test]
fn a_path_keeps_its_identity_while_the_door_moves() {
    let settings = PropagationSettings::default();
    let mut rooms = Propagator::new(commit(&rooms()), settings).expect("settings");
    let open = swung(InstanceId::default(), 30.0);
    let id = rooms
        .scene_mut()
        .add_instance(commit(&door()), &open)
        .expect("a door");
    let sources = [source(0, Vec3::new(12.6, 1.2, 2.6))];
    let ear = ear(Vec3::new(9.92, 1.65, 1.89));
    let mut set = PathSet::default();
    rooms.warm_up(&ear, &sources);
    let (mut names, mut lengths, mut kept, mut all) = (Vec::new(), Vec::new(), 0, 0);
    let mut before: Vec<Path> = Vec::new();
    for step in 0..60 {
        let pose = swung(id, 54.0 + 0.2 * step as f32);
        rooms.scene_mut().set_instance_pose(&pose).expect("rigid");
        rooms.update(&ear, &sources, 0.0, &mut set);
        if let Some(path) = in_the_door(&set) {
            names.push(path.id);
            lengths.push(path.length_m);
        }
        // Every path of both updates has moved little and keeps its identity.
        for path in &before {
            let follows = |p: &&Path| {
                p.surfaces() == path.surfaces()
                    && (p.diffraction_order, p.edges) == (path.diffraction_order, path.edges)
            };
            if let Some(next) = set.paths.iter().find(follows) {
                all += 1;
                kept += usize::from(next.id == path.id);
            }
        }
        before.clone_from(&set.paths);
    }
    assert!(
        names.len() > 20,
        "{} updates with a reflection in the door",
        names.len()
    );
    assert!(names.iter().all(|name| *name == names[0]), "one identity");
    let (least, most) = lengths
        .iter()
        .fold((f32::MAX, 0f32), |(a, b), l| (a.min(*l), b.max(*l)));
    assert!(
        most - least > 0.05,
        "the path has moved: {least} to {most} m"
    );
    assert!(
        all > 1000 && kept == all,
        "{kept} of {all} kept their identity"
    );
}

fn crowd(scene: &mut Scene, part: &Arc<Scene>, count: u64) -> Vec<InstanceId> {
    (0..count)
        .map(|n| {
            let pose = crowd_pose(InstanceId::default(), n, 0.0);
            scene
                .add_instance(Arc::clone(part), &pose)
                .expect("one more")
        })
        .collect()
}

fn crowd_pose(id: InstanceId, n: u64, time_s: f32) -> InstancePose {
    let draw = |k: u64| unit(mix(n << 8 | k));
    let position = Vec3::new(
        1.0 + 14.0 * draw(0),
        0.4 + 2.0 * draw(1),
        1.0 + 4.0 * draw(2),
    );
    InstancePose {
        id,
        position: position.as_dvec3() + DVec3::X * f64::from(0.3 * (time_s + draw(3)).sin()),
        rotation: Quat::from_euler(glam::EulerRot::YXZ, time_s + draw(4), draw(5), draw(6)),
    }
}

#[test]
fn the_number_of_threads_changes_no_bit_of_a_moving_scene() {
    let scene = commit(&rooms());
    let part = commit(&block(Vec3::splat(-0.2), Vec3::splat(0.25)));
    let sources = [
        source(0, Vec3::new(4.8, 1.5, 3.2)),
        source(1, Vec3::new(12.2, 1.4, 4.4)),
    ];
    let run = |count: usize| {
        let threads = Threads::start(count).expect("threads start");
        let settings = PropagationSettings::default();
        let mut propagator = Propagator::new(Arc::clone(&scene), settings).expect("settings");
        let ids = crowd(propagator.scene_mut(), &part, 40);
        let update = |step: u32| {
            let time_s = 0.05 * step as f32;
            let poses = ids
                .iter()
                .zip(0..)
                .map(|(id, n)| crowd_pose(*id, n, time_s));
            let moved = propagator
                .scene_mut()
                .set_instance_poses(&poses.collect::<Vec<_>>());
            assert!(moved == ids.len() || step == 0);
            let mut set = PathSet::default();
            let ear = ear(Vec3::new(12.7 - 0.2 * step as f32, 1.65, 0.9));
            propagator.update_with(&threads, &ear, &sources, 0.0, &mut set);
            set
        };
        (0..6).map(update).collect::<Vec<_>>()
    };
    let one = run(1);
    assert!(
        one.iter()
            .all(|set| set.instances.len() == 40 && set.paths.len() > 10)
    );
    for count in [2, 3] {
        assert_eq!(one, run(count), "{count} threads");
    }
}

/// Paths of a listener at rest after one update of every ray rotation.
fn settled(propagator: &mut Propagator) -> PathSet {
    let sources = [
        source(0, Vec3::new(4.8, 1.5, 3.2)),
        source(1, Vec3::new(12.2, 1.4, 4.4)),
    ];
    let ear = ear(Vec3::new(9.7, 1.65, 2.9));
    // Rotations and caches depend on the number of updates, which is the same in every call.
    let set = propagate(propagator, &ear, &sources);
    PathSet {
        rays: 0,
        update: 0,
        ..set
    }
}

#[test]
fn a_removed_instance_leaves_no_trace() {
    let scene = commit(&rooms());
    let mut plain = Propagator::new(Arc::clone(&scene), exhaustive()).expect("settings");
    let never = settled(&mut plain);
    let mut changed = Propagator::new(Arc::clone(&scene), exhaustive()).expect("settings");
    let part = commit(&door());
    let open = swung(InstanceId::default(), 80.0);
    let id = changed
        .scene_mut()
        .add_instance(Arc::clone(&part), &open)
        .expect("a door");
    assert!(changed.scene().same_fixed_part(&scene) && !scene.has_instances());
    let with = settled(&mut changed);
    assert_ne!(with.paths, never.paths);
    changed.scene_mut().remove_instance(id).expect("is there");
    // Two rounds, until no cache holds the door.
    settled(&mut changed);
    let mut after = settled(&mut changed);
    // The late field averages sixteen updates in the order of their rotations.
    assert_eq!(after.paths, never.paths);
    after.late.clone_from(&never.late);
    after.late_groups = never.late_groups;
    assert_eq!(after, never);
    // The next instance of the slot has another handle, and its paths have other identities.
    let again = changed
        .scene_mut()
        .add_instance(part, &open)
        .expect("a door");
    assert_eq!(
        (again.slot(), again.generation()),
        (id.slot(), id.generation() + 1)
    );
    let other = settled(&mut changed);
    assert_eq!(other.paths.len(), with.paths.len());
    let (a, b) = (in_the_door(&with), in_the_door(&other));
    assert!(
        a.zip(b)
            .is_none_or(|(a, b)| a.id != b.id && a.length_m == b.length_m)
    );
}

#[test]
fn bad_poses_and_old_handles_are_refused() {
    let mut scene = Scene::clone(&commit(&rooms()));
    let part = commit(&door());
    let good = swung(InstanceId::default(), 20.0);
    let bad = [
        InstancePose {
            position: DVec3::new(f64::NAN, 0.0, 0.0),
            ..good
        },
        InstancePose {
            position: DVec3::splat(1e7),
            ..good
        },
        InstancePose {
            rotation: Quat::from_xyzw(0.0, 0.0, 0.0, 2.0),
            ..good
        },
        InstancePose {
            rotation: Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0),
            ..good
        },
    ];
    for pose in &bad {
        let refused = scene.add_instance(Arc::clone(&part), pose);
        assert!(matches!(refused, Err(Error::Setting { .. })), "{pose:?}");
    }
    assert_eq!(scene.instance_count(), 0);
    let id = scene
        .add_instance(Arc::clone(&part), &good)
        .expect("a door");
    let standing: Vec<_> = scene.instance_poses().collect();
    assert_eq!(standing, [InstancePose { id, ..good }]);
    for pose in &bad {
        let pose = InstancePose { id, ..*pose };
        assert!(matches!(
            scene.set_instance_pose(&pose),
            Err(Error::Setting { .. })
        ));
        assert_eq!(scene.set_instance_poses(&[pose]), 0);
        assert!(
            scene.instance_poses().eq(standing.iter().copied()),
            "the last good one stays"
        );
    }
    let nested = scene.add_instance(Arc::new(scene.clone()), &good);
    assert!(
        matches!(nested, Err(Error::Setting { .. })),
        "no parts of parts"
    );
    scene.remove_instance(id).expect("is there");
    let stale = |result: foresound::Result<()>| matches!(result, Err(Error::StaleInstance { .. }));
    assert!(stale(scene.remove_instance(id)));
    assert!(stale(scene.set_instance_pose(&InstancePose { id, ..good })));
    assert!(stale(scene.instance_part(id).map(|_| ())));
    assert!(stale(scene.remove_instance(InstanceId::new(60_000, 0))));
}

/// Updates at one pose, frames at others: every predictor continues, and the geometric one uses the current pose of the door.
#[test]
fn extrapolation_follows_the_door() {
    let sources = [source(0, Vec3::new(12.6, 1.2, 2.6))];
    let ear = ear(Vec3::new(9.92, 1.65, 1.89));
    let settings = PropagationSettings::default();
    let mut rooms = Propagator::new(commit(&rooms()), settings).expect("settings");
    let open = swung(InstanceId::default(), 60.0);
    let id = rooms
        .scene_mut()
        .add_instance(commit(&door()), &open)
        .expect("a door");
    let update = propagate(&mut rooms, &ear, &sources);
    let reflected = in_the_door(&update)
        .copied()
        .expect("a reflection in the door");
    let speed_m_s = rooms.scene().speed_of_sound_m_s();
    for kind in PredictorKind::ALL {
        let mut extrapolator =
            Extrapolator::new(Arc::clone(rooms.scene()), kind, settings.min_distance_m);
        let mut frame = FramePaths::default();
        // Two updates at the same position, for predictors that need a pair.
        extrapolator.store_update(update.clone(), 5);
        extrapolator.store_update(update.clone(), 5);
        for step in 0..6 {
            let pose = swung(id, 60.0 + 0.5 * step as f32);
            extrapolator.set_instance_poses(&[pose]);
            extrapolator.frame(&ear, &sources, &mut frame);
            assert!(
                frame
                    .paths
                    .iter()
                    .all(|p| p.delay_s.is_finite() && p.arrival.is_finite())
            );
            let heard = frame.paths.iter().find(|path| path.id == reflected.id);
            let heard = heard.unwrap_or_else(|| panic!("{kind:?}, {step}: the path is there"));
            let mut there = Propagator::new(Arc::clone(rooms.scene()), settings).expect("settings");
            there.scene_mut().set_instance_pose(&pose).expect("rigid");
            let exact = propagate(&mut there, &ear, &sources);
            let exact_m = in_the_door(&exact).expect("still there").length_m;
            let error_m = (heard.delay_s * speed_m_s - f64::from(exact_m)).abs();
            match kind {
                PredictorKind::Geometric(_) => assert!(error_m < 1e-4, "{step}: {error_m} m off"),
                _ => assert_eq!(heard.delay_s * speed_m_s, f64::from(reflected.length_m)),
            }
        }
        // The direct path is that of the frame for every predictor.
        let behind = ear_behind();
        for (degrees, open) in [(10.0, true), (88.0, false)] {
            extrapolator.set_instance_poses(&[swung(id, degrees)]);
            extrapolator.frame(&behind, &[source(0, Vec3::new(6.0, 1.5, 3.6))], &mut frame);
            let direct = frame.paths.iter().filter(|path| path.order == 0);
            let loudest = direct.map(|path| path.amplitude[4]).fold(0.0, f32::max);
            assert_eq!(loudest > 0.15, open, "{kind:?}, {degrees}°: {loudest}");
        }
    }
}

fn ear_behind() -> ListenerPose {
    ear(Vec3::new(10.2, 1.65, 3.55))
}

#[test]
fn paths_in_a_part_end_with_it() {
    let sources = [source(0, Vec3::new(12.6, 1.2, 2.6))];
    let ear = ear(Vec3::new(9.92, 1.65, 1.89));
    let settings = PropagationSettings::default();
    let mut rooms = Propagator::new(commit(&rooms()), settings).expect("settings");
    let open = swung(InstanceId::default(), 60.0);
    let id = rooms
        .scene_mut()
        .add_instance(commit(&door()), &open)
        .expect("a door");
    let update = propagate(&mut rooms, &ear, &sources);
    let reflected = in_the_door(&update)
        .copied()
        .expect("a reflection in the door");
    for kind in PredictorKind::ALL {
        let mut extrapolator =
            Extrapolator::new(Arc::clone(rooms.scene()), kind, settings.min_distance_m);
        let mut frame = FramePaths::default();
        extrapolator.store_update(update.clone(), 5);
        extrapolator.frame(&ear, &sources, &mut frame);
        let heard = |frame: &FramePaths| frame.paths.iter().any(|path| path.id == reflected.id);
        assert!(heard(&frame), "{kind:?}");
        // Removed, and another instance in its slot.
        for tenant in [None, Some(block(Vec3::splat(-0.1), Vec3::splat(0.1)))] {
            let mut scene = Scene::clone(rooms.scene());
            scene.remove_instance(id).expect("is there");
            if let Some(mesh) = &tenant {
                scene.add_instance(commit(mesh), &open).expect("another");
            }
            let mut scenes = foresound::extrapolation::ScenePair::of(&Arc::new(scene));
            extrapolator.swap_scene(&mut scenes);
            extrapolator.frame(&ear, &sources, &mut frame);
            let holds = !matches!(kind, PredictorKind::Geometric(_)) && tenant.is_some();
            assert!(!heard(&frame) || holds, "{kind:?}");
        }
    }
}
