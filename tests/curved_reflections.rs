//! Paths with two reflections in a dome: they exist, work both ways, and later positions give them anew.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use foresound::acoustics::Material;
use foresound::propagation::curved_reflection::CurvedSequence;
use foresound::propagation::endpoints::Endpoints;
use foresound::propagation::{Path, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
};
use glam::{DVec3, Vec3};

const SOURCE: Vec3 = Vec3::new(0.6, 1.5, 0.3);
const LISTENER: Vec3 = Vec3::new(-0.9, 1.6, -0.8);

/// A hemisphere of 5 m on a floor.
fn dome() -> Arc<Scene> {
    let (rows, columns) = (12u32, 36u32);
    let mut mesh = TriangleMesh::default();
    let wall = mesh.material("wall");
    let at = |row: u32, column: u32| {
        let (height, turn) = (
            0.5 * PI * f64::from(row) / f64::from(rows),
            TAU * f64::from(column) / f64::from(columns),
        );
        let level = DVec3::new(
            height.cos() * turn.cos(),
            height.sin(),
            height.cos() * turn.sin(),
        );
        (5.0 * level).as_vec3()
    };
    let mut triangle = |corners: [Vec3; 3]| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.triangle_materials.push(wall);
    };
    for column in 0..columns {
        for row in 0..rows {
            let [a, b] = [column, column + 1].map(|column| at(row, column));
            let [c, d] = [column, column + 1].map(|column| at(row + 1, column));
            triangle([a, b, d]);
            triangle([a, d, c]);
        }
        triangle([Vec3::ZERO, at(0, column), at(0, column + 1)]);
    }
    let materials = MaterialTable::from_materials(vec![Material {
        name: "wall".to_owned(),
        absorption: [0.1; 8],
        scattering: [0.1; 8],
        transmission: [0.0; 8],
    }]);
    let scene = Scene::commit(&mesh, &materials, &SceneSettings::default());
    Arc::new(scene.expect("commits"))
}

fn pose(position: Vec3) -> SourcePose {
    SourcePose::at(SourceId::new(0, 0), position)
}

fn heard(scene: &Arc<Scene>, from: Vec3, to: Vec3) -> Vec<Path> {
    let settings = PropagationSettings {
        diffraction_order: 0,
        ..PropagationSettings::default()
    };
    let mut propagator = Propagator::new(Arc::clone(scene), settings).expect("settings");
    let mut set = PathSet::default();
    for _ in 0..4 {
        propagator.update(&ListenerPose::facing(to, 0.0), &[pose(from)], 0.0, &mut set);
    }
    set.paths
}

/// Number of a path's reflections at the dome.
fn at_dome(path: &Path) -> usize {
    let points = path.points().iter();
    points
        .filter(|point| (point.length() - 5.0).abs() < 1e-3)
        .count()
}

fn twice(paths: &[Path]) -> Vec<&Path> {
    paths.iter().filter(|path| at_dome(path) == 2).collect()
}

/// Dome or floor, by the height of a point.
fn kind(height_m: f64) -> char {
    if height_m < 1e-3 { 'P' } else { 'C' }
}

/// Surfaces of rays in the smooth dome that meet it twice, have four reflections at most and pass near the listener.
fn traced_patterns() -> BTreeSet<String> {
    const RAYS: u32 = 400_000;
    const NEAR_M: f64 = 0.02;
    let golden = PI * (3.0 - 5f64.sqrt());
    let mut found = BTreeSet::new();
    for number in 0..RAYS {
        let height = 1.0 - (2.0 * f64::from(number) + 1.0) / f64::from(RAYS);
        let turn = golden * f64::from(number);
        let flat = (1.0 - height * height).sqrt();
        let mut ray = DVec3::new(flat * turn.cos(), height, flat * turn.sin());
        let (mut at, mut pattern) = (SOURCE.as_dvec3(), String::new());
        for _ in 0..4 {
            let along = at.dot(ray);
            let to_dome = -along + (along * along - at.length_squared() + 25.0).max(0.0).sqrt();
            let to_floor = if ray.y < 0.0 { -at.y / ray.y } else { f64::MAX };
            at += to_dome.min(to_floor) * ray;
            let normal = if to_floor < to_dome {
                DVec3::Y
            } else {
                at / 5.0
            };
            pattern.push(kind(if to_floor < to_dome { 0.0 } else { 1.0 }));
            ray -= 2.0 * ray.dot(normal) * normal;
            let to = LISTENER.as_dvec3() - at;
            let is_near = to.dot(ray) > 0.0 && to.cross(ray).length() < NEAR_M;
            // What is behind the next surface is not reached.
            let to_floor = if ray.y < 0.0 { -at.y / ray.y } else { f64::MAX };
            if is_near && to.dot(ray) < to_floor && pattern.matches('C').count() == 2 {
                found.insert(pattern.clone());
            }
        }
    }
    found
}

