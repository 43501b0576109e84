//! Decay and directions of a part of the late reverb that many sources share.
//!
//! Data; any thread.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};

/// Common decays of the late reverb at one time.
pub const LATE_GROUPS: usize = 3;

/// Directions between which the energy of a [`LateGroup`] is divided.
pub const LATE_DIRECTIONS: usize = 12;

/// Coordinates of an icosahedron's vertices: `1 / √(1 + φ²)` and `φ / √(1 + φ²)` with the golden ratio φ.
const SHORT: f32 = 0.525_731_1;
const LONG: f32 = 0.850_650_8;

/// Unit vectors in world coordinates, from the listener to where the energy arrives from: the vertices of an icosahedron,
/// opposite ones side by side. Sums over them equal integrals over the sphere for polynomials up to the fifth degree.
pub const LATE_DIRECTION_VECTORS: [Vec3; LATE_DIRECTIONS] = [
    Vec3::new(0.0, SHORT, LONG),
    Vec3::new(0.0, -SHORT, -LONG),
    Vec3::new(0.0, SHORT, -LONG),
    Vec3::new(0.0, -SHORT, LONG),
    Vec3::new(SHORT, LONG, 0.0),
    Vec3::new(-SHORT, -LONG, 0.0),
    Vec3::new(SHORT, -LONG, 0.0),
    Vec3::new(-SHORT, LONG, 0.0),
    Vec3::new(LONG, 0.0, SHORT),
    Vec3::new(-LONG, 0.0, -SHORT),
    Vec3::new(LONG, 0.0, -SHORT),
    Vec3::new(-LONG, 0.0, SHORT),
];

/// One common decay of the late reverb: sources send into it, each with its own energies and starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LateGroup {
    /// Reverberation time T60 in seconds per band; up to 0.05 s is silence.
    pub decay_time_s: BandArray,
    /// Share of the arriving energy from each of [`LATE_DIRECTION_VECTORS`] per band. Range: at least 0; the sum over the
    /// directions is 1 in every band.
    pub directions: [BandArray; LATE_DIRECTIONS],
}

impl LateGroup {
    /// A group whose energy arrives from all directions alike, with these decay times in seconds.
    pub const fn isotropic(decay_time_s: BandArray) -> Self {
        Self {
            decay_time_s,
            directions: [[1.0 / LATE_DIRECTIONS as f32; BANDS]; LATE_DIRECTIONS],
        }
    }
}

impl Default for LateGroup {
    /// Silence.
    fn default() -> Self {
        Self::isotropic([0.0; BANDS])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_opposite_pairs_of_unit_vectors_without_a_preferred_axis() {
        for pair in LATE_DIRECTION_VECTORS.chunks_exact(2) {
            assert_eq!(pair[0], -pair[1]);
            assert!((pair[0].length() - 1.0).abs() < 1e-6);
        }
        for axis in [Vec3::X, Vec3::new(0.36, 0.48, -0.8)] {
            let mean = |power: i32| {
                let sum: f32 = LATE_DIRECTION_VECTORS
                    .iter()
                    .map(|d| d.dot(axis).powi(power))
                    .sum();
                sum / LATE_DIRECTIONS as f32
            };
            // Means of x² and x⁴ over the sphere.
            assert!((mean(2) - 1.0 / 3.0).abs() < 1e-6 && (mean(4) - 0.2).abs() < 1e-6);
        }
    }

    #[test]
    fn isotropic_shares_sum_to_one() {
        let sum: f32 = LateGroup::default().directions.iter().map(|d| d[0]).sum();
        assert!((sum - 1.0).abs() < 1e-6);
    }
}
