//! The benchmark scenes: committed files equal the generated ones, and the meshes have the documented properties.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::path::Path;

use foresound::scene::procedural::{self, BenchmarkScene, NAMES};
use glam::Vec3;

/// Least distance of a source from any surface, in metres.
const SOURCE_CLEARANCE_M: f32 = 0.3;
/// Least distance of a walk from any surface, in metres.
const WALK_CLEARANCE_M: f32 = 0.25;
/// Least distance of a source from the walk, in metres.
const SOURCE_FROM_WALK_M: f32 = 1.0;

fn scenes() -> impl Iterator<Item = BenchmarkScene> {
    NAMES
        .iter()
        .map(|name| procedural::by_name(name).expect("a name of the list"))
}

fn corners(scene: &BenchmarkScene, triangle: usize) -> [Vec3; 3] {
    scene.mesh.triangles[triangle].map(|v| scene.mesh.vertices[v as usize])
}

fn all_corners(scene: &BenchmarkScene) -> Vec<[Vec3; 3]> {
    (0..scene.mesh.triangles.len())
        .map(|t| corners(scene, t))
        .collect()
}

/// Distance of a point from a triangle: from its plane if the projection lies inside, else from the nearest edge.
fn distance(point: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let normal = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|&(p, q)| (q - p).cross(point - p).dot(normal) >= 0.0);
    if inside {
        return (point - a).dot(normal).abs() / normal.length();
    }
    let to_edge = |p: Vec3, q: Vec3| {
        let along = (point - p).dot(q - p) / (q - p).length_squared();
        point.distance(p.lerp(q, along.clamp(0.0, 1.0)))
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

/// Distance of a point from the nearest triangle, up to 1 m.
fn clearance(point: Vec3, triangles: &[[Vec3; 3]]) -> f32 {
    let mut nearest = 1.0_f32;
    for &[a, b, c] in triangles {
        let outside = (a.min(b).min(c) - point).max(point - a.max(b).max(c));
        if outside.max_element() < nearest {
            nearest = nearest.min(distance(point, [a, b, c]));
        }
    }
    nearest
}

/// Points of the walk every 5 cm, from end to end.
fn walk_points(scene: &BenchmarkScene) -> Vec<Vec3> {
    let (from, to) = (scene.walk.from, scene.walk.to);
    let steps = (from.distance(to) / 0.05).ceil() as u32;
    (0..=steps)
        .map(|i| from.lerp(to, i as f32 / steps as f32))
        .collect()
}

/// Whether the first hit of each of 64 rays is a front face. From a point inside a solid all hits are back faces.
fn hits_only_fronts(point: Vec3, triangles: &[[Vec3; 3]]) -> bool {
    (0..64).all(|i| {
        // A spherical Fibonacci lattice: even, and parallel to no wall.
        let y = 1.0 - (2.0 * i as f32 + 1.0) / 64.0;
        let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
        let across = (1.0 - y * y).sqrt();
        let direction = Vec3::new(across * cos, y, across * sin);
        let (mut nearest, mut front) = (f32::INFINITY, true);
        for &[a, b, c] in triangles {
            // Möller and Trumbore 1997; a positive determinant is a front.
            let (ab, ac) = (b - a, c - a);
            let p = direction.cross(ac);
            let determinant = ab.dot(p);
            if determinant.abs() < 1e-9 {
                continue;
            }
            let from_a = point - a;
            let u = from_a.dot(p) / determinant;
            let q = from_a.cross(ab);
            let v = direction.dot(q) / determinant;
            let along = ac.dot(q) / determinant;
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && along > 0.0 && along < nearest {
                (nearest, front) = (along, determinant > 0.0);
            }
        }
        front
    })
}

#[test]
fn committed_files_are_what_the_code_writes() {
    let committed = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    let fresh = tempfile::tempdir().expect("a temporary folder");
    for scene in scenes() {
        procedural::write_files(&scene, fresh.path()).expect("a writable folder");
        for extension in ["obj", "mtl", "toml"] {
            let file = Path::new(scene.name).with_extension(extension);
            let read = |folder: &Path| fs::read(folder.join(&file)).expect("the file is there");
            // `assert_eq` would print megabytes of numbers.
            assert!(
                read(&committed) == read(fresh.path()),
                "{} differs: run `foresound scenes --out assets/scenes`",
                file.display()
            );
        }
    }
}

#[test]
fn triangle_counts_are_those_of_the_published_scenes() {
    let count = |name| procedural::by_name(name).map_or(0, |s| s.mesh.triangles.len());
    for (name, published) in [
        ("concert_hall", 25_000),
        ("bootcamp", 130_000),
        ("angrybot", 26_000),
    ] {
        let share = count(name) as f64 / f64::from(published);
        assert!((0.98..=1.02).contains(&share), "{name}: {share}");
    }
    assert!(count("doorway") < 400);
}

#[test]
fn triangles_have_area_and_appear_once() {
    for scene in scenes() {
        let mut seen = HashSet::new();
        let mut positions = HashSet::new();
        for vertex in &scene.mesh.vertices {
            assert!(
                positions.insert(vertex.to_array().map(f32::to_bits)),
                "{}: unwelded",
                scene.name
            );
        }
        for (t, triangle) in scene.mesh.triangles.iter().enumerate() {
            let [a, b, c] = corners(&scene, t);
            let area = 0.5 * (b - a).cross(c - a).length();
            assert!(area > 1e-8, "{}: triangle {t} has {area} m²", scene.name);
            let mut sorted = *triangle;
            sorted.sort_unstable();
            assert!(
                seen.insert(sorted),
                "{}: triangle {t} appears twice",
                scene.name
            );
        }
        let end = scene.parts.iter().fold(0, |end, part| {
            assert_eq!(part.triangles.start, end, "{}: {}", scene.name, part.name);
            part.triangles.end
        });
        assert_eq!(end, scene.mesh.triangles.len());
        assert_eq!(end, scene.mesh.triangle_materials.len());
    }
}

/// Every edge of the shell belongs to two triangles of consistent winding.
#[test]
fn shells_are_closed() {
    for name in ["concert_hall", "doorway"] {
        let scene = procedural::by_name(name).expect("a name of the list");
        let shell = scene
            .parts
            .iter()
            .find(|part| part.name == "shell")
            .expect("a shell");
        let mut uses = HashMap::new();
        let mut volume = 0.0;
        for t in shell.triangles.clone() {
            let [a, b, c] = corners(&scene, t);
            volume -= a.dot(b.cross(c)) / 6.0;
            let [i, j, k] = scene.mesh.triangles[t];
            for edge in [(i, j), (j, k), (k, i)] {
                *uses.entry(edge).or_insert(0) += 1;
            }
        }
        for (&(i, j), &count) in &uses {
            assert_eq!(count, 1, "{name}: edge {i} to {j}");
            assert_eq!(uses.get(&(j, i)), Some(&1), "{name}: edge {j} to {i}");
        }
        // Faces point inwards: the volume is positive; 30 · 20 · 10, and two rooms and a doorway.
        let expected = if name == "doorway" {
            2.0 * 144.0 + 0.2 * 2.1 * 0.95
        } else {
            6000.0
        };
        assert!(
            (volume - expected).abs() < 1e-3 * expected,
            "{name}: {volume} m³"
        );
    }
}

#[test]
fn sources_are_clear_of_surfaces() {
    for scene in scenes() {
        let triangles = all_corners(&scene);
        let (min, max) = scene
            .mesh
            .vertices
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), &v| {
                (min.min(v), max.max(v))
            });
        assert_eq!(scene.sources.len(), 16);
        for (i, (name, position)) in scene.sources.iter().enumerate() {
            let label = format!("{} {name} at {position}", scene.name);
            assert_eq!(*name, format!("source{:02}", i + 1));
            assert!(
                position.cmpgt(min).all() && position.cmplt(max).all(),
                "{label}: outside"
            );
            let clear = clearance(*position, &triangles);
            assert!(
                clear >= SOURCE_CLEARANCE_M,
                "{label}: {clear} m from a surface"
            );
            assert!(
                hits_only_fronts(*position, &triangles),
                "{label}: inside something"
            );
            let near = walk_points(&scene)
                .iter()
                .map(|p| p.distance(*position))
                .fold(f32::INFINITY, f32::min);
            assert!(
                near >= SOURCE_FROM_WALK_M,
                "{label}: {near} m from the walk"
            );
            assert!(i > 0 || near < 5.0, "{label}: {near} m from the walk");
        }
    }
}