#[test]
fn a_dome_focuses_again_what_it_has_reflected() {
    let scene = dome();
    let paths = heard(&scene, SOURCE, LISTENER);
    let found = twice(&paths);
    let patterns = |found: &[&Path]| -> BTreeSet<String> {
        found
            .iter()
            .map(|path| {
                path.points()
                    .iter()
                    .map(|point| kind(point.y.into()))
                    .collect()
            })
            .collect()
    };
    let expected = traced_patterns();
    assert!(expected.len() >= 3, "{expected:?}");
    assert_eq!(patterns(&found), expected);
    for path in found {
        let stops: Vec<DVec3> = [SOURCE]
            .iter()
            .chain(path.points())
            .chain([&LISTENER])
            .map(|point| point.as_dvec3())
            .collect();
        for leg in stops.windows(3) {
            let normal = match leg[1].y < 1e-3 {
                true => DVec3::Y,
                false => leg[1].normalize(),
            };
            let [a, b] = [leg[0], leg[2]].map(|end| (end - leg[1]).normalize());
            // Angles of incidence and reflection are equal, in one plane with the normal.
            assert!(
                (a - b - (a - b).dot(normal) * normal).length() < 2e-5 || {
                    let aside = a + b - (a + b).dot(normal) * normal;
                    aside.length() < 2e-5
                }
            );
        }
    }
}

#[test]
fn source_and_listener_may_be_exchanged() {
    let scene = dome();
    let [there, back] = [(SOURCE, LISTENER), (LISTENER, SOURCE)].map(|(a, b)| heard(&scene, a, b));
    let (there, back) = (twice(&there), twice(&back));
    assert_eq!(there.len(), back.len());
    for path in there {
        let same = |other: &&&Path| {
            let mut points = path.points().iter().zip(other.points().iter().rev());
            points.len() == other.points().len() && points.all(|(a, b)| a.distance(*b) < 1e-3)
        };
        let other = back.iter().find(same).expect("the same path");
        for (a, b) in path.amplitude.iter().zip(&other.amplitude) {
            // Caustics are bounded at the last reflection, which is another one.
            let off_db = 20.0 * (a / b).log10();
            assert!(off_db.abs() < 1.0, "{off_db} dB: {path:?} {other:?}");
        }
    }
}

#[test]
fn later_positions_give_the_path_anew() {
    let scene = dome();
    let moved = LISTENER + Vec3::new(0.03, 0.01, -0.02);
    let [before, after] = [LISTENER, moved].map(|to| heard(&scene, SOURCE, to));
    let mut followed = 0;
    for path in twice(&before) {
        let sequence = CurvedSequence::of(&scene, path).expect("a curved path");
        let again = |to: Vec3| {
            let endpoints = Endpoints::of(&pose(SOURCE), to, 0.3);
            sequence.between(&scene, &endpoints, path)
        };
        let same = again(LISTENER).expect("the same path");
        assert_eq!((same.id, same.surfaces), (path.id, path.surfaces));
        assert!((same.length_m - path.length_m).abs() < 1e-5);
        let Some(later) = after.iter().find(|later| later.id == path.id) else {
            continue;
        };
        followed += 1;

        let found = again(moved).expect("the path at the later position");
        assert!((found.length_m - later.length_m).abs() < 1e-4, "{path:?}");
        for (a, b) in found.amplitude.iter().zip(&later.amplitude) {
            assert!((a - b).abs() < 1e-3 * b.abs(), "{path:?}");
        }
    }
    assert!(followed >= 3, "{followed}");
}
