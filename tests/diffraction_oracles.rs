//! Diffracted paths beyond a single free edge, against oracles independent of rays: the end of a large wall's reflection, a
//! reflecting floor, a thick barrier.

mod reference;

use std::f64::consts::PI;
use std::sync::Arc;

use foresound::acoustics::Material;
use foresound::propagation::{PathSet, PropagationSettings, Propagator};
use foresound::scene::{
    ListenerPose, MaterialTable, Scene, SceneSettings, SourceId, SourcePose, TriangleMesh,
};
use glam::Vec3;
use reference::boundary_elements::{gain, hankel};
use reference::wedge::{Wedge, size};

/// Exact midbands.
const CENTRES_HZ: [f64; 8] = [
    63.0957, 125.8925, 251.1886, 501.1872, 1000.0, 1995.2623, 3981.0717, 7943.2823,
];

/// Rectangles, each given by a corner and two sides, of a material that transmits `transmission` of the energy and reflects
/// the rest.
fn scene(transmission: f32, rectangles: &[[Vec3; 3]]) -> Arc<Scene> {
    let material = Material {
        name: "wall".to_owned(),
        absorption: [transmission; 8],
        scattering: [0.0; 8],
        transmission: [transmission; 8],
    };
    let table = MaterialTable::from_materials(vec![material]);
    let mut mesh = TriangleMesh::default();
    let wall = mesh.material("wall");
    for &[corner, a, b] in rectangles {
        let first = mesh.vertices.len() as u32;
        mesh.vertices
            .extend([corner, corner + a, corner + a + b, corner + b]);
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.triangles.push([first, first + 2, first + 3]);
        mesh.triangle_materials.extend([wall; 2]);
    }
    Arc::new(Scene::commit(&mesh, &table, &SceneSettings::default()).expect("commits"))
}

fn hear(scene: &Arc<Scene>, pose: &SourcePose, to: Vec3) -> PathSet {
    let settings = PropagationSettings {
        guide_rays: 512,
        source_rays: 16,
        depth: 2,
        ..PropagationSettings::default()
    };
    let mut propagator = Propagator::new(Arc::clone(scene), settings).expect("settings");
    let ear = ListenerPose {
        position: to,
        ..ListenerPose::default()
    };
    let mut set = PathSet::default();
    propagator.update(&ear, &[*pose], 0.0, &mut set);
    set
}

fn wavenumber(scene: &Scene, band: usize) -> f64 {
    2.0 * PI * CENTRES_HZ[band] / scene.speed_of_sound_m_s()
}

/// Pressure of all paths at a band's centre without air, times `weight` of a path's length.
fn level(scene: &Scene, set: &PathSet, band: usize, weight: impl Fn(f64) -> f64) -> f64 {
    let k = wavenumber(scene, band);
    let (mut re, mut im) = (0.0, 0.0);
    for path in &set.paths {
        let length_m = f64::from(path.length_m);
        let dry = (f64::from(scene.air_np_per_m()[band]) * length_m).exp();
        let pressure = f64::from(path.amplitude[band]) * dry * weight(length_m);
        re += pressure * (k * length_m).cos();
        im -= pressure * (k * length_m).sin();
    }
    re.hypot(im)
}

fn db(ratio: f64) -> f64 {
    20.0 * ratio.log10()
}

/// A screen from the z axis along +x; points by distance and angle from it.
fn screen(transmission: f32) -> Arc<Scene> {
    let half = 60.0 * Vec3::Z;
    scene(transmission, &[[-half, 2.0 * half, 60.0 * Vec3::X]])
}

fn at(radius_m: f64, angle: f64) -> Vec3 {
    Vec3::new(
        (radius_m * angle.cos()) as f32,
        (radius_m * angle.sin()) as f32,
        0.0,
    )
}

