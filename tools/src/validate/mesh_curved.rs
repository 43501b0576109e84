//! Law *mesh/curved*: the early energy that domes, vaults, bent walls and columns reflect does not depend on their
//! tessellation nor on noise, and is that of particles on the finest one.
//!
//! The oracle shares the scene's rays and the material model's reflection by angle with the crate, nothing of propagation:
//! particles are reflected by the facets of a mesh whose facets no longer matter, and counted in a ball about the listener.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::mesh_rooms::{add_noise, merge_near};
use super::rooms::{self, Probe, commit, even};
use super::{Case, Row};
use foresound::error::Result;
use foresound::geometry::Ray;
use foresound::geometry::bvh::NO_GROUP;
use foresound::propagation::diffuse::late_segments;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::propagation::{PathSet, PropagationSettings};
use foresound::scene::{Scene, TriangleMesh};

/// Windows in seconds after emission.
const WINDOWS_S: [[f64; 2]; 3] = [[0.0, 0.02], [0.02, 0.04], [0.04, 0.08]];

/// Band that is compared: 1 kHz.
const BAND: usize = 4;

/// Bounds in dB: between tessellations, and from the particles.
const SPREAD_DB: f64 = 1.5;
const PARTICLES_DB: f64 = 3.0;

/// Bound in dB of what noise changes.
const NOISE_DB: f64 = 1.5;

/// Sides of facets in metres, and noise on each vertex along its normal, as a standard deviation in metres.
const NOISY_M: [f64; 2] = [0.3, 0.1];
const SIGMAS_M: [f32; 3] = [0.001, 0.005, 0.01];

/// Least distance of two vertices of a noisy mesh relative to the sides: at a dome's pole meridians meet.
const LEAST_SIDE: f64 = 0.6;

/// A window this far below the loudest one is not compared, in dB.
const QUIET_DB: f64 = -25.0;

/// Radius of the ball in metres, and the particles.
const BALL_M: f64 = 0.5;
const PARTICLES: u64 = 600_000;

/// Positions of the listener, evenly in the ball, and updates at each.
const POSITIONS: u32 = 64;
const UPDATES: u32 = 4;

/// Absorption and scattering of all surfaces.
const MATERIAL: [f32; 2] = [0.1, 0.1];

/// A reflector in a room or on open ground, in tessellations from coarse to fine.
struct Reflector {
    name: &'static str,
    tessellations: &'static [[usize; 2]],
    /// Length in metres along both directions of its cells.
    extent_m: [f64; 2],
    /// Of the reflector's cells, with flat parts in cells of so many metres.
    mesh: fn([usize; 2], f64) -> TriangleMesh,
    source: Vec3,
    listener: Vec3,
}

const REFLECTORS: [Reflector; 4] = [
    Reflector {
        name: "dome",
        tessellations: &[[6, 18], [10, 30], [16, 48], [30, 90], [72, 216]],
        extent_m: [5.0 * PI / 2.0, 10.0 * PI],
        mesh: dome,
        source: Vec3::new(0.6, 1.5, 0.3),
        listener: Vec3::new(-0.9, 1.6, -0.8),
    },
    Reflector {
        name: "barrel vault",
        tessellations: &[[9, 8], [18, 16], [36, 32], [120, 128]],
        extent_m: [4.0 * PI, 12.0],
        mesh: vault,
        source: Vec3::new(0.7, 1.5, 4.0),
        listener: Vec3::new(-1.1, 1.6, 8.2),
    },
    Reflector {
        name: "concave back wall",
        tessellations: &[[6, 3], [12, 6], [24, 12], [100, 50]],
        extent_m: [10.0 * PI / 3.0, 5.0],
        mesh: back_wall,
        source: Vec3::new(2.0, 1.5, 1.0),
        listener: Vec3::new(1.0, 1.6, -2.0),
    },
    Reflector {
        name: "convex column",
        tessellations: &[[13, 1], [24, 3], [48, 8], [96, 30]],
        extent_m: [TAU, 6.0],
        mesh: column,
        source: Vec3::new(4.0, 1.5, 0.4),
        listener: Vec3::new(2.8, 1.6, 3.1),
    },
];

