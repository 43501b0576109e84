//! Materials: how much of a sound a surface absorbs, scatters and lets through, and at which angle it reflects what.
//!
//! Angle dependence is that of a locally reacting surface whose real impedance has the stated random-incidence
//! absorption (Paris' formula inverted), see \[KUTTRUFF\] 2.3 to 2.5.

use std::sync::OnceLock;

use super::bands::{BANDS, BandArray, amplitude_of_energy};

/// A surface material. All values are energy ratios from 0 to 1, one a band.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name, as the mesh file has it.
    pub name: String,
    /// Random-incidence absorption coefficient: the share of energy that does not come back (what passes through counts).
    pub absorption: BandArray,
    /// Scattering coefficient: the share of the *reflected* energy that leaves the specular direction (ISO 17497-1).
    pub scattering: BandArray,
    /// Transmission coefficient: the share of energy that passes through. 10^(−TL/10) for a transmission loss of TL dB.
    pub transmission: BandArray,
}

impl Material {
    /// Pressure factor of one passage through the material, in each band.
    pub fn transmission_factor(&self) -> BandArray {
        self.transmission.map(amplitude_of_energy)
    }

    /// Pressure factor that scattering leaves to the specular reflection, in each band.
    pub fn specular_factor(&self) -> BandArray {
        self.scattering.map(|s| amplitude_of_energy(1.0 - s))
    }
}

/// Angle-dependent pressure reflection factor of one material, ready for use: a specific impedance and a residue a band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reflectance {
    /// Specific impedance ζ of each band (real, in units of the air's), at least that of highest absorption.
    pub impedance: BandArray,
    /// Factor beyond what any real impedance absorbs, times the loss to scattering.
    pub residue: BandArray,
    /// The first of these two factors alone.
    pub unscattered_residue: BandArray,
}

impl Reflectance {
    /// Of a material, with the share that scattering takes away already taken away.
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

    /// Pressure reflection factor in each band at an angle of incidence given by its cosine. Signed: near grazing
    /// incidence (ζ cos θ < 1) the reflection turns its phase.
    #[inline]
    pub fn factor(&self, cos_incidence: f32) -> BandArray {
        let mut factor = [0.0; BANDS];
        for b in 0..BANDS {
            let z = self.impedance[b] * cos_incidence;
            factor[b] = (z - 1.0) / (z + 1.0) * self.residue[b];
        }
        factor
    }
}

impl Reflectance {
    /// Share of the energy that comes back at an angle of incidence given by its cosine, in each band: the mirrored and
    /// the scattered together.
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

/// Random-incidence absorption of a locally reacting surface of real specific impedance `zeta` (Paris, \[KUTTRUFF\] 2.42).
pub fn random_incidence_absorption(zeta: f64) -> f64 {
    8.0 / (zeta * zeta) * (1.0 + zeta - 1.0 / (1.0 + zeta) - 2.0 * (1.0 + zeta).ln())
}

/// Impedance above 1.567 of highest random-incidence absorption (0.951), the stationary point of
/// [`random_incidence_absorption`].
fn most_absorbing_impedance() -> f64 {
    static ZETA: OnceLock<f64> = OnceLock::new();
    *ZETA.get_or_init(|| {
        // Golden-section search; the maximum is single and flat, so 1e-9 in ζ is far beyond need.
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

/// Largest impedance in use: absorption 8e-6, below any material's.
const HARDEST_IMPEDANCE: f64 = 1e6;

/// Real impedance whose random-incidence absorption is `absorption`, and the extra pressure factor where none has so
/// much: above 0.951 the impedance stays at its most absorbing and the rest is taken off evenly, down to nothing at 1.
pub fn impedance_of_absorption(absorption: f64) -> (f64, f64) {
    let softest = most_absorbing_impedance();
    let most = random_incidence_absorption(softest);
    if absorption >= most {
        return (softest, ((1.0 - absorption).max(0.0) / (1.0 - most)).sqrt());
    }
    // Falls steadily from `softest` on, so bisection on a logarithmic scale finds the only root.
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
