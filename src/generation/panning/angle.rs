//! The angle of a point in the plane, without a call of the C library: the same bits on every target.
//!
//! Pure; any thread. Every arrival is looked up by two angles in every graphics frame.

use std::f32::consts::{FRAC_PI_2, PI};

/// `arctan(t) / t - 1` for `t` from 0 to 1 by powers of `t`², highest first: \[ABRAMOWITZ64\] 4.4.49, within 2e-8.
const ARCTAN: [f32; 8] = [
    0.002_866_225_7,
    -0.016_165_737,
    0.042_909_61,
    -0.075_289_64,
    0.106_562_64,
    -0.142_089,
    0.199_935_51,
    -0.333_331_45,
];

/// `y.atan2(x)` within 1e-6 radians where one of the two is at least [`f32::MIN_POSITIVE`]; 0 at the origin, no finite number for NaN.
#[inline]
pub(crate) fn angle(y: f32, x: f32) -> f32 {
    let (along, up) = (x.abs(), y.abs());
    let (low, high) = match up > along {
        true => (along, up),
        false => (up, along),
    };
    let ratio = low / high.max(f32::MIN_POSITIVE);
    let square = ratio * ratio;
    let sum = ARCTAN.iter().fold(0.0, |sum, term| (sum + term) * square);
    let first = ratio + ratio * sum;
    let right = match up > along {
        true => FRAC_PI_2 - first,
        false => first,
    };
    let positive = if x < 0.0 { PI - right } else { right };
    positive.copysign(y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_the_standard_library() {
        let values = [
            -3.0, -1.0, -0.3, -1e-4, -1e-30, 0.0, 2e-38, 0.2, 0.999, 1.0, 7e4,
        ];
        for y in values {
            for x in values {
                // The library tells the two zeros of x apart.
                let expected = f32::atan2(y, x + 0.0);
                assert!((angle(y, x) - expected).abs() < 1e-6, "{y} {x}");
            }
        }
        for step in 0..10_000u16 {
            let turn = f64::from(step) * 1e-3 - 5.0;
            let (sin, cos) = turn.sin_cos();
            let expected = sin.atan2(cos);
            let found = f64::from(angle(sin as f32, cos as f32));
            assert!((found - expected).abs() < 1e-6, "{turn}: {found}");
        }
        assert!(!angle(f32::NAN, 1.0).is_finite() && !angle(1.0, f32::NAN).is_finite());
        assert!(angle(1.0, f32::INFINITY).abs() < 1e-6);
    }
}
