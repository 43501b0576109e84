//! Scattering of a rough surface, from the height and the slope of its roughness.
//!
//! A wave of wave number k loses the share `1 − exp(−(2 k σ cos θ)²)` of its mirrored energy to a roughness of standard
//! deviation σ (Rayleigh's roughness parameter, \[BECKMANN63\] 5.3). cos² θ is ½ on the mean over diffuse incidence.
//! Of a roughness of correlation length l with a Gaussian spectrum the share `exp(−(k l)²/4)` is finer than the wave: it
//! radiates nothing (\[OGILVY91\] 3).

use std::collections::HashMap;
use std::f64::consts::PI;

use crate::acoustics::bands::CENTRES_HZ;
use crate::acoustics::{BANDS, BandArray, Material};

use glam::DVec3;

use super::super::surface::SurfaceSet;
use super::plane_fit::Plane;

/// Steps of the roughness in a factor of two of height or length: neighbouring classes differ by 0.75 dB in scattered energy.
const STEPS_A_DOUBLING: f64 = 8.0;

/// Standard deviation in metres below which nothing is scattered: 8 kHz by less than 0.0002.
const SMOOTH_M: f64 = 1e-4;

/// Sums over triangles, weighted by their area: squared heights over the plane, and squared slopes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::scene) struct Roughness {
    area_m2: f64,
    squares: f64,
    slopes: f64,
}

impl Roughness {
    /// The roughness of one triangle about a plane.
    pub(super) fn of(corners: &[DVec3; 3], normal: DVec3, area_m2: f64, plane: Plane) -> Self {
        let heights = corners.map(|corner| plane.distance_m(corner));
        Self::of_heights(heights, normal.dot(plane.normal), area_m2)
    }

    /// The roughness of one triangle of which the corners' heights are known, and the cosine of its angle to the smooth surface.
    pub(super) fn of_heights([a, b, c]: [f64; 3], cosine: f64, area_m2: f64) -> Self {
        let cosine = cosine.abs().max(0.1);
        Self {
            area_m2,
            // The mean of the square of a linear function.
            squares: area_m2 * (a * a + b * b + c * c + a * b + b * c + c * a) / 6.0,
            slopes: area_m2 * (1.0 / (cosine * cosine) - 1.0),
        }
    }

    /// Of an area without roughness.
    pub(super) fn flat(area_m2: f64) -> Self {
        Self {
            area_m2,
            ..Self::default()
        }
    }

    /// The same roughness of another area.
    pub(super) fn over(&self, area_m2: f64) -> Self {
        let part = area_m2 / self.area_m2.max(1e-12);
        Self {
            area_m2,
            squares: part * self.squares,
            slopes: part * self.slopes,
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.area_m2 += other.area_m2;
        self.squares += other.squares;
        self.slopes += other.slopes;
    }

    /// Standard deviation of the heights in metres.
    fn sigma_m(&self) -> f64 {
        (self.squares / self.area_m2.max(1e-12)).sqrt()
    }

    /// Correlation length in metres: the mean squared slope of a Gaussian correlation is 4 σ² / l².
    fn length_m(&self) -> f64 {
        2.0 * (self.squares / self.slopes.max(1e-12)).sqrt()
    }

    /// Classes of height and length; none for a smooth surface.
    fn class(&self) -> Option<[i32; 2]> {
        let of = |length_m: f64| (STEPS_A_DOUBLING * length_m.log2()).round() as i32;
        (self.sigma_m() > SMOOTH_M).then(|| [of(self.sigma_m()), of(self.length_m())])
    }
}

/// Gives rough surfaces a material of their own, one a material and class of roughness; `roughness` is by triangle.
pub(in crate::scene) fn apply(
    surfaces: &mut SurfaceSet,
    materials: &mut Vec<Material>,
    roughness: &[Roughness],
    speed_m_s: f64,
) {
    let mut known: HashMap<(u32, [i32; 2]), u32> = HashMap::new();
    let mut sums = vec![Roughness::default(); surfaces.surfaces.len()];
    for (roughness, &surface) in roughness.iter().zip(&surfaces.triangle_surface) {
        sums[surface as usize].add(roughness);
    }
    for (surface, sum) in surfaces.surfaces.iter_mut().zip(sums) {
        let Some(class) = sum.class() else { continue };
        surface.material = *known.entry((surface.material, class)).or_insert_with(|| {
            materials.push(roughened(
                &materials[surface.material as usize],
                class,
                speed_m_s,
            ));
            materials.len() as u32 - 1
        });
    }
}

/// A material with the scattering of a roughness in addition to its own.
fn roughened(material: &Material, class: [i32; 2], speed_m_s: f64) -> Material {
    let [sigma_m, length_m] = class.map(|step| (f64::from(step) / STEPS_A_DOUBLING).exp2());
    let rough = scattering(sigma_m, length_m, speed_m_s);
    let mut result = material.clone();
    for band in 0..BANDS {
        let mirrored = (1.0 - material.scattering[band]) * (1.0 - rough[band]);
        result.scattering[band] = 1.0 - mirrored;
    }
    result
}

/// Scattering coefficient of a roughness by band.
pub(super) fn scattering(sigma_m: f64, length_m: f64, speed_m_s: f64) -> BandArray {
    CENTRES_HZ.map(|hz| {
        let k = 2.0 * PI * hz / speed_m_s;
        let coarse = 1.0 - (-(k * length_m).powi(2) / 4.0).exp();
        let rayleigh = 0.5 * (2.0 * k * sigma_m).powi(2);
        (1.0 - (-rayleigh * coarse).exp()) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattering_grows_with_frequency_and_height() {
        let of = |sigma_m: f64| scattering(sigma_m, 0.2, 343.0);
        let (fine, coarse) = (of(0.001), of(0.01));
        for band in 0..BANDS {
            assert!(fine[band] < coarse[band]);
            assert!(band == 0 || coarse[band] >= coarse[band - 1]);
        }
        // A centimetre is nothing at 63 Hz and half a wave's height at 8 kHz.
        assert!(coarse[0] < 1e-3 && coarse[7] > 0.98, "{coarse:?}");
        // 1 kHz at normal incidence: 2 k σ = 0.366.
        assert!((coarse[4] - (1.0 - (-0.5f32 * 0.134).exp())).abs() < 0.01);
    }
}
