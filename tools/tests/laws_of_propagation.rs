//! Laws of the propagation stage, against oracles that share no code with it.

#[path = "../../tests/reference/mod.rs"]
mod reference;

use std::sync::Arc;

use foresound::propagation::{Path, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    Directivity, Effects, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose,
    procedural,
};
use foresound_tools::validate;
use glam::Vec3;
use reference::{shoebox, visibility};

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

fn update(scene: &Arc<Scene>, listener: Vec3, sources: &[SourcePose], updates: u32) -> PathSet {
    let mut propagator =
        Propagator::new(Arc::clone(scene), PropagationSettings::default()).expect("settings");
    let ear = ListenerPose {
        position: listener,
        ..ListenerPose::default()
    };
    let mut set = PathSet::default();
    for _ in 0..updates {
        propagator.update(&ear, sources, 0.0, &mut set);
    }
    set
}

/// One test a law, and a test that every law has one.
macro_rules! laws {
    ($($law:ident $name:literal)*) => {
        mod laws {
            $(#[test]
            fn $law() {
                super::holds($name);
            })*
        }

        #[test]
        fn every_law_has_a_test() {
            assert_eq!(validate::law_names(), [$($name),*]);
        }
    };
}

laws! {
    shoebox "shoebox"
    recall "recall"
    decay "decay"
    joining "joining"
    reciprocity "reciprocity"
    air "air"
    doppler "doppler"
    edge "edge"
    doorway "doorway"
    flush "flush"
    thick "thick"
    invariance "invariance"
    leak "leak"
    rims "rims"
    corner "corner"
    continuity "continuity"
    transmission "transmission"
    late_density "late/density"
    late_colour "late/colour"
    late_coherence "late/coherence"
    late_level "late/level"
    partition "partition"
    late_slopes "late/slopes"
    late_direction "late/direction"
    late_independence "late/independence"
    late_steady "late/steady"
    thread_count "thread count"
    mesh "mesh"
    mesh_curved "mesh/curved"
    mesh_chunks "mesh/chunks"
}

fn holds(law: &str) {
    let rows = validate::measure(law).expect("measures");
    assert!(!rows.is_empty(), "{law} has no figure");
    for row in rows {
        assert!(
            row.pass,
            "{}: {} {}, bound {}",
            row.law, row.figure, row.unit, row.bound
        );
    }
}

#[test]
fn the_shoebox_oracle_has_the_images_of_pyroomacoustics() {
    // Written by pyroomacoustics 0.10.1 for this room, source and order; one image a line: x, y, z, order.
    let text = include_str!("../../tests/reference/pyroomacoustics_images.csv");
    let theirs: Vec<[f64; 4]> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| {
            let numbers: Vec<f64> = line
                .split(',')
                .map(|n| n.parse().expect("a number"))
                .collect();
            numbers.try_into().expect("four columns")
        })
        .collect();
    let room = shoebox::Room {
        size: [30.0, 20.0, 10.0],
        absorption: [[0.1; 8]; 6],
        scattering: [[0.0; 8]; 6],
        air_np_per_m: [0.0; 8],
    };
    let ours = shoebox::images(&room, [7.3, 5.9, 1.6], [21.4, 12.2, 1.7], 4);
    assert_eq!((ours.len(), theirs.len()), (129, 129));
    for [x, y, z, order] in theirs {
        let near = |image: &&shoebox::Image| {
            let off = [
                image.position[0] - x,
                image.position[1] - y,
                image.position[2] - z,
            ];
            // Printed to six decimals.
            off.iter().all(|d| d.abs() < 1e-5) && f64::from(image.order) == order
        };
        assert_eq!(
            ours.iter().filter(near).count(),
            1,
            "image at {x}, {y}, {z}"
        );
    }
}

