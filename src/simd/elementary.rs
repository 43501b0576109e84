//! Elementary functions of four `f64`. Nothing here calls a mathematical library, whose bits differ between systems.

use std::f64::consts::FRAC_1_PI;

use crate::simd::{ComplexLanes, Doubles};

/// Taylor's series of sin(r)/r and cos(r) in r², highest power first. Up to π/2 the first term left out is 5.3 · 10⁻¹³.
const SINE: [f64; 9] = [
    2.811_457_254_345_521e-15,
    -7.647_163_731_819_816e-13,
    1.605_904_383_682_161_3e-10,
    -2.505_210_838_544_172e-8,
    2.755_731_922_398_589_3e-6,
    -1.984_126_984_126_984e-4,
    8.333_333_333_333_333e-3,
    -0.166_666_666_666_666_66,
    1.0,
];
const COSINE: [f64; 9] = [
    4.779_477_332_387_385e-14,
    -1.147_074_559_772_972_5e-11,
    2.087_675_698_786_81e-9,
    -2.755_731_922_398_589e-7,
    2.480_158_730_158_73e-5,
    -1.388_888_888_888_889e-3,
    4.166_666_666_666_666_4e-2,
    -0.5,
    1.0,
];

/// Taylor's series of e^r, highest power first: 5 · 10⁻¹¹ of it at r = 0.3.
const EXPONENTIAL: [f64; 9] = [
    2.480_158_730_158_73e-5,
    1.984_126_984_126_984e-4,
    1.388_888_888_888_889e-3,
    8.333_333_333_333_333e-3,
    4.166_666_666_666_666_4e-2,
    0.166_666_666_666_666_66,
    0.5,
    1.0,
    1.0,
];

/// artanh(r)/r in r²: 10⁻¹¹ of it at r = 0.29.
const AREA_TANGENT: [f64; 9] = [
    1.0 / 17.0,
    1.0 / 15.0,
    1.0 / 13.0,
    1.0 / 11.0,
    1.0 / 9.0,
    1.0 / 7.0,
    1.0 / 5.0,
    1.0 / 3.0,
    1.0,
];

/// 8 arctan(r)/r in r²: 3 · 10⁻¹³ of it at r = 0.2.
const ARC_TANGENT: [f64; 8] = [
    -8.0 / 15.0,
    8.0 / 13.0,
    -8.0 / 11.0,
    8.0 / 9.0,
    -8.0 / 7.0,
    8.0 / 5.0,
    -8.0 / 3.0,
    8.0,
];

/// Powers that are left out where six coefficients do.
const ROUGH: usize = 3;

/// A polynomial, highest power first.
#[inline(always)]
fn polynomial<D: Doubles>(coefficients: &[f64], x: D) -> D {
    let mut sum = D::splat(coefficients[0]);
    for coefficient in &coefficients[1..] {
        sum = sum.mul_add(x, D::splat(*coefficient));
    }
    sum
}

/// Sine and cosine of angles from −π/2 to π/2 and somewhat beyond: within 10⁻¹² there, and at 1.93 within 2.5 · 10⁻¹¹.
#[inline(always)]
pub(crate) fn sine_cosine<D: Doubles>(r: D) -> (D, D) {
    let square = r.mul(r);
    (
        polynomial(&SINE, square).mul(r),
        polynomial(&COSINE, square),
    )
}

/// [`sine_cosine`] within 5 · 10⁻⁷ up to π/2.
#[inline(always)]
pub(crate) fn rough_sine_cosine<D: Doubles>(r: D) -> (D, D) {
    let square = r.mul(r);
    (
        polynomial(&SINE[ROUGH..], square).mul(r),
        polynomial(&COSINE[ROUGH..], square),
    )
}

/// e^(jφ) for phases of up to some 10⁶ radians, whose rounding is the error.
#[inline(always)]
pub(crate) fn turned<D: Doubles>(phase: D) -> ComplexLanes<D> {
    /// Added and subtracted, it rounds to a whole number.
    const TO_WHOLE: f64 = 6_755_399_441_055_744.0;
    /// π in two parts; the last 27 bits of the first are 0, so its multiples are exact.
    const PI_HIGH: f64 = 3.141_592_621_803_283_7;
    const PI_LOW: f64 = 3.178_650_954_705_639e-8;
    let turns = phase.mul(D::splat(0.5 * FRAC_1_PI));
    let whole = turns.add(D::splat(TO_WHOLE)).sub(D::splat(TO_WHOLE));
    // With φ = 2r the real part is 1 − 2 sin² r, the imaginary one 2 sin r cos r.
    let r = D::splat(0.5).mul(phase);
    let r = whole.neg_mul_add(D::splat(PI_HIGH), r);
    let r = whole.neg_mul_add(D::splat(PI_LOW), r);
    let (sine, cosine) = sine_cosine(r);
    let twice = D::splat(2.0).mul(sine);
    ComplexLanes {
        re: twice.neg_mul_add(sine, D::splat(1.0)),
        im: twice.mul(cosine),
    }
}

