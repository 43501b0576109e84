//! Noise on the corners of spheres and cylinders leaves them whole, and makes none of what is not round.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use foresound::scene::{MaterialTable, Scene, SceneSettings, TriangleMesh};
use glam::{DVec3, Vec3};

/// Facets' sides, and noise in metres as a standard deviation.
const FACETS_M: [f64; 2] = [0.3, 0.1];
const SIGMAS_M: [f64; 3] = [0.001, 0.005, 0.01];

#[derive(Default)]
struct Builder {
    mesh: TriangleMesh,
    of_position: HashMap<[i64; 3], u32>,
    normals: Vec<DVec3>,
}

impl Builder {
    /// A corner; patches that meet have it in common.
    fn corner(&mut self, at: DVec3) -> u32 {
        let key = at.to_array().map(|x| (1000.0 * x).round() as i64);
        *self.of_position.entry(key).or_insert_with(|| {
            self.mesh.vertices.push(at.as_vec3());
            self.normals.push(DVec3::ZERO);
            self.mesh.vertices.len() as u32 - 1
        })
    }

    /// A surface over the unit square in cells of about `facet_m`, of so many metres along both sides.
    fn patch(&mut self, size_m: [f64; 2], facet_m: f64, at: impl Fn(f64, f64) -> DVec3) {
        let material = self.mesh.material("plaster");
        let counts = size_m.map(|size| (size / facet_m).round().max(1.0) as u32);
        let part = |n: u32, axis: usize| f64::from(n) / f64::from(counts[axis]);
        for (i, j) in (0..counts[0]).flat_map(|i| (0..counts[1]).map(move |j| (i, j))) {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)]
                .map(|(di, dj)| self.corner(at(part(i + di, 0), part(j + dj, 1))));
            for [p, q, r] in [[a, b, c], [a, c, d]] {
                if p != q && q != r && r != p {
                    self.mesh.triangles.push([p, q, r]);
                    self.mesh.triangle_materials.push(material);
                }
            }
        }
    }

    /// Moves the corners along their normals by nearly normal noise, a sum of twelve uniform random numbers, and commits.
    fn commit(mut self, sigma_m: f64, seed: u64) -> Scene {
        for triangle in &self.mesh.triangles {
            let [a, b, c] = triangle.map(|v| self.mesh.vertices[v as usize].as_dvec3());
            let normal = (b - a).cross(c - a).normalize_or_zero();
            for v in triangle {
                self.normals[*v as usize] += normal;
            }
        }
        let mut state = seed;
        let mut random = || {
            let mut sum = -6.0;
            for _ in 0..12 {
                state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
                let mixed = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
                sum += (mixed >> 11) as f64 / (1u64 << 53) as f64;
            }
            sum
        };
        for (vertex, normal) in self.mesh.vertices.iter_mut().zip(&self.normals) {
            *vertex += (sigma_m * random() * normal.normalize_or_zero()).as_vec3();
        }
        let settings = SceneSettings::default();
        Scene::commit(&self.mesh, &MaterialTable::built_in(), &settings).expect("commits")
    }
}

fn turned(part: f64) -> DVec3 {
    DVec3::new((TAU * part).cos(), 0.0, (TAU * part).sin())
}

fn column(builder: &mut Builder, foot: DVec3, radius_m: f64, height_m: f64, facet_m: f64) {
    let around_m = TAU * radius_m;
    builder.patch([around_m, height_m], facet_m, |u, v| {
        foot + radius_m * turned(u) + height_m * v * DVec3::Y
    });
}

/// A floor of 12 m in cells.
fn floor(builder: &mut Builder, facet_m: f64) {
    builder.patch([12.0, 12.0], facet_m, |u, v| {
        Vec3::new(12.0 * u as f32 - 6.0, 0.0, 12.0 * v as f32 - 6.0).as_dvec3()
    });
}

fn for_all(test: impl Fn(f64, f64)) {
    for facet_m in FACETS_M {
        for sigma_m in SIGMAS_M {
            test(facet_m, sigma_m);
        }
    }
}

#[track_caller]
fn is_one(scene: &Scene, radius_m: f64, area_m2: f64, case: &str) {
    let found = scene.curved_surfaces();
    assert_eq!(found.len(), 1, "{case}: {found:?}");
    let off_m = (found[0].shape.radius_m - radius_m).abs();
    assert!(off_m < 0.01 * radius_m, "{case}: {found:?}");
    assert!(found[0].area_m2 > 0.9 * area_m2, "{case}: {found:?}");
}

#[test]
fn a_noisy_vault_is_one_cylinder() {
    for_all(|facet_m, sigma_m| {
        for seed in 1..4 {
            let mut builder = Builder::default();
            builder.patch([4.0 * PI, 9.0], facet_m, |u, v| {
                DVec3::new(4.0 * (PI * u).cos(), 4.0 * (PI * u).sin(), 9.0 * v)
            });
            for z in [0.0, 9.0] {
                builder.patch([4.0 * PI, 4.0], facet_m, |u, v| {
                    // Rings of the end walls, none finer than the facets.
                    let out = 4.0 - v * (4.0 - 2.0);
                    DVec3::new(out * (PI * u).cos(), out * (PI * u).sin(), z)
                });
            }
            let scene = builder.commit(sigma_m, seed);
            is_one(
                &scene,
                4.0,
                36.0 * PI,
                &format!("{facet_m} {sigma_m} {seed}"),
            );
        }
    });
}

