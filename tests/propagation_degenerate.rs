//! Meshes and places that nobody would build: every path is finite and no louder than the source, and every update ends.

use std::sync::Arc;

use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
    procedural,
};
use glam::Vec3;
use proptest::prelude::*;

/// Fewer rays than usual: it is the odd places that count.
const SETTINGS: PropagationSettings = PropagationSettings {
    guide_rays: 128,
    source_rays: 32,
    depth: 4,
    seed: 1,
    cache_updates: 16,
    cache_capacity: 256,
    nearest_m: 0.3,
    bends: 2,
};

/// Three updates; what cannot be committed is refused, which is well too.
fn hold(mesh: &TriangleMesh, sources: &[Vec3], listener: Vec3) -> Result<(), TestCaseError> {
    let settings = SceneSettings::default();
    let Ok(scene) = Scene::commit(mesh, &MaterialTable::built_in(), &settings) else {
        return Ok(());
    };
    let mut propagator = Propagator::new(Arc::new(scene), SETTINGS).expect("settings");
    let poses: Vec<SourcePose> = (0..)
        .zip(sources)
        .map(|(slot, &position)| SourcePose::at(SourceId::new(slot, 0), position))
        .collect();
    let ear = ListenerPose {
        position: listener,
        ..ListenerPose::default()
    };
    let mut set = PathSet::default();
    for _ in 0..3 {
        propagator.update(&ear, &poses, 0.0, &mut set);
        for path in &set.paths {
            let loudest = 1.0 / SETTINGS.nearest_m + 1e-3;
            let finite = path.amplitude.iter().all(|a| a.abs() <= loudest);
            prop_assert!(finite, "{path:?}");
            let places = path.points().iter().all(|p| p.is_finite());
            prop_assert!(
                places && path.image.is_finite() && path.length_m.is_finite(),
                "{path:?}"
            );
        }
        prop_assert!(set.paths.windows(2).all(|pair| pair[0].id <= pair[1].id));
    }
    Ok(())
}

fn mesh_of(triangles: &[[Vec3; 3]]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let material = mesh.material("concrete");
    for triangle in triangles {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(triangle);
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.triangle_materials.push(material);
    }
    mesh
}

fn point(size: f32) -> impl Strategy<Value = Vec3> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

/// On a grid, so that coplanar, collinear and touching ones are frequent.
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

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn soups_end_well(soup in triangles(point(10.0).boxed(), 60), a in point(12.0), b in point(12.0)) {
        hold(&mesh_of(&soup), &[a, b, on_surface(soup[0])[0]], b)?;
    }

    #[test]
    fn soups_on_a_grid_end_well(soup in triangles(grid_point().boxed(), 60), a in grid_point(), b in grid_point()) {
        hold(&mesh_of(&soup), &[a, b, on_surface(soup[0])[2]], b)?;
    }

    #[test]
    fn one_triangle_ends_well(triangle in triangles(point(1.0).boxed(), 2), a in point(2.0)) {
        for listener in on_surface(triangle[0]).into_iter().chain([a]) {
            hold(&mesh_of(&triangle), &[a, triangle[0][1], Vec3::ZERO], listener)?;
        }
    }

    #[test]
    fn ten_kilometres_end_well(soup in triangles(point(5000.0).boxed(), 30), a in point(5000.0), b in point(5000.0)) {
        let mut all = soup;
        all.extend(shell(Vec3::splat(10_000.0)));
        hold(&mesh_of(&all), &[a, b], a)?;
        hold(&mesh_of(&all), &[a], b)?;
    }

    #[test]
    fn inside_out_twice_and_in_the_walls(x in 1.0f32..20.0, y in 1.0f32..6.0, place in point(10.0)) {
        let inside: Vec<[Vec3; 3]> = shell(Vec3::new(x, y, 5.0));
        let outside: Vec<[Vec3; 3]> = inside.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let twice: Vec<[Vec3; 3]> = inside.iter().chain(&outside).chain(&inside).copied().collect();
        let wall = Vec3::new(0.5 * x, 0.0, 0.0);
        for mesh in [&inside, &outside, &twice] {
            let mesh = mesh_of(mesh);
            hold(&mesh, &[Vec3::ZERO, place, wall], wall)?;
            hold(&mesh, &[wall, Vec3::new(0.5 * x, 0.5 * y, 2.5)], Vec3::ZERO)?;
            hold(&mesh, &[place], place)?;
        }
    }
}

#[test]
fn numbers_that_are_none_end_well() {
    let mesh = procedural::shoebox(Vec3::new(4.0, 3.0, 5.0), "concrete");
    for odd in [Vec3::NAN, Vec3::INFINITY, Vec3::splat(f32::MAX)] {
        let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default());
        let mut propagator =
            Propagator::new(Arc::new(scene.expect("commits")), SETTINGS).expect("settings");
        let pose = SourcePose::at(SourceId::new(0, 0), odd);
        let ear = ListenerPose {
            position: Vec3::ONE,
            ..ListenerPose::default()
        };
        let mut set = PathSet::default();
        propagator.update(&ear, &[pose], 0.0, &mut set);
        assert!(set.paths.is_empty(), "{odd}");
    }
}