/// Adds a patch of cells of two triangles.
fn patch(mesh: &mut TriangleMesh, [rows, columns]: [usize; 2], at: impl Fn(f64, f64) -> DVec3) {
    let first = mesh.vertices.len() as u32;
    for i in 0..=rows {
        for j in 0..=columns {
            let point = at(i as f64 / rows as f64, j as f64 / columns as f64);
            mesh.vertices.push(point.as_vec3());
        }
    }
    let stride = columns as u32 + 1;
    for i in 0..rows as u32 {
        for j in 0..columns as u32 {
            let a = first + i * stride + j;
            mesh.triangles.push([a, a + 1, a + stride + 1]);
            mesh.triangles.push([a, a + stride + 1, a + stride]);
        }
    }
    mesh.triangle_materials.resize(mesh.triangles.len(), 0);
}

fn begin() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    mesh.material("wall");
    mesh
}

/// Number of cells of so many metres along a length, at least one.
fn cells(length_m: f64, cell_m: f64) -> usize {
    (length_m / cell_m).round().max(1.0) as usize
}

fn ground(mesh: &mut TriangleMesh, half_m: [f64; 2], middle: DVec3, flat_m: f64) {
    patch(
        mesh,
        half_m.map(|half| cells(2.0 * half, flat_m)),
        |u, v| {
            middle
                + DVec3::new(
                    (2.0 * u - 1.0) * half_m[0],
                    0.0,
                    (2.0 * v - 1.0) * half_m[1],
                )
        },
    );
}

/// A hemisphere of 5 m on a floor.
fn dome([rows, columns]: [usize; 2], flat_m: f64) -> TriangleMesh {
    let mut mesh = begin();
    let at = |u: f64, v: f64| {
        let (height, turn) = (0.5 * PI * u, TAU * v);
        5.0 * DVec3::new(
            height.cos() * turn.cos(),
            height.sin(),
            height.cos() * turn.sin(),
        )
    };
    patch(&mut mesh, [rows, columns], at);
    patch(&mut mesh, [cells(5.0, flat_m), columns], |u, v| {
        (1.0 - u) * at(0.0, v)
    });
    mesh
}

/// A half cylinder of 4 m radius and 12 m length on a floor, between two walls.
fn vault([rows, columns]: [usize; 2], flat_m: f64) -> TriangleMesh {
    let mut mesh = begin();
    let at = |u: f64, z: f64| DVec3::new(4.0 * (PI * u).cos(), 4.0 * (PI * u).sin(), z);
    patch(&mut mesh, [rows, columns], |u, v| at(u, 12.0 * v));
    for z in [0.0, 12.0] {
        patch(&mut mesh, [rows, cells(4.0, flat_m)], |u, v| {
            let rim = at(u, z);
            DVec3::new(v * rim.x, v * rim.y, z)
        });
    }
    ground(&mut mesh, [4.0, 6.0], DVec3::Z * 6.0, flat_m);
    mesh
}

/// A wall of 10 m radius through 60 degrees, 5 m high, on the ground.
fn back_wall([columns, rows]: [usize; 2], flat_m: f64) -> TriangleMesh {
    let mut mesh = begin();
    patch(&mut mesh, [columns, rows], |u, v| {
        let turn = PI / 3.0 * (u - 0.5);
        DVec3::new(10.0 * turn.cos(), 5.0 * v, 10.0 * turn.sin())
    });
    ground(&mut mesh, [12.0; 2], DVec3::ZERO, flat_m);
    mesh
}

/// A column of 1 m radius, 6 m high, on the ground.
fn column([columns, rows]: [usize; 2], flat_m: f64) -> TriangleMesh {
    let mut mesh = begin();
    patch(&mut mesh, [columns, rows], |u, v| {
        DVec3::new((TAU * u).cos(), 6.0 * v, (TAU * u).sin())
    });
    ground(&mut mesh, [12.0; 2], DVec3::ZERO, flat_m);
    mesh
}

pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for reflector in &REFLECTORS {
        let mut energies: Vec<[f64; 3]> = Vec::new();
        let mut curved = usize::MAX;
        for &cells in reflector.tessellations {
            let scene = scene(&(reflector.mesh)(cells, f64::INFINITY))?;
            curved = curved.min(scene.curved_surfaces().len());
            energies.push(heard(&scene, reflector)?);
        }
        let finest = reflector.tessellations[reflector.tessellations.len() - 1];
        let finest = scene(&(reflector.mesh)(finest, f64::INFINITY))?;
        let exact = particles(&finest, reflector);
        let mut case = Case::new(format!("mesh/curved: {}", reflector.name));
        case.at_least("curved surfaces found", curved as f64, 1.0, "");
        let loudest = exact.iter().copied().fold(0.0, f64::max);
        for (window, [from_s, to_s]) in WINDOWS_S.into_iter().enumerate() {
            let level = |energy: f64| 10.0 * (energy / loudest).max(1e-12).log10();
            if level(exact[window]) < QUIET_DB {
                continue;
            }
            let levels = energies.iter().map(|energy| level(energy[window]));
            let (low, high) = levels
                .clone()
                .fold((f64::MAX, f64::MIN), |(l, h), e| (l.min(e), h.max(e)));
            let (from_ms, to_ms) = (1000.0 * from_s, 1000.0 * to_s);
            let name = format!("{from_ms:.0} to {to_ms:.0} ms");
            case.at_most(
                &format!("{name}, between tessellations"),
                high - low,
                SPREAD_DB,
                "dB",
            );
            let off = levels
                .map(|e| (e - level(exact[window])).abs())
                .fold(0.0, f64::max);
            case.at_most(
                &format!("{name}, against particles"),
                off,
                PARTICLES_DB,
                "dB",
            );
        }
        rows.extend(case.rows);
        let is_heard = exact.map(|energy| 10.0 * (energy / loudest).log10() >= QUIET_DB);
        for facet_m in NOISY_M {
            rows.extend(noise(reflector, facet_m, is_heard)?);
        }
    }
    Ok(rows)
}

/// What noise on the vertices changes with facets of one size.
fn noise(reflector: &Reflector, facet_m: f64, is_heard: [bool; 3]) -> Result<Vec<Row>> {
    let counts = reflector.extent_m.map(|length_m| cells(length_m, facet_m));
    let mut clean = (reflector.mesh)(counts, facet_m);
    merge_near(&mut clean, LEAST_SIDE * facet_m);
    let before = heard(&scene(&clean)?, reflector)?;
    let mut rows = Vec::new();
    for sigma_m in SIGMAS_M {
        let mut mesh = clean.clone();
        add_noise(&mut mesh, sigma_m, 1);
        let scene = scene(&mesh)?;
        let after = heard(&scene, reflector)?;
        let (facet_cm, sigma_mm) = (100.0 * facet_m, 1000.0 * sigma_m);
        let name = reflector.name;
        let name = format!("mesh/curved: {name}, {facet_cm:.0} cm, {sigma_mm:.0} mm");
        let mut case = Case::new(name);
        let found = scene.curved_surfaces().len();
        case.at_most(
            "curved surfaces, from one",
            found.abs_diff(1) as f64,
            0.0,
            "",
        );
        for (window, [from_s, to_s]) in WINDOWS_S.into_iter().enumerate() {
            if is_heard[window] {
                let off_db = 10.0 * (after[window] / before[window]).log10();
                let name = format!("{:.0} to {:.0} ms", 1000.0 * from_s, 1000.0 * to_s);
                case.at_most(&name, off_db.abs(), NOISE_DB, "dB");
            }
        }
        rows.extend(case.rows);
    }
    Ok(rows)
}

fn scene(mesh: &TriangleMesh) -> Result<Arc<Scene>> {
    let [absorption, scattering] = MATERIAL;
    commit(mesh, vec![even("wall", absorption, scattering)])
}

/// Energy in the windows without the direct sound, in the mean over positions in the ball.
fn heard(scene: &Arc<Scene>, reflector: &Reflector) -> Result<[f64; 3]> {
    let settings = PropagationSettings {
        diffraction_order: 0,
        ..PropagationSettings::default()
    };
    let mut sum = [0.0; 3];
    let mut probe = Probe::new(scene, reflector.source, settings)?;
    for number in 0..POSITIONS {
        let [a, b, c] = [1, 2, 3].map(|k| f64::from(unit(mix(u64::from(number) << 2 | k))));
        let aside = BALL_M * c.cbrt() * direction([a, b]);
        for _ in 0..UPDATES {
            probe.update(reflector.listener + aside.as_vec3());
        }
        let energy = windows(&probe.set, scene.speed_of_sound_m_s());
        for (sum, energy) in sum.iter_mut().zip(energy) {
            *sum += energy / f64::from(POSITIONS);
        }
    }
    Ok(sum)
}

