//! Sound behind edges: the oracle's own test, and situations.

mod reference;

use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::Arc;

use foresound::propagation::diffraction::{
    MAX_DIRECT_EDGES, MAX_REFLECTED_EDGE_PATHS, MAX_TWO_EDGE_PATHS, direct_field, no_limits,
};
use foresound::propagation::endpoints::Endpoints;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, procedural,
};
use glam::Vec3;
use reference::wedge::{Wedge, size};

/// Exact midbands.
const CENTRES_HZ: [f64; 8] = [
    63.0957, 125.8925, 251.1886, 501.1872, 1000.0, 1995.2623, 3981.0717, 7943.2823,
];

fn losses_db(wedge: &Wedge) -> Vec<f64> {
    let loss = |hz: &f64| {
        let k = 2.0 * PI * hz / 343.4;
        -20.0 * (size(wedge.total([k])[0]) * wedge.direct_m()).log10()
    };
    CENTRES_HZ.iter().map(loss).collect()
}

#[test]
fn the_wedge_oracle_agrees_with_a_line_integral_along_the_edge() {
    // Reference levels by secondary sources on the edge ([SVENSSON99]): 5 m on either side, the source 60° from
    // the face, the listener 20° in the shadow of a half-plane and of a right-angled corner; printed to 0.1 dB.
    let half_plane = [6.6, 8.1, 9.9, 12.0, 14.4, 17.2, 20.1, 23.1];
    let corner = [2.8, 4.5, 6.4, 8.7, 11.3, 14.2, 17.1, 20.1];
    for (n, expected) in [(2.0, half_plane), (1.5, corner)] {
        let wedge = Wedge {
            n,
            radii_m: [5.0, 5.0],
            angles: [PI / 3.0, PI / 3.0 + PI * 10.0 / 9.0],
            along_m: 0.0,
        };
        for (ours, theirs) in losses_db(&wedge).iter().zip(expected) {
            assert!((ours - theirs).abs() < 0.15, "{n}: {ours} for {theirs}");
        }
    }
}

#[test]
fn the_wedge_oracle_adds_no_field_on_a_flat_wall() {
    // n = 1: the image source is the exact solution.
    let wall = Wedge {
        n: 1.0,
        radii_m: [2.0, 3.0],
        angles: [0.7, 2.1],
        along_m: 0.5,
    };
    assert!(size(wall.diffracted([10.0])[0]) < 1e-9);
}

#[test]
fn the_wedge_oracle_is_sommerfeld_s_half_plane_far_away() {
    // Behind a half-plane at the shadow boundary a plane wave keeps half its pressure, except for the reflected part, which
    // decays with the distance of the reflection's boundary.
    let wedge = Wedge {
        n: 2.0,
        radii_m: [1e4, 50.0],
        angles: [0.5 * PI, 1.5 * PI + 1e-7],
        along_m: 0.0,
    };
    let share = size(wedge.total([40.0])[0]) * wedge.direct_m();
    // The reflected part: 1/(2 √(2π k L)) of the wave at 180° from its own boundary, here 0.4 %.
    assert!((share - 0.5).abs() < 0.01, "{share}");
}

fn commit(scene: &procedural::BenchmarkScene) -> Arc<Scene> {
    let settings = SceneSettings::default();
    Arc::new(Scene::commit(&scene.mesh, &MaterialTable::built_in(), &settings).expect("commits"))
}

fn hear(scene: &Arc<Scene>, from: Vec3, to: Vec3, diffraction_order: usize) -> PathSet {
    let pose = SourcePose::at(SourceId::new(0, 0), from);
    hear_pose(scene, pose, to, diffraction_order)
}

fn hear_pose(scene: &Arc<Scene>, pose: SourcePose, to: Vec3, diffraction_order: usize) -> PathSet {
    let settings = PropagationSettings {
        diffraction_order,
        ..PropagationSettings::default()
    };
    let mut propagator = Propagator::new(Arc::clone(scene), settings).expect("settings");
    let ear = ListenerPose {
        position: to,
        ..ListenerPose::default()
    };
    let mut set = PathSet::default();
    propagator.update(&ear, &[pose], 0.0, &mut set);
    set
}

