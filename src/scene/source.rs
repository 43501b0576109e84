//! What a source is like: where it sends its sound to, how large it is, and which parts of its sound are wanted.
//!
//! Small and `Copy`, so that it travels with the pose and every stage sees the same.

use glam::Vec3;

use crate::acoustics::{BANDS, BandArray};

/// Directivity of the cardioid family in each band: pressure `|(1 − w) + w cos θ|ⁿ` at the angle θ from the front, the
/// first-order patterns of microphones and loudspeakers, sharpened by an exponent.
///
/// # Range
/// Weights 0 (omnidirectional) over ½ (cardioid) to 1 (dipole); other values count as the nearest of these. Orders 0 to
/// 64. The front keeps its level: a source that is narrower in one band sends less power in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Directivity {
    /// Weight `w` of the dipole, one a band.
    pub weight: BandArray,
    /// Exponent `n`; 1 is the plain pattern.
    pub order: f32,
}

impl Directivity {
    /// The same in all directions.
    pub const OMNI: Self = Self {
        weight: [0.0; BANDS],
        order: 1.0,
    };

    /// The same pattern in all bands.
    pub const fn even(weight: f32, order: f32) -> Self {
        Self {
            weight: [weight; BANDS],
            order,
        }
    }

    /// Pressure factor towards a direction whose angle from the front has this cosine.
    pub fn factor(&self, cos_angle: f32) -> BandArray {
        let order = if self.order.is_finite() {
            self.order.clamp(0.0, 64.0)
        } else {
            1.0
        };
        self.weight.map(|weight| {
            // A weight that is not a number is none.
            let weight = if weight > 0.0 { weight.min(1.0) } else { 0.0 };
            ((1.0 - weight) + weight * cos_angle.clamp(-1.0, 1.0))
                .abs()
                .powf(order)
        })
    }

    /// Whether it does nothing.
    pub fn is_omni(&self) -> bool {
        self.weight.iter().all(|w| *w <= 0.0) || self.order == 0.0
    }
}

impl Default for Directivity {
    fn default() -> Self {
        Self::OMNI
    }
}

/// Which parts of a source's sound are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effects {
    /// The direct path.
    pub direct: bool,
    /// Reflected paths.
    pub reflections: bool,
    /// Bending around edges.
    pub diffraction: bool,
    /// The direct path through walls.
    pub transmission: bool,
    /// The late reverb.
    pub late: bool,
}

impl Default for Effects {
    /// All.
    fn default() -> Self {
        Self {
            direct: true,
            reflections: true,
            diffraction: true,
            transmission: true,
            late: true,
        }
    }
}

/// Everything about a source but its place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SourceSettings {
    /// Where it sends its sound to.
    pub directivity: Directivity,
    /// Radius in metres within which it gets no louder; `None` as propagation's settings say.
    pub radius_m: Option<f32>,
    /// What is computed of it.
    pub effects: Effects,
}

impl SourceSettings {
    /// Radius in metres within which the source gets no louder, given what holds for sources that do not say.
    pub fn nearest_m(&self, otherwise_m: f64) -> f64 {
        match self.radius_m {
            Some(radius_m) if radius_m.is_finite() && radius_m > 0.0 => f64::from(radius_m),
            _ => otherwise_m,
        }
    }
}

/// Front of a source that is not turned, as of a head.
pub(super) const FRONT: Vec3 = Vec3::NEG_Z;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn omni_is_one_everywhere() {
        for i in 0..=20 {
            let cosine = -1.0 + 0.1 * i as f32;
            assert_eq!(Directivity::OMNI.factor(cosine), [1.0; BANDS]);
            assert_eq!(
                Directivity::even(f32::NAN, 1.0).factor(cosine),
                [1.0; BANDS]
            );
        }
    }

    #[test]
    fn dipole_is_silent_aside_and_cardioid_behind() {
        assert_eq!(Directivity::even(1.0, 1.0).factor(0.0), [0.0; BANDS]);
        assert_eq!(Directivity::even(0.5, 2.0).factor(-1.0), [0.0; BANDS]);
        for weight in [0.0, 0.3, 0.5, 1.0] {
            assert_eq!(Directivity::even(weight, 3.0).factor(1.0), [1.0; BANDS]);
        }
    }

    #[test]
    fn mean_power_is_that_of_the_integral() {
        // ∫ ((1 − w) + w x)² dx / 2 over −1 … 1 is (1 − w)² + w² / 3.
        for weight in [0.0f64, 0.25, 0.5, 1.0] {
            let pattern = Directivity::even(weight as f32, 1.0);
            let steps = 2000;
            let mean: f64 = (0..steps)
                .map(|i| {
                    let cosine = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(steps);
                    f64::from(pattern.factor(cosine as f32)[3]).powi(2) / f64::from(steps)
                })
                .sum();
            let exact = (1.0 - weight).powi(2) + weight * weight / 3.0;
            // Midpoints err by the step squared, single precision by 1e-6.
            assert!((mean - exact).abs() < 1e-5, "{weight}: {mean}");
        }
    }
}
