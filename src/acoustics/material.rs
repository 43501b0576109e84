//! Materials: absorption, scattering, transmission, and the reflection factor by angle of incidence.
//!
//! The angle dependence is that of a locally reacting surface whose real impedance has the given random-incidence
//! absorption (Paris' formula inverted, \[KUTTRUFF\] 2.3 to 2.5).

use std::sync::OnceLock;

use super::bands::{BANDS, BandArray, amplitude_of_energy};
use crate::binary::stored;

/// A surface material. All values are energy ratios from 0 to 1, one per band.
///
/// ```
/// use foresound::{BANDS, Material};
/// let curtain = Material {
///     name: "curtain".to_owned(),
///     absorption: [0.5; BANDS],
///     scattering: [0.19; BANDS],
///     transmission: [0.01; BANDS],
/// };
/// assert!((curtain.transmission_factor()[0] - 0.1).abs() < 1e-6);
/// assert!((curtain.specular_factor()[0] - 0.9).abs() < 1e-6);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name, as in the mesh file.
    pub name: String,
    /// Random-incidence absorption coefficient: share of the incident energy that is not reflected, transmission included.
    pub absorption: BandArray,
    /// Scattering coefficient (ISO 17497-1): share of the *reflected* energy outside the specular direction.
    pub scattering: BandArray,
    /// Transmission coefficient: share of the incident energy behind the surface, 10^(−TL/10) for a transmission loss of TL dB.
    pub transmission: BandArray,
}

impl Material {
    /// Pressure factor of transmission through the material, per band.
    pub fn transmission_factor(&self) -> BandArray {
        self.transmission.map(amplitude_of_energy)
    }

    /// Pressure factor of the specular reflection due to scattering, √(1 − s) per band.
    pub fn specular_factor(&self) -> BandArray {
        self.scattering.map(|s| amplitude_of_energy(1.0 - s))
    }
}

/// Angle-dependent pressure reflection factor of a material: a specific impedance and a residual factor per band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflectance {
    /// Specific impedance ζ (real, in units of the air's), at least that of highest absorption.
    pub impedance: BandArray,
    /// Pressure factor for absorption above that of any real impedance, times the loss to scattering.
    pub residue: BandArray,
    /// The former factor without the loss to scattering.
    pub unscattered_residue: BandArray,
}

impl Reflectance {
    /// The reflectance of a material. Not for real-time threads: it inverts Paris' formula by bisection in every band.
    pub fn of(material: &Material) -> Self {
        let specular = material.specular_factor();
        let mut result = Self {
            impedance: [1.0; BANDS],
            residue: [1.0; BANDS],
            unscattered_residue: [1.0; BANDS],
        };
        for b in 0..BANDS {
            let (zeta, residue) = impedance_of_absorption(f64::from(material.absorption[b]));
            result.impedance[b] = zeta as f32;
            result.unscattered_residue[b] = residue as f32;
            result.residue[b] = residue as f32 * specular[b];
        }
        result
    }

    /// Specular pressure reflection factor per band at an angle of incidence with this cosine (0 to 1). Negative near
    /// grazing incidence, where ζ cos θ < 1. Real-time safe.
    #[inline]
    pub fn factor(&self, cos_incidence: f32) -> BandArray {
        let mut factor = [0.0; BANDS];
        for b in 0..BANDS {
            let z = self.impedance[b] * cos_incidence;
            factor[b] = (z - 1.0) / (z + 1.0) * self.residue[b];
        }
        factor
    }

    /// Reflected share of the energy per band at an angle of incidence with this cosine (0 to 1), specular and scattered
    /// together. Real-time safe.
    #[inline]
    pub fn energy(&self, cos_incidence: f32) -> BandArray {
        let mut energy = [0.0; BANDS];
        for b in 0..BANDS {
            let z = self.impedance[b] * cos_incidence;
            let factor = (z - 1.0) / (z + 1.0) * self.unscattered_residue[b];
            energy[b] = factor * factor;
        }
        energy
    }
}

