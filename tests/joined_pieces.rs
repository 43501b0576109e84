//! Pieces of a wall below the least area of a panel, each in a part of its own: the wall decides what mirrors.

use std::sync::Arc;

use foresound::geometry::Ray;
use foresound::scene::{
    InstanceId, InstancePose, MaterialTable, Scene, SceneSettings, TriangleMesh, procedural,
};
use glam::{DVec3, Vec3};

fn commit(mesh: &TriangleMesh) -> Arc<Scene> {
    let settings = SceneSettings::default();
    Arc::new(Scene::commit(mesh, &MaterialTable::built_in(), &settings).expect("commits"))
}

/// Its height in metres: 0.5 m of it are too small for a panel, and twice 0.5 m.
const HEIGHT_M: f32 = 0.4;

/// A wall in the plane z = 0 from one place along x to another one.
fn wall(from: f32, to: f32) -> Arc<Scene> {
    let corners = [[from, 0.0], [to, 0.0], [to, HEIGHT_M], [from, HEIGHT_M]];
    let corners = corners.map(|[x, y]| [x, y, 0.0]);
    let mesh = TriangleMesh::from_slices(&corners, &[0, 1, 2, 0, 2, 3], &["wood"], &[0, 0]);
    commit(&mesh.expect("a mesh"))
}

fn world() -> Scene {
    let mut mark = procedural::shoebox(Vec3::splat(0.01), "wood");
    for vertex in &mut mark.vertices {
        *vertex -= 20.0;
    }
    Scene::clone(&commit(&mark))
}

fn add(world: &mut Scene, part: &Arc<Scene>) -> InstanceId {
    let here = InstancePose::at(InstanceId::default(), DVec3::ZERO);
    let added = world.add_joined_instance(Arc::clone(part), &here);
    added.expect("is added")
}

/// Whether the wall mirrors at a place along x: for sequences, for rays, and by its surface.
fn mirrors(world: &Scene, x: f32) -> bool {
    let point = Vec3::new(x, 0.15, 0.0);
    let above = world.to_local(point + Vec3::Z).as_vec3();
    let hit = world.closest_hit(&Ray::new(above, Vec3::NEG_Z), [u32::MAX; 2]);
    let hit = hit.expect("a wall");
    let answers = [
        world.reflects_at(hit.group, world.to_local(point)),
        world.is_panel(hit.triangle),
    ];
    assert_eq!(answers[0], answers[1], "{x}");
    // Surfaces of the fixed part stay as committed.
    let is_counted = world.surface(hit.group).panel_triangle_count > 0;
    assert!(!answers[0] || is_counted || !world.is_of_instance(hit.group));
    answers[0]
}

/// Length in metres of the wall's upper edge.
fn upper_edge_m(world: &Scene) -> f64 {
    let top = world.to_local(HEIGHT_M * Vec3::Y).y;
    let is_top = |y: f64| (y - top).abs() < 1e-3;
    let edges = world.all_edges();
    let upper = edges.filter(|edge| is_top(edge.origin.y) && is_top(edge.at(edge.length_m).y));
    upper.map(|edge| edge.length_m).sum()
}

#[test]
fn a_piece_mirrors_beside_the_panel_of_another_part() {
    for order in [[0, 1], [1, 0]] {
        let parts = [wall(0.0, 0.5), wall(0.5, 3.0)];
        let mut world = world();
        let mut ids = [InstanceId::default(); 2];
        for index in order {
            ids[index] = add(&mut world, &parts[index]);
        }
        assert!(mirrors(&world, 0.1) && mirrors(&world, 0.499) && mirrors(&world, 2.0));
        assert!((upper_edge_m(&world) - 3.0).abs() < 1e-3);
        // The outer end fades, the border does not.
        let surface = |x: f32| {
            let above = world.to_local(Vec3::new(x, 0.15, 1.0)).as_vec3();
            let hit = world.closest_hit(&Ray::new(above, Vec3::NEG_Z), [u32::MAX; 2]);
            hit.expect("a wall").group
        };
        assert_eq!(surface(0.1), surface(2.0));
        let rim_m = |x: f32| {
            let at = world.to_local(Vec3::new(x, 0.2, 0.0));
            world.edge_distance_m(surface(0.1), at, true, 0.15)
        };
        let outer_m = rim_m(0.1).expect("an outer end");
        assert!((outer_m - 0.1).abs() < 1e-6, "{outer_m}");
        assert_eq!(rim_m(0.5), None);
        world.remove_instance(ids[1]).expect("is there");
        assert!(!mirrors(&world, 0.1));
        assert_eq!(upper_edge_m(&world), 0.0);
    }
}

