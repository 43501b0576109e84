//! Paths over two edges, between listeners 5 mm apart: a path fades where its geometry ends, and all of them where the source
//! comes into sight.

#[expect(dead_code, reason = "this test uses a part of it")]
mod parts;

use foresound::propagation::Path;
use foresound::propagation::diffraction::{
    self, DiffractionSequence, LastSearch, direct_field, no_limits,
};
use foresound::propagation::endpoints::Endpoints;
use foresound::scene::{InstanceId, InstancePose, Scene, SourcePose, TriangleMesh};
use glam::{Quat, Vec2, Vec3};
use parts::{block, commit, joined, source};

/// Distance between two listeners in metres.
const STEP_M: f32 = 0.005;

/// Largest change of a path in a step relative to the free field at the straight distance: 1 dB of a sound as loud as the
/// direct one would be.
const BOUND: f32 = 0.122;

/// Angle in radians from a face below which a leg runs along it: what a listener 3 m away passes in two steps.
const GRAZING: f64 = 3e-3;

/// Stones of the ring, and its radius in metres.
const STONES: usize = 14;
const RADIUS_M: f32 = 7.0;

/// A ring of upright stones on the ground, no two alike.
fn ring() -> std::sync::Arc<Scene> {
    let mut mesh = block(Vec3::new(-40.0, -0.2, -40.0), Vec3::new(40.0, 0.0, 40.0));
    for stone in 0..STONES {
        let number = stone as f32;
        let turn = std::f32::consts::TAU * number / STONES as f32;
        let half = Vec3::new(0.5 + 0.03 * number, 0.0, 0.35 - 0.01 * number);
        let part = block(-half, half + Vec3::Y * (2.2 + 0.05 * number));
        let place = RADIUS_M * Vec3::new(turn.sin(), 0.0, turn.cos());
        let pose = InstancePose {
            id: InstanceId::default(),
            position: place.as_dvec3(),
            rotation: Quat::from_rotation_y(turn + 0.07 * number),
        };
        mesh = joined(&mesh, &part, &pose);
    }
    commit(&mesh)
}

/// The path over two edges, or nothing, and whether something occludes it, be it a face of its own edges.
fn path_over(
    scene: &Scene,
    edges: [u32; 2],
    source: &SourcePose,
    at: Vec3,
) -> (Option<Path>, bool) {
    let endpoints = Endpoints::of(source, at, 0.3);
    if !scene.edge(edges[1]).is_outside(scene.to_local(at)) {
        return (None, true);
    }
    let Some(path) = DiffractionSequence::TwoEdges(edges).between(scene, &endpoints) else {
        return (None, false);
    };
    let is_occluded = !path.is_unoccluded(scene, &endpoints, &mut 0);
    (path.path(scene, &endpoints, false), is_occluded)
}

/// Whether a leg of a path runs along a face of one of its edges: beyond the face nothing is in sight.
fn grazes_a_face(scene: &Scene, path: &Path, source: &SourcePose, at: Vec3) -> bool {
    let [first, second] = [path.points[0], path.points[1]];
    let ends = [[source.position, second], [first, at]];
    let edges = path.edges().iter().zip(ends);
    edges.into_iter().any(|(edge, ends)| {
        let edge = scene.edge(*edge);
        ends.into_iter().any(|end| {
            let far = edge.n * std::f64::consts::PI;
            let angle = edge.angle_of(scene.to_local(end));
            angle.is_none_or(|angle| angle.min(far - angle) < GRAZING)
        })
    })
}

/// Listeners of a walk past the ring.
fn position(walk: i32, step: i32) -> Vec3 {
    let turn = std::f32::consts::TAU * (walk as f32 + 0.3) / 24.0;
    let ahead = Vec3::new(turn.cos(), 0.0, -turn.sin());
    let middle = Vec3::new(20.0 * turn.sin(), 1.6, 20.0 * turn.cos());
    middle + ahead * (STEP_M * step as f32)
}

#[test]
fn paths_over_two_edges_fade_where_their_geometry_ends() {
    let scene = ring();
    let source = source(0, Vec3::new(1.3, 1.4, 0.6));
    let count = scene.edges().len() as u32;
    let mut ended = 0;
    for walk in 0..24 {
        let position = |step: i32| position(walk, step);
        let pairs = (0..count).flat_map(|a| scene.edge_neighbours(a).map(move |b| [a, b]));
        for edges in pairs {
            let ever = |step: i32| path_over(&scene, edges, &source, position(step)).0;
            if (-60..60).step_by(20).all(|step| ever(step).is_none()) {
                continue;
            }
            let mut before: Option<(Option<Path>, bool)> = None;
            for step in -60..60 {
                let at = position(step);
                let now = path_over(&scene, edges, &source, at);
                let straight_m = at.distance(source.position);
                if let Some(before) = before.replace(now) {
                    let ((before, was_occluded), (now, is_occluded)) = (before, now);
                    let grazes = |path: Option<Path>| {
                        path.is_some_and(|path| grazes_a_face(&scene, &path, &source, at))
                    };
                    if was_occluded || is_occluded || grazes(before) || grazes(now) {
                        // A third edge, or a face of these, comes between.
                        continue;
                    }
                    let amplitude = |path: &Option<Path>, band: usize| {
                        path.map_or(0.0, |path| path.amplitude[band].abs())
                    };
                    if before.is_some() == now.is_some() {
                        continue;
                    }
                    ended += 1;
                    for band in 0..4 {
                        let change = amplitude(&now, band) - amplitude(&before, band);
                        let relative = change.abs() * straight_m;
                        assert!(
                            relative < BOUND,
                            "{edges:?} at {at}, band {band}: {relative}\n{before:?}\n{now:?}"
                        );
                    }
                }
            }
        }
    }
    assert!(ended > 15, "{ended} ends were passed");
}

