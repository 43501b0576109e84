//! Rooms of the late field's laws, and an oracle for them: many particles in the same boxes and materials.
//!
//! A room is made of rectangular boxes: hollow ones are air, solid ones block. Particles fly between the faces by arithmetic
//! of their own in `f64`; only the reflection by angle is the material model's definition, written again.

use glam::{DVec3, Vec3};

use foresound::acoustics::{BANDS, BandArray, Material};
use foresound::error::Result;
use foresound::scene::{Scene, TriangleMesh};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::rooms;

/// A rectangle across an axis: material, position along the axis, and its two corners in the two other axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Panel {
    pub(super) axis: usize,
    pub(super) at: f64,
    /// Lower and upper corner; the coordinate of the axis has no meaning.
    pub(super) corners: [DVec3; 2],
    pub(super) material: usize,
}

/// One room of the laws.
#[derive(Debug, Clone)]
pub(super) struct Room {
    pub(super) name: &'static str,
    pub(super) panels: Vec<Panel>,
    pub(super) materials: Vec<Material>,
    pub(super) source: Vec3,
    pub(super) listener: Vec3,
}

/// A material whose absorption is the same in all bands.
fn plain(name: &str, absorption: f32, scattering: f32, loss_db: Option<f32>) -> Material {
    Material {
        name: name.to_owned(),
        absorption: [absorption; BANDS],
        scattering: [scattering; BANDS],
        transmission: [loss_db.map_or(0.0, |loss| 10f32.powf(-0.1 * loss)); BANDS],
    }
}

/// The six faces of a box; `materials` of x = low, x = high, y = low, …; `None` leaves a face open.
fn box_faces(low: [f64; 3], high: [f64; 3], materials: [Option<usize>; 6]) -> Vec<Panel> {
    let corners = [DVec3::from(low), DVec3::from(high)];
    let face = |(number, material): (usize, Option<usize>)| {
        let axis = number / 2;
        material.map(|material| Panel {
            axis,
            at: corners[number % 2][axis],
            corners,
            material,
        })
    };
    materials.into_iter().enumerate().filter_map(face).collect()
}

/// A wall across the x axis with a door from the floor: three panels.
fn wall_with_door(x: f64, size: [f64; 2], door: [f64; 3], material: usize) -> Vec<Panel> {
    let [height, depth] = size;
    let [door_low, door_high, door_height] = door;
    let panel = |y: [f64; 2], z: [f64; 2]| Panel {
        axis: 0,
        at: x,
        corners: [DVec3::new(x, y[0], z[0]), DVec3::new(x, y[1], z[1])],
        material,
    };
    vec![
        panel([0.0, height], [0.0, door_low]),
        panel([0.0, height], [door_high, depth]),
        panel([door_height, height], [door_low, door_high]),
    ]
}

fn single(
    name: &'static str,
    size: [f64; 3],
    materials: Vec<Material>,
    faces: [Option<usize>; 6],
    [source, listener]: [[f32; 3]; 2],
) -> Room {
    Room {
        name,
        panels: box_faces([0.0; 3], size, faces),
        materials,
        source: source.into(),
        listener: listener.into(),
    }
}

/// Live and dead room with a door of 0.9 m × 2.1 m between them.
fn coupled(name: &'static str, source: [f32; 3], listener: [f32; 3]) -> Room {
    let live = box_faces(
        [0.0; 3],
        [8.0, 3.5, 6.0],
        [Some(0), None, Some(0), Some(0), Some(0), Some(0)],
    );
    let dead = box_faces(
        [8.0, 0.0, 0.0],
        [12.0, 3.5, 6.0],
        [None, Some(1), Some(1), Some(1), Some(1), Some(1)],
    );
    let mut panels = live;
    panels.extend(dead);
    panels.extend(wall_with_door(8.0, [3.5, 6.0], [2.0, 2.9, 2.1], 2));
    Room {
        name,
        panels,
        materials: vec![
            plain("live", 0.04, 0.3, None),
            plain("dead", 0.6, 0.3, None),
            plain("between", 0.1, 0.3, None),
        ],
        source: source.into(),
        listener: listener.into(),
    }
}