#[test]
fn a_large_wall_s_reflection_fades_over_its_edge() {
    let (screen, incoming, radius_m) = (screen(0.0), PI / 3.0, 5.0);
    let pose = SourcePose::at(SourceId::default(), at(radius_m, incoming));
    // The direct and the reflected wave separate where the reflection ends, at 120°.
    let steps: Vec<f64> = (-40..=40).map(|i| f64::from(i) * 0.25 + 120.013).collect();
    let (mut worst, mut worst_step) = ([0f64; 8], [0f64; 8]);
    let mut before = [0.0; 8];
    for (number, degrees) in steps.iter().enumerate() {
        let outgoing = degrees.to_radians();
        let set = hear(&screen, &pose, at(radius_m, outgoing));
        let wedge = Wedge {
            n: 2.0,
            radii_m: [radius_m; 2],
            angles: [incoming, outgoing],
            along_m: 0.0,
        };
        for band in 0..8 {
            let exact = size(wedge.total([wavenumber(&screen, band)])[0]);
            let ours = level(&screen, &set, band, |_| 1.0);
            let error = db(ours / exact);
            worst[band] = worst[band].max(error.abs());
            if number > 0 {
                worst_step[band] = worst_step[band].max((error - before[band]).abs());
            }
            before[band] = error;
        }
    }
    println!("{worst:.2?} {worst_step:.2?}");
    // A hard end would be a step of 6 dB and more.
    assert!(worst.iter().all(|e| *e < 1.5), "{worst:?}");
    assert!(worst_step.iter().all(|e| *e < 1.5), "{worst_step:?}");
}

#[test]
fn a_shadow_of_an_opaque_wall_has_no_step() {
    let (screen, incoming, radius_m) = (screen(0.3), PI / 3.0, 5.0);
    for transmission in [true, false] {
        let mut pose = SourcePose::at(SourceId::default(), at(radius_m, incoming));
        pose.settings.effects.transmission = transmission;
        pose.settings.effects.reflections = false;
        let levels = [-0.02f64, 0.02].map(|degrees| {
            let outgoing = incoming + PI + degrees.to_radians();
            let set = hear(&screen, &pose, at(radius_m, outgoing));
            [0, 2, 4, 6].map(|band| db(level(&screen, &set, band, |_| 1.0)))
        });
        for (lit, dark) in levels[0].iter().zip(levels[1]) {
            assert!((lit - dark).abs() < 0.3, "{transmission}: {levels:?}");
        }
    }
}

#[test]
fn diffraction_over_a_reflecting_floor_equals_that_of_the_images() {
    // A screen 4 m high on a floor; source and listener are behind it, at 1 and 1.5 m.
    let far = 50.0;
    let floor = [
        Vec3::new(-far, 0.0, -far),
        2.0 * far * Vec3::X,
        2.0 * far * Vec3::Z,
    ];
    let wall = [
        Vec3::new(0.0, 0.0, -far),
        2.0 * far * Vec3::Z,
        4.0 * Vec3::Y,
    ];
    let scene = scene(0.0, &[floor, wall]);
    let (from, to) = (Vec3::new(-4.0, 1.0, 0.0), Vec3::new(5.0, 1.5, 2.0));
    let set = hear(&scene, &SourcePose::at(SourceId::default(), from), to);
    let mirror = |p: Vec3| Vec3::new(p.x, -p.y, p.z);
    for (a, b, order) in [
        (from, to, 0),
        (mirror(from), to, 1),
        (from, mirror(to), 1),
        (mirror(from), mirror(to), 2),
    ] {
        // Angles from the wall's face on the source's side.
        let polar = |p: Vec3, turn: f64| {
            let (x, y) = (f64::from(p.x), f64::from(p.y) - 4.0);
            (x.hypot(y), (turn * x.atan2(-y)).rem_euclid(2.0 * PI))
        };
        let ((r0, phi0), (r, phi)) = (polar(a, -1.0), polar(b, -1.0));
        let wedge = Wedge {
            n: 2.0,
            radii_m: [r0, r],
            angles: [phi0, phi],
            along_m: f64::from(b.z - a.z),
        };
        let near = |length_m: f32| (f64::from(length_m) - wedge.path_m()).abs() < 1e-3;
        let found: Vec<_> = set
            .paths
            .iter()
            .filter(|p| p.diffraction_order == 1 && p.order == order && near(p.length_m))
            .collect();
        assert_eq!(found.len(), 1, "order {order}: {:?}", set.paths);
        let length_m = f64::from(found[0].length_m);
        for band in 1..8 {
            let dry = (f64::from(scene.air_np_per_m()[band]) * length_m).exp();
            let exact = size(wedge.diffracted([wavenumber(&scene, band)])[0]);
            let error = db(f64::from(found[0].amplitude[band]) * dry / exact);
            assert!(error.abs() < 0.3, "order {order}, band {band}: {error} dB");
        }
    }
}