#[test]
fn small_pieces_mirror_where_they_are_large_enough_together() {
    let parts = [wall(0.0, 0.5), wall(0.5, 1.0), wall(1.0, 1.5)];
    for order in [[0, 1, 2], [0, 2, 1], [2, 1, 0], [1, 2, 0]] {
        let mut world = world();
        let mut ids = [InstanceId::default(); 3];
        for (count, index) in order.into_iter().enumerate() {
            assert!(count == 0 || !mirrors(&world, 0.5 * order[0] as f32 + 0.1));
            ids[index] = add(&mut world, &parts[index]);
        }
        for x in [0.1, 0.7, 1.4] {
            assert!(mirrors(&world, x), "{order:?} {x}");
        }
        assert!((upper_edge_m(&world) - 1.5).abs() < 1e-3, "{order:?}");
        // Without one of them the others are too small, also those that did not touch it.
        world.remove_instance(ids[order[0]]).expect("is there");
        for index in [order[1], order[2]] {
            assert!(!mirrors(&world, 0.5 * index as f32 + 0.1), "{order:?}");
        }
        assert_eq!(upper_edge_m(&world), 0.0);
        add(&mut world, &parts[order[0]]);
        assert!(mirrors(&world, 0.1) && mirrors(&world, 1.4));
    }
}

#[test]
fn pieces_apart_stay_small() {
    let mut world = world();
    for part in [wall(0.0, 0.5), wall(0.55, 1.05), wall(1.1, 3.0)] {
        add(&mut world, &part);
    }
    assert!(!mirrors(&world, 0.1) && !mirrors(&world, 0.7) && mirrors(&world, 2.0));
}

#[test]
fn a_piece_of_the_fixed_part_mirrors_beside_the_panel_of_a_part() {
    let mut world = Scene::clone(&wall(0.0, 0.5));
    assert!(!mirrors(&world, 0.1));
    for _ in 0..2 {
        let id = add(&mut world, &wall(0.5, 3.0));
        assert!(mirrors(&world, 0.1) && mirrors(&world, 0.499) && mirrors(&world, 2.0));
        assert!((upper_edge_m(&world) - 3.0).abs() < 1e-3);
        world.remove_instance(id).expect("is there");
        assert!(!mirrors(&world, 0.1));
        assert_eq!(upper_edge_m(&world), 0.0);
    }
}

#[test]
fn small_pieces_of_the_fixed_part_and_of_parts_mirror_together() {
    let parts = [wall(0.0, 0.5), wall(0.5, 1.0), wall(1.0, 1.5)];
    for [fixed, first, second] in [[0, 1, 2], [1, 0, 2], [1, 2, 0], [2, 0, 1]] {
        let mut world = Scene::clone(&parts[fixed]);
        let ids = [first, second].map(|index| add(&mut world, &parts[index]));
        for x in [0.1, 0.7, 1.4] {
            assert!(mirrors(&world, x), "{fixed} {first} {x}");
        }
        assert!((upper_edge_m(&world) - 1.5).abs() < 1e-3, "{fixed} {first}");
        world.remove_instance(ids[0]).expect("is there");
        for index in [fixed, second] {
            assert!(
                !mirrors(&world, 0.5 * index as f32 + 0.1),
                "{fixed} {first}"
            );
        }
        assert_eq!(upper_edge_m(&world), 0.0);
    }
}
