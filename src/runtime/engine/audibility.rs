//! Estimated energy of a source at the listener, and masking by other sources. Own.
//!
//! Control side. Uses distance, its curve, gain and directivity and ignores occlusion: a source behind a door is ready when it
//! opens.

use glam::Vec3;

use crate::acoustics::BANDS;
use crate::scene::SourcePose;

/// Threshold of audibility as energy relative to 1 at 1 m: −100 dB re full scale.
const SILENT: f32 = 1e-10;

/// Fraction of the energy of all sources below which one is masked: −60 dB, below the late reverb of any of them.
const MASKED: f32 = 1e-6;

/// Factor on the threshold for a source that was audible: −6 dB.
const HYSTERESIS: f32 = 0.25;

/// Distance in metres below which energy is constant.
pub(super) const MIN_DISTANCE_M: f32 = 0.3;

/// Energy at the listener of a source that plays at full scale, without walls.
pub(super) fn energy(pose: &SourcePose, gain: f32, listener: Vec3) -> f32 {
    let offset = listener - pose.position;
    let distance_m = offset.length().max(MIN_DISTANCE_M);
    let factor = pose.factor_towards(offset.normalize_or(Vec3::NEG_Z));
    // Reflections arrive from all directions: a source facing away remains audible.
    let directed: f32 = factor.iter().map(|f| f * f).sum::<f32>() / BANDS as f32;
    let curve = pose.settings.mix.distance;
    let amplitude = gain * curve.ratio(distance_m, MIN_DISTANCE_M) / distance_m;
    amplitude * amplitude * directed.max(0.1)
}

/// Whether a source of this energy is audible; `all` is the energy of all sources including it.
pub(super) fn is_audible(energy: f32, all: f32, was_audible: bool) -> bool {
    let least = SILENT.max(MASKED * all);
    energy
        > if was_audible {
            HYSTERESIS * least
        } else {
            least
        }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SourceId;

    fn at(x: f32) -> SourcePose {
        SourcePose::at(SourceId::default(), Vec3::X * x)
    }

    #[test]
    fn energy_falls_with_the_square_of_distance_and_rises_with_that_of_gain() {
        let one = energy(&at(1.0), 1.0, Vec3::ZERO);
        assert!((one - 1.0).abs() < 1e-6);
        assert!((energy(&at(10.0), 1.0, Vec3::ZERO) - 0.01).abs() < 1e-6);
        assert!((energy(&at(2.0), 2.0, Vec3::ZERO) - one).abs() < 1e-6);
        assert!(energy(&at(0.0), 1.0, Vec3::ZERO).is_finite());
    }

    #[test]
    fn a_masked_source_returns_only_when_clearly_louder() {
        assert!(is_audible(1.1e-6, 1.0, false));
        assert!(!is_audible(0.9e-6, 1.0, false));
        assert!(is_audible(0.9e-6, 1.0, true));
        assert!(!is_audible(0.2e-6, 1.0, true));
        assert!(!is_audible(0.0, 0.0, true));
    }
}