#[test]
fn a_noisy_round_wall_is_one_cylinder() {
    for_all(|facet_m, sigma_m| {
        for seed in 1..4 {
            let mut builder = Builder::default();
            builder.patch([8.0, 4.0], facet_m, |u, v| {
                10.0 * turned(0.127 * u) + 4.0 * v * DVec3::Y
            });
            let scene = builder.commit(sigma_m, seed);
            is_one(&scene, 10.0, 32.0, &format!("{facet_m} {sigma_m} {seed}"));
        }
    });
}

#[test]
fn a_noisy_sphere_is_one() {
    for_all(|facet_m, sigma_m| {
        for seed in 1..4 {
            let mut builder = Builder::default();
            // From the equator to 60 degrees.
            builder.patch([2.0 * PI, PI], facet_m, |u, v| {
                let (height, level) = (PI / 3.0 * v).sin_cos();
                3.0 * (level * turned(u) + height * DVec3::Y)
            });
            let scene = builder.commit(sigma_m, seed);
            let area_m2 = TAU * 9.0 * (PI / 3.0).sin();
            is_one(&scene, 3.0, area_m2, &format!("{facet_m} {sigma_m} {seed}"));
        }
    });
}

#[test]
fn a_noisy_column_is_one_cylinder() {
    for_all(|facet_m, sigma_m| {
        for seed in 1..4 {
            let mut builder = Builder::default();
            column(&mut builder, DVec3::ZERO, 1.0, 5.0, facet_m);
            floor(&mut builder, facet_m);
            let scene = builder.commit(sigma_m, seed);
            let area_m2 = TAU * 5.0;
            is_one(&scene, 1.0, area_m2, &format!("{facet_m} {sigma_m} {seed}"));
        }
    });
}

#[test]
fn a_church_has_all_its_columns() {
    let mut builder = Builder::default();
    for number in 0..60 {
        let foot = DVec3::new(
            f64::from(number % 6) * 5.0,
            0.0,
            f64::from(number / 6) * 4.0,
        );
        builder.patch([16.0, 8.0], 1.0, |u, v| {
            foot + 0.4 * turned(u) + 8.0 * v * DVec3::Y
        });
    }
    let scene = builder.commit(0.0, 1);
    assert_eq!(scene.curved_surfaces().len(), 60);
}

#[test]
fn what_has_edges_is_not_round() {
    let none = |builder: Builder, sigma_m: f64, case: &str| {
        let scene = builder.commit(sigma_m, 5);
        let found = scene.curved_surfaces();
        assert!(found.is_empty(), "{case}, {sigma_m} m: {found:?}");
    };
    for_all(|facet_m, sigma_m| {
        // Columns of eight and six sides, thick and thin ones.
        for (sides, radius_m) in [(8, 1.0), (8, 0.6), (8, 0.35), (6, 1.0), (6, 0.35)] {
            let mut builder = Builder::default();
            for side in 0..sides {
                let [from, to] = [0, 1].map(|n| turned(f64::from(side + n) / f64::from(sides)));
                let width_m = radius_m * from.distance(to);
                builder.patch([width_m, 5.0], facet_m, |u, v| {
                    radius_m * from.lerp(to, u) + 5.0 * v * DVec3::Y
                });
            }
            none(
                builder,
                sigma_m,
                &format!("{sides} sides of {radius_m} m, {facet_m}"),
            );
        }
        let mut stairs = Builder::default();
        for step in 0..16 {
            let at = |u: f64, y: f64, z: f64| DVec3::new(1.5 * u, 0.17 * y, 0.28 * z);
            let n = f64::from(step);
            stairs.patch([1.5, 0.17], facet_m, |u, v| at(u, n + v, n));
            stairs.patch([1.5, 0.28], facet_m, |u, v| at(u, n + 1.0, n + v));
        }
        none(stairs, sigma_m, &format!("stairs, {facet_m}"));
        let mut wall = Builder::default();
        wall.patch([7.0, 3.0], facet_m, |u, v| {
            DVec3::new(7.0 * u, 3.0 * v, 0.0)
        });
        none(wall, sigma_m, &format!("wall, {facet_m}"));
        // Ridges and hollows of some metres.
        let mut terrain = Builder::default();
        terrain.patch([20.0, 20.0], facet_m, |u, v| {
            let (x, z) = (20.0 * u, 20.0 * v);
            let height = 0.7 * (0.9 * x).sin() * (0.7 * z + 0.4).cos() + 0.3 * (1.7 * x - z).sin();
            DVec3::new(x, height, z)
        });
        none(terrain, sigma_m, &format!("terrain, {facet_m}"));
        let mut boxes = Builder::default();
        for number in 0..4 {
            let size = DVec3::new(1.4, 0.75, 0.8);
            let foot = DVec3::new(f64::from(number) * 3.0, 0.0, 0.0);
            for axis in 0..3 {
                for far in [0.0, 1.0] {
                    let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
                    boxes.patch([size[a], size[b]], facet_m, |u, v| {
                        let mut at = DVec3::ZERO;
                        (at[axis], at[a], at[b]) = (far, u, v);
                        foot + at * size
                    });
                }
            }
        }
        none(boxes, sigma_m, &format!("boxes, {facet_m}"));
    });
}
