//! What the late reverb needs: decay, level and start of the diffuse tail, estimated from source rays.
//!
//! Source: [KUTTRUFF] 5.1 (Eyring's decay from the mean free path and the mean of −ln(1 − α)), with air and with the
//! share of rays that leave the scene as a further loss. Sixteen updates' estimates are averaged by the number of their
//! ray rotation, so that the mean of a scene at rest does not depend on when it is looked at.

use glam::{DVec3, Mat3, Vec3};

use super::path::{LateSource, MAX_ORDER};
use super::sampling::{ROTATIONS, fibonacci_direction, lambert_direction, mix, unit};
use super::sequence::Sequence;
use super::sequence_set::SequenceSet;
use crate::acoustics::{BANDS, BandArray};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::{Scene, SourceId};

/// Band whose scattering coefficient decides whether a ray bounces diffusely: the one around 1 kHz.
const SCATTERING_BAND: usize = 4;

/// Largest absorption that enters a logarithm; a ray that meets more is as good as gone.
const MOST_ABSORPTION: f32 = 0.999;

/// Mean free paths after which the tail takes over: discrete paths carry what has bounced up to [`MAX_ORDER`] times.
const START_MEAN_FREE_PATHS: f64 = MAX_ORDER as f64;

/// Longest decay that is told, in seconds: beyond lies a numerical accident, not a room.
const LONGEST_DECAY_S: f64 = 30.0;

/// Sums over the rays of one update.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// Cubes of the first legs' lengths, and their number: the volume that the source sees.
    first_cubed_m3: f64,
    first_legs: u32,
    /// Lengths of the later legs, and their number: the mean free path.
    legs_m: f64,
    legs: u32,
    /// −ln(1 − α) over all bounces.
    loss: [f64; BANDS],
    bounces: u32,
    /// Legs that left the scene.
    escapes: u32,
}

/// Running estimate of one source's late field.
#[derive(Debug, Clone)]
pub struct LateEstimator {
    slots: [Option<Sums>; ROTATIONS as usize],
}

impl Default for LateEstimator {
    fn default() -> Self {
        Self {
            slots: [None; ROTATIONS as usize],
        }
    }
}

/// Where source rays start and how many there are.
#[derive(Debug, Clone, Copy)]
pub struct SourceRays {
    /// The source, local coordinates.
    pub origin: DVec3,
    /// Rotation of the lattice.
    pub turn: Mat3,
    /// Number of the rotation, `update % ROTATIONS`.
    pub rotation: u64,
    /// Number of rays.
    pub count: u32,
    /// Bounces of each.
    pub depth: usize,
    /// Seed of the diffuse bounces.
    pub seed: u64,
}

impl LateEstimator {
    /// Traces source rays with diffuse bounces, takes their sums in, and adds the sequences of their specular
    /// beginnings to `found`. Adds the rays it cast to `rays`.
    pub fn trace(
        &mut self,
        scene: &Scene,
        from: &SourceRays,
        found: &mut SequenceSet,
        rays: &mut u64,
    ) {
        let mut sums = Sums::default();
        let farthest_m = f64::from(scene.diagonal_m());
        for index in 0..from.count {
            let mut ray = Ray::new(
                from.origin.as_vec3(),
                from.turn * fibonacci_direction(index, from.count),
            );
            let mut last = NO_GROUP;
            let mut surfaces = [0; MAX_ORDER];
            let mut specular = true;
            for step in 0..from.depth {
                *rays += 1;
                let hit = scene.bvh().closest_hit(&ray, [last, NO_GROUP]);
                let leg_m = hit.map_or(farthest_m, |h| f64::from(h.t));
                if step == 0 {
                    sums.first_cubed_m3 += leg_m * leg_m * leg_m;
                    sums.first_legs += 1;
                }
                let Some(hit) = hit else {
                    sums.escapes += 1;
                    break;
                };
                if step > 0 {
                    sums.legs_m += leg_m;
                    sums.legs += 1;
                }
                let material = scene.material(hit.group);
                for b in 0..BANDS {
                    let absorption = material.absorption[b].min(MOST_ABSORPTION);
                    sums.loss[b] -= f64::from(1.0 - absorption).ln();
                }
                sums.bounces += 1;
                specular &= scene.is_panel(hit.triangle);
                if specular && step < MAX_ORDER {
                    surfaces[step] = hit.group;
                    found.insert(Sequence::canonical(scene, &surfaces[..=step]));
                }
                let draw = |k: u64| {
                    let ray_number =
                        from.rotation << 32 | u64::from(index) << 8 | (step as u64) << 2;
                    unit(mix(from.seed ^ mix(ray_number | k)))
                };
                let normal = facing(scene.surface(hit.group).normal.as_vec3(), ray.direction);
                let origin = ray.at(hit.t);
                let onward = if draw(0) < material.scattering[SCATTERING_BAND] {
                    specular = false;
                    lambert_direction(normal, draw(1), draw(2))
                } else {
                    ray.direction - 2.0 * normal.dot(ray.direction) * normal
                };
                ray = Ray::new(origin, onward.normalize_or(normal));
                last = hit.group;
            }
        }
        self.slots[(from.rotation % ROTATIONS) as usize] = Some(sums);
    }