/// Two rooms of 5 m × 4 m × 3 m beside each other, with a partition and no opening.
fn partition(name: &'static str, loss_db: f32) -> Room {
    let mut panels = box_faces([0.0; 3], [10.0, 3.0, 4.0], [Some(0); 6]);
    panels.push(Panel {
        axis: 0,
        at: 5.0,
        corners: [DVec3::new(5.0, 0.0, 0.0), DVec3::new(5.0, 3.0, 4.0)],
        material: 1,
    });
    Room {
        name,
        panels,
        materials: vec![
            plain("wall", 0.15, 0.4, None),
            plain("partition", 0.15, 0.4, Some(loss_db)),
        ],
        source: Vec3::new(1.3, 1.4, 1.6),
        listener: Vec3::new(7.9, 1.5, 2.3),
    }
}

/// All rooms.
pub(super) fn all() -> Vec<Room> {
    let walls = |absorption, scattering| vec![plain("wall", absorption, scattering, None)];
    let ceiling = |scattering| {
        vec![
            plain("wall", 0.1, scattering, None),
            plain("ceiling", 0.8, scattering, None),
        ]
    };
    let below = [Some(0), Some(0), Some(0), Some(1), Some(0), Some(0)];
    let open = [Some(0), Some(0), Some(0), None, Some(0), Some(0)];
    let street = [None, None, Some(0), None, Some(0), Some(0)];
    let closed = [Some(0); 6];
    vec![
        single(
            "cube",
            [5.0; 3],
            walls(0.2, 0.3),
            closed,
            [[1.2, 1.5, 1.7], [3.6, 1.6, 3.1]],
        ),
        single(
            "flat room",
            [20.0, 2.8, 16.0],
            ceiling(0.2),
            below,
            [[5.0, 1.5, 4.5], [13.5, 1.6, 10.5]],
        ),
        single(
            "office",
            [7.0, 2.8, 5.0],
            ceiling(0.1),
            below,
            [[1.6, 1.2, 1.5], [5.2, 1.2, 3.6]],
        ),
        single(
            "corridor",
            [30.0, 2.8, 2.4],
            walls(0.1, 0.3),
            closed,
            [[4.0, 1.5, 1.1], [19.0, 1.6, 1.3]],
        ),
        single(
            "courtyard",
            [15.0, 10.0, 12.0],
            walls(0.06, 0.4),
            open,
            [[4.0, 1.5, 4.0], [10.5, 1.6, 8.0]],
        ),
        single(
            "street",
            [60.0, 12.0, 10.0],
            walls(0.06, 0.4),
            street,
            [[20.0, 1.5, 4.0], [38.0, 1.6, 6.0]],
        ),
        single(
            "hall",
            [30.0, 12.0, 20.0],
            vec![
                plain("wall", 0.1, 0.6, None),
                plain("seats", 0.7, 0.6, None),
            ],
            [Some(0), Some(0), Some(1), Some(0), Some(0), Some(0)],
            [[6.0, 1.8, 9.0], [21.0, 1.4, 12.0]],
        ),
        coupled(
            "source live, listener live",
            [2.0, 1.5, 2.0],
            [5.5, 1.6, 4.4],
        ),
        coupled(
            "source live, listener dead",
            [2.0, 1.5, 2.0],
            [10.2, 1.6, 4.1],
        ),
        coupled(
            "source dead, listener live",
            [10.2, 1.5, 4.1],
            [2.0, 1.6, 2.0],
        ),
        coupled(
            "source dead, listener dead",
            [9.3, 1.5, 1.2],
            [10.8, 1.6, 4.6],
        ),
        partition("partition of 20 dB", 20.0),
        partition("partition of 35 dB", 35.0),
    ]
}