#[test]
fn walks_keep_clear_of_surfaces() {
    for scene in scenes() {
        let triangles = all_corners(&scene);
        let walk = &scene.walk;
        assert!(walk.from.distance(walk.to) >= 8.0, "{}", scene.name);
        assert_eq!(walk.standing, (walk.from + walk.to) * 0.5);
        let mut points = walk_points(&scene);
        // The doorway's walk passes the wall on purpose.
        points.retain(|p| scene.name != "doorway" || (p.x - 8.1).abs() > 0.1 + WALK_CLEARANCE_M);
        for point in points.iter().chain([&walk.standing]) {
            let clear = clearance(*point, &triangles);
            assert!(
                clear >= WALK_CLEARANCE_M,
                "{} at {point}: {clear} m",
                scene.name
            );
        }
        for point in points.iter().step_by(points.len() / 4) {
            assert!(
                hits_only_fronts(*point, &triangles),
                "{} at {point}",
                scene.name
            );
        }
    }
}

/// Inside the opening on one face of the wall, inside the wall on the other.
#[test]
fn doorway_walk_crosses_the_wall_beside_the_door() {
    let scene = procedural::doorway();
    let triangles = all_corners(&scene);
    let (from, to) = (scene.walk.from, scene.walk.to);
    let at = |x: f32| from.lerp(to, (x - from.x) / (to.x - from.x));
    assert!(hits_only_fronts(at(8.15), &triangles));
    assert!(!hits_only_fronts(at(8.03), &triangles));
    assert!(hits_only_fronts(at(7.9), &triangles));
    assert!(clearance(at(8.1), &triangles) < 0.1);
}
