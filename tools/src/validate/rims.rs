//! Law *rims*: energy of reflections of orders 2 to 4 in six rooms against image sources. A reflection is weighted by the
//! exact diffraction at the edges where its surface ends; corners where another surface continues it and the winding of the
//! triangles have no effect.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::recall::OracleRoom;
use super::recall_rooms::{self, RecallRoom, Rectangles};
use super::rooms::{commit, even};
use super::{Case, Row};
use foresound::acoustics::BANDS;
use foresound::acoustics::bands::CENTRES_HZ;
use foresound::error::Result;
use foresound::scene::{Scene, TriangleMesh, procedural};

/// Source and listener pairs in each room.
const PAIRS: u64 = 12;

/// Updates before the paths are counted.
const UPDATES: u32 = 16;

/// Size of the rectangular rooms in metres.
const SIZE: Vec3 = Vec3::new(8.0, 3.0, 6.0);

/// Corners of the open doorway in the wall x = 0, by z and height in metres.
const DOOR: [f32; 3] = [2.1, 3.1, 2.1];

/// A room, and the segments where reflecting surfaces end on the air's side.
struct Room {
    room: RecallRoom,
    rims: Vec<[DVec3; 2]>,
}

/// All figures of the law.
pub(super) fn rows() -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for room in rooms()? {
        let mut case = Case::new(format!("rims: {}", room.room.name));
        let (ours, exact) = energies(&room)?;
        let total = |energy: &[f64; BANDS]| energy.iter().sum::<f64>();
        let off_db = level_db(total(&ours), total(&exact)).abs();
        // Nothing fades in a room without rims; the rest is rounding.
        let bound_db = if room.rims.is_empty() { 0.001 } else { 0.2 };
        case.at_most("energy of orders 2 to 4", off_db, bound_db, "dB");
        rows.extend(case.rows);
    }
    Ok(rows)
}

fn rooms() -> Result<Vec<Room>> {
    let rigid = |mesh: &TriangleMesh| commit(mesh, vec![even("wall", 0.0, 0.0)]);
    let shoebox = |name, turn: &dyn Fn(usize) -> bool| -> Result<Room> {
        let mut mesh = procedural::shoebox(SIZE, "wall");
        for (index, triangle) in mesh.triangles.iter_mut().enumerate() {
            if turn(index) {
                triangle.swap(0, 1);
            }
        }
        Ok(closed(name, rigid(&mesh)?))
    };
    let mut separate = Rectangles::default();
    for axis in 0..3 {
        // Walls that pass through each other by two centimetres.
        let (mut low, mut high) = (Vec3::splat(-0.02), SIZE + 0.02);
        for at in [0.0, SIZE[axis]] {
            (low[axis], high[axis]) = (at, at);
            separate.add(low.into(), high.into());
        }
    }
    let l_room = recall_rooms::l_room_of(even("wall", 0.0, 0.0))?;
    let corner = [0.0, 3.0].map(|y| DVec3::new(4.0, y, 4.0));
    Ok(vec![
        shoebox("shoebox wound inward", &|_| false)?,
        shoebox("shoebox wound outward", &|_| true)?,
        shoebox("shoebox wound both ways", &|index| index % 3 == 0)?,
        closed("shoebox of separate walls", rigid(&separate.mesh)?),
        Room {
            room: l_room,
            rims: vec![corner],
        },
        doorway(rigid(&doorway_mesh())?),
    ])
}

/// A rectangular room without rims.
fn closed(name: &'static str, scene: Arc<Scene>) -> Room {
    Room {
        room: RecallRoom {
            name,
            scene,
            air: vec![[Vec3::ZERO, SIZE]],
            solid: Vec::new(),
            bounds: [0.0; 2],
        },
        rims: Vec::new(),
    }
}

fn doorway_mesh() -> TriangleMesh {
    let mut b = Rectangles::default();
    let [x, y, z] = SIZE.to_array();
    b.add([0.0; 3], [x, 0.0, z]);
    b.add([0.0, y, 0.0], [x, y, z]);
    b.add([0.0; 3], [x, y, 0.0]);
    b.add([0.0, 0.0, z], [x, y, z]);
    b.add([x, 0.0, 0.0], [x, y, z]);
    let [near, far, top] = DOOR;
    b.add([0.0; 3], [0.0, y, near]);
    b.add([0.0, 0.0, far], [0.0, y, z]);
    b.add([0.0, top, near], [0.0, y, far]);
    b.mesh
}