    /// The estimate over the last sixteen updates.
    pub fn estimate(&self, scene: &Scene, source: SourceId) -> LateSource {
        let mut total = Sums::default();
        for sums in self.slots.iter().flatten() {
            total.first_cubed_m3 += sums.first_cubed_m3;
            total.first_legs += sums.first_legs;
            total.legs_m += sums.legs_m;
            total.legs += sums.legs;
            for b in 0..BANDS {
                total.loss[b] += sums.loss[b];
            }
            total.bounces += sums.bounces;
            total.escapes += sums.escapes;
        }
        total.estimate(scene, source)
    }
}

impl Sums {
    fn estimate(&self, scene: &Scene, source: SourceId) -> LateSource {
        let silent = LateSource {
            source,
            energy_per_s: [0.0; BANDS],
            decay_time_s: [0.0; BANDS],
            start_s: 0.0,
        };
        if self.legs == 0 || self.bounces == 0 || self.first_legs == 0 {
            return silent;
        }
        let speed_m_s = scene.speed_of_sound_m_s();
        let mean_free_path_m = self.legs_m / f64::from(self.legs);
        let volume_m3 =
            4.0 / 3.0 * std::f64::consts::PI * self.first_cubed_m3 / f64::from(self.first_legs);
        let escape = f64::from(self.escapes) / f64::from(self.escapes + self.bounces);
        let escape_loss = -(1.0 - escape.min(f64::from(MOST_ABSORPTION))).ln();
        let mut late = LateSource {
            start_s: (START_MEAN_FREE_PATHS * mean_free_path_m / speed_m_s) as f32,
            ..silent
        };
        for b in 0..BANDS {
            let loss = self.loss[b] / f64::from(self.bounces) + escape_loss;
            let air = 2.0 * f64::from(scene.air_np_per_m()[b]);
            // 60 dB are 6 ln 10 = 13.8 nepers of energy.
            let nepers_per_s = speed_m_s * (loss / mean_free_path_m + air);
            let decay_s = 6.0 * std::f64::consts::LN_10 / nepers_per_s;
            late.decay_time_s[b] = decay_s.min(LONGEST_DECAY_S) as f32;
            // Images fill space evenly: 4 π c³ t² / V of them a second, each of energy 1 / (c t)².
            late.energy_per_s[b] = (4.0 * std::f64::consts::PI * speed_m_s / volume_m3) as f32;
        }
        late
    }
}

/// The normal on the side that a ray comes from.
fn facing(normal: Vec3, direction: Vec3) -> Vec3 {
    if normal.dot(direction) > 0.0 {
        -normal
    } else {
        normal
    }
}

/// Energy-weighted reverberation time of several sources' late fields, one a band.
pub fn common_decay(late: &[LateSource]) -> BandArray {
    let mut decay_s = [0.0; BANDS];
    for b in 0..BANDS {
        let energy: f32 = late.iter().map(|l| l.energy_per_s[b]).sum();
        if energy > 0.0 {
            let sum: f32 = late
                .iter()
                .map(|l| l.energy_per_s[b] * l.decay_time_s[b])
                .sum();
            decay_s[b] = sum / energy;
        }
    }
    decay_s
}
