//! Which regions of a mesh are spheres and cylinders.

use std::f64::consts::PI;

use foresound::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};
use glam::{DVec3, Vec3};

const RADIUS_M: f64 = 4.0;
const LENGTH_M: f64 = 16.0;

/// A surface over the unit square, in so many cells.
fn patch(mesh: &mut TriangleMesh, [columns, rows]: [u32; 2], at: impl Fn(f64, f64) -> DVec3) {
    let wall = mesh.material("plaster");
    let corner = |column: u32, row: u32| -> Vec3 {
        let part = |n: u32, of: u32| f64::from(n) / f64::from(of);
        at(part(column, columns), part(row, rows)).as_vec3()
    };
    for (column, row) in (0..columns).flat_map(|c| (0..rows).map(move |r| (c, r))) {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend([
            corner(column, row),
            corner(column + 1, row),
            corner(column + 1, row + 1),
            corner(column, row + 1),
        ]);
        let [a, b, c, d] = [0, 1, 2, 3].map(|n| first + n);
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
        mesh.triangle_materials.extend([wall; 2]);
    }
}

/// A barrel vault whose end is a quarter of a sphere with a round wall below, so that all three go over into each other smoothly.
fn chapel(around: u32) -> Scene {
    let turned = |turn: f64| DVec3::new((PI * turn).cos(), (PI * turn).sin(), 0.0);
    let mut mesh = TriangleMesh::default();
    patch(&mut mesh, [around, around / 2], |turn, along| {
        RADIUS_M * turned(turn) + LENGTH_M * along * DVec3::Z
    });
    patch(&mut mesh, [around, around / 2], |turn, rise| {
        let (height, level) = (0.5 * PI * rise).sin_cos();
        let out = turned(turn);
        RADIUS_M * DVec3::new(level * out.x, height, level * out.y) + LENGTH_M * DVec3::Z
    });
    patch(&mut mesh, [around, 4], |turn, height| {
        let out = turned(turn);
        let level = RADIUS_M * DVec3::new(out.x, 0.0, out.y) + LENGTH_M * DVec3::Z;
        level - RADIUS_M * height * DVec3::Y
    });
    let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default());
    scene.expect("commits")
}

#[test]
fn curved_surfaces_that_continue_each_other_are_told_apart() {
    // A vault of half a turn, a round wall, a quarter of a sphere.
    let exact_m2 = [
        PI * RADIUS_M * LENGTH_M,
        PI * RADIUS_M * RADIUS_M,
        PI * RADIUS_M * RADIUS_M,
    ];
    for around in [12, 24, 36, 60, 96] {
        let scene = chapel(around);
        let found = scene.curved_surfaces();
        assert_eq!(found.len(), 3, "{around} facets around: {found:?}");
        let spheres = found.iter().filter(|curved| curved.shape.axis.is_none());
        assert_eq!(spheres.count(), 1, "{around} facets around: {found:?}");
        for (curved, exact_m2) in found.iter().zip(exact_m2) {
            // Facets with their corners on a circle have 1 - (pi / around)²/6 of its length; a row of facets may be the neighbour's.
            let error = (curved.area_m2 / exact_m2 - 1.0).abs();
            assert!(error < 0.06, "{around} facets around: {curved:?}");
            assert!(
                (curved.shape.radius_m - RADIUS_M).abs() < 1e-3,
                "{curved:?}"
            );
        }
    }
}
