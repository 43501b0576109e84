//! Parts that continue the fixed part: together they are heard as one mesh, and the fixed part alone as before.

use std::sync::Arc;

use foresound::propagation::{Path, PathId, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourcePose, TriangleMesh,
};
use glam::{DVec3, Vec3};

/// Height of walls in metres.
const HEIGHT_M: f32 = 2.5;

fn commit(mesh: &TriangleMesh) -> Arc<Scene> {
    let settings = SceneSettings::default();
    Arc::new(Scene::commit(mesh, &MaterialTable::built_in(), &settings).expect("commits"))
}

fn quad(mesh: &mut TriangleMesh, corners: [[f32; 3]; 4]) {
    let wall = mesh.material("concrete");
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(corners.map(Vec3::from_array));
    mesh.triangles
        .extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| first + i)));
    mesh.triangle_materials.extend([wall; 2]);
}

/// Ground and a solid wall 0.3 m thick along x between two positions. Of the wall's ends, those of the whole are closed.
fn strip(from: f32, to: f32, [begins, ends]: [bool; 2]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let (near, far, top) = (-0.15, 0.15, HEIGHT_M);
    for [a, b] in [[-8.0, near], [far, 8.0]] {
        quad(
            &mut mesh,
            [[from, 0.0, a], [from, 0.0, b], [to, 0.0, b], [to, 0.0, a]],
        );
    }
    for z in [near, far] {
        quad(
            &mut mesh,
            [[from, 0.0, z], [to, 0.0, z], [to, top, z], [from, top, z]],
        );
    }
    quad(
        &mut mesh,
        [
            [from, top, near],
            [from, top, far],
            [to, top, far],
            [to, top, near],
        ],
    );
    for x in [from, to] {
        if x == from && begins || x == to && ends {
            quad(
                &mut mesh,
                [[x, 0.0, near], [x, top, near], [x, top, far], [x, 0.0, far]],
            );
        }
    }
    mesh
}

const WHOLE: [f32; 2] = [0.0, 12.0];
const BORDER: f32 = 5.3;

/// Source and listener: both sides of the wall, and both on one side.
const PAIRS: [[Vec3; 2]; 3] = [
    [Vec3::new(3.1, 1.5, -2.0), Vec3::new(6.9, 1.6, 2.4)],
    [Vec3::new(5.0, 1.5, -3.0), Vec3::new(5.5, 1.6, 2.0)],
    [Vec3::new(3.5, 1.2, -2.0), Vec3::new(7.6, 1.7, -2.6)],
];

fn heard(scene: &Arc<Scene>, [from, to]: [Vec3; 2]) -> PathSet {
    let settings = PropagationSettings::default();
    let mut propagator = Propagator::new(Arc::clone(scene), settings).expect("settings");
    let source = SourcePose::at(SourceId::new(0, 0), from);
    let mut set = PathSet::default();
    for _ in 0..16 {
        propagator.update(&ListenerPose::facing(to, 0.0), &[source], 0.0, &mut set);
    }
    set
}

fn energy(path: &Path) -> f32 {
    path.amplitude.iter().map(|a| a * a).sum()
}

/// Fails unless every audible path of one set is in the other one, at the same level.
fn assert_same(a: &PathSet, b: &PathSet, what: &str) {
    let loudest = a.paths.iter().map(energy).fold(0.0, f32::max);
    let audible = a.paths.iter().filter(|path| energy(path) > 1e-5 * loudest);
    let mut count = 0;
    for path in audible.filter(|path| path.order + path.diffraction_order <= 3) {
        count += 1;
        let is_same = |other: &&Path| {
            (other.order, other.diffraction_order) == (path.order, path.diffraction_order)
                && other.image.distance(path.image) < 0.02
        };
        let other = b.paths.iter().find(is_same);
        let other = other.unwrap_or_else(|| unreachable!("{what}: missing {path:?}"));
        let off_db = 10.0 * (energy(other) / energy(path)).log10();
        assert!(
            off_db.abs() < 0.5,
            "{what}: {off_db} dB\n{path:?}\n{other:?}"
        );
    }
    assert!(count >= 4, "{what}: {count} paths");
}