/// The paths over two edges of an update, and whether the direct path is visible.
fn two_edge_paths(scene: &Scene, source: &SourcePose, at: Vec3) -> (Vec<Path>, bool) {
    let endpoints = Endpoints::of(source, at, 0.3);
    let mut paths = Vec::new();
    let last = &mut LastSearch::default();
    diffraction::update(scene, &endpoints, 2, last, &mut 0, &mut |path| {
        if path.diffraction_order == 2 {
            paths.push(path);
        }
    });
    let line = direct_field(
        scene,
        &endpoints,
        [].into_iter(),
        no_limits,
        &mut 0,
        &mut |_| (),
    );
    (paths, line.visible)
}

#[test]
fn paths_over_two_edges_begin_in_the_light() {
    let scene = ring();
    let mut source = source(0, Vec3::new(1.3, 1.4, 0.6));
    source.settings.effects.reflections = false;
    let (mut boundaries, mut in_light) = (0, 0);
    for walk in 0..24 {
        let mut before: Option<(Vec<Path>, bool)> = None;
        for step in -60..60 {
            let at = position(walk, step);
            let now = two_edge_paths(&scene, &source, at);
            in_light += now.0.len() * usize::from(now.1);
            let free = at.distance(source.position).recip();
            let Some((before, was_lit)) = before.replace(now.clone()) else {
                continue;
            };
            if was_lit == now.1 {
                continue;
            }
            boundaries += 1;
            let amplitude = |paths: &[Path], like: &Path| {
                let same = paths.iter().find(|path| path.id == like.id);
                same.map_or([0.0; 8], |path| path.amplitude)
            };
            for path in before.iter().chain(&now.0) {
                let [before, now] = [amplitude(&before, path), amplitude(&now.0, path)];
                for band in 0..4 {
                    let change = (now[band] - before[band]).abs();
                    assert!(change < BOUND * free, "{at}, band {band}: {path:?}");
                }
            }
        }
    }
    assert!(boundaries > 0 && in_light > 100, "{boundaries} {in_light}");
}

/// Sound pressure of all paths of an update in the bands up to 500 Hz, and the root of their energy.
fn pressures(paths: &[Path]) -> [(Vec2, f32); 4] {
    std::array::from_fn(|band| {
        let wavenumber = std::f32::consts::TAU * 62.5 * 2f32.powi(band as i32) / 343.0;
        let wave = |p: &Path| p.amplitude[band] * Vec2::from_angle(-wavenumber * p.length_m);
        let energy = paths.iter().map(|p| p.amplitude[band].powi(2));
        (paths.iter().map(wave).sum(), energy.sum::<f32>().sqrt())
    })
}

/// A sheet hides the source, and the end of another one, 12 m behind it, comes before the only edge that its sound passes. Two walls
/// would take four edges.
#[test]
fn a_sheet_far_behind_another_one_hides_its_edge_by_degrees() {
    let mut mesh = TriangleMesh::default();
    let material = mesh.material("concrete");
    for (left, right, z) in [(-30.0, 0.0, 0.0), (-2.4, 30.0, 12.0)] {
        let first = mesh.vertices.len() as u32;
        let corners = [(left, -20.0), (right, -20.0), (right, 20.0), (left, 20.0)];
        let corners = corners.map(|(x, y)| Vec3::new(x, y, z));
        mesh.vertices.extend(corners);
        for corners in [[0, 1, 2], [0, 2, 3]] {
            mesh.triangles.push(corners.map(|corner| first + corner));
            mesh.triangle_materials.push(material);
        }
    }
    let scene = commit(&mesh);
    let mut source = source(0, Vec3::new(1.0, 1.5, -8.0));
    source.settings.effects.reflections = false;
    source.settings.effects.transmission = false;
    let mut before: Option<(Vec<Path>, usize)> = None;
    let mut boundaries = 0;
    for step in -60..60 {
        let at = Vec3::new(-4.0 + STEP_M * step as f32, 1.5, 20.0);
        let endpoints = Endpoints::of(&source, at, 0.3);
        let mut paths = Vec::new();
        let last = &mut LastSearch::default();
        diffraction::update(&scene, &endpoints, 2, last, &mut 0, &mut |path| {
            paths.push(path);
        });
        let alone = paths.iter().filter(|p| p.diffraction_order == 1).count();
        let Some((last, alone_before)) = before.replace((paths.clone(), alone)) else {
            continue;
        };
        boundaries += usize::from(alone != alone_before);
        let pairs = pressures(&last).into_iter().zip(pressures(&paths));
        for ((before, root), (now, new_root)) in pairs {
            let step = before.distance(now) / root.max(new_root);
            assert!(step < BOUND, "{at}: {step}\n{last:#?}\n{paths:#?}");
        }
    }
    assert!(boundaries > 0, "no edge was hidden");
}
