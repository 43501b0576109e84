//! Complex numbers in `f64`.
//!
//! `num-complex` has the same arithmetic, but its `norm` is `hypot`, and `sqrt` and `powf` use polar coordinates: slower,
//! and with other bits.

use std::ops::{Add, AddAssign, Div, Mul, Sub};

use crate::acoustics::BANDS;
use crate::geometry::angle::{atan2, sin_cos};

/// A complex number. Time runs as e^(+jωt): a wave that travels r has the phase e^(−jkr).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Complex {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

/// One complex pressure per band.
pub type ComplexBands = [Complex; BANDS];

impl Complex {
    /// Zero.
    pub const ZERO: Self = Self::new(0.0, 0.0);
    /// One.
    pub const ONE: Self = Self::new(1.0, 0.0);

    /// From its parts.
    #[inline]
    pub const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    /// e^(jφ), φ in radians.
    pub fn cis(phase: f64) -> Self {
        let (im, re) = sin_cos(phase);
        Self { re, im }
    }

    /// Absolute value; its square must be finite.
    #[inline]
    pub fn abs(self) -> f64 {
        (self.re * self.re + self.im * self.im).sqrt()
    }

    /// Principal square root.
    pub fn sqrt(self) -> Self {
        let re = (0.5 * (self.abs() + self.re.abs())).sqrt();
        if re == 0.0 {
            return Self::ZERO;
        }
        let im = 0.5 * self.im / re;
        match self.re >= 0.0 {
            true => Self::new(re, im),
            false => Self::new(im.abs(), re.copysign(self.im)),
        }
    }

    /// Principal value of a real power; the base must not be zero.
    pub fn powf(self, exponent: f64) -> Self {
        let size = (self.re * self.re + self.im * self.im).powf(0.5 * exponent);
        Self::cis(atan2(self.im, self.re) * exponent) * size
    }
}

impl Add for Complex {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        Self::new(self.re + other.re, self.im + other.im)
    }
}

impl AddAssign for Complex {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Complex {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self::new(self.re - other.re, self.im - other.im)
    }
}

impl Mul for Complex {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        Self::new(
            self.re * other.re - self.im * other.im,
            self.re * other.im + self.im * other.re,
        )
    }
}

impl Mul<f64> for Complex {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f64) -> Self {
        Self::new(self.re * factor, self.im * factor)
    }
}

impl Div for Complex {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let size = other.re * other.re + other.im * other.im;
        Self::new(
            (self.re * other.re + self.im * other.im) / size,
            (self.im * other.re - self.re * other.im) / size,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn division_undoes_multiplication() {
        let (a, b) = (Complex::new(0.3, -1.7), Complex::new(-2.1, 0.4));
        assert!((a * b / b - a).abs() < 1e-15);
        for a in [a, b, a * -1.0, b * -1.0] {
            assert!((a.sqrt() * a.sqrt() - a).abs() < 1e-15 && a.sqrt().re >= 0.0);
            let third = a.powf(1.0 / 3.0);
            assert!((third * third * third - a).abs() < 2e-15 && third.re > 0.0);
        }
        assert!((Complex::cis(0.7) * Complex::cis(-0.7) - Complex::ONE).abs() < 1e-15);
    }
}
