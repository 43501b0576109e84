//! Every tree and instruction set returns the specified result, to the bit: `PreparedRay::intersect` on every triangle,
//! the smallest parameter first and the lowest index among equals.

use foresound::geometry::bvh::{InstructionSet, NO_GROUP};
use foresound::geometry::triangle::PreparedRay;
use foresound::geometry::{Bvh, Hit, Ray};
use foresound::propagation::rays::directions::{fibonacci_direction, mix, unit};
use foresound::scene::{MaterialTable, Scene, SceneSettings, procedural};
use glam::Vec3;
use proptest::prelude::*;

const SEED: u64 = 20_261_121;

fn draw(counter: u64) -> f32 {
    unit(mix(SEED ^ counter))
}

/// The specification itself: no tree.
fn specified(bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<Hit> {
    let prepared = PreparedRay::new(ray, bvh.margin_m())?;
    bvh.triangles()
        .filter(|(_, _, group)| !ignored.contains(group))
        .filter_map(|(corners, triangle, group)| {
            let t = prepared.intersect(&corners)?;
            Some(Hit { t, triangle, group })
        })
        .min_by(|a, b| a.t.total_cmp(&b.t).then(a.triangle.cmp(&b.triangle)))
}

/// One tree for every instruction set of the machine.
fn trees(bvh: &Bvh) -> Vec<Bvh> {
    InstructionSet::ALL
        .into_iter()
        .filter_map(|set| bvh.rebuilt_for(set))
        .collect()
}

fn bits(hit: Option<Hit>) -> Option<(u32, u32, u32)> {
    hit.map(|h| (h.t.to_bits(), h.triangle, h.group))
}

/// Traces in every tree and compares; `expected` is the closest hit.
fn compare(trees: &[Bvh], ray: &Ray, ignored: [u32; 2], expected: Option<Hit>) {
    for tree in trees {
        let set = tree.instruction_set();
        let found = tree.closest_hit(ray, ignored);
        assert_eq!(bits(found), bits(expected), "{set:?}, {ray:?}");
        let any = tree.any_hit(ray, ignored);
        assert_eq!(any, expected.is_some(), "{set:?}, {ray:?}");
    }
}

fn agree_in(scene: procedural::BenchmarkScene) {
    let table = MaterialTable::built_in();
    let committed = Scene::commit(&scene.mesh, &table, &SceneSettings::default()).expect("commits");
    let trees = trees(committed.bvh());
    let origin = committed.to_local(scene.walk.standing).as_vec3();
    for i in 0..20_000u32 {
        let mut ray = Ray::new(origin, fibonacci_direction(i, 20_000));
        let mut ignored = [NO_GROUP; 2];
        for _ in 0..4 {
            let expected = trees[0].closest_hit(&ray, ignored);
            compare(&trees, &ray, ignored, expected);
            let Some(hit) = expected else { break };
            // A hit at the ray's own bound does not count, one just before it does.
            for (t_max, expected) in [(hit.t, None), (hit.t.next_up(), Some(hit))] {
                let bounded = Ray { t_max, ..ray };
                let found = trees[0].closest_hit(&bounded, ignored);
                assert_eq!(bits(found), bits(expected), "{bounded:?}");
                compare(&trees, &bounded, ignored, expected);
            }
            let normal = committed.surface(hit.group).normal.as_vec3();
            let onward = ray.direction - 2.0 * normal.dot(ray.direction) * normal;
            ray = Ray::new(ray.at(hit.t), onward);
            ignored[0] = hit.group;
        }
    }
    for i in 0..100u64 {
        let direction = fibonacci_direction(i as u32, 100);
        let ray = Ray::new(origin + draw(i), direction);
        let expected = specified(&trees[0], &ray, [NO_GROUP; 2]);
        compare(&trees, &ray, [NO_GROUP; 2], expected);
    }
}

#[test]
fn all_instruction_sets_agree_in_the_hall() {
    agree_in(procedural::concert_hall());
}

#[test]
fn all_instruction_sets_agree_in_the_camp() {
    agree_in(procedural::bootcamp());
}

#[test]
fn rays_along_axes_agree_whatever_the_sign_of_zero() {
    let room = procedural::shoebox(Vec3::new(4.0, 3.0, 5.0), "concrete");
    let groups: Vec<u32> = (0..room.triangles.len() as u32).collect();
    let trees = trees(&Bvh::build(&room.vertices, &room.triangles, &groups));
    for origin in [Vec3::splat(1.0), Vec3::new(2.0, 1.5, 2.5), Vec3::ZERO] {
        for signs in 0..64u32 {
            let part = |shift: u32| match signs >> shift & 3 {
                0 => 0.0,
                1 => -0.0,
                2 => 1.0,
                _ => -1.0,
            };
            let ray = Ray::new(origin, Vec3::new(part(0), part(2), part(4)));
            let expected = specified(&trees[0], &ray, [NO_GROUP; 2]);
            let inside = origin != Vec3::ZERO && ray.direction != Vec3::ZERO;
            assert!(!inside || expected.is_some(), "{ray:?}");
            compare(&trees, &ray, [NO_GROUP; 2], expected);
        }
    }
}

#[test]
fn among_equal_triangles_the_lowest_eligible_index_is_hit() {
    let corners = [
        Vec3::new(-1.0, -1.0, 2.0),
        Vec3::new(3.0, -1.0, 2.0),
        Vec3::new(-1.0, 3.0, 2.0),
    ];
    let triangles = vec![[0, 1, 2]; 5000];
    let groups: Vec<u32> = (0..5000).collect();
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    for tree in trees(&Bvh::build(&corners, &triangles, &groups)) {
        let hit = |ignored| tree.closest_hit(&ray, ignored).map(|h| h.triangle);
        assert_eq!(hit([NO_GROUP; 2]), Some(0));
        assert_eq!(hit([0, 1]), Some(2));
        assert_eq!(tree.triangle_count(), 5000);
    }
}

#[test]
fn invalid_bounds_and_non_finite_rays_hit_nothing() {
    let room = procedural::shoebox(Vec3::splat(2.0), "concrete");
    let groups = vec![0; room.triangles.len()];
    let ray = Ray::new(Vec3::ONE, Vec3::X);
    for tree in trees(&Bvh::build(&room.vertices, &room.triangles, &groups)) {
        for (t_min, t_max) in [
            (0.0, f32::NAN),
            (f32::NAN, 1.0),
            (2.0, 1.0),
            (0.0, -1.0),
            (1.0, 1.0),
        ] {
            let ray = Ray {
                t_min,
                t_max,
                ..ray
            };
            assert_eq!(tree.closest_hit(&ray, [NO_GROUP; 2]), None, "{ray:?}");
            assert!(!tree.any_hit(&ray, [NO_GROUP; 2]), "{ray:?}");
        }
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for axis in 0..3 {
                let (mut origin, mut direction) = (ray.origin, ray.direction);
                origin[axis] = bad;
                direction[axis] = bad;
                for ray in [
                    Ray::new(origin, ray.direction),
                    Ray::new(ray.origin, direction),
                ] {
                    assert_eq!(tree.closest_hit(&ray, [NO_GROUP; 2]), None, "{ray:?}");
                    assert!(!tree.any_hit(&ray, [NO_GROUP; 2]), "{ray:?}");
                }
            }
        }
        // Hits before zero do not count, at any bound.
        let behind = Ray {
            t_min: -10.0,
            t_max: 0.0,
            ..ray
        };
        assert_eq!(tree.closest_hit(&behind, [NO_GROUP; 2]), None);
    }
}