/// Energy of reflections and of the late reverb in each window.
fn windows(set: &PathSet, speed_m_s: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for path in set.paths.iter().filter(|path| path.order > 0) {
        let at_s = f64::from(path.length_m) / speed_m_s;
        let window = WINDOWS_S
            .iter()
            .position(|[from, to]| (*from..*to).contains(&at_s));
        if let Some(window) = window {
            sum[window] += f64::from(path.amplitude[BAND]).powi(2);
        }
    }
    for field in &set.late {
        for segment in late_segments(field, &set.late_groups) {
            let decay_time_s = set.late_groups[usize::from(segment.group)].decay_time_s[BAND];
            let start_s = f64::from(segment.start_s);
            for (sum, [from_s, to_s]) in sum.iter_mut().zip(WINDOWS_S) {
                let energy = f64::from(segment.energy_per_s[BAND]);
                *sum +=
                    rooms::decayed(energy, decay_time_s, from_s.max(start_s), to_s.max(start_s));
            }
        }
    }
    sum
}

/// Energy of reflected particles in the windows.
fn particles(scene: &Scene, reflector: &Reflector) -> [f64; 3] {
    let [source, listener] = [reflector.source, reflector.listener].map(|p| scene.to_local(p));
    let speed_m_s = scene.speed_of_sound_m_s();
    let volume_m3 = 4.0 / 3.0 * PI * BALL_M.powi(3);
    let longest_m = WINDOWS_S[2][1] * speed_m_s;
    let air = f64::from(scene.air_np_per_m()[BAND]);
    let mut result = [0.0; 3];
    let mut state = 1u64;
    let mut random = || {
        state = mix(state);
        f64::from(unit(state))
    };
    for _ in 0..PARTICLES {
        let mut energy = 4.0 * PI / PARTICLES as f64 / volume_m3;
        let (mut at, mut direction) = (source, direction([random(), random()]));
        let (mut path_m, mut last, mut is_reflected) = (0.0, NO_GROUP, false);
        while path_m < longest_m {
            let ray = Ray::new(at.as_vec3(), direction.as_vec3());
            let hit = scene.closest_hit(&ray, [last, NO_GROUP]);
            let leg_m = hit.map_or(longest_m, |hit| f64::from(hit.t));
            if is_reflected {
                let to = listener - at;
                let along_m = to.dot(direction);
                let aside_m2 = to.length_squared() - along_m * along_m;
                if aside_m2 < BALL_M * BALL_M {
                    let half_m = (BALL_M * BALL_M - aside_m2).sqrt();
                    let inside_m = (along_m + half_m).min(leg_m) - (along_m - half_m).max(0.0);
                    let at_s = (path_m + along_m) / speed_m_s;
                    let window = WINDOWS_S
                        .iter()
                        .position(|[from, to]| (*from..*to).contains(&at_s));
                    if let (Some(window), true) = (window, inside_m > 0.0) {
                        let dry = (-2.0 * air * (path_m + along_m)).exp();
                        result[window] += energy * inside_m * dry;
                    }
                }
            }
            let Some(hit) = hit else { break };
            path_m += leg_m;
            at += leg_m * direction;
            last = scene.surface_of(hit.triangle);
            let normal = scene.triangle_normal(hit.triangle).as_dvec3().normalize();
            let normal = normal * -1f64.copysign(normal.dot(direction));
            let cosine = -normal.dot(direction);
            energy *= f64::from(scene.reflectance(last).energy(cosine as f32)[BAND]);
            direction = match random() < f64::from(MATERIAL[1]) {
                true => (self::direction([random(), random()]) + normal).normalize_or(normal),
                false => (direction + 2.0 * cosine * normal).normalize(),
            };
            is_reflected = true;
        }
    }
    result
}

/// A direction, evenly over the sphere by two numbers from 0 to 1.
fn direction([a, b]: [f64; 2]) -> DVec3 {
    let z = 1.0 - 2.0 * a;
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * (TAU * b).cos(), r * (TAU * b).sin(), z)
}
