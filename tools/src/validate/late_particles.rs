//! An oracle for the late field: many particles in the rooms of its laws. [`super::late_reference`] keeps what they give.
//!
//! Particles fly between rectangles and triangles by arithmetic of their own in `f64`; only the reflection by angle is the
//! material model's definition, written again.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;

use foresound::acoustics::{BANDS, BandArray, Material};

use super::late_rooms::{Room, Triangle};

/// What a particle meets.
struct Met {
    leg_m: f64,
    /// Unit normal, of either side.
    normal: DVec3,
    material: usize,
}

impl Room {
    /// Energy over time and by direction at a ball about the listener, without the direct sound and without the air's absorption.
    /// All rooms of equal legs take the same work: where sound soon leaves there are more particles.
    pub(super) fn trace(&self, speed_m_s: f64) -> Echogram {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let next = AtomicU64::new(0);
        let fly = || {
            let shares = std::iter::from_fn(|| Some(next.fetch_add(1, Ordering::Relaxed)));
            let own = shares.take_while(|share| *share < SHARES);
            own.map(|share| (share, self.fly(speed_m_s, share, self.legs / SHARES)))
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
        let parts: Vec<_> = found.into_iter().map(|(_, part)| part).collect();
        self.sum(speed_m_s, &parts)
    }

    /// What the first particles alone give, over this many legs.
    pub(super) fn sample(&self, speed_m_s: f64, legs: u64) -> Echogram {
        self.sum(speed_m_s, &[self.fly(speed_m_s, 0, legs)])
    }

    /// The echogram of all particles, relative to the free field at 1 m.
    fn sum(&self, speed_m_s: f64, parts: &[(Echogram, u64)]) -> Echogram {
        let mut echogram = Echogram::new(self.late_from_s(speed_m_s));
        let particles: u64 = parts.iter().map(|(_, particles)| particles).sum();
        let gain = 4.0 * std::f64::consts::PI
            / particles as f64
            / (4.0 / 3.0 * std::f64::consts::PI * BALL_M.powi(3));
        for (part, _) in parts {
            for (sum, energy) in echogram.energy.iter_mut().zip(&part.energy) {
                sum[0] += gain * energy[0];
            }
            for (sum, energy) in echogram.towards.iter_mut().zip(part.towards) {
                *sum += gain * energy;
            }
        }
        echogram
    }

    /// One share of the particles, each of energy 1, over so many legs, and their number.
    fn fly(&self, speed_m_s: f64, share: u64, most_legs: u64) -> (Echogram, u64) {
        let source = self.source.as_dvec3();
        let listener = self.listener.as_dvec3();
        let mut echogram = Echogram::new(self.late_from_s(speed_m_s));
        let impedances: Vec<_> = self.materials.iter().map(impedance).collect();
        let mut random = Random(0x9e37_79b9_97f4_a7c5_u64.wrapping_mul(2 * share + 1));
        let (mut particles, mut legs) = (0, 0);
        while legs < most_legs {
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
                let leg_m = hit.as_ref().map_or(f64::INFINITY, |met| met.leg_m);
                if reflections > 0 {
                    let time = |path_m: f64| path_m / speed_m_s;
                    echogram.count(at, direction, leg_m, listener, path_m, energy, time);
                }
                let Some(met) = hit else { break };
                at += leg_m * direction;
                path_m += leg_m;
                reflections += 1;
                let material = &self.materials[met.material];
                let (zeta, residue) = impedances[met.material];
                let towards = direction.dot(met.normal);
                let z = zeta * towards.abs();
                let reflected = ((z - 1.0) / (z + 1.0) * residue).powi(2);
                let through = f64::from(material.transmission[0]);
                let mut side = -towards.signum() * met.normal;
                // Particles of the partition's law are split evenly; the energies are those of the wall.
                if through > 0.0 && random.unit() < 0.5 {
                    energy *= 2.0 * through;
                    floor *= 2.0 * through;
                    side = -side;
                    direction = random.lambert(side);
                } else {
                    energy *= reflected * if through > 0.0 { 2.0 } else { 1.0 };
                    if random.unit() < f64::from(material.scattering[0]) {
                        direction = random.lambert(side);
                    } else {
                        direction -= 2.0 * towards * met.normal;
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

    /// Time in seconds after emission from which on energy is late: 80 ms after the direct sound.
    pub(super) fn late_from_s(&self, speed_m_s: f64) -> f64 {
        f64::from(self.source.distance(self.listener)) / speed_m_s + LATE_S
    }

    /// What is ahead.
    fn next(&self, at: DVec3, direction: DVec3) -> Option<Met> {
        let mut nearest: Option<Met> = None;
        for panel in &self.panels {
            let axis = panel.axis;
            let leg_m = (panel.at - at[axis]) / direction[axis];
            let is_nearer = |met: &Met| leg_m < met.leg_m;
            if leg_m.is_nan() || leg_m <= 1e-9 || !nearest.as_ref().is_none_or(is_nearer) {
                continue;
            }
            let point = at + leg_m * direction;
            let is_within = |other: usize| {
                let [low, high] = panel.corners;
                point[other] >= low[other] - 1e-9 && point[other] <= high[other] + 1e-9
            };
            if is_within((axis + 1) % 3) && is_within((axis + 2) % 3) {
                nearest = Some(Met {
                    leg_m,
                    normal: DVec3::AXES[axis],
                    material: panel.material,
                });
            }
        }
        for triangle in &self.triangles {
            let met = triangle.meet(at, direction);
            let is_nearer =
                |met: &Met| nearest.as_ref().is_none_or(|other| met.leg_m < other.leg_m);
            nearest = met.filter(is_nearer).or(nearest);
        }
        nearest
    }
}

impl Triangle {
    fn meet(&self, at: DVec3, direction: DVec3) -> Option<Met> {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a).normalize();
        let leg_m = (a - at).dot(normal) / direction.dot(normal);
        let point = at + leg_m * direction;
        let is_within = [[a, b], [b, c], [c, a]]
            .iter()
            .all(|[from, to]| (to - from).cross(point - from).dot(normal) >= -1e-9);
        let is_ahead = leg_m.is_finite() && leg_m > 1e-9;
        (is_ahead && is_within).then_some(Met {
            leg_m,
            normal,
            material: self.material,
        })
    }
}

/// Real specific impedance and residual factor, the material model's definition.
fn impedance(material: &Material) -> (f64, f64) {
    foresound::acoustics::material::impedance_of_absorption(f64::from(material.absorption[0]))
}

/// Shares in which the particles fly.
const SHARES: u64 = 16;

/// Energy relative to a particle's first one at which it ends, unless it survives in place of others, and the chance of that.
const ROULETTE: f64 = 1e-5;
const ROULETTE_SURVIVAL: f64 = 0.1;

/// Time in seconds after the direct sound from which on energy is late.
pub(super) const LATE_S: f64 = 0.08;

/// Radius of the ball that particles are counted in.
pub(super) const BALL_M: f64 = 0.5;

/// Time steps of an echogram and their length: 60 dB and more in the room that decays most slowly.
const STEPS: usize = 1000;
pub(super) const STEP_S: f64 = 0.01;
const LENGTH_S: f64 = STEPS as f64 * STEP_S;

/// Energy relative to the free field at 1 m over time.
#[derive(Debug, Clone)]
pub(super) struct Echogram {
    /// By time step and band.
    pub(super) energy: Vec<[f64; BANDS]>,
    /// Time in seconds after emission from which on energy is late.
    late_from_s: f64,
    /// Late energy without air from −x, x, −y, y, −z, z by the squares of the cosines.
    pub(super) towards: [f64; 6],
}

impl Echogram {
    pub(super) fn new(late_from_s: f64) -> Self {
        Self {
            late_from_s,
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
            if at_s > self.late_from_s {
                for (sum, share) in self.towards.iter_mut().zip(axis_shares(-direction)) {
                    *sum += energy * inside_m * share;
                }
            }
        }
    }

    /// Spreads the first band to all, with the air's absorption.
    pub(super) fn damp(&mut self, air_np_per_m: &BandArray, speed_m_s: f64) {
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

    /// Level in dB of the late energy.
    pub(super) fn late_db(&self, band: usize) -> f64 {
        10.0 * self.early_and_late(band)[1].max(1e-30).log10()
    }

    /// Clarity in dB, the direct sound included.
    pub(super) fn clarity_db(&self, band: usize, direct: f64) -> f64 {
        let [early, late] = self.early_and_late(band);
        10.0 * ((early + direct) / late.max(1e-30)).log10()
    }

    /// Energy before and after the time from which on it is late; that of the step around it is even.
    fn early_and_late(&self, band: usize) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (step, energy) in self.energy.iter().enumerate() {
            let early = (self.late_from_s / STEP_S - step as f64).clamp(0.0, 1.0);
            sums[0] += early * energy[band];
            sums[1] += (1.0 - early) * energy[band];
        }
        sums
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

    /// A direction out of two numbers in a disc \[MARSAGLIA72\]: without sines, whose last bits are the machine's, particles fly
    /// alike everywhere.
    fn sphere(&mut self) -> DVec3 {
        loop {
            let [x, y] = [self.unit(), self.unit()].map(|unit| 2.0 * unit - 1.0);
            let square = x * x + y * y;
            if square < 1.0 {
                let wide = 2.0 * (1.0 - square).sqrt();
                return DVec3::new(wide * x, wide * y, 1.0 - 2.0 * square);
            }
        }
    }

    /// A direction about a unit normal by Lambert's law.
    fn lambert(&mut self, normal: DVec3) -> DVec3 {
        let direction = (self.sphere() + normal).normalize_or_zero();
        if direction.dot(normal) > 0.0 {
            direction
        } else {
            self.lambert(normal)
        }
    }
}