#[test]
fn behind_a_door_s_jamb_levels_are_those_of_its_edge() {
    let doorway = procedural::doorway();
    let scene = commit(&doorway);
    let source = Vec3::new(4.8, 1.5, 1.5);
    // In the other room, beside the door, and in front of it.
    let (dark, open) = (Vec3::new(10.5, 1.65, 5.9), Vec3::new(10.5, 1.65, 3.6));
    // Beside transmission the wave lacks what the wall transmits.
    let mut pose = SourcePose::at(SourceId::new(0, 0), source);
    pose.settings.effects.transmission = false;
    let set = hear_pose(&scene, pose, dark, 2);
    let diffracted: Vec<_> = set
        .paths
        .iter()
        .filter(|p| p.diffraction_order > 0)
        .collect();
    assert!(!diffracted.is_empty());
    let first = diffracted
        .iter()
        .min_by(|a, b| a.length_m.total_cmp(&b.length_m))
        .expect("one at least");
    let gains = first.amplitude.map(|a| a * first.length_m);
    println!("{} diffracted paths, first {first:?}", diffracted.len());
    // Half of the wave, and part of its reflection in the jamb.
    assert!(gains[0] > 0.5 && gains[0] < 0.8, "{gains:?}");
    // To 1 kHz the wall is thinner than a wavelength, a half-plane; above it the jamb is the face of a corner. The edge
    // ends at the lintel, and is continued by the floor's image.
    let exact = CENTRES_HZ.map(|hz| {
        let (x_m, n, face) = match hz < 1500.0 {
            true => (8.1, 2.0, 0.5 * PI),
            false => (8.2, 1.5, 0.0),
        };
        let [before, after] = [source, dark].map(|p| {
            let (x, z) = (f64::from(p.x) - x_m, f64::from(p.z) - 4.05);
            (x.hypot(z), (-z).atan2(-x).rem_euclid(2.0 * PI) + face)
        });
        let edge = Wedge {
            n,
            radii_m: [before.0, after.0],
            angles: [before.1, after.1],
            along_m: f64::from(dark.y - source.y),
        };
        let ends_m = [-2.1, 2.1].map(|y| y - f64::from(source.y));
        size(edge.total_of_section(2.0 * PI * hz / 343.4, ends_m)) * edge.path_m()
    });
    let off_db: Vec<f64> = (0..8)
        .map(|b| 20.0 * (f64::from(gains[b]) / exact[b]).log10())
        .collect();
    let rms_db = (off_db.iter().map(|off| off * off).sum::<f64>() / 8.0).sqrt();
    println!("{gains:?} for {exact:.3?}: {off_db:.2?} dB");
    // As for a wall of 0.3 m against finite differences. The wood of the jamb absorbs; the exact figures are rigid.
    assert!(rms_db < 1.0, "{rms_db} dB: {off_db:?}");
    assert!(gains[4..].windows(2).all(|g| g[0] > g[1]), "{gains:?}");
    // The direction of arrival is that of the door, not of the source.
    let door = (first.points()[first.points().len() - 1] - dark).normalize();
    let heard = (first.image - dark).normalize();
    assert!(door.dot(heard) > 0.9999);
    assert!((first.image.distance(dark) - first.length_m).abs() < 1e-3);
    let reflected = hear(&scene, source, dark, 0).paths;
    assert!(!reflected.is_empty());
    assert!(reflected.iter().all(|p| p.diffraction_order == 0));
    assert!(hear(&scene, source, open, 2).paths.len() > 1);
}

#[test]
fn positions_at_edges_give_finite_paths_no_louder_than_the_source() {
    let doorway = procedural::doorway();
    let scene = commit(&doorway);
    let edges = scene.edges();
    assert!(!edges.is_empty());
    let (source, mut heard) = (doorway.sources[0].1, 0);
    for edge in edges.as_slice() {
        let middle = edge.at(0.5 * edge.length_m);
        let faces = [edge.tangent, edge.normal, edge.outward()];
        for position in [middle]
            .into_iter()
            .chain(faces.map(|out| middle + 0.4 * out))
            .chain(faces.map(|out| middle + 1e-5 * out))
        {
            let ear = scene.to_world(position);
            for from in [source, ear] {
                let paths = hear_few(&scene, from, ear).paths;
                heard += paths.len();
                for path in &paths {
                    // Twice the source at the minimum distance of 0.3 m: a wave and its reflection.
                    let sane = |a: &f32| a.is_finite() && a.abs() <= 2.0 / 0.3;
                    assert!(path.amplitude.iter().all(sane), "{path:?}");
                    assert!(
                        path.image.is_finite() && path.length_m.is_finite(),
                        "{path:?}"
                    );
                }
            }
        }
    }
    assert!(heard > edges.len(), "{heard}");
}

fn hear_few(scene: &Arc<Scene>, from: Vec3, to: Vec3) -> PathSet {
    let settings = PropagationSettings {
        guide_rays: 32,
        source_rays: 4,
        ..PropagationSettings::default()
    };
    let mut propagator = Propagator::new(Arc::clone(scene), settings).expect("settings");
    let pose = SourcePose::at(SourceId::new(0, 0), from);
    let ear = ListenerPose {
        position: to,
        ..ListenerPose::default()
    };
    let mut set = PathSet::default();
    propagator.update(&ear, &[pose], 0.0, &mut set);
    set
}

