//! Angles in the plane, without a call of the C library: the same bits on every target.
//!
//! Pure; any thread. An update of sixteen sources computes some ten thousand. Generation has an arctangent in single precision.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, PI};

use glam::DVec2;

/// Tangent of an eighth of a half-turn, up to which the series of the arctangent is used.
const TAN_PI_8: f64 = 0.414_213_562_373_095_03;

/// `(arctan(t) / t - 1) / t²` for `t` up to [`TAN_PI_8`] by powers of `t²`, lowest first: Chebyshev's fit, within 9e-16.
const ARC_TANGENT: [f64; 10] = [
    -0.333_333_333_333_332_5,
    0.199_999_999_998_984_07,
    -0.142_857_142_660_964_75,
    0.111_111_096_365_250_59,
    -0.090_908_525_568_752_34,
    0.076_910_551_529_583_36,
    -0.066_496_136_378_790_05,
    0.057_363_318_138_629_805,
    -0.044_833_334_623_513_88,
    0.022_750_511_120_272_945,
];

/// `(sin(r) / r - 1) / r²` and `((cos(r) - 1) / r² + ½) / r²` for `r` up to π/4 by powers of `r²`, lowest first: Chebyshev's fits,
/// within 3e-17.
const SINE: [f64; 6] = [
    -0.166_666_666_666_666_66,
    8.333_333_333_330_936e-3,
    -1.984_126_983_674_053_2e-4,
    2.755_731_609_319_840_4e-6,
    -2.505_112_989_645_018_5e-8,
    1.591_798_897_939_743_5e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_666_4e-2,
    -1.388_888_888_888_738_9e-3,
    2.480_158_729_875_44e-5,
    -2.755_731_726_587_808e-7,
    2.087_614_504_941_318e-9,
    -1.138_254_464_534_925e-11,
];

/// A polynomial, lowest power first, as two of half the length, which depend on each other less.
#[inline]
fn polynomial<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    let square = x * x;
    let (mut even, mut odd) = (0.0, 0.0);
    for pair in coefficients.chunks_exact(2).rev() {
        even = even * square + pair[0];
        odd = odd * square + pair[1];
    }
    even + odd * x
}

/// `y.atan2(x)` in radians, within 5e-16; 0 at the origin, no number if either is none.
#[inline]
pub(crate) fn atan2(y: f64, x: f64) -> f64 {
    // Which case holds is as good as random: numbers, not branches.
    let number = |is_case: bool| f64::from(u8::from(is_case));
    let (along, up) = (x.abs(), y.abs());
    // Ordered so that what is no number stays.
    let low = if along < up { along } else { up };
    let high = if up > along { up } else { along };
    let high = if high < f64::MIN_POSITIVE {
        f64::MIN_POSITIVE
    } else {
        high
    };
    // Beyond an eighth of a half-turn that from a quarter.
    let is_wide = number(low > TAN_PI_8 * high);
    let ratio = (low - is_wide * high) / (high + is_wide * low);
    let square = ratio * ratio;
    let series = ratio + ratio * square * polynomial(&ARC_TANGENT, square);
    let first = is_wide * FRAC_PI_4 + series;
    let right = first + number(up > along) * (FRAC_PI_2 - 2.0 * first);
    let positive = right + number(x < 0.0) * (PI - 2.0 * right);
    positive.copysign(y)
}

/// Sine and cosine of an angle in radians, within 3e-16 up to 37,000.
#[inline]
pub(crate) fn sin_cos(angle: f64) -> (f64, f64) {
    /// Added and subtracted, it rounds to a whole number.
    const TO_WHOLE: f64 = 6_755_399_441_055_744.0;
    /// π/2 in two parts; the last 27 bits of the first are 0, so its multiples are exact.
    const HIGH: f64 = 1.570_796_310_901_641_8;
    const LOW: f64 = 1.589_325_477_352_819_6e-8;
    let shifted = angle * FRAC_2_PI + TO_WHOLE;
    let quarters = shifted - TO_WHOLE;
    let r = angle - quarters * HIGH - quarters * LOW;
    let square = r * r;
    let sine = r + r * square * polynomial(&SINE, square);
    let cosine = 1.0 - square * (0.5 - square * polynomial(&COSINE, square));
    // The last bits of the shifted number are those of the whole one.
    match shifted.to_bits() & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// The unit vector at an angle in radians from the x axis, as [`sin_cos`].
#[inline]
pub(crate) fn unit_vector(angle: f64) -> DVec2 {
    let (sine, cosine) = sin_cos(angle);
    DVec2::new(cosine, sine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_the_standard_library() {
        let values = [
            -3.0, -1.0, -0.3, -1e-4, -1e-200, 0.0, 3e-308, 0.2, 0.999, 1.0, 7e150,
        ];
        for y in values {
            for x in values {
                // The library tells the two zeros of x apart.
                let expected = f64::atan2(y, x + 0.0);
                assert!((atan2(y, x) - expected).abs() < 5e-16, "{y} {x}");
            }
        }
        for step in 0..200_000 {
            let turn = f64::from(step) * 6.3e-5 - 6.3;
            let (sin, cos) = turn.sin_cos();
            let error = atan2(3.7 * sin, 3.7 * cos) - (3.7 * sin).atan2(3.7 * cos);
            assert!(error.abs() < 5e-16, "{turn}: {error}");
        }
        assert!(atan2(f64::NAN, 1.0).is_nan() && atan2(1.0, f64::NAN).is_nan());
    }

    #[test]
    fn sines_and_cosines_are_those_of_the_standard_library() {
        for step in -100_000..100_000 {
            for scale in [1e-4, 0.37] {
                let turn = f64::from(step) * scale;
                let (sine, cosine) = sin_cos(turn);
                let errors = [sine - turn.sin(), cosine - turn.cos()];
                assert!(errors.iter().all(|error| error.abs() < 3e-16), "{turn}");
            }
        }
        assert!(sin_cos(f64::NAN).0.is_nan() && sin_cos(f64::INFINITY).1.is_nan());
    }
}