/// e^(−x) for x from 0 to 700, within 10⁻⁸ of it up to x = 30.
#[inline(always)]
pub(crate) fn decay<D: Doubles>(x: D) -> D {
    const SQUARINGS: u32 = 11;
    const SHARE: f64 = -1.0 / (1u32 << SQUARINGS) as f64;
    let mut power = polynomial(&EXPONENTIAL[ROUGH..], x.mul(D::splat(SHARE)));
    for _ in 0..SQUARINGS {
        power = power.mul(power);
    }
    power
}

/// Principal square root of numbers other than zero whose imaginary part is not positive.
#[inline(always)]
pub(crate) fn root_of_lower_half<D: Doubles>(z: ComplexLanes<D>) -> ComplexLanes<D> {
    let (zero, half) = (D::splat(0.0), D::splat(0.5));
    let size = z.square().sqrt();
    let greater = half.mul(size.add(z.re.max(zero.sub(z.re)))).sqrt();
    let less = half.mul(z.im).div(greater);
    let on_left = ComplexLanes {
        re: zero.sub(less),
        im: zero.sub(greater),
    };
    let on_right = ComplexLanes {
        re: greater,
        im: less,
    };
    ComplexLanes::select_at_most(zero, z.re, on_right, on_left)
}

/// sinh² of an exponent (0 to 1) times the logarithm of z, which is in the fourth quadrant and of absolute value 1 to 120. Within
/// 10⁻⁸ of it.
#[inline(always)]
pub(crate) fn sinh_squared_of_power<D: Doubles>(
    z: ComplexLanes<D>,
    exponent: D,
) -> ComplexLanes<D> {
    let (one, half) = (D::splat(1.0), D::splat(0.5));
    let size = z.square().sqrt();
    // A sixteenth of the size's logarithm: that of its eighth root x is 2 artanh((x − 1)/(x + 1)).
    let x = size.sqrt().sqrt().sqrt();
    let ratio = x.sub(one).div(x.add(one));
    let sixteenth = polynomial(&AREA_TANGENT, ratio.mul(ratio)).mul(ratio);
    let mut grown = polynomial(&EXPONENTIAL, sixteenth.mul(exponent));
    for _ in 0..4 {
        grown = grown.mul(grown);
    }
    // Tangents of a quarter and of an eighth of the angle.
    let cosine = z.re.div(size);
    let cosine_of_half = half.mul(one.add(cosine)).sqrt();
    let sine_of_half = D::splat(-0.5).mul(z.im).div(size.mul(cosine_of_half));
    let quarter = sine_of_half.div(one.add(cosine_of_half));
    let eighth = quarter.div(one.add(one.add(quarter.mul(quarter)).sqrt()));
    let angle = polynomial(&ARC_TANGENT, eighth.mul(eighth)).mul(eighth);
    let (sine, cosine) = sine_cosine(angle.mul(exponent));
    let shrunk = one.div(grown);
    let sinh = ComplexLanes {
        re: half.mul(grown.sub(shrunk)).mul(cosine),
        im: D::splat(-0.5).mul(grown.add(shrunk)).mul(sine),
    };
    sinh.mul(sinh)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;
    use crate::propagation::diffraction::complex::Complex;
    use crate::simd::{LaneSet, kernel};

    kernel! {
        /// Real functions.
        fn real<L>(input: &[f64; 4], output: &mut [[f64; 4]; 5]) {
            let x = L::Doubles::load(input);
            let (sine, cosine) = sine_cosine(x);
            sine.store(&mut output[0]);
            cosine.store(&mut output[1]);
            decay(x).store(&mut output[2]);
            let (sine, cosine) = rough_sine_cosine(x);
            sine.store(&mut output[3]);
            cosine.store(&mut output[4]);
        }
    }

    kernel! {
        /// Complex functions of re + j im; the power has the exponent of the third row.
        fn complex<L>(input: &[[f64; 4]; 3], output: &mut [[f64; 4]; 6]) {
            let z = ComplexLanes {
                re: L::Doubles::load(&input[0]),
                im: L::Doubles::load(&input[1]),
            };
            let results = [
                turned(z.re),
                root_of_lower_half(z),
                sinh_squared_of_power(z, L::Doubles::load(&input[2])),
            ];
            for i in 0..3 {
                results[i].re.store(&mut output[2 * i]);
                results[i].im.store(&mut output[2 * i + 1]);
            }
        }
    }

    fn real_of(set: LaneSet, input: [f64; 4]) -> [[f64; 4]; 5] {
        let mut output = [[0.0; 4]; 5];
        real(set, &input, &mut output);
        output
    }

    fn complex_of(set: LaneSet, input: [[f64; 4]; 3]) -> [[f64; 4]; 6] {
        let mut output = [[0.0; 4]; 6];
        complex(set, &input, &mut output);
        output
    }

    #[test]
    fn real_functions_are_those_of_the_mathematical_library() {
        for step in 0..=1000 {
            let share = 0.001 * f64::from(step);
            let (angle, x) = (FRAC_PI_2 * (2.0 * share - 1.0), 700.0 * share);
            let [sine, cosine, _, rough_sine, rough_cosine] =
                real_of(LaneSet::Portable, [angle; 4]);
            // Twice the first term left out, and rounding.
            assert!((sine[0] - angle.sin()).abs() < 1.2e-12, "{angle}");
            assert!((cosine[0] - angle.cos()).abs() < 1.2e-12, "{angle}");
            assert!((rough_sine[0] - sine[0]).abs() < 5e-7, "{angle}");
            assert!((rough_cosine[0] - cosine[0]).abs() < 5e-7, "{angle}");
            for x in [x, 0.01 * x, 1e-4 * x] {
                let ours = real_of(LaneSet::Portable, [x; 4])[2][0];
                // From 30 on only the size matters, 10⁻¹³ and less.
                let most = if x < 30.0 { 1e-8 } else { 0.1 };
                assert!((ours / (-x).exp() - 1.0).abs() < most, "{x}");
            }
        }
    }

    #[test]
    fn complex_functions_are_those_of_the_mathematical_library() {
        for size in [1.0, 1.001, 1.3, 4.0, 17.0, 119.0] {
            for step in 0..=90 {
                let angle = f64::from(-step) * PI / 180.0;
                let z = Complex::cis(angle) * size;
                for exponent in [0.5, 2.0 / 3.0, 0.97] {
                    let input = [[z.re; 4], [z.im.min(0.0); 4], [exponent; 4]];
                    let [re, im, root_re, root_im, sinh_re, sinh_im] =
                        complex_of(LaneSet::Portable, input);
                    let at = |re: [f64; 4], im: [f64; 4]| Complex::new(re[0], im[0]);
                    assert!((at(re, im) - Complex::cis(z.re)).abs() < 1e-11);
                    let root = at(root_re, root_im);
                    assert!((root - z.sqrt()).abs() < 1e-14 * size, "{z:?}");
                    let power = z.powf(exponent);
                    let sinh = (power - Complex::ONE / power) * 0.5;
                    let error = (at(sinh_re, sinh_im) - sinh * sinh).abs();
                    assert!(error < 1e-8 * (sinh * sinh).abs() + 1e-11, "{z:?} {error}");
                }
            }
        }
        for phase in [-3.2, 0.0, 7.0, 100.3, 1e4, -99_999.9] {
            let [re, im, ..] = complex_of(LaneSet::Portable, [[phase; 4]; 3]);
            let error = (Complex::new(re[0], im[0]) - Complex::cis(phase)).abs();
            assert!(error < 1e-11, "{phase}: {error}");
        }
        // On the left, where the root's real part is the smaller one.
        let z = Complex::new(-3.0, -0.2);
        let [_, _, re, im, ..] = complex_of(LaneSet::Portable, [[z.re; 4], [z.im; 4], [0.5; 4]]);
        assert!((Complex::new(re[0], im[0]) - z.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn vector_units_give_the_bits_of_the_reference() {
        for step in 0..100 {
            let x = 0.01 * f64::from(step);
            let row = [x, 1.0 - x, 0.3 * x, 2.0];
            let input = [row.map(|x| 1.0 + x), row.map(|x| -x), row.map(|x| 0.4 * x)];
            for set in LaneSet::vector_units() {
                assert_eq!(real_of(set, row), real_of(LaneSet::Fused, row));
                assert_eq!(complex_of(set, input), complex_of(LaneSet::Fused, input));
            }
        }
    }
}