impl Room {
    /// The room as a scene.
    pub(super) fn scene(&self) -> Result<Arc<Scene>> {
        let mut mesh = TriangleMesh {
            material_names: self.materials.iter().map(|m| m.name.clone()).collect(),
            ..TriangleMesh::default()
        };
        for panel in &self.panels {
            let first = mesh.vertices.len() as u32;
            let (u, v) = ((panel.axis + 1) % 3, (panel.axis + 2) % 3);
            for (a, b) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                let mut corner = DVec3::ZERO;
                corner[panel.axis] = panel.at;
                corner[u] = panel.corners[a][u];
                corner[v] = panel.corners[b][v];
                mesh.vertices.push(corner.as_vec3());
            }
            for triangle in [[0, 1, 2], [0, 2, 3]] {
                mesh.triangles.push(triangle.map(|k: u32| first + k));
                mesh.triangle_materials.push(panel.material as u32);
            }
        }
        rooms::commit(&mesh, self.materials.clone())
    }

    /// Energy over time and by direction at a ball about the listener, without the direct sound. All rooms take the same work:
    /// where sound soon leaves there are more particles.
    pub(super) fn trace(&self, air_np_per_m: &BandArray, speed_m_s: f64) -> Echogram {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let next = AtomicU64::new(0);
        let fly = || {
            let shares = std::iter::from_fn(|| Some(next.fetch_add(1, Ordering::Relaxed)));
            let own = shares.take_while(|share| *share < SHARES);
            own.map(|share| (share, self.fly(speed_m_s, share)))
                .collect::<Vec<_>>()
        };
        let mut found: Vec<_> = std::thread::scope(|scope| {
            let others: Vec<_> = (1..threads).map(|_| scope.spawn(fly)).collect();
            let joined = others
                .into_iter()
                .flat_map(|other| other.join().expect("flies"));
            fly().into_iter().chain(joined).collect()
        });
        // The order of the sum does not depend on the threads.
        found.sort_by_key(|(share, _)| *share);
        let mut echogram = Echogram::new();
        let particles: u64 = found.iter().map(|(_, (_, particles))| particles).sum();
        let gain = 4.0 * std::f64::consts::PI
            / particles as f64
            / (4.0 / 3.0 * std::f64::consts::PI * BALL_M.powi(3));
        for (_, (part, _)) in &found {
            for (sum, energy) in echogram.energy.iter_mut().zip(&part.energy) {
                sum[0] += gain * energy[0];
            }
            for (sum, energy) in echogram.towards.iter_mut().zip(part.towards) {
                *sum += gain * energy;
            }
        }
        echogram.damp(air_np_per_m, speed_m_s);
        echogram
    }

    /// One share of the particles, each of energy 1, and their number.
    fn fly(&self, speed_m_s: f64, share: u64) -> (Echogram, u64) {
        let source = self.source.as_dvec3();
        let listener = self.listener.as_dvec3();
        let mut echogram = Echogram::new();
        let impedances: Vec<_> = self.materials.iter().map(impedance).collect();
        let mut random = Random(0x9e37_79b9_97f4_a7c5_u64.wrapping_mul(2 * share + 1));
        let (mut particles, mut legs) = (0, 0);
        while legs < LEGS / SHARES {
            particles += 1;
            let mut at = source;
            let mut direction = random.sphere();
            let mut energy = 1.0;
            let mut floor = ROULETTE;
            let mut path_m = 0.0;
            let mut reflections = 0;
            while path_m < LENGTH_S * speed_m_s {
                legs += 1;
                let hit = self.next(at, direction);
                let leg_m = hit.map_or(f64::INFINITY, |(leg_m, _)| leg_m);
                if reflections > 0 {
                    let time = |path_m: f64| path_m / speed_m_s;
                    echogram.count(at, direction, leg_m, listener, path_m, energy, time);
                }
                let Some((leg_m, panel)) = hit else { break };
                at += leg_m * direction;
                path_m += leg_m;
                reflections += 1;
                let axis = panel.axis;
                let material = &self.materials[panel.material];
                let (zeta, residue) = impedances[panel.material];
                let z = zeta * direction[axis].abs();
                let reflected = ((z - 1.0) / (z + 1.0) * residue).powi(2);
                let through = f64::from(material.transmission[0]);
                let mut side = -direction[axis].signum();
                // Particles of the partition's law are split evenly; the energies are those of the wall.
                if through > 0.0 && random.unit() < 0.5 {
                    energy *= 2.0 * through;
                    floor *= 2.0 * through;
                    side = -side;
                    direction = random.lambert(axis, side);
                } else {
                    energy *= reflected * if through > 0.0 { 2.0 } else { 1.0 };
                    if random.unit() < f64::from(material.scattering[0]) {
                        direction = random.lambert(axis, side);
                    } else {
                        direction[axis] = -direction[axis];
                    }
                }
                if energy < floor {
                    if random.unit() >= ROULETTE_SURVIVAL {
                        break;
                    }
                    energy /= ROULETTE_SURVIVAL;
                    floor *= ROULETTE;
                }
            }
        }
        (echogram, particles)
    }

    /// The nearest panel ahead and the distance to it.
    fn next(&self, at: DVec3, direction: DVec3) -> Option<(f64, &Panel)> {
        let mut nearest: Option<(f64, &Panel)> = None;
        for panel in &self.panels {
            let axis = panel.axis;
            let leg_m = (panel.at - at[axis]) / direction[axis];
            if leg_m.is_nan() || leg_m <= 1e-9 || nearest.is_some_and(|(least, _)| leg_m >= least) {
                continue;
            }
            let point = at + leg_m * direction;
            let is_within = |other: usize| {
                let [low, high] = panel.corners;
                point[other] >= low[other] - 1e-9 && point[other] <= high[other] + 1e-9
            };
            if is_within((axis + 1) % 3) && is_within((axis + 2) % 3) {
                nearest = Some((leg_m, panel));
            }
        }
        nearest
    }
}