#[test]
fn no_path_is_occluded() {
    let doorway = procedural::doorway();
    let scene = commit(&doorway);
    let triangles: Vec<[Vec3; 3]> = scene.triangles().collect();
    let sources = poses(&doorway, 4);
    let set = update(&scene, doorway.walk.standing, &sources, 1);
    assert!(
        set.paths.iter().filter(|p| p.order > 0).count() > 20,
        "the oracle has paths to test"
    );
    for path in set.paths.iter().filter(|p| p.order > 0) {
        let source = sources[path.source.slot()].position;
        let stops: Vec<Vec3> = [source]
            .into_iter()
            .chain(path.points().iter().copied())
            .chain([doorway.walk.standing])
            .collect();
        for leg in stops.windows(2) {
            // Short of the reflecting planes themselves, where the leg ends.
            let (from, to) = (leg[0].as_dvec3(), leg[1].as_dvec3());
            let (from, to) = (from.lerp(to, 1e-4), from.lerp(to, 1.0 - 1e-4));
            assert!(
                visibility::is_visible(&triangles, from, to, |_| false),
                "{path:?}"
            );
        }
        let length: f32 = stops.windows(2).map(|leg| leg[0].distance(leg[1])).sum();
        assert!(
            (length - path.length_m).abs() < 1e-4 * path.length_m,
            "{path:?}"
        );
    }
}

#[test]
fn paths_are_sorted_and_distinct() {
    let hall = procedural::concert_hall();
    let scene = commit(&hall);
    let set = update(&scene, hall.walk.standing, &poses(&hall, 4), 3);
    assert!(set.paths.windows(2).all(|pair| pair[0].id < pair[1].id));
    assert!(set.paths.len() > 40, "{} paths", set.paths.len());
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let hall = procedural::concert_hall();
    let (first, second) = (commit(&hall), commit(&hall));
    let sources = poses(&hall, 2);
    assert_eq!(
        update(&first, hall.walk.standing, &sources, 4),
        update(&second, hall.walk.standing, &sources, 4)
    );
}

#[test]
fn a_step_preserves_the_identities_of_paths() {
    // A listener who moves by a centimetre keeps nearly every path under its identity: canonical sequences are stable.
    let room = procedural::shoebox(Vec3::new(30.0, 20.0, 10.0), "concrete");
    let settings = SceneSettings::default();
    let scene =
        Arc::new(Scene::commit(&room, &MaterialTable::built_in(), &settings).expect("commits"));
    let source = SourcePose::at(SourceId::new(0, 0), Vec3::new(7.3, 1.6, 5.9));
    let mut propagator =
        Propagator::new(Arc::clone(&scene), PropagationSettings::default()).expect("settings");
    let mut ids: Option<Vec<_>> = None;
    let mut set = PathSet::default();
    for step in 0..200 {
        let position = Vec3::new(15.0 + 0.02 * step as f32, 1.7, 9.0);
        let ear = ListenerPose {
            position,
            ..ListenerPose::default()
        };
        propagator.update(&ear, &[source], 0.0, &mut set);
        let now: Vec<_> = set.paths.iter().map(|p: &Path| p.id).collect();
        if let Some(before) = ids.replace(now.clone()) {
            assert_eq!(before, now, "step {step}");
        }
    }
}

#[test]
fn degenerate_positions_give_finite_paths() {
    let doorway = procedural::doorway();
    let scene = commit(&doorway);
    let bounds = scene.report();
    let inside = doorway.sources[0].1;
    let wall = Vec3::new(inside.x, inside.y, bounds.bounds_min.z);
    let far = Vec3::splat(9e4);
    let mut found = 0;
    for (source, listener) in [
        (inside, inside),
        (inside, wall),
        (wall, inside),
        (far, inside),
        (wall, wall),
    ] {
        let pose = SourcePose::at(SourceId::new(0, 0), source);
        let set = update(&scene, listener, &[pose], 2);
        assert_eq!(set.late.len(), 1);
        found += set.paths.len();
        for path in &set.paths {
            assert!(
                path.amplitude
                    .iter()
                    .all(|a| a.is_finite() && a.abs() <= 1.0 / 0.3),
                "{path:?}"
            );
            assert!(
                path.length_m.is_finite() && path.image.is_finite(),
                "{path:?}"
            );
        }
    }
    // At least two of the five pairs are mutually visible, each with first-order reflections.
    assert!(found > 10, "{found} paths show little");
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let scene = commit(&procedural::doorway());
    for (settings, name) in [
        (
            PropagationSettings {
                guide_rays: 0,
                ..Default::default()
            },
            "guide_rays",
        ),
        (
            PropagationSettings {
                depth: 5,
                ..Default::default()
            },
            "depth",
        ),
        (
            PropagationSettings {
                min_distance_m: f32::NAN,
                ..Default::default()
            },
            "min_distance_m",
        ),
    ] {
        let error = Propagator::new(Arc::clone(&scene), settings).expect_err("refused");
        assert!(error.to_string().starts_with(name), "{error}");
    }
}