#[test]
fn edges_and_their_identities_do_not_depend_on_the_order_of_triangles() {
    let doorway = procedural::doorway();
    let mut turned = doorway.clone();
    turned.mesh.triangles.reverse();
    turned.mesh.triangle_materials.reverse();
    let (a, b) = (commit(&doorway), commit(&turned));
    assert_eq!(a.edges().as_slice(), b.edges().as_slice());
    // The two jambs and the lintel have an edge in either room; the corners of a furnished room have none.
    let corners = a.edges().as_slice().iter().filter(|edge| {
        let ends = [0.0, edge.length_m].map(|s| a.to_world(edge.at(s)));
        let outer = |v: f32, low: f32, high: f32| (v - low).abs() < 0.01 || (v - high).abs() < 0.01;
        ends.iter()
            .all(|p| outer(p.x, 0.0, 16.2) && outer(p.z, 0.0, 6.0))
    });
    assert_eq!(corners.count(), 0);
    let jambs = a.edges().as_slice().iter().filter(|edge| {
        let ends = [0.0, edge.length_m].map(|s| a.to_world(edge.at(s)));
        ends.iter()
            .all(|p| p.y < 2.2 && (p.x - 8.1).abs() < 0.15 && (3.0..4.1).contains(&p.z))
    });
    assert!(jambs.count() >= 4);
    let room = procedural::shoebox(Vec3::new(4.0, 3.0, 5.0), "concrete");
    let table = MaterialTable::built_in();
    let closed = Scene::commit(&room, &table, &SceneSettings::default()).expect("commits");
    // Alone it may be a solid, whichever way it is wound.
    assert_eq!(closed.edges().len(), 12);
}

#[test]
fn diffracted_paths_are_few_and_distinct() {
    let mut all = 0;
    for name in procedural::NAMES {
        let benchmark = procedural::by_name(name).expect("a name of the list");
        let scene = commit(&benchmark);
        let mut paths = 0;
        for (_, source) in &benchmark.sources {
            let set = hear(&scene, *source, benchmark.walk.standing, 2);
            let diffracted = set.paths.iter().filter(|p| p.diffraction_order > 0).count();
            // The lists' lengths; the quietest path of a full list over one edge is silent.
            let most = MAX_DIRECT_EDGES - 1 + MAX_TWO_EDGE_PATHS + MAX_REFLECTED_EDGE_PATHS;
            assert!(diffracted <= most, "{name}: {diffracted} of {most}");
            all += diffracted;
            paths += set.paths.len();
            let mut ids: Vec<_> = set.paths.iter().map(|p| p.id).collect();
            ids.sort_unstable();
            ids.dedup();
            assert_eq!(ids.len(), set.paths.len(), "{name}");
        }
        // Some sources of `angrybot` are out of reach of the listener.
        assert!(paths > 0, "{name}");
    }
    assert!(all > 0);
}

/// What a field has found without the wave's angles is what it finds with them; a listener elsewhere sees other edges.
#[test]
fn the_edges_of_a_direct_field_are_seen_again_from_its_positions_alone() {
    let layout = procedural::doorway();
    let scene = commit(&layout);
    let source = SourcePose::at(SourceId::new(0, 0), layout.sources[0].1);
    let sorted = |edges: &[u32]| edges.iter().copied().collect::<BTreeSet<_>>();
    let (mut with_edges, mut others) = (0, 0);
    let mut last = None;
    for step in 0..120 {
        let ear = layout.walk.from.lerp(layout.walk.to, step as f32 / 119.0);
        let endpoints = Endpoints::of(&source, ear, 0.3);
        let ends = [endpoints.from, endpoints.to].map(|end| scene.to_local(end));
        let all = 0..scene.edges().len() as u32;
        let near = scene.diffracting_edges_over(all, ends[0], ends[1]);
        let edges = || near.as_slice().iter().map(|found| (found.edge, 1.0));
        let field = direct_field(&scene, &endpoints, edges(), no_limits, &mut 0, &mut |_| ());
        assert!(
            field.seen.are_seen(&scene, &endpoints, edges(), &mut 0),
            "{ear}"
        );
        with_edges += u32::from(!field.seen.as_slice().is_empty());
        if let Some(last) = last.replace(field.seen) {
            let is_same = last.are_seen(&scene, &endpoints, edges(), &mut 0);
            let [before, now] = [last, field.seen].map(|seen| sorted(seen.as_slice()));
            assert_eq!(is_same, before == now, "{ear}");
            others += u32::from(!is_same);
        }
    }
    assert!(with_edges > 20 && others > 0, "{with_edges}, {others}");
}
