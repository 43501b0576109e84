//! Joined parts: what touches is one surface, has no edge at its border, and has the wedges of the whole.

use std::sync::Arc;

use foresound::Error;
use foresound::scene::edges::Edge;
use foresound::scene::{
    InstanceId, InstancePose, MaterialTable, Scene, SceneSettings, TriangleMesh, procedural,
};
use glam::{DVec3, Quat, Vec3};

fn commit(mesh: &TriangleMesh) -> Arc<Scene> {
    let table = MaterialTable::built_in();
    let settings = SceneSettings::default();
    Arc::new(Scene::commit(mesh, &table, &settings).expect("commits"))
}

/// A quadrangle between two sides from a corner.
fn quad(corner: [f32; 3], a: [f32; 3], b: [f32; 3], material: &str) -> TriangleMesh {
    let [corner, a, b] = [corner, a, b].map(Vec3::from);
    let corners = [corner, corner + a, corner + a + b, corner + b].map(|c| c.to_array());
    TriangleMesh::from_slices(&corners, &[0, 1, 2, 0, 2, 3], &[material], &[0, 0]).expect("a mesh")
}

/// A floor of 8 m by 8 m.
fn floor(x: f32, material: &str) -> TriangleMesh {
    quad([x, 0.0, 0.0], [0.0, 0.0, 8.0], [8.0, 0.0, 0.0], material)
}

fn world() -> Scene {
    let mut mark = procedural::shoebox(Vec3::splat(0.01), "wood");
    for vertex in &mut mark.vertices {
        *vertex -= 20.0;
    }
    Scene::clone(&commit(&mark))
}

fn at(x: f64) -> InstancePose {
    InstancePose::at(InstanceId::default(), DVec3::new(x, 0.0, 0.0))
}

/// The edges near a point in world coordinates.
fn edges_at(scene: &Scene, point: [f32; 3]) -> Vec<Edge> {
    let point = scene.to_local(point.into());
    let is_near = |edge: &Edge| {
        let along = (point - edge.origin).dot(edge.direction);
        edge.at(along.clamp(0.0, edge.length_m)).distance(point) < 0.01
    };
    scene.all_edges().filter(is_near).collect()
}

/// Numbers and keys of the surfaces below points at a height, by rays.
fn below(scene: &Scene, points: &[[f32; 3]]) -> Vec<(u32, u64)> {
    let surface = |point: &[f32; 3]| {
        let origin = scene.to_local((*point).into()).as_vec3();
        let ray = foresound::geometry::Ray::new(origin, Vec3::NEG_Y);
        let hit = scene.closest_hit(&ray, [u32::MAX; 2]).expect("a floor");
        (hit.group, scene.surface(hit.group).key)
    };
    points.iter().map(surface).collect()
}

#[test]
fn two_floors_of_one_material_are_one_surface_without_an_edge_between_them() {
    let mut world = world();
    let tile = commit(&floor(0.0, "wood"));
    let first = world
        .add_joined_instance(Arc::clone(&tile), &at(0.0))
        .expect("is added");
    let alone = below(&world, &[[4.0, 1.0, 4.0]])[0];
    assert_eq!(edges_at(&world, [8.0, 0.0, 4.0]).len(), 1, "a rim");
    // Turned by half a turn about the vertical: the same plane, another orientation of part and rim.
    let turned = InstancePose {
        rotation: Quat::from_rotation_y(std::f32::consts::PI),
        ..InstancePose::at(InstanceId::default(), DVec3::new(16.0, 0.0, 8.0))
    };
    let second = world.add_joined_instance(tile, &turned).expect("is added");
    let both = below(&world, &[[4.0, 1.0, 4.0], [12.0, 1.0, 4.0]]);
    assert_eq!(both, [alone; 2]);
    let surface = world.surface(alone.0);
    assert!((surface.area_m2 - 128.0).abs() < 1e-3);
    assert!(edges_at(&world, [8.0, 0.0, 4.0]).is_empty());
    assert_eq!(
        edges_at(&world, [16.0, 0.0, 4.0]).len(),
        1,
        "the outer rim stays"
    );
    for x in [7.99, 8.0, 8.01] {
        let point = world.to_local(Vec3::new(x, 0.0, 4.0));
        assert!(world.reflects_at(alone.0, point), "{x}");
        for in_front in [false, true] {
            assert_eq!(
                world.edge_distance_m(alone.0, point, in_front, 0.3),
                None,
                "{x}"
            );
            assert_eq!(world.finite_panel_at(alone.0, point, in_front), None, "{x}");
        }
    }
    let outer = world.to_local(Vec3::new(15.9, 0.0, 4.0));
    assert!(world.edge_distance_m(alone.0, outer, true, 0.3).is_some());
    world.remove_instance(second).expect("is there");
    assert_eq!(
        edges_at(&world, [8.0, 0.0, 4.0]).len(),
        1,
        "the rim is back"
    );
    assert_eq!(below(&world, &[[4.0, 1.0, 4.0]])[0], alone);
    let border = world.to_local(Vec3::new(7.9, 0.0, 4.0));
    assert!(world.edge_distance_m(alone.0, border, true, 0.3).is_some());
    world.remove_instance(first).expect("is there");
    assert!(!world.has_surface(alone.0) && !world.has_joined_instances());
}

