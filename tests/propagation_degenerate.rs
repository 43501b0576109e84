//! Degenerate meshes, moving parts and positions: every path and late field is finite, no path is louder than the source,
//! and every update ends. Diffraction, transmission and the list of nearby paths are on.

use std::cell::Cell;
use std::sync::Arc;

use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    InstanceId, InstancePose, ListenerPose, MaterialTable, Scene, SceneSettings, SourceId,
    SourcePose, TriangleMesh, procedural,
};
use glam::{Quat, Vec3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Fewer rays than usual: degenerate positions matter here.
const SETTINGS: PropagationSettings = PropagationSettings {
    guide_rays: 128,
    source_rays: 32,
    depth: 4,
    seed: 1,
    cache_updates: 16,
    cache_capacity: 256,
    min_distance_m: 0.3,
    diffraction_order: 2,
};

/// Distance that the listener may walk while nearby paths remain valid.
const REACH_M: f64 = 0.3;

fn commit(mesh: &TriangleMesh) -> Option<Arc<Scene>> {
    let table = MaterialTable::built_in();
    let scene = Scene::commit(mesh, &table, &SceneSettings::default());
    scene.ok().map(Arc::new)
}

fn propagator(scene: Arc<Scene>) -> Propagator {
    let mut propagator = Propagator::new(scene, SETTINGS).expect("settings");
    propagator.set_nearby_radius(Some(REACH_M));
    propagator
}

/// The loudest possible path: amplitudes are single precision.
const LOUDEST: f32 = 1.0001 / SETTINGS.min_distance_m;

fn check(set: &PathSet) -> Result<(), TestCaseError> {
    for path in set.paths.iter().chain(&set.nearby) {
        let bounded = path.amplitude.iter().all(|a| a.abs() <= LOUDEST);
        prop_assert!(bounded, "{path:?}");
        let positions = path.points().iter().all(|p| p.is_finite());
        prop_assert!(
            positions && path.image.is_finite() && path.length_m.is_finite(),
            "{path:?}"
        );
    }
    prop_assert!(set.paths.windows(2).all(|pair| pair[0].id <= pair[1].id));
    for late in &set.late {
        let numbers = late.energy.as_flattened().as_flattened().iter();
        let mut numbers = numbers.chain([&late.start_s, &late.mean_free_time_s]);
        prop_assert!(
            numbers.all(|number| number.is_finite() && *number >= 0.0),
            "{late:?}"
        );
    }
    Ok(())
}

fn poses(sources: &[Vec3]) -> Vec<SourcePose> {
    (0..)
        .zip(sources)
        .map(|(slot, &position)| SourcePose::at(SourceId::new(slot, 0), position))
        .collect()
}

fn ear(position: Vec3) -> ListenerPose {
    ListenerPose {
        position,
        ..ListenerPose::default()
    }
}

/// Three updates, or none if the mesh is refused. Returns the number of paths.
fn hold(mesh: &TriangleMesh, sources: &[Vec3], listener: Vec3) -> Result<usize, TestCaseError> {
    let Some(scene) = commit(mesh) else {
        return Ok(0);
    };
    let mut propagator = propagator(scene);
    let (mut set, mut paths) = (PathSet::default(), 0);
    for _ in 0..3 {
        propagator.update(&ear(listener), &poses(sources), 0.0, &mut set);
        check(&set)?;
        paths += set.paths.len();
    }
    Ok(paths)
}

/// A part at each of `positions` in turn, rotated each time, in a fixed scene. Returns the number of paths.
fn hold_moving(
    fixed: &TriangleMesh,
    part: &TriangleMesh,
    positions: &[Vec3],
    sources: &[Vec3],
    listener: Vec3,
) -> Result<usize, TestCaseError> {
    let (Some(fixed), Some(part)) = (commit(fixed), commit(part)) else {
        return Ok(0);
    };
    let mut propagator = propagator(fixed);
    let at = InstancePose::at(InstanceId::default(), positions[0].as_dvec3());
    let id = propagator.scene_mut().add_instance(part, &at);
    let id = id.expect("a part without parts, at a finite position");
    let (mut set, mut paths) = (PathSet::default(), 0);
    for (step, position) in positions.iter().enumerate() {
        let pose = InstancePose {
            id,
            position: position.as_dvec3(),
            // Sometimes unrotated: its planes coincide with those of the fixed scene.
            rotation: Quat::from_rotation_y(0.7 * (step % 3) as f32),
        };
        let moved = propagator.scene_mut().set_instance_pose(&pose);
        moved.expect("a rigid pose");
        propagator.update(&ear(listener), &poses(sources), 0.0, &mut set);
        check(&set)?;
        paths += set.paths.len();
    }
    // Cached paths name surfaces that no longer exist.
    let removed = propagator.scene_mut().remove_instance(id);
    removed.expect("it is there");
    propagator.update(&ear(listener), &poses(sources), 0.0, &mut set);
    check(&set)?;
    Ok(paths)
}

fn mesh_of(triangles: &[[Vec3; 3]]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    // One that transmits hardly anything, one that transmits much, and one that absorbs nearly all.
    let materials = ["concrete", "curtain", "rock_wool"].map(|name| mesh.material(name));
    for (number, triangle) in triangles.iter().enumerate() {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(triangle);
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.triangle_materials.push(materials[number % 3]);
    }
    mesh
}

fn point(size: f32) -> impl Strategy<Value = Vec3> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

/// On a grid: coplanar, collinear and touching ones are frequent.
fn grid_point() -> impl Strategy<Value = Vec3> {
    (-3i8..4, -3i8..4, -3i8..4)
        .prop_map(|(x, y, z)| Vec3::new(f32::from(x), f32::from(y), f32::from(z)))
}

fn triangles(
    corner: impl Strategy<Value = Vec3> + Clone,
    most: usize,
) -> impl Strategy<Value = Vec<[Vec3; 3]>> {
    prop::collection::vec([corner.clone(), corner.clone(), corner], 1..most)
}

/// The middle and a corner of a triangle, points on its edge.
fn on_surface([a, b, c]: [Vec3; 3]) -> [Vec3; 3] {
    [(a + b + c) / 3.0, a, (a + b) / 2.0]
}

fn shell(size: Vec3) -> Vec<[Vec3; 3]> {
    let room = procedural::shoebox(size, "concrete");
    let corners = |t: &[u32; 3]| t.map(|v| room.vertices[v as usize] - size * 0.5);
    room.triangles.iter().map(corners).collect()
}

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 48,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(11),
        ..ProptestConfig::default()
    }
}