#[test]
fn hankel_functions_of_the_boundary_elements_have_the_wronskian() {
    // Their Wronskian, J₁ Y₀ − J₀ Y₁ = 2/(πx), on both sides of the change of series; and a tabulated value.
    for x in [0.05, 0.7, 3.0, 9.0, 13.9, 14.1, 40.0] {
        let (h0, h1) = (hankel(0, x), hankel(1, x));
        let wronskian = h1.0 * -h0.1 - h0.0 * -h1.1;
        assert!(
            (wronskian * PI * x / 2.0 - 1.0).abs() < 1e-8,
            "{x}: {wronskian}"
        );
    }
    let (below, above) = (hankel(0, 14.0 - 1e-9), hankel(0, 14.0 + 1e-9));
    assert!((below.0 - above.0).abs() < 1e-8 && (below.1 - above.1).abs() < 1e-8);
    let one = hankel(0, 1.0);
    assert!((one.0 - 0.765_197_686_6).abs() < 1e-9 && (one.1 + 0.088_256_964_2).abs() < 1e-9);
}

#[test]
fn second_order_around_a_thick_barrier_agrees_with_boundary_elements() {
    // A bar 1 m thick and 3 m high, of infinite length; sound passes over and under it.
    let (thick, high, half) = (1.0f32, 3.0f32, 60.0f32);
    let low = Vec3::new(-0.5 * thick, -0.5 * high, -half);
    let (x, y, z) = (thick * Vec3::X, high * Vec3::Y, 2.0 * half * Vec3::Z);
    let bar = scene(
        0.0,
        // Wound with every face outward.
        &[[low, z, y], [low + x, y, z], [low, x, z], [low + y, z, x]],
    );
    let (t, h) = (0.5 * f64::from(thick), 0.5 * f64::from(high));
    let outline = [[-t, -h], [t, -h], [t, h], [-t, h]];
    let inside = [
        [0.13, 0.71],
        [-0.21, -0.93],
        [0.07, -0.29],
        [-0.31, 1.17],
        [0.33, 0.37],
    ];
    let mut sum = 0.0;
    for (from, to) in [
        (Vec3::new(-4.0, 0.4, 0.0), Vec3::new(3.0, 0.7, 0.0)),
        (Vec3::new(-3.0, 1.2, 0.0), Vec3::new(5.0, 1.0, 0.0)),
        (Vec3::new(-6.0, 0.9, 0.0), Vec3::new(2.0, -0.2, 0.0)),
    ] {
        let set = hear(&bar, &SourcePose::at(SourceId::default(), from), to);
        let direct_m = f64::from(from.distance(to));
        for band in 1..5 {
            let [source, listener] = [from, to].map(|p| [f64::from(p.x), f64::from(p.y)]);
            let k = wavenumber(&bar, band);
            let exact = gain(&outline, &inside, k, source, listener);
            // A line source's wave decays with the root of the path length, a point source's with the length.
            let ours = level(&bar, &set, band, |length_m| length_m.sqrt()) * direct_m.sqrt();
            let error = db(ours / exact);
            println!("{from} {to} {band}: {:.2} dB, off by {error:.2}", db(exact));
            assert!(error.abs() < 3.5, "{from} {to} {band}: {error} dB");
            sum += error.abs() / 12.0;
        }
    }
    // At 126 Hz the top is less than half a wavelength thick, with diffraction of higher orders; the waves over and under
    // the bar interfere with phases that real amplitudes leave out.
    assert!(sum < 2.0, "{sum} dB in the mean");
}
