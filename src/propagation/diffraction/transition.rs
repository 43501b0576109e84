//! The transition function: decay of a wave with the distance from its shadow boundary.

use crate::acoustics::BANDS;
use crate::propagation::diffraction::complex::Complex;
use crate::propagation::diffraction::wedge_geometry::DiffractedField;
use crate::simd::{LaneSet, kernel};

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

/// e^(jx) erfc(e^(jπ/4) √x) for x ≥ 0, one x per band: 1 at a shadow boundary (x = 0), ½/√x and less far from it.
///
/// Kouyoumjian and Pathak's F(x) is √(πx) e^(jπ/4) times this (\[KOUYOUMJIAN74\] 26); in this form the cotangent's pole
/// and the root's zero cancel ([`crate::propagation::diffraction::utd`]). It is the Faddeeva function at
/// z = e^(3πj/4) √x. Relative error 5e-6, that is 0.00004 dB.
pub fn transition(x: &[f64; BANDS]) -> [Complex; BANDS] {
    let mut result = [Complex::ZERO; BANDS];
    in_lanes(LaneSet::best(), x, &mut result);
    result
}

/// The wave of one boundary: an amplitude, and the transition function's argument over kL.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct BoundaryTerm {
    pub(crate) amplitude: f64,
    pub(crate) argument: f64,
}

/// Sum of the waves of four boundaries ([`crate::propagation::diffraction::wedge_geometry::WedgeAngles`]) per band.
pub(crate) fn boundary_waves(
    terms: &[BoundaryTerm; 4],
    kl: &[f64; BANDS],
) -> [DiffractedField; BANDS] {
    let mut fields = [DiffractedField::default(); BANDS];
    for (boundary, term) in terms.iter().enumerate() {
        if term.amplitude != 0.0 {
            let waves = transition(&kl.map(|kl| kl * term.argument));
            for (field, wave) in fields.iter_mut().zip(waves) {
                *field.part_mut(boundary) += wave * term.amplitude;
            }
        }
    }
    fields
}

kernel! {
    /// Bands are lanes. No fused products: all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn in_lanes<Wide>(x: &[f64; BANDS], result: &mut [Complex; BANDS]) {
        const SCALE: f64 = 0.5 * std::f64::consts::FRAC_2_SQRT_PI;
        let (mut ratio_re, mut ratio_im) = ([0.0; BANDS], [0.0; BANDS]);
        let (mut inverse_re, mut inverse_im) = ([0.0; BANDS], [0.0; BANDS]);
        for b in 0..BANDS {
            let root = (0.5 * x[b].max(0.0)).sqrt();
            let (far_re, near_re) = (L + root, L - root);
            let size = far_re * far_re + root * root;
            ratio_re[b] = (near_re * far_re - root * root) / size;
            ratio_im[b] = (-root * far_re - near_re * root) / size;
            inverse_re[b] = far_re / size;
            inverse_im[b] = -root / size;
        }
        let (mut sum_re, mut sum_im) = ([0.0; BANDS], [0.0; BANDS]);
        for coefficient in COEFFICIENTS {
            for b in 0..BANDS {
                let re = sum_re[b] * ratio_re[b] - sum_im[b] * ratio_im[b];
                let im = sum_re[b] * ratio_im[b] + sum_im[b] * ratio_re[b];
                sum_re[b] = re + coefficient;
                sum_im[b] = im;
            }
        }
        for b in 0..BANDS {
            let re = 2.0 * (sum_re[b] * inverse_re[b] - sum_im[b] * inverse_im[b]) + SCALE;
            let im = 2.0 * (sum_re[b] * inverse_im[b] + sum_im[b] * inverse_re[b]);
            result[b] = Complex::new(
                inverse_re[b] * re - inverse_im[b] * im,
                inverse_re[b] * im + inverse_im[b] * re,
            );
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