/// Random-incidence absorption of a locally reacting surface of real specific impedance `zeta` > 0 (Paris,
/// \[KUTTRUFF\] 2.42).
pub fn random_incidence_absorption(zeta: f64) -> f64 {
    8.0 / (zeta * zeta) * (1.0 + zeta - 1.0 / (1.0 + zeta) - 2.0 * (1.0 + zeta).ln())
}

/// Impedance above 1.567 of highest random-incidence absorption (0.951), the stationary point of
/// [`random_incidence_absorption`].
fn most_absorbing_impedance() -> f64 {
    static ZETA: OnceLock<f64> = OnceLock::new();
    *ZETA.get_or_init(|| {
        // Golden-section search; the maximum is unique.
        let (mut low, mut high) = (1.0, 3.0);
        let ratio = (5f64.sqrt() - 1.0) / 2.0;
        while high - low > 1e-9 {
            let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
            if random_incidence_absorption(a) > random_incidence_absorption(b) {
                high = b
            } else {
                low = a
            }
        }
        0.5 * (low + high)
    })
}

/// Largest impedance in use: absorption 8e-6, below that of any material.
const HARDEST_IMPEDANCE: f64 = 1e6;

/// Real impedance of a random-incidence absorption (0 to 1), and a residual pressure factor. Above 0.951, the most that
/// a real impedance absorbs, the impedance stays there and the factor falls from 1 to 0 at an absorption of 1.
pub fn impedance_of_absorption(absorption: f64) -> (f64, f64) {
    let softest = most_absorbing_impedance();
    let most = random_incidence_absorption(softest);
    if absorption >= most {
        return (softest, ((1.0 - absorption).max(0.0) / (1.0 - most)).sqrt());
    }
    // The absorption falls monotonically from `softest` on: bisection on a logarithmic scale.
    let (mut low, mut high) = (softest.ln(), HARDEST_IMPEDANCE.ln());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if random_incidence_absorption(middle.exp()) > absorption {
            low = middle
        } else {
            high = middle
        }
    }
    ((0.5 * (low + high)).exp(), 1.0)
}

stored!(Material {
    name: String,
    absorption: BandArray,
    scattering: BandArray,
    transmission: BandArray,
});

stored!(Reflectance {
    impedance: BandArray,
    residue: BandArray,
    unscattered_residue: BandArray,
});

#[cfg(test)]
mod tests {
    use super::*;

    /// Energy absorbed from a diffuse field, integrated over the half space: ∫ (1 − R²) sin 2θ dθ.
    fn integrated_absorption(reflectance: &Reflectance, band: usize) -> f64 {
        let steps = 20_000;
        (0..steps)
            .map(|i| {
                let theta = (i as f64 + 0.5) / steps as f64 * std::f64::consts::FRAC_PI_2;
                let r = f64::from(reflectance.factor(theta.cos() as f32)[band]);
                (1.0 - r * r) * (2.0 * theta).sin() * std::f64::consts::FRAC_PI_2 / steps as f64
            })
            .sum()
    }

    #[test]
    fn diffuse_field_loses_what_the_material_says() {
        for absorption in [0.01, 0.02, 0.1, 0.3, 0.6, 0.9, 0.95, 0.97, 1.0] {
            let material = Material {
                name: String::new(),
                absorption: [absorption; BANDS],
                scattering: [0.0; BANDS],
                transmission: [0.0; BANDS],
            };
            let figure = integrated_absorption(&Reflectance::of(&material), 3);
            // f32 impedances and 20,000 midpoints: 1e-4 leaves room for both.
            assert!(
                (figure - f64::from(absorption)).abs() < 2e-4,
                "{figure} for {absorption}"
            );
        }
    }

    #[test]
    fn reflection_never_adds_energy() {
        for absorption in [0.0, 0.05, 0.5, 0.951, 1.0] {
            let (zeta, residue) = impedance_of_absorption(absorption);
            for i in 0..=100 {
                let z = zeta * f64::from(i) / 100.0;
                assert!(((z - 1.0) / (z + 1.0) * residue).abs() <= 1.0 + 1e-12);
            }
        }
    }
}