/// The scene, fixed up to the border, with and without the part beyond it.
fn world() -> (Scene, InstanceId) {
    let mut world = Scene::clone(&commit(&strip(WHOLE[0], BORDER, [true, false])));
    let part = commit(&strip(BORDER, WHOLE[1], [false, true]));
    let here = InstancePose::at(InstanceId::default(), DVec3::ZERO);
    let id = world.add_joined_instance(part, &here).expect("is added");
    (world, id)
}

#[test]
fn a_part_that_continues_the_fixed_part_is_heard_as_one_mesh() {
    let whole = commit(&strip(WHOLE[0], WHOLE[1], [true, true]));
    let world = Arc::new(world().0);
    for (number, pair) in PAIRS.into_iter().enumerate() {
        let [whole, joined] = [&whole, &world].map(|scene| heard(scene, pair));
        assert_same(&whole, &joined, &format!("pair {number}, of the whole"));
        assert_same(&joined, &whole, &format!("pair {number}, of both"));
    }
}

#[test]
fn edges_at_the_border_are_those_of_one_mesh() {
    let length_m = |scene: &Scene, counts: &dyn Fn(DVec3, DVec3) -> bool| -> f64 {
        let ends = |point: DVec3| scene.to_world(point).as_dvec3();
        let edges = scene.all_edges();
        let own = edges.filter(|e| counts(ends(e.origin), ends(e.at(e.length_m))));
        own.map(|edge| edge.length_m).sum()
    };
    let at_border = |a: DVec3, b: DVec3| {
        (a.x - f64::from(BORDER)).abs() < 1e-3 && (b.x - f64::from(BORDER)).abs() < 1e-3
    };
    let at_top = |a: DVec3, b: DVec3| {
        let top = |point: DVec3| (point.y - f64::from(HEIGHT_M)).abs() < 1e-3;
        top(a) && top(b) && (a.z - b.z).abs() < 1e-3
    };
    let whole = commit(&strip(WHOLE[0], WHOLE[1], [true, true]));
    let (mut world, id) = world();
    assert_eq!(length_m(&world, &at_border), 0.0);
    let [expected, found] = [&*whole, &world].map(|scene| length_m(scene, &at_top));
    assert!((expected - found).abs() < 0.05, "{expected} {found}");
    world.remove_instance(id).expect("is there");
    let alone = commit(&strip(WHOLE[0], BORDER, [true, false]));
    for counts in [&at_border as &dyn Fn(DVec3, DVec3) -> bool, &at_top] {
        assert_eq!(length_m(&alone, counts), length_m(&world, counts));
    }
    assert!(length_m(&world, &at_border) > 1.0);
}

#[test]
fn the_fixed_part_alone_is_heard_as_before() {
    let alone = commit(&strip(WHOLE[0], BORDER, [true, false]));
    let (mut world, id) = world();
    world.remove_instance(id).expect("is there");
    let world = Arc::new(world);
    for pair in PAIRS {
        assert_eq!(heard(&alone, pair).paths, heard(&world, pair).paths);
    }
}

#[test]
fn a_reflection_keeps_its_identity_across_the_border() {
    let world = Arc::new(world().0);
    let settings = PropagationSettings {
        diffraction_order: 0,
        ..PropagationSettings::default()
    };
    let mut propagator = Propagator::new(Arc::clone(&world), settings).expect("settings");
    let source = SourcePose::at(SourceId::new(0, 0), Vec3::new(4.1, 1.5, -2.0));
    let mut set = PathSet::default();
    let mut before: Option<Vec<(u8, PathId)>> = None;
    let mut crossed = 0;
    for step in 0..80 {
        // The points of reflection pass the border at different steps.
        let ear = Vec3::new(5.0 + 0.05 * step as f32, 1.6, -2.6);
        for _ in 0..if step == 0 { 16 } else { 1 } {
            propagator.update(&ListenerPose::facing(ear, 0.0), &[source], 0.0, &mut set);
        }
        let mut now: Vec<(u8, PathId)> = set.paths.iter().map(|p| (p.order, p.id)).collect();
        now.sort_unstable();
        // Ground, wall, both.
        assert_eq!(now.len(), 4, "step {step}");
        if let Some(before) = before.replace(now.clone()) {
            assert_eq!(before, now, "step {step}");
        }
        let of_part = set.paths.iter().flat_map(|p| p.surfaces());
        crossed = of_part.filter(|s| world.is_of_instance(**s)).count();
    }
    assert_eq!(crossed, 4, "all reflections are beyond the border at last");
}