#[test]
fn neutral_source_settings_change_no_bit() {
    // A pattern of weight 0 and any order, turned anywhere, and the default radius set explicitly.
    let hall = procedural::concert_hall();
    let scene = commit(&hall);
    let plain = poses(&hall, 1);
    let mut explicit = plain.clone();
    explicit[0].orientation = glam::Quat::from_rotation_y(1.0);
    explicit[0].settings.directivity = Directivity::even(0.0, 3.0);
    explicit[0].settings.radius_m = Some(0.3);
    let first = update(&scene, hall.walk.standing, &plain, 3);
    let second = update(&scene, hall.walk.standing, &explicit, 3);
    assert_eq!((first.paths, first.late), (second.paths, second.late));
}

#[test]
fn directivity_weighs_each_path_by_its_departure() {
    let room = procedural::shoebox(Vec3::new(8.0, 3.0, 6.0), "concrete");
    let settings = SceneSettings::default();
    let scene =
        Arc::new(Scene::commit(&room, &MaterialTable::built_in(), &settings).expect("commits"));
    let omni = SourcePose::at(SourceId::new(0, 0), Vec3::new(3.0, 1.5, 3.0));
    let ear = Vec3::new(5.0, 1.5, 3.0);
    let mut dipole = omni;
    dipole.settings.directivity = Directivity::even(1.0, 1.0);
    // The front is −z: the listener at +x is in the null.
    let (before, after) = (
        update(&scene, ear, &[omni], 16),
        update(&scene, ear, &[dipole], 16),
    );
    assert_eq!(before.paths.len(), after.paths.len());
    for (plain, path) in before.paths.iter().zip(&after.paths) {
        let first = path.points().first().copied().unwrap_or(ear);
        let cosine = (first - omni.position).normalize().dot(Vec3::NEG_Z).abs();
        for b in 0..8 {
            // Reflection points in single precision: 1e-6 in the direction.
            let off = path.amplitude[b] - plain.amplitude[b] * cosine;
            assert!(
                off.abs() < 1e-5 * plain.amplitude[b].abs().max(1e-3),
                "{path:?}"
            );
        }
    }
    let direct = after.paths.iter().find(|p| p.is_direct()).expect("seen");
    assert!(direct.amplitude.iter().all(|a| a.abs() < 1e-6));
    // A dipole emits a third of an omnidirectional source's power, and the late reverb has no direction.
    let level = |set: &PathSet, b: usize| set.late[0].total()[b];
    for b in 0..8 {
        let share = level(&after, b) / level(&before, b);
        // Rays are 128 beyond the fourth bounce, and concrete hardly scatters: 1 dB for the remaining dependence on them.
        assert!((10.0 * (3.0 * share).log10()).abs() < 1.0, "{share}");
    }
}

#[test]
fn a_disabled_effect_is_absent() {
    let doorway = procedural::doorway();
    let scene = commit(&doorway);
    let listener = doorway.walk.standing;
    let mut sources = poses(&doorway, 4);
    for pose in &mut sources {
        pose.settings.effects = Effects {
            direct: false,
            late: false,
            ..Effects::default()
        };
    }
    let set = update(&scene, listener, &sources, 2);
    assert!(set.paths.iter().all(|p| !p.is_direct()) && !set.paths.is_empty());
    assert!(set.late.iter().all(|l| l.total() == [0.0; 8]));
    for pose in &mut sources {
        pose.settings.effects = Effects {
            reflections: false,
            diffraction: false,
            transmission: false,
            ..Effects::default()
        };
    }
    let set = update(&scene, listener, &sources, 2);
    let triangles: Vec<[Vec3; 3]> = scene.triangles().collect();
    assert!(set.paths.iter().all(Path::is_direct));
    for pose in &sources {
        let (from, to) = (pose.position.as_dvec3(), listener.as_dvec3());
        let seen = visibility::is_visible(&triangles, from, to, |_| false);
        assert_eq!(seen, set.paths.iter().any(|p| p.source == pose.id));
    }
}

#[test]
fn the_late_reverb_of_a_scene_at_rest_does_not_depend_on_the_update() {
    let doorway = procedural::doorway();
    let scene = commit(&doorway);
    let sources = poses(&doorway, 2);
    let once = update(&scene, doorway.walk.standing, &sources, 16);
    for updates in [17, 23, 40] {
        assert_eq!(
            once.late,
            update(&scene, doorway.walk.standing, &sources, updates).late
        );
    }
}
