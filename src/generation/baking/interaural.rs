//! Interaural delays by cross-correlation from 0.3 to 1.5 kHz, where listeners rely on them \[WIGHTMAN92\].
//!
//! A pure delay shifts a cross-correlation by itself exactly: the delay that a pair of filters needs is the wanted lag less
//! the filters' own.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

/// Band of the cross-correlation.
pub(super) const LOW_HZ: f64 = 300.0;
pub(super) const HIGH_HZ: f64 = 1500.0;
/// Largest interaural delay in seconds: a head of 13 cm radius.
const LONGEST_S: f64 = 1.1e-3;
/// First search of the peak; a period of 1.5 kHz is 667 us.
const STEP_S: f64 = 20e-6;
/// Frequency step of responses that are evaluated here; they have up to 3 ms.
const RESPONSE_STEP_HZ: f64 = 25.0;

/// A complex number as real and imaginary part.
pub(super) type Complex = [f64; 2];

/// `a · conj(b)`.
fn times_conjugate([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a * c + b * d, b * c - a * d]
}

/// The lag of the largest cross-correlation in seconds, from the cross-spectrum left × conj(right) at frequencies from
/// `first_hz` in equal steps. Positive if the right ear is later.
pub(super) fn lag_s(cross: &[Complex], first_hz: f64, step_hz: f64) -> f64 {
    let correlation = |lag_s: f64| -> f64 {
        let mut turn = (-TAU * first_hz * lag_s).sin_cos();
        let step = (-TAU * step_hz * lag_s).sin_cos();
        let mut sum = 0.0;
        for [re, im] in cross {
            let (sin, cos) = turn;
            sum += re * cos - im * sin;
            turn = (sin * step.1 + cos * step.0, cos * step.1 - sin * step.0);
        }
        sum
    };
    let steps = (LONGEST_S / STEP_S) as i32;
    let lags = (-steps..=steps).map(|n| f64::from(n) * STEP_S);
    let peak = lags.map(|lag| (correlation(lag), lag));
    let (_, mut best) = peak.fold((f64::MIN, 0.0), |a, b| if b.0 > a.0 { b } else { a });
    // Parabolas around the peak converge on it: the correlation is smooth.
    let mut half = STEP_S;
    for _ in 0..3 {
        let [before, at, after] = [best - half, best, best + half].map(correlation);
        let bend = before - 2.0 * at + after;
        if bend < 0.0 {
            best += (0.5 * half * (before - after) / bend).clamp(-half, half);
        }
        half *= 0.25;
    }
    best
}

/// The lag between two spectra in seconds; positive if the right one is later.
pub(super) fn lag_of_spectra_s(
    left: &[Complex],
    right: &[Complex],
    first_hz: f64,
    step_hz: f64,
) -> f64 {
    let pairs = left.iter().zip(right);
    let cross: Vec<Complex> = pairs.map(|(l, r)| times_conjugate(*l, *r)).collect();
    lag_s(&cross, first_hz, step_hz)
}

/// The spectrum of a response at `count` frequencies from `first_hz` in equal steps.
pub(super) fn spectrum(
    response: &[f64],
    rate_hz: f64,
    first_hz: f64,
    step_hz: f64,
    count: usize,
) -> Vec<Complex> {
    let bin = |n: usize| {
        let angle = -TAU * (first_hz + n as f64 * step_hz) / rate_hz;
        let samples = response.iter().enumerate();
        samples.fold([0.0; 2], |[re, im], (tap, value)| {
            let (sin, cos) = (angle * tap as f64).sin_cos();
            [re + value * cos, im + value * sin]
        })
    };
    (0..count).map(bin).collect()
}

/// Spectra of shared filters in the band.
pub(super) struct BandPhase {
    filters: Vec<Vec<Complex>>,
}

impl BandPhase {
    pub(super) fn new(rate_hz: f64, basis: &[Vec<f64>]) -> Self {
        let count = ((HIGH_HZ - LOW_HZ) / RESPONSE_STEP_HZ) as usize + 1;
        let of = |filter: &Vec<f64>| spectrum(filter, rate_hz, LOW_HZ, RESPONSE_STEP_HZ, count);
        Self {
            filters: basis.iter().map(of).collect(),
        }
    }

    /// The lag between the sums of both ears in seconds; positive if the right ear is later.
    pub(super) fn delay_s(&self, left: &[f64], right: &[f64]) -> f64 {
        let [left, right] = [left, right].map(|weights| self.sum(weights));
        lag_of_spectra_s(&left, &right, LOW_HZ, RESPONSE_STEP_HZ)
    }

    fn sum(&self, weights: &[f64]) -> Vec<Complex> {
        let count = self.filters.first().map_or(0, Vec::len);
        let mut sum = vec![[0.0; 2]; count];
        for (filter, weight) in self.filters.iter().zip(weights) {
            for ([re, im], value) in sum.iter_mut().zip(filter) {
                *re += weight * value[0];
                *im += weight * value[1];
            }
        }
        sum
    }
}

/// The angle of a direction (+x right) from the median plane, positive to the left.
fn lateral(direction: DVec3) -> f64 {
    (-direction.x).clamp(-1.0, 1.0).asin()
}

/// Interaural delay of a sphere, right less left, in units of its radius over the speed of sound \[WOODWORTH54\].
pub(super) fn sphere_difference(direction: DVec3) -> f64 {
    let angle = lateral(direction);
    angle + angle.sin()
}

/// Mean of both ears' delays behind the sphere's centre, in the same units.
pub(super) fn sphere_mean(direction: DVec3) -> f64 {
    let angle = lateral(direction).abs().min(FRAC_PI_2);
    0.5 * (angle - angle.sin())
}

/// Radius over speed of sound, in seconds, of the sphere that comes closest to measured interaural delays.
pub(super) fn head_time_s(directions: &[DVec3], delays_s: &[f64]) -> f64 {
    let sums = directions
        .iter()
        .zip(delays_s)
        .fold([0.0; 2], |[a, b], (direction, delay_s)| {
            let sphere = sphere_difference(*direction);
            [a + sphere * delay_s, b + sphere * sphere]
        });
    if sums[1] > 0.0 {
        sums[0] / sums[1]
    } else {
        0.0
    }
}