fn doorway(scene: Arc<Scene>) -> Room {
    let [near, far, top] = DOOR.map(f64::from);
    let at = |y: f64, z: f64| DVec3::new(0.0, y, z);
    let mut room = closed("shoebox with an open doorway", scene);
    room.rims = vec![
        [at(0.0, near), at(top, near)],
        [at(0.0, far), at(top, far)],
        [at(top, near), at(top, far)],
        // The floor ends below the door.
        [at(0.0, near), at(0.0, far)],
    ];
    room
}

/// Energy of orders 2 to 4 of all pairs in each band: of propagation, and of the weighted image sources.
fn energies(room: &Room) -> Result<([f64; BANDS], [f64; BANDS])> {
    let Room { room, rims } = room;
    let oracle = OracleRoom::of(room);
    let (mut ours, mut exact) = ([0.0; BANDS], [0.0; BANDS]);
    let first = room.probe()?;
    for number in 0..PAIRS {
        let (source, listener) = (room.position(2 * number), room.position(2 * number + 1));
        let mut probe = first.beside(source)?;
        for _ in 0..UPDATES {
            probe.update(listener);
        }
        for path in &probe.set.paths {
            if path.order > 1 && path.diffraction_order == 0 {
                for (sum, amplitude) in ours.iter_mut().zip(path.amplitude) {
                    *sum += f64::from(amplitude).powi(2);
                }
            }
        }
        for path in oracle.paths(source, listener) {
            if path.planes.len() > 1 {
                for (b, sum) in exact.iter_mut().enumerate() {
                    let wavelength_m = room.scene.speed_of_sound_m_s() / CENTRES_HZ[b];
                    let air = f64::from(room.scene.air_np_per_m()[b]) * path.length;
                    let share = share(&path.stops, rims, wavelength_m);
                    *sum += ((-air).exp() / path.length).powi(2) * share;
                }
            }
        }
    }
    Ok((ours, exact))
}

/// Share of a path's energy that the edges at its reflections leave, by Fresnel's integral for each.
fn share(stops: &[DVec3], rims: &[[DVec3; 2]], wavelength_m: f64) -> f64 {
    let legs: Vec<f64> = stops
        .windows(2)
        .map(|leg| leg[0].distance(leg[1]))
        .collect();
    let length_m: f64 = legs.iter().sum();
    let mut share = 1.0;
    for at in 1..stops.len() - 1 {
        let point = stops[at];
        let [before, after] = [stops[at - 1], stops[at + 1]].map(|p| (p - point).normalize());
        let normal = (before + after).normalize();
        // The whole path, unfolded at this reflection.
        let from = point + before * legs[..at].iter().sum::<f64>();
        let to = point + after * legs[at..].iter().sum::<f64>();
        for rim in rims {
            let is_in_plane = rim.iter().all(|p| (*p - point).dot(normal).abs() < 1e-3);
            let over_m = over_m(from, to, rim).filter(|_| is_in_plane);
            if let Some(over_m) = over_m {
                let detour_m = (over_m - length_m).max(0.0);
                share *= lit_energy(2.0 * (detour_m / wavelength_m).sqrt());
            }
        }
    }
    share
}

/// Length of the shortest path over the line of a segment, if it crosses within the ends.
fn over_m(from: DVec3, to: DVec3, rim: &[DVec3; 2]) -> Option<f64> {
    let along = (rim[1] - rim[0]).normalize();
    let place = |p: DVec3| {
        let out = p - rim[0];
        (out.dot(along), (out - out.dot(along) * along).length())
    };
    let ((a, near), (b, far)) = (place(from), place(to));
    let apex = a + (b - a) * near / (near + far);
    let is_within = (0.0..=rim[0].distance(rim[1])).contains(&apex);
    is_within.then(|| (near + far).hypot(b - a))
}

/// Energy on the lit side of a straight edge at Fresnel's parameter ν: |(1 + j)/2 ∫ e^(−jπt²/2) dt|² from −ν on.
fn lit_energy(nu: f64) -> f64 {
    if nu > 40.0 {
        return 1.0;
    }
    let steps = 400 + (nu * nu * 40.0) as u32;
    let width = nu / f64::from(steps);
    let (mut c, mut s) = (0.5, 0.5);
    for i in 0..steps {
        let phase = 0.5 * PI * ((f64::from(i) + 0.5) * width).powi(2);
        c += phase.cos() * width;
        s += phase.sin() * width;
    }
    0.5 * (c * c + s * s)
}

fn level_db(ours: f64, exact: f64) -> f64 {
    10.0 * (ours / exact).log10()
}