/// Real specific impedance and residual factor, the material model's definition.
fn impedance(material: &Material) -> (f64, f64) {
    foresound::acoustics::material::impedance_of_absorption(f64::from(material.absorption[0]))
}

/// Legs of the particles of a room, and shares in which they fly: the scatter over seeds is below a fifth of the laws' bounds.
const LEGS: u64 = 150_000_000;
const SHARES: u64 = 16;

/// Energy relative to a particle's first one at which it ends, unless it survives in place of others, and the chance of that.
const ROULETTE: f64 = 1e-5;
const ROULETTE_SURVIVAL: f64 = 0.1;

/// Radius of the ball that particles are counted in.
const BALL_M: f64 = 0.5;

/// Time steps of an echogram and their length.
pub(super) const STEPS: usize = 400;
pub(super) const STEP_S: f64 = 0.01;
const LENGTH_S: f64 = STEPS as f64 * STEP_S;

/// Energy relative to the free field at 1 m over time.
#[derive(Debug, Clone)]
pub(super) struct Echogram {
    /// By time step and band.
    pub(super) energy: Vec<[f64; BANDS]>,
    /// Late energy (after 80 ms) without air from −x, x, −y, y, −z, z by the squares of the cosines.
    pub(super) towards: [f64; 6],
}

impl Echogram {
    pub(super) fn new() -> Self {
        Self {
            energy: vec![[0.0; BANDS]; STEPS],
            towards: [0.0; 6],
        }
    }

