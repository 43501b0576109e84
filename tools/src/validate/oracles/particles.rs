//! Oracle: scattered sound in a rectangular room, by many particles in `f64`.
//!
//! Particles leave the source evenly in all directions, lose energy at walls by the material model's definition, are
//! scattered by Lambert's law with the walls' probability, and are counted while they fly through a ball about the
//! listener: energy times path length inside over its volume (\[VORLANDER08\] 11.2). Only scattered ones count;
//! specular reflections are the image sources'. Shares no code with the crate.

use super::shoebox::{Bands, Room, impedances, reflection};

/// Energy relative to the free field at 1 m that arrives in each window of `window_m` of path length, scattered at least once.
///
/// Every wall must scatter alike in all bands.
pub fn scattered(
    room: &Room,
    source: [f64; 3],
    listener: [f64; 3],
    ball_m: f64,
    window_m: f64,
    windows: usize,
    particles: u32,
) -> Vec<Bands> {
    let walls = impedances(room);
    let volume = 4.0 / 3.0 * std::f64::consts::PI * ball_m.powi(3);
    let share = 4.0 * std::f64::consts::PI / f64::from(particles) / volume;
    let mut result = vec![[0.0; 8]; windows];
    let mut random = Random(0x2545_f491_4f6c_dd1d);
    for _ in 0..particles {
        let mut position = source;
        let mut direction = random.direction();
        let mut energy = [share; 8];
        let mut path_m = 0.0;
        let mut is_scattered = false;
        while path_m < window_m * windows as f64 {
            // The nearest wall ahead.
            let mut leg_m = f64::INFINITY;
            let mut axis = 0;
            for a in 0..3 {
                let aim = if direction[a] > 0.0 {
                    room.size[a]
                } else {
                    0.0
                };
                let to_wall = (aim - position[a]) / direction[a];
                if direction[a] != 0.0 && to_wall < leg_m {
                    (leg_m, axis) = (to_wall.max(0.0), a);
                }
            }
            if is_scattered {
                count(
                    &mut result,
                    room,
                    position,
                    direction,
                    leg_m,
                    listener,
                    ball_m,
                    path_m,
                    window_m,
                    &energy,
                );
            }
            path_m += leg_m;
            for a in 0..3 {
                position[a] += leg_m * direction[a];
            }
            let wall = 2 * axis + usize::from(direction[axis] > 0.0);
            for (band, value) in energy.iter_mut().enumerate() {
                *value *= reflection(walls[wall][band], direction[axis].abs()).powi(2);
            }
            let inward = -direction[axis].signum();
            if random.unit() < room.scattering[wall][0] {
                is_scattered = true;
                let round = random.direction();
                direction = round;
                direction[axis] += inward;
                let length = direction
                    .iter()
                    .map(|d| d * d)
                    .sum::<f64>()
                    .sqrt()
                    .max(1e-9);
                direction = direction.map(|d| d / length);
            } else {
                direction[axis] = -direction[axis];
            }
        }
    }
    result
}

#[expect(clippy::too_many_arguments, reason = "a flight and a ball")]
fn count(
    result: &mut [Bands],
    room: &Room,
    position: [f64; 3],
    direction: [f64; 3],
    leg_m: f64,
    listener: [f64; 3],
    ball_m: f64,
    path_m: f64,
    window_m: f64,
    energy: &Bands,
) {
    let to: Vec<f64> = (0..3).map(|a| listener[a] - position[a]).collect();
    let along: f64 = (0..3).map(|a| to[a] * direction[a]).sum();
    let aside = to.iter().map(|d| d * d).sum::<f64>() - along * along;
    if aside >= ball_m * ball_m {
        return;
    }
    let half = (ball_m * ball_m - aside).sqrt();
    let inside = (along + half).min(leg_m) - (along - half).max(0.0);
    let window = ((path_m + along) / window_m) as usize;
    if inside > 0.0 && window < result.len() {
        for band in 0..8 {
            let air = (-2.0 * room.air_np_per_m[band] * (path_m + along)).exp();
            result[window][band] += energy[band] * inside * air;
        }
    }
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

    fn direction(&mut self) -> [f64; 3] {
        let z = 1.0 - 2.0 * self.unit();
        let r = (1.0 - z * z).sqrt();
        let angle = std::f64::consts::TAU * self.unit();
        [r * angle.cos(), r * angle.sin(), z]
    }
}