#[test]
fn triangle_soups_give_valid_updates() {
    let paths = Cell::new(0);
    proptest!(config(), |(soup in triangles(point(10.0).boxed(), 60), a in point(12.0), b in point(12.0))| {
        paths.set(paths.get() + hold(&mesh_of(&soup), &[a, b, on_surface(soup[0])[0]], b)?);
    });
    assert!(paths.get() > 0, "no mesh has a path");
}

#[test]
fn triangle_soups_on_a_grid_give_valid_updates() {
    let paths = Cell::new(0);
    proptest!(config(), |(soup in triangles(grid_point().boxed(), 60), a in grid_point(), b in grid_point())| {
        paths.set(paths.get() + hold(&mesh_of(&soup), &[a, b, on_surface(soup[0])[2]], b)?);
    });
    assert!(paths.get() > 0, "no mesh has a path");
}

#[test]
fn one_triangle_gives_valid_updates() {
    let paths = Cell::new(0);
    proptest!(config(), |(triangle in triangles(point(1.0).boxed(), 2), a in point(2.0))| {
        for listener in on_surface(triangle[0]).into_iter().chain([a]) {
            paths.set(paths.get() + hold(&mesh_of(&triangle), &[a, triangle[0][1], Vec3::ZERO], listener)?);
        }
    });
    assert!(paths.get() > 0, "no mesh has a path");
}

#[test]
fn ten_kilometres_give_valid_updates() {
    let paths = Cell::new(0);
    proptest!(config(), |(soup in triangles(point(5000.0).boxed(), 30), a in point(5000.0), b in point(5000.0))| {
        let mut all = soup;
        all.extend(shell(Vec3::splat(10_000.0)));
        paths.set(paths.get() + hold(&mesh_of(&all), &[a, b], a)?);
        paths.set(paths.get() + hold(&mesh_of(&all), &[a], b)?);
    });
    assert!(paths.get() > 0, "no mesh has a path");
}

#[test]
fn moving_parts_give_valid_updates() {
    let paths = Cell::new(0);
    proptest!(config(), |(soup in triangles(prop_oneof![grid_point(), point(2.0)].boxed(), 24), (a, b) in (point(4.0), point(4.0)), walk in prop::collection::vec(prop_oneof![grid_point(), point(4.0)], 2..5))| {
        // Through the walls, over the listener, and into a corner; a room is fixed, a soup of triangles moves.
        let (room, heap) = (mesh_of(&shell(Vec3::new(8.0, 3.0, 6.0))), mesh_of(&soup));
        let mut positions = walk;
        positions.extend([a, b, Vec3::new(4.0, 1.5, 3.0), Vec3::new(1e5, 0.0, -1e5)]);
        let sources = [b, a, positions[0] + on_surface(soup[0])[0]];
        paths.set(paths.get() + hold_moving(&room, &heap, &positions, &sources, a)?);
        // The soup is fixed, the room moves about it.
        paths.set(paths.get() + hold_moving(&heap, &room, &positions, &sources, b)?);
    });
    assert!(paths.get() > 0, "no mesh has a path");
}

