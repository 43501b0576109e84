//! The transition function: decay of a wave with the distance from its shadow boundary.

use crate::acoustics::BANDS;
use crate::propagation::diffraction::complex::Complex;
use crate::simd::{ComplexLanes, Doubles, LaneSet, kernel};

/// Weideman's series for the Faddeeva function, N = 12 (\[WEIDEMAN94\]): L = √(N/√2), and the coefficients of the
/// polynomial, highest power first.
const L: f64 = 2.912_950_630_243_940_5;
const COEFFICIENTS: [f64; 12] = [
    -4.240_043_104_889_441e-5,
    -9.010_947_432_659_215e-5,
    2.491_848_089_192_228e-4,
    7.141_208_737_846_497e-4,
    -1.171_132_875_717_443_7e-3,
    -6.939_889_776_350_387e-3,
    -3.128_205_383_972_645e-3,
    5.596_741_437_747_992e-2,
    2.410_224_093_579_736_7e-1,
    5.949_451_781_134_398e-1,
    1.062_656_389_658_687_8,
    1.476_710_773_398_823,
];

/// Half of the bands: the lanes of one kernel.
pub(crate) const HALF: usize = BANDS / 2;

/// Complex pressures in half of the bands, real and imaginary parts apart.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct HalfWave {
    re: [f64; HALF],
    im: [f64; HALF],
}

impl HalfWave {
    #[inline(always)]
    pub(crate) fn load<D: Doubles>(&self) -> ComplexLanes<D> {
        ComplexLanes {
            re: D::load(&self.re),
            im: D::load(&self.im),
        }
    }

    #[inline(always)]
    pub(crate) fn store<D: Doubles>(&mut self, lanes: ComplexLanes<D>) {
        lanes.re.store(&mut self.re);
        lanes.im.store(&mut self.im);
    }

    /// The pressure in a band of the half.
    #[inline(always)]
    pub(crate) fn at(&self, band: usize) -> Complex {
        Complex::new(self.re[band], self.im[band])
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, band: usize, value: Complex) {
        (self.re[band], self.im[band]) = (value.re, value.im);
    }
}

/// The lower and the upper half of values by band.
pub(crate) fn halves(values: &[f64; BANDS]) -> [[f64; HALF]; 2] {
    let [a, b, c, d, e, f, g, h] = *values;
    [[a, b, c, d], [e, f, g, h]]
}

/// e^(jx) erfc(e^(jπ/4) √x) for x ≥ 0, one x per band: 1 at a shadow boundary (x = 0), ½/√x and less far from it.
///
/// Kouyoumjian and Pathak's F(x) is √(πx) e^(jπ/4) times this (\[KOUYOUMJIAN74\] 26); in this form the cotangent's pole
/// and the root's zero cancel ([`crate::propagation::diffraction::utd`]). It is the Faddeeva function at
/// z = e^(3πj/4) √x. Relative error 5e-6, that is 0.00004 dB.
pub fn transition(x: &[f64; BANDS]) -> [Complex; BANDS] {
    let mut waves = [HalfWave::default(); 2];
    for (x, wave) in halves(x).iter().zip(&mut waves) {
        *wave = transition_of_half(x);
    }
    std::array::from_fn(|b| waves[b / HALF].at(b % HALF))
}

/// The wave of one boundary: an amplitude, and the transition function's argument over kL.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct BoundaryTerm {
    pub(crate) amplitude: f64,
    pub(crate) argument: f64,
}

/// The waves of four boundaries in half of the bands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct BoundaryWaves {
    /// Their sums in the order of [`DiffractedField`]'s parts.
    ///
    /// [`DiffractedField`]: crate::propagation::diffraction::wedge_geometry::DiffractedField
    pub(crate) parts: [HalfWave; 3],
    /// The transition function of each, without its amplitude; 0 without one.
    pub(crate) alone: [HalfWave; 4],
}

