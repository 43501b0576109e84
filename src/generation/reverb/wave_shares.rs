//! The plane waves by which the late reverb arrives, and their shares of its energy.
//!
//! Audio side; wait-free; allocates nothing.
//!
//! The waves lie on a Fibonacci spiral (\[SWINBANK06\]) fixed in world coordinates. Points of a spiral have neither planes nor
//! axes of symmetry, so the phases between the ears differ from wave to wave: over turns of the head, 24 waves have the
//! interaural coherence of the diffuse field within 0.07, the vertices of a cube 0.25 and of an icosahedron 0.18.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};
use crate::extrapolation::{LATE_DIRECTION_VECTORS, LATE_DIRECTIONS, LateGroup};

use crate::generation::reverb::mixing::LINES;

/// Cosine of the angle between neighbours of [`LATE_DIRECTION_VECTORS`], at which the share of a direction ends.
const NEIGHBOUR_COSINE: f32 = 0.447_213_6;

/// Rounds in which the shares of waves and of directions are made to sum to one; the last changes them by 1e-6.
const ROUNDS: usize = 200;

/// Least share of a wave, relative to the isotropic share: −30 dB.
const LEAST_SHARE: f32 = 1e-3;

/// Unit vectors from the listener in world coordinates.
pub(crate) fn wave_directions() -> [Vec3; LINES] {
    let golden_angle = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    std::array::from_fn(|wave| {
        let up = 1.0 - (2 * wave + 1) as f64 / LINES as f64;
        let (sin, cos) = (golden_angle * wave as f64).sin_cos();
        let across = (1.0 - up * up).sqrt();
        Vec3::new((across * cos) as f32, up as f32, (across * sin) as f32)
    })
}

/// How the energy of the directions is divided among the waves.
#[derive(Debug)]
pub(crate) struct WaveShares {
    /// By wave, for each direction.
    shares: [[f32; LATE_DIRECTIONS]; LINES],
}

impl WaveShares {
    /// A wave takes from the directions near it, the more the nearer they are; all of a direction is taken, and all
    /// waves take alike.
    pub(crate) fn new() -> Self {
        let waves = wave_directions();
        let mut shares = waves.map(|wave| {
            LATE_DIRECTION_VECTORS
                .map(|direction| (wave.dot(direction) - NEIGHBOUR_COSINE).max(0.0).powi(2))
        });
        for _ in 0..ROUNDS {
            for share in &mut shares {
                let sum: f32 = share.iter().sum();
                let wanted = LATE_DIRECTIONS as f32 / LINES as f32;
                share.iter_mut().for_each(|s| *s *= wanted / sum);
            }
            for direction in 0..LATE_DIRECTIONS {
                let sum: f32 = shares.iter().map(|share| share[direction]).sum();
                shares.iter_mut().for_each(|share| share[direction] /= sum);
            }
        }
        Self { shares }
    }

    /// Levels of the waves in dB re the isotropic one.
    pub(crate) fn levels_db(&self, group: &LateGroup) -> [BandArray; LINES] {
        let energies = self.shares.map(|share| {
            let mut energy = [0.0; BANDS];
            for (share, direction) in share.iter().zip(&group.directions) {
                for (energy, part) in energy.iter_mut().zip(direction) {
                    *energy += share * part * LINES as f32;
                }
            }
            // `max` converts NaN to the least share.
            energy.map(|energy| energy.min(LINES as f32).max(LEAST_SHARE))
        });
        smoothed(&energies).map(|energies| energies.map(|energy| 10.0 * energy.log10()))
    }
}

/// The energies of waves, averaged over neighbouring bands in dB; each band keeps the energy of all waves.
///
/// Few rays come from one direction, so levels go up and down by up to 24 dB from band to band by chance. The shelves for
/// such levels would have gains of up to 100 dB, which cancel one another only at rest.
pub(crate) fn smoothed(energies: &[BandArray; LINES]) -> [BandArray; LINES] {
    let mut smooth = energies.map(|energy| {
        std::array::from_fn(|band| {
            let beside = energy[band.saturating_sub(1)] * energy[(band + 1).min(BANDS - 1)];
            (energy[band] * beside.sqrt()).sqrt()
        })
    });
    for band in 0..BANDS {
        let [before, after] =
            [energies, &smooth].map(|waves| waves.iter().map(|wave| wave[band]).sum::<f32>());
        smooth
            .iter_mut()
            .for_each(|wave| wave[band] *= before / after);
    }
    smooth
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waves_have_no_preferred_direction() {
        let mean = wave_directions().iter().sum::<Vec3>() / LINES as f32;
        assert!(mean.length() < 0.02, "{mean}");
    }

    #[test]
    fn isotropic_energy_is_divided_equally() {
        let shares = WaveShares::new();
        for levels in shares.levels_db(&LateGroup::default()) {
            assert!(levels.iter().all(|level| level.abs() < 1e-3), "{levels:?}");
        }
    }

    #[test]
    fn waves_carry_the_energy_of_each_direction_from_near_it() {
        let shares = WaveShares::new();
        for (index, direction) in LATE_DIRECTION_VECTORS.iter().enumerate() {
            let mut group = LateGroup {
                directions: [[0.0; BANDS]; LATE_DIRECTIONS],
                ..LateGroup::default()
            };
            group.directions[index] = [1.0; BANDS];
            let levels = shares.levels_db(&group);
            let energies = levels.map(|level| 10f32.powf(0.1 * level[3]) / LINES as f32);
            let sum: f32 = energies.iter().sum();
            let near: f32 = wave_directions()
                .iter()
                .zip(energies)
                .filter(|(wave, _)| wave.dot(*direction) > 45f32.to_radians().cos())
                .map(|(_, energy)| energy)
                .sum();
            println!("{index}: {sum:.4}, {near:.3} within 45 degrees");
            // 0.9 of the weights if there were waves everywhere; some five waves share a direction.
            assert!(
                (sum - 1.0).abs() < 2e-3 && near > 0.7,
                "{index}: {sum} {near}"
            );
        }
    }
}