#[test]
fn slivers_and_needles_give_valid_updates() {
    let paths = Cell::new(0);
    proptest!(config(), |((a, b) in (point(6.0), point(6.0)), thin in prop::collection::vec((point(5.0), point(5.0), -8i32..-2), 1..24))| {
        // Down to a few units in the last place: some have no area left and no usable plane.
        let needle = |&(from, to, exponent): &(Vec3, Vec3, i32)| {
            [from, to, to + 10f32.powi(exponent) * (to - from).any_orthogonal_vector()]
        };
        let mut all: Vec<[Vec3; 3]> = thin.iter().map(needle).collect();
        let positions = on_surface(all[0]);
        all.extend(shell(Vec3::splat(10.0)));
        paths.set(paths.get() + hold(&mesh_of(&all), &[a, positions[0], positions[1]], b)?);
        paths.set(paths.get() + hold(&mesh_of(&all), &[a, b], positions[2])?);
    });
    assert!(paths.get() > 0, "no mesh has a path");
}

#[test]
fn inverted_and_doubled_meshes_and_points_in_walls_give_valid_updates() {
    let paths = Cell::new(0);
    proptest!(config(), |(x in 1.0f32..20.0, y in 1.0f32..6.0, position in point(10.0))| {
        let inside: Vec<[Vec3; 3]> = shell(Vec3::new(x, y, 5.0));
        let outside: Vec<[Vec3; 3]> = inside.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let twice: Vec<[Vec3; 3]> = inside.iter().chain(&outside).chain(&inside).copied().collect();
        let wall = Vec3::new(0.5 * x, 0.0, 0.0);
        for mesh in [&inside, &outside, &twice] {
            let mesh = mesh_of(mesh);
            paths.set(paths.get() + hold(&mesh, &[Vec3::ZERO, position, wall], wall)?);
            paths.set(paths.get() + hold(&mesh, &[wall, Vec3::new(0.5 * x, 0.5 * y, 2.5)], Vec3::ZERO)?);
            paths.set(paths.get() + hold(&mesh, &[position], position)?);
        }
    });
    assert!(paths.get() > 0, "no mesh has a path");
}

/// Nearly coincident planes, as modellers leave them: a wall in front of another, at distances from zero to a
/// centimetre.
#[test]
fn nearly_coincident_walls_give_valid_updates() {
    let room = shell(Vec3::new(6.0, 3.0, 5.0));
    for exponent in [-9, -7, -6, -5, -4, -3, -2] {
        let gap = 10f32.powi(exponent);
        let mut all = room.clone();
        all.extend(room.iter().map(|t| t.map(|corner| corner * (1.0 - gap))));
        let between = Vec3::new(3.0 * (1.0 - gap / 2.0), 0.2, 0.1);
        for listener in [Vec3::new(0.4, 0.3, -0.2), between, Vec3::new(3.0, 1.5, 2.5)] {
            let paths = hold(&mesh_of(&all), &[between, Vec3::ONE, listener], listener);
            let paths = paths.unwrap_or_else(|error| panic!("{gap} m apart: {error}"));
            assert!(paths > 0, "{gap} m apart");
        }
    }
}

#[test]
fn non_finite_positions_give_valid_updates() {
    let mesh = procedural::shoebox(Vec3::new(4.0, 3.0, 5.0), "concrete");
    for odd in [Vec3::NAN, Vec3::INFINITY, Vec3::splat(f32::MAX)] {
        let mut propagator = propagator(commit(&mesh).expect("commits"));
        let mut set = PathSet::default();
        // First the source, then the listener is at a position that is not finite.
        for (source, listener) in [(odd, Vec3::ONE), (Vec3::ONE, odd)] {
            propagator.update(&ear(listener), &poses(&[source]), 0.0, &mut set);
            assert!(set.paths.is_empty(), "{odd}");
            check(&set).unwrap_or_else(|error| panic!("{odd}: {error}"));
        }
        // The same propagator continues with finite positions of both.
        propagator.update(&ear(Vec3::ONE), &poses(&[Vec3::splat(1.5)]), 0.0, &mut set);
        assert!(set.paths.len() > 6, "{odd}");
    }
}