/// The transition function of lanes.
#[inline(always)]
pub(super) fn transition_lanes<D: Doubles>(x: D) -> ComplexLanes<D> {
    const SCALE: f64 = 0.5 * std::f64::consts::FRAC_2_SQRT_PI;
    let root = D::splat(0.5).mul(x.max(D::splat(0.0))).sqrt();
    let (far_re, near_re) = (D::splat(L).add(root), D::splat(L).sub(root));
    let square = root.mul(root);
    let over_size = D::splat(1.0).div(far_re.mul_add(far_re, square));
    let inverse = ComplexLanes {
        re: far_re.mul(over_size),
        im: D::splat(-0.0).sub(root).mul(over_size),
    };
    let ratio = ComplexLanes {
        re: near_re,
        im: D::splat(-0.0).sub(root),
    }
    .mul(inverse);
    let mut sum = ComplexLanes::splat(COEFFICIENTS[0], 0.0);
    for coefficient in &COEFFICIENTS[1..] {
        sum = sum.mul(ratio);
        sum.re = sum.re.add(D::splat(*coefficient));
    }
    let mut value = sum.mul(inverse).scale(D::splat(2.0));
    value.re = value.re.add(D::splat(SCALE));
    inverse.mul(value)
}

/// [`transition`] in half of the bands.
pub(crate) fn transition_of_half(x: &[f64; HALF]) -> HalfWave {
    let mut result = HalfWave::default();
    in_lanes(LaneSet::best(), x, &mut result);
    result
}

kernel! {
    /// Bands are lanes.
    fn in_lanes<Wide>(x: &[f64; HALF], result: &mut HalfWave) {
        result.store(transition_lanes(Wide::Doubles::load(x)));
    }
}

kernel! {
    /// Sums of the waves of four boundaries ([`crate::propagation::diffraction::wedge_geometry::WedgeAngles`]).
    pub(crate) fn boundary_waves<Wide>(
        terms: &[Option<BoundaryTerm>; 4],
        kl: &[f64; HALF],
        result: &mut BoundaryWaves,
    ) {
        let kl = Wide::Doubles::load(kl);
        let mut parts = [ComplexLanes::splat(0.0, 0.0); 3];
        for (boundary, part) in [0, 0, 1, 2].into_iter().enumerate() {
            if let Some(term) = &terms[boundary] {
                let alone = transition_lanes(kl.mul(Wide::Doubles::splat(term.argument)));
                result.alone[boundary].store(alone);
                parts[part] = parts[part].add_scaled(alone, Wide::Doubles::splat(term.amplitude));
            }
        }
        for part in 0..3 {
            result.parts[part].store(parts[part]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// 2/√π ∫ exp(−u² − 2 e^(jπ/4) √x u) du from 0, by Simpson's rule.
    fn integrated(x: f64) -> Complex {
        let slope = Complex::cis(PI / 4.0) * (2.0 * x.sqrt());
        let (steps, end) = (4000, 8.0);
        let mut sum = Complex::ZERO;
        for i in 0..=steps {
            let u = end * f64::from(i) / f64::from(steps);
            let weight = if i == 0 || i == steps {
                1.0
            } else {
                f64::from(2 + 2 * (i % 2))
            };
            let value = Complex::cis(-slope.im * u) * (-u * u - slope.re * u).exp();
            sum += value * weight;
        }
        sum * (2.0 / PI.sqrt() * end / f64::from(steps) / 3.0)
    }

    fn alone(x: f64) -> Complex {
        transition(&[x; BANDS])[0]
    }

    #[test]
    fn bands_are_independent() {
        for i in 0..40 {
            let x: [f64; BANDS] =
                std::array::from_fn(|b| 10f64.powf(0.2 * f64::from(i) + 0.3 * b as f64 - 5.0));
            assert_eq!(transition(&x), x.map(alone));
        }
    }

    #[test]
    fn agrees_with_the_integral() {
        assert!((alone(0.0) - Complex::ONE).abs() < 5e-6);
        for i in -30..15 {
            let x = 10f64.powf(f64::from(i) / 10.0);
            let exact = integrated(x);
            // The series' own error; Simpson's is below 1e-9 here.
            assert!((alone(x) - exact).abs() < 6e-6 * exact.abs(), "{x}");
        }
        // Far out F tends to 1 as 1 + j/(2x).
        let far = alone(1e6) * (1e6 * PI).sqrt() * Complex::cis(PI / 4.0);
        assert!((far - Complex::ONE).abs() < 1e-5);
    }
}