    /// Counts a flight from `at` over `leg_m`.
    #[expect(clippy::too_many_arguments, reason = "a flight, a ball and a clock")]
    fn count(
        &mut self,
        at: DVec3,
        direction: DVec3,
        leg_m: f64,
        listener: DVec3,
        path_m: f64,
        energy: f64,
        time: impl Fn(f64) -> f64,
    ) {
        let to = listener - at;
        let along = to.dot(direction);
        let aside = to.length_squared() - along * along;
        if aside >= BALL_M * BALL_M {
            return;
        }
        let half = (BALL_M * BALL_M - aside).sqrt();
        let inside_m = (along + half).min(leg_m) - (along - half).max(0.0);
        if inside_m <= 0.0 {
            return;
        }
        let at_s = time(path_m + along.max(0.0));
        if let Some(step) = self.energy.get_mut((at_s / STEP_S) as usize) {
            step[0] += energy * inside_m;
            if at_s > 0.08 {
                for (sum, share) in self.towards.iter_mut().zip(axis_shares(-direction)) {
                    *sum += energy * inside_m * share;
                }
            }
        }
    }

    /// Spreads the first band to all, with the air's absorption.
    fn damp(&mut self, air_np_per_m: &BandArray, speed_m_s: f64) {
        for (step, energy) in self.energy.iter_mut().enumerate() {
            let path_m = (step as f64 + 0.5) * STEP_S * speed_m_s;
            let plain = energy[0];
            for b in 0..BANDS {
                energy[b] = plain * (-2.0 * f64::from(air_np_per_m[b]) * path_m).exp();
            }
        }
    }

    /// Decay time in seconds from the line between two levels of the decay curve below its start, in dB.
    pub(super) fn decay_time_s(&self, band: usize, top_db: f64, bottom_db: f64) -> Option<f64> {
        let mut left: f64 = self.energy.iter().map(|e| e[band]).sum();
        let whole = left;
        let (mut n, mut t, mut tt, mut y, mut ty) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let mut is_reached = false;
        for (step, energy) in self.energy.iter().enumerate() {
            let level_db = 10.0 * (left / whole).max(1e-30).log10();
            if level_db <= top_db && level_db >= bottom_db {
                let at = step as f64 * STEP_S;
                n += 1.0;
                t += at;
                tt += at * at;
                y += level_db;
                ty += at * level_db;
            }
            is_reached |= level_db < bottom_db;
            left -= energy[band];
        }
        let slope = (n * ty - t * y) / (n * tt - t * t);
        (is_reached && n > 3.0 && slope < 0.0).then_some(-60.0 / slope)
    }

    /// Level in dB of the energy after 80 ms.
    pub(super) fn late_db(&self, band: usize) -> f64 {
        let late = self.energy.iter().skip((0.08 / STEP_S) as usize);
        10.0 * late.map(|e| e[band]).sum::<f64>().max(1e-30).log10()
    }

    /// Clarity in dB, the direct sound included.
    pub(super) fn clarity_db(&self, band: usize, direct: f64) -> f64 {
        let early = self.energy.iter().take((0.08 / STEP_S) as usize);
        let early = early.map(|e| e[band]).sum::<f64>() + direct;
        10.0 * early.log10() - self.late_db(band)
    }
}

/// Shares of a direction towards −x, x, −y, y, −z, z: squares of the cosines.
pub(super) fn axis_shares(towards: DVec3) -> [f64; 6] {
    std::array::from_fn(|number| {
        let sign = if number % 2 == 0 { -1.0 } else { 1.0 };
        (sign * towards[number / 2]).max(0.0).powi(2)
    })
}

/// Marsaglia's xorshift64*.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn sphere(&mut self) -> DVec3 {
        let z = 1.0 - 2.0 * self.unit();
        let r = (1.0 - z * z).sqrt();
        let (sin, cos) = (std::f64::consts::TAU * self.unit()).sin_cos();
        DVec3::new(r * cos, r * sin, z)
    }

    /// A direction about an axis by Lambert's law.
    fn lambert(&mut self, axis: usize, side: f64) -> DVec3 {
        let mut sum = self.sphere();
        sum[axis] += side;
        let direction = sum.normalize_or_zero();
        if direction[axis] * side > 0.0 {
            direction
        } else {
            self.lambert(axis, side)
        }
    }
}
