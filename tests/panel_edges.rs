//! A reflection fades where its reflector ends, without a step for a moving listener.

use std::f64::consts::PI;
use std::sync::Arc;

use foresound::propagation::{Path, PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
};
use glam::Vec3;

const CENTRES_HZ: [f64; 8] = [
    63.0957, 125.8925, 251.1886, 501.1872, 1000.0, 1995.2623, 3981.0717, 7943.2823,
];

/// Rectangles of concrete, each by a corner and two sides.
fn scene(rectangles: &[[Vec3; 3]]) -> Arc<Scene> {
    let mut mesh = TriangleMesh::default();
    mesh.material_names.push("concrete".into());
    for [corner, a, b] in rectangles {
        let first = mesh.vertices.len() as u32;
        for position in [*corner, corner + a, corner + a + b, corner + b] {
            mesh.vertices.push(position);
        }
        for corners in [[0, 1, 2], [0, 2, 3]] {
            mesh.triangles.push(corners.map(|c| first + c));
            mesh.triangle_materials.push(0);
        }
    }
    let table = MaterialTable::built_in();
    Arc::new(Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits"))
}

/// Paths at each position of a walk.
fn walk(scene: &Arc<Scene>, source: Vec3, positions: impl Iterator<Item = Vec3>) -> Vec<Vec<Path>> {
    let mut propagator =
        Propagator::new(Arc::clone(scene), PropagationSettings::default()).expect("settings");
    let pose = SourcePose::at(SourceId::new(0, 0), source);
    let mut set = PathSet::default();
    let hear = |position| {
        let ear = ListenerPose {
            position,
            ..ListenerPose::default()
        };
        propagator.update(&ear, &[pose], 0.0, &mut set);
        set.paths.clone()
    };
    positions.map(hear).collect()
}

/// Share of a wave at Fresnel's parameter on the lit side of a straight edge: |(1 + j)/2 ∫ e^(−jπt²/2) dt| from −ν on.
fn fresnel(nu: f64) -> f64 {
    // C and S from 0 to |ν| by the midpoint rule; both are ½ at infinity.
    let steps = 4000;
    let width = nu.abs() / f64::from(steps);
    let (mut c, mut s) = (0.0, 0.0);
    for i in 0..steps {
        let phase = 0.5 * PI * ((f64::from(i) + 0.5) * width).powi(2);
        c += phase.cos() * width;
        s += phase.sin() * width;
    }
    let (c, s) = (0.5 + c.copysign(nu), 0.5 + s.copysign(nu));
    (0.5 * (c * c + s * s)).sqrt()
}

#[test]
fn a_straight_edge_leaves_half_at_the_boundary() {
    assert!((fresnel(0.0) - 0.5).abs() < 1e-12);
    // Tabulated: the brightest fringe is 1.37 of the intensity, at ν = 1.217.
    assert!((fresnel(1.217).powi(2) - 1.370).abs() < 2e-3);
    assert!(fresnel(-2.0) < 0.12);
}

#[test]
fn a_second_reflection_fades_where_its_wall_ends() {
    // A wall on the ground that ends at x = 0. The reflection's point on it is two fifths along the path to the listener.
    let ground = [
        Vec3::new(-40.0, 0.0, -40.0),
        Vec3::new(0.0, 0.0, 80.0),
        Vec3::new(80.0, 0.0, 0.0),
    ];
    let wall = [
        Vec3::new(-30.0, 0.0, 0.0),
        Vec3::new(30.0, 0.0, 0.0),
        Vec3::new(0.0, 10.0, 0.0),
    ];
    let scene = scene(&[ground, wall]);
    let source = Vec3::new(-6.0, 2.0, 4.0);
    let step_m = 0.02;
    let x = |step: usize| 6.0 + step_m * step as f32;
    let positions = (0..200).map(|step| Vec3::new(x(step), 1.7, 6.0));
    let heard = walk(&scene, source, positions);
    let twice = |paths: &[Path]| {
        let found = paths
            .iter()
            .find(|path| path.order == 2 && path.diffraction_order == 0);
        found.map_or([0.0; 8], |path| {
            path.amplitude.map(|a| f64::from(a * path.length_m))
        })
    };
    let whole = twice(&heard[0]);
    assert!(whole.iter().all(|a| a.abs() > 0.3), "{whole:?}");
    let mut before = [1.0; 8];
    let mut ended = false;
    let mut worst = [0.0f64; 2];
    for (step, paths) in heard.iter().enumerate() {
        let now = twice(paths);
        let inside_m = -(-6.0 + 0.4 * f64::from(x(step) + 6.0));
        let [near_m, far_m] = [4.0, 6.0].map(|z: f64| {
            let across = (f64::from(x(step)) + 6.0) * z / 10.0;
            (across * across + z * z + (3.7 * z / 10.0).powi(2)).sqrt()
        });
        let cosine = 4.0 / near_m;
        for b in 0..8 {
            let share = now[b] / whole[b];
            // A smooth cubic over the point's displacement; 0.2 m is the narrowest fade here, and air and angles change a
            // little.
            let most = 1.5 * 0.4 * f64::from(step_m) / 0.2 + 0.01;
            worst[0] = worst[0].max((share - before[b]).abs());
            assert!((share - before[b]).abs() < most, "step {step}, band {b}");
            before[b] = share;
            let wavelength_m = 343.4 / CENTRES_HZ[b];
            let nu = inside_m
                * cosine
                * (2.0 * (near_m + far_m) / (wavelength_m * near_m * far_m)).sqrt();
            let exact = fresnel(nu);
            worst[1] = worst[1].max((share - exact).abs());
            // Half is missing at the boundary, and bright fringes are not modelled: 1.17 at most; air and angles 0.05.
            assert!(
                (share - exact).abs() < 0.55,
                "{share} for {exact}, band {b}"
            );
        }
        ended |= now == [0.0; 8];
    }
    println!(
        "greatest step {:.3}, from the exact share {:.3}",
        worst[0], worst[1]
    );
    assert!(ended, "the walk passes the boundary");
}

#[test]
fn a_free_panel_s_reflection_counts_once_where_it_ends() {
    // A board above both, which ends at x = 0.
    let board = [
        Vec3::new(-5.0, 4.0, -2.5),
        Vec3::new(0.0, 0.0, 5.0),
        Vec3::new(5.0, 0.0, 0.0),
    ];
    let scene = scene(&[board]);
    assert!(!scene.finite_panels().is_empty());
    let source = Vec3::new(-3.0, 1.0, 0.0);
    let step_m = 0.01;
    let positions = (0..300).map(|step| Vec3::new(1.0 + step_m * step as f32, 1.5, 0.0));
    let heard = walk(&scene, source, positions);
    // The other edges' waves reach their corners at x = 0, 2.5 m beside it.
    let middle = Vec3::new(0.0, 4.0, 0.0);
    let rim = |path: &Path| path.diffraction_order == 1 && path.points()[0].distance(middle) < 1e-3;
    // The reflection and the wave from its edge are one wave at the boundary, so their sizes add there.
    let sum = |paths: &[Path]| {
        let mut sum = [0.0; 8];
        let ends = paths
            .iter()
            .filter(|path| path.order == 1 && path.diffraction_order == 0 || rim(path));
        for path in ends {
            for (sum, a) in sum.iter_mut().zip(path.amplitude) {
                *sum += f64::from(a * path.length_m);
            }
        }
        sum
    };
    let passes = |is: fn(&Path) -> bool| heard.iter().any(|paths| paths.iter().any(is));
    assert!(passes(|path| path.order == 1));
    assert!(heard.iter().any(|paths| paths.iter().any(rim)));
    let mut before = sum(&heard[0]);
    let mut worst = 0.0f64;
    for (step, paths) in heard.iter().enumerate() {
        let now = sum(paths);
        for b in 0..8 {
            let change = (now[b] - before[b]).abs();
            worst = worst.max(change);
            // A smoothstep over 0.3 m, of which the reflection point moves 5.5 mm: 0.027; the edge's wave that replaces
            // the reflection changes as much.
            assert!(change < 0.06, "step {step}, band {b}: {change}");
            // Not louder than a whole reflection with its brightest fringe.
            assert!(now[b].abs() < 1.2, "step {step}, band {b}: {}", now[b]);
        }
        before = now;
    }
    println!("greatest step {worst:.3}");
}