#[test]
fn floors_of_two_materials_have_no_edge_between_them_and_stay_two() {
    let mut world = world();
    for (x, material) in [(0.0, "wood"), (8.0, "grass")] {
        let part = commit(&floor(x, material));
        world.add_joined_instance(part, &at(0.0)).expect("is added");
    }
    let both = below(&world, &[[4.0, 1.0, 4.0], [12.0, 1.0, 4.0]]);
    assert_ne!(both[0], both[1]);
    assert!(edges_at(&world, [8.0, 0.0, 4.0]).is_empty());
}

#[test]
fn a_wall_of_one_part_at_the_end_of_the_floor_of_another_makes_one_wedge() {
    let (ground, wall) = (
        floor(0.0, "wood"),
        quad([8.0, 0.0, 0.0], [0.0, 0.0, 8.0], [0.0, 3.0, 0.0], "wood"),
    );
    let mut whole = ground.clone();
    whole
        .append(&wall, &glam::DAffine3::IDENTITY)
        .expect("appends");
    let whole = commit(&whole);
    let expected = edges_at(&whole, [8.0, 0.0, 4.0]);
    assert_eq!(expected.len(), 1);
    for order in [[&ground, &wall], [&wall, &ground]] {
        let mut world = world();
        for mesh in order {
            world
                .add_joined_instance(commit(mesh), &at(0.0))
                .expect("is added");
        }
        let found = edges_at(&world, [8.0, 0.0, 4.0]);
        assert_eq!(found.len(), 1);
        assert!((found[0].n - expected[0].n).abs() < 1e-9, "{}", found[0].n);
        assert!(found[0].outward().dot(expected[0].outward()) > 0.9999);
        assert!(found[0].faces[0] != found[0].faces[1]);
    }
}

#[test]
fn a_wall_on_the_middle_of_a_floor_has_no_edge_there() {
    let mut world = world();
    let wall = quad([3.0, 0.0, 1.0], [0.0, 0.0, 6.0], [0.0, 3.0, 0.0], "wood");
    for mesh in [floor(0.0, "wood"), wall] {
        world
            .add_joined_instance(commit(&mesh), &at(0.0))
            .expect("is added");
    }
    assert!(edges_at(&world, [3.0, 0.0, 4.0]).is_empty());
    assert_eq!(edges_at(&world, [3.0, 3.0, 4.0]).len(), 1, "the wall's top");
}

#[test]
fn an_edge_across_a_border_goes_on_there() {
    let mut world = world();
    for x in [0.0, 8.0] {
        let wall = quad([x, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 3.0, 0.0], "wood");
        world
            .add_joined_instance(commit(&wall), &at(0.0))
            .expect("is added");
    }
    let tops = edges_at(&world, [8.0, 3.0, 0.0]);
    assert_eq!(tops.len(), 2);
    let (from, to) = (DVec3::new(0.0, -1.0, 4.0), DVec3::new(0.0, -1.0, -4.0));
    let border = world.to_local(Vec3::new(8.0, 3.0, 0.0));
    // Of a path across the border just beside it there is one, at full strength.
    let aside = DVec3::X * 0.05;
    let crossings = tops
        .iter()
        .filter_map(|edge| edge.crossing(border + aside + from, border + aside + to));
    let found: Vec<_> = crossings.collect();
    assert_eq!(found.len(), 1);
    assert!(found[0].beyond_weight() == 1.0 && found[0].excess_m.contains(&f64::INFINITY));
}

#[test]
fn a_joined_part_does_not_move() {
    let mut world = world();
    let tile = commit(&floor(0.0, "wood"));
    let id = world.add_joined_instance(tile, &at(0.0)).expect("is added");
    let pose = InstancePose { id, ..at(1.0) };
    assert!(matches!(
        world.set_instance_pose(&pose),
        Err(Error::Setting { .. })
    ));
    assert_eq!(world.set_instance_poses(&[pose]), 0);
    assert!(below(&world, &[[0.5, 1.0, 4.0]]).len() == 1);
}
