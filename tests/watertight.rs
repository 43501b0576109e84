//! No ray leaks out of a closed hall, whatever it is aimed at.

#[allow(unreachable_pub, reason = "shared by several tests")]
mod reference;

use foresound::geometry::bvh::NO_GROUP;
use foresound::geometry::{Bvh, Ray};
use foresound::propagation::sampling::{fibonacci_direction, mix, unit};
use foresound::scene::{MaterialTable, Scene, SceneSettings, procedural};
use glam::Vec3;
use reference::visibility::brute_force_closest;

const SEED: u64 = 20_261_121;

fn hall() -> Scene {
    let hall = procedural::concert_hall();
    Scene::commit(
        &hall.mesh,
        &MaterialTable::built_in(),
        &SceneSettings::default(),
    )
    .expect("the hall commits")
}

fn draw(counter: u64) -> f32 {
    unit(mix(SEED ^ counter))
}

#[test]
fn a_million_rays_stay_in_the_hall() {
    let scene = hall();
    let bounds = scene.report();
    let size = bounds.bounds_max - bounds.bounds_min;
    let walk = procedural::concert_hall().walk;
    let mut leaks = 0;
    for i in 0..1_000_000u64 {
        // From places along the walk, which are inside for certain.
        let from = walk.from.lerp(walk.to, draw(2 * i));
        let ray = Ray::new(
            scene.to_local(from).as_vec3(),
            fibonacci_direction(i as u32, 1_000_000),
        );
        match scene.bvh().closest_hit(&ray, [NO_GROUP; 2]) {
            Some(hit) => assert!(hit.t <= size.length(), "ray {i} flew {} m", hit.t),
            None => leaks += 1,
        }
    }
    assert_eq!(leaks, 0, "seed {SEED}");
}

#[test]
fn rays_aimed_at_edges_and_vertices_do_not_slip_through() {
    let room = procedural::shoebox(Vec3::new(31.3, 19.7, 9.9), "concrete");
    // A fine grid of shared edges: every quad of the room in many triangles.
    let (vertices, triangles) = subdivide(&room.vertices, &room.triangles, 5);
    let groups = vec![0; triangles.len()];
    let bvh = Bvh::build(&vertices, &triangles, &groups);
    let mut leaks = [0u32; 2];
    for i in 0..200_000u64 {
        let from = Vec3::new(
            1.0 + 29.0 * draw(5 * i),
            1.0 + 17.0 * draw(5 * i + 1),
            1.0 + 7.0 * draw(5 * i + 2),
        );
        let triangle = triangles[(draw(5 * i + 3) * triangles.len() as f32) as usize];
        let [a, b, _] = triangle.map(|v| vertices[v as usize]);
        for (kind, target) in [a.lerp(b, draw(5 * i + 4)), a].into_iter().enumerate() {
            let hit = bvh.closest_hit(&Ray::new(from, target - from), [NO_GROUP; 2]);
            leaks[kind] += u32::from(hit.is_none());
        }
    }
    assert_eq!(leaks, [0, 0], "at edges and at vertices, seed {SEED}");
}

/// Splits every triangle in four, `times` times over, without welding: neighbours compute the same midpoints.
fn subdivide(vertices: &[Vec3], triangles: &[[u32; 3]], times: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut corners: Vec<[Vec3; 3]> = triangles
        .iter()
        .map(|t| t.map(|v| vertices[v as usize]))
        .collect();
    for _ in 0..times {
        corners = corners
            .into_iter()
            .flat_map(|[a, b, c]| {
                let middle = |p: Vec3, q: Vec3| (p + q) * 0.5;
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let indices = (0..corners.len() as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    (corners.into_iter().flatten().collect(), indices)
}

#[test]
fn the_tree_answers_as_brute_force_does() {
    let scene = hall();
    let triangles: Vec<[Vec3; 3]> = scene
        .triangles()
        .map(|t| t.map(|corner| scene.to_local(corner).as_vec3()))
        .collect();
    let walk = procedural::concert_hall().walk;
    for i in 0..300u64 {
        let from = scene
            .to_local(walk.from.lerp(walk.to, draw(3 * i)))
            .as_vec3();
        let direction = fibonacci_direction(i as u32, 300);
        let expected = brute_force_closest(&triangles, from.as_dvec3(), direction.as_dvec3());
        let found = scene
            .bvh()
            .closest_hit(&Ray::new(from, direction), [NO_GROUP; 2]);
        let (expected, found) = (
            expected.expect("the hall is closed"),
            found.expect("the hall is closed"),
        );
        // f32 against f64 over 30 m: a few units in the last place of the coordinates.
        assert!(
            (f64::from(found.t) - expected).abs() < 1e-4,
            "ray {i}: {} for {expected}",
            found.t
        );
        let before = Ray {
            t_max: found.t * 0.999,
            ..Ray::new(from, direction)
        };
        assert!(!scene.bvh().any_hit(&before, [NO_GROUP; 2]), "ray {i}");
        let beyond = Ray {
            t_max: found.t * 1.001,
            ..Ray::new(from, direction)
        };
        assert!(scene.bvh().any_hit(&beyond, [NO_GROUP; 2]), "ray {i}");
    }
}

#[test]
fn rays_that_are_none_hit_nothing() {
    let scene = hall();
    let none = [
        Ray::new(Vec3::NAN, Vec3::X),
        Ray::new(Vec3::ZERO, Vec3::ZERO),
        Ray::new(Vec3::ZERO, Vec3::new(f32::INFINITY, 0.0, 0.0)),
        Ray {
            t_max: f32::NAN,
            ..Ray::new(Vec3::ZERO, Vec3::X)
        },
    ];
    for ray in none {
        assert_eq!(scene.bvh().closest_hit(&ray, [NO_GROUP; 2]), None);
        assert!(!scene.bvh().any_hit(&ray, [NO_GROUP; 2]));
    }
    let empty = Bvh::build(&[], &[], &[]);
    assert_eq!(
        empty.closest_hit(&Ray::new(Vec3::ZERO, Vec3::X), [NO_GROUP; 2]),
        None
    );
}

#[test]
fn ten_thousand_collinear_triangles_do_not_overflow_the_walk() {
    // Trees of these are as deep as they are long unless the builder is watched.
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..10_000u32 {
        let x = 1.0 + 1e-6 * i as f32;
        vertices.extend([
            Vec3::new(x, -1.0, -1.0),
            Vec3::new(x, 1.0, -1.0),
            Vec3::new(x, 0.0, 1.0),
        ]);
        triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let bvh = Bvh::build(&vertices, &triangles, &vec![0; triangles.len()]);
    let hit = bvh
        .closest_hit(&Ray::new(Vec3::ZERO, Vec3::X), [NO_GROUP; 2])
        .expect("a wall of triangles");
    assert_eq!(hit.triangle, 0);
}
