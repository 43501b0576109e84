//! No ray leaks out of a watertight hall, through a terrain or out of a large shell, whatever it is aimed at, with any
//! instruction set. `one_answer.rs` tests that all of them agree.

mod reference;

use foresound::geometry::bvh::{InstructionSet, NO_GROUP};
use foresound::geometry::{Bvh, Ray};
use foresound::propagation::rays::directions::{fibonacci_direction, mix, unit};
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

/// One tree for every instruction set of the machine.
fn trees(bvh: &Bvh) -> Vec<Bvh> {
    InstructionSet::ALL
        .into_iter()
        .filter_map(|set| bvh.rebuilt_for(set))
        .collect()
}

/// Number of trees in which a ray hits nothing.
fn misses(trees: &[Bvh], ray: &Ray) -> u32 {
    let missed = |tree: &&Bvh| tree.closest_hit(ray, [NO_GROUP; 2]).is_none();
    trees.iter().filter(missed).count() as u32
}

#[test]
fn a_million_rays_stay_in_the_hall() {
    let scene = hall();
    let bounds = scene.report();
    let size = bounds.bounds_max - bounds.bounds_min;
    let walk = procedural::concert_hall().walk;
    let mut leaks = 0;
    for i in 0..1_000_000u64 {
        // From points along the walk, which are inside for certain.
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
    let trees = trees(&Bvh::build(&vertices, &triangles, &groups));
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
            leaks[kind] += misses(&trees, &Ray::new(from, target - from));
        }
    }
    assert_eq!(leaks, [0, 0], "at edges and at vertices, seed {SEED}");
}

/// Casts rays at shared edges, at vertices and along axes, and counts misses: at edges, at vertices.
fn leaks(bvh: &Bvh, rays: u64, from: impl Fn(u64) -> Vec3) -> [u32; 2] {
    let triangles: Vec<[Vec3; 3]> = bvh.triangles().map(|(corners, ..)| corners).collect();
    let trees = trees(bvh);
    let mut leaks = [0; 2];
    for i in 0..rays {
        let from = from(i);
        let [a, b, _] = triangles[mix(7 * i) as usize % triangles.len()];
        for (kind, target) in [a.lerp(b, draw(7 * i + 1)), a].into_iter().enumerate() {
            leaks[kind] += misses(&trees, &Ray::new(from, target - from));
        }
    }
    leaks
}

#[test]
fn rays_aimed_at_the_halls_edges_and_vertices_hit() {
    let scene = hall();
    let walk = procedural::concert_hall().walk;
    let from = |i: u64| {
        let origin = walk.from.lerp(walk.to, draw(7 * i + 2));
        scene.to_local(origin).as_vec3()
    };
    assert_eq!(leaks(scene.bvh(), 200_000, from), [0, 0], "seed {SEED}");
}

#[test]
fn rays_aimed_down_at_the_terrain_hit_it() {
    let camp = procedural::bootcamp();
    let terrain = camp.parts.iter().find(|part| part.name == "ground");
    let range = terrain.expect("the camp has ground").triangles.clone();
    let triangles = &camp.mesh.triangles[range];
    let groups = vec![0; triangles.len()];
    let trees = trees(&Bvh::build(&camp.mesh.vertices, triangles, &groups));
    // A boundary edge belongs to one triangle only: rays aimed at it may pass beside it.
    let mut sides = std::collections::HashMap::new();
    for t in triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *sides.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    let boundary: std::collections::HashSet<u32> = sides
        .iter()
        .filter(|(_, count)| **count < 2)
        .flat_map(|((a, b), _)| [*a, *b])
        .collect();
    let mut missed = [0u32; 3];
    let mut aimed = 0;
    for i in 0..210_000u64 {
        let corners = triangles[mix(7 * i) as usize % triangles.len()];
        if corners.iter().any(|v| boundary.contains(v)) {
            continue;
        }
        aimed += 1;
        let [a, b, c] = corners.map(|v| camp.mesh.vertices[v as usize]);
        let edge = a.lerp(b, draw(7 * i + 1));
        let above = (a + b + c) / 3.0 + Vec3::new(0.0, 50.0 + 100.0 * draw(7 * i + 2), 0.0);
        let plumb = Vec3::new(edge.x, above.y, edge.z);
        let rays = [
            Ray::new(above, edge - above),
            Ray::new(above, a - above),
            Ray::new(plumb, Vec3::NEG_Y),
        ];
        for (missed, ray) in missed.iter_mut().zip(rays) {
            *missed += misses(&trees, &ray);
        }
    }
    assert!(aimed >= 200_000, "{aimed}");
    assert_eq!(missed, [0; 3], "edges, vertices, plumb; seed {SEED}");
}

#[test]
fn a_shell_of_a_kilometre_holds_rays_along_every_axis() {
    let size = Vec3::new(1031.7, 987.3, 1009.1);
    let room = procedural::shoebox(size, "concrete");
    let centred: Vec<Vec3> = room.vertices.iter().map(|v| *v - size * 0.5).collect();
    let (vertices, triangles) = subdivide(&centred, &room.triangles, 6);
    let bvh = Bvh::build(&vertices, &triangles, &vec![0; triangles.len()]);
    let from = |i: u64| {
        let share = Vec3::new(draw(7 * i + 3), draw(7 * i + 4), draw(7 * i + 5));
        (share - 0.5) * 0.98 * size
    };
    assert_eq!(leaks(&bvh, 200_000, from), [0, 0], "seed {SEED}");
    let trees = trees(&bvh);
    // From the exact coordinates of vertices, which makes axis-parallel rays hit edges and vertices.
    let mut passed = 0;
    for i in 0..200_000u64 {
        let vertex = vertices[mix(i) as usize % vertices.len()];
        let inside = vertex.clamp(size * -0.49, size * 0.49);
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for direction in [axis, -axis] {
                let ray = Ray::new(inside, direction);
                passed += misses(&trees, &ray);
            }
        }
    }
    assert_eq!(passed, 0, "seed {SEED}");
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
fn the_tree_agrees_with_brute_force() {
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
            expected.expect("the hall is watertight"),
            found.expect("the hall is watertight"),
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
fn non_finite_rays_hit_nothing() {
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
fn ten_thousand_collinear_triangles_do_not_overflow_the_stack() {
    // Trees of these are as deep as they are long unless the builder bounds the depth.
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