#[test]
fn non_finite_or_distant_vertices_are_left_out() {
    let bad = [f32::NAN, f32::INFINITY, 1e30];
    let mut vertices = vec![
        Vec3::new(-1.0, -1.0, 2.0),
        Vec3::new(3.0, -1.0, 2.0),
        Vec3::new(-1.0, 3.0, 2.0),
    ];
    vertices.extend(bad.map(|b| Vec3::new(b, 0.0, 2.0)));
    let triangles = [[3, 1, 2], [0, 4, 2], [0, 1, 5], [0, 1, 2]];
    for tree in trees(&Bvh::build(&vertices, &triangles, &[0; 4])) {
        assert_eq!(tree.triangle_count(), 1);
        let hit = tree.closest_hit(&Ray::new(Vec3::ZERO, Vec3::Z), [NO_GROUP; 2]);
        assert_eq!(hit.map(|h| (h.t, h.triangle)), Some((2.0, 3)));
    }
}

/// Coordinates on a coarse grid (corners, edges and planes coincide), of all sizes, zeros of both signs.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => (-4i8..=4).prop_map(f32::from),
        3 => -5.0f32..5.0,
        1 => prop_oneof![Just(-0.0f32), Just(1e-30), Just(-1e-12), Just(1e6), Just(-3e11), Just(1e-41)],
    ]
}

fn point() -> impl Strategy<Value = Vec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_soups_are_hit_as_specified(
        corners in prop::collection::vec([point(), point(), point()], 1..120),
        rays in prop::collection::vec((point(), point()), 40),
        ignored in 0u32..4,
    ) {
        let vertices: Vec<Vec3> = corners.iter().flatten().copied().collect();
        let count = corners.len() as u32;
        let triangles: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let groups: Vec<u32> = (0..count).map(|i| i % 4).collect();
        let trees = trees(&Bvh::build(&vertices, &triangles, &groups));
        for (origin, direction) in rays {
            for ray in [Ray::new(origin, direction), Ray::between(origin, direction)] {
                let expected = specified(&trees[0], &ray, [ignored, NO_GROUP]);
                compare(&trees, &ray, [ignored, NO_GROUP], expected);
            }
        }
    }
}
