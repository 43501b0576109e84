//! How far a set is from the measurement it was made of: interaural delays and levels.
//!
//! Control side. Compared at every measured direction, with the interpolation that rendering uses. Levels are compared after
//! diffuse-field equalisation of the measurement, which the set has too.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::error::Result;
use crate::generation::Hrtf;
use crate::simd::F32x8;

use super::DIRECTIONS;
use super::interaural::{Complex, HIGH_HZ, LOW_HZ, lag_of_spectra_s, spectrum};
use super::sofa_file::Measurement;
use super::sphere_grid;

/// Frequency step of the comparison in Hz: responses of 40 ms.
const STEP_HZ: f64 = 25.0;
const LOWEST_HZ: f64 = 200.0;
const HIGHEST_HZ: f64 = 11_400.0;
/// What counts as near.
const NEAR_S: f64 = 20e-6;
const NEAR_DB: f64 = 1.0;
/// Octave bands, and third-octave bands from 250 Hz to 10 kHz.
const OCTAVES_HZ: [f64; 6] = [250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];
const THIRDS: std::ops::RangeInclusive<i32> = -6..=10;

/// Differences between a set and its measurement.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct HrtfAccuracy {
    /// Measured directions.
    pub directions: usize,
    /// Interaural delay by cross-correlation from 0.3 to 1.5 kHz.
    pub interaural_delay: DelayErrors,
    /// Interaural phase delay at 250, 500 and 1000 Hz: mean absolute difference in seconds.
    pub phase_delay_s: [f64; 3],
    /// Levels of octave bands from 250 Hz to 8 kHz.
    pub octaves: LevelErrors,
    /// Levels of third-octave bands from 250 Hz to 10 kHz.
    pub thirds: LevelErrors,
}

/// Errors of interaural delays.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct DelayErrors {
    /// Share of directions within 20 us.
    pub within_20_us: f64,
    /// Mean absolute error in seconds.
    pub mean_s: f64,
    /// Largest error in seconds.
    pub worst_s: f64,
}

/// Errors of band levels over all directions, ears and bands.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct LevelErrors {
    /// Share within 1 dB.
    pub within_1_db: f64,
    /// Mean absolute error in dB.
    pub mean_db: f64,
    /// Largest error in dB.
    pub worst_db: f64,
}

impl HrtfAccuracy {
    /// Compares a set with a SOFA file's content. Takes some seconds.
    ///
    /// Errors: [`Error::Format`](crate::Error::Format) with `name` for a file that is refused.
    pub fn compare(set: &Hrtf, sofa: &[u8], name: &str) -> Result<Self> {
        let measured = Measurement::read(sofa, name)?;
        let count = measured.directions.len();
        let shares = sphere_grid::shares(&measured.directions, DIRECTIONS);
        let filters = Filters::of(set);
        let raw: Vec<[Vec<Complex>; 2]> = (0..count)
            .map(|n| std::array::from_fn(|ear| raw_spectrum(&measured, n, ear)))
            .collect();
        let rendered: Vec<[Vec<Complex>; 2]> = measured
            .directions
            .iter()
            .map(|d| filters.spectra(set, *d))
            .collect();
        let mut diffuse = vec![0.0; bins()];
        for (ears, share) in raw.iter().zip(&shares) {
            for spectrum in ears {
                for (sum, bin) in diffuse.iter_mut().zip(spectrum) {
                    *sum += 0.5 * share * power(bin);
                }
            }
        }
        let octaves: Vec<[f64; 2]> = OCTAVES_HZ.map(|hz| band(hz, 0.5)).to_vec();
        let thirds: Vec<[f64; 2]> = THIRDS
            .map(|n| band(1000.0 * (f64::from(n) / 3.0).exp2(), 1.0 / 6.0))
            .collect();
        Ok(Self {
            directions: count,
            interaural_delay: delay_errors(&raw, &rendered),
            phase_delay_s: [250.0, 500.0, 1000.0]
                .map(|hz| phase_delay_error_s(&raw, &rendered, hz)),
            octaves: level_errors(&raw, &rendered, &diffuse, &octaves),
            thirds: level_errors(&raw, &rendered, &diffuse, &thirds),
        })
    }
}

fn bins() -> usize {
    ((HIGHEST_HZ - LOWEST_HZ) / STEP_HZ) as usize
}

/// Frequency of a bin in Hz.
fn frequency(bin: usize) -> f64 {
    LOWEST_HZ + bin as f64 * STEP_HZ
}

fn bin(hz: f64) -> usize {
    ((hz - LOWEST_HZ) / STEP_HZ).round() as usize
}

fn band(centre_hz: f64, half_octaves: f64) -> [f64; 2] {
    [
        centre_hz * (-half_octaves).exp2(),
        centre_hz * half_octaves.exp2(),
    ]
}

fn power([re, im]: &Complex) -> f64 {
    re * re + im * im
}

/// Turns a spectrum by a delay.
fn delayed(spectrum: &mut [Complex], delay_s: f64) {
    for (n, [re, im]) in spectrum.iter_mut().enumerate() {
        let (sin, cos) = (-TAU * frequency(n) * delay_s).sin_cos();
        (*re, *im) = (*re * cos - *im * sin, *re * sin + *im * cos);
    }
}

fn raw_spectrum(measured: &Measurement, direction: usize, ear: usize) -> Vec<Complex> {
    let response = measured.response(direction, ear);
    let response: Vec<f64> = response.iter().map(|sample| f64::from(*sample)).collect();
    let mut found = spectrum(
        &response,
        f64::from(measured.rate_hz),
        LOWEST_HZ,
        STEP_HZ,
        bins(),
    );
    delayed(&mut found, measured.delays_s[direction][ear]);
    found
}

/// Spectra of a set's shared filters.
struct Filters {
    spectra: Vec<Vec<Complex>>,
    rate_hz: f64,
}

impl Filters {
    fn of(set: &Hrtf) -> Self {
        let rate_hz = f64::from(set.rate_hz());
        let lanes = (0..set.groups()).flat_map(|group| (0..8).map(move |lane| (group, lane)));
        let of_lane = |(group, lane): (usize, usize)| {
            let taps: Vec<f64> = set
                .basis(group)
                .iter()
                .map(|tap| f64::from(tap.0[lane]))
                .collect();
            spectrum(&taps, rate_hz, LOWEST_HZ, STEP_HZ, bins())
        };
        Self {
            spectra: lanes.map(of_lane).collect(),
            rate_hz,
        }
    }

    /// Spectra of both ears for a direction.
    fn spectra(&self, set: &Hrtf, direction: DVec3) -> [Vec<Complex>; 2] {
        let mut weights = vec![F32x8::ZERO; 2 * set.groups()];
        let delays = set.look_up(direction.as_vec3(), &mut weights);
        std::array::from_fn(|ear| {
            let mut sum = vec![[0.0; 2]; bins()];
            let of_ear = weights[ear * set.groups()..][..set.groups()].iter();
            let lanes = of_ear.flat_map(|group| group.0);
            for (weight, filter) in lanes.zip(&self.spectra) {
                for ([re, im], bin) in sum.iter_mut().zip(filter) {
                    *re += f64::from(weight) * bin[0];
                    *im += f64::from(weight) * bin[1];
                }
            }
            delayed(&mut sum, f64::from(delays[ear]) / self.rate_hz);
            sum
        })
    }
}

fn delay_errors(raw: &[[Vec<Complex>; 2]], rendered: &[[Vec<Complex>; 2]]) -> DelayErrors {
    let range = bin(LOW_HZ)..bin(HIGH_HZ) + 1;
    let lag_s = |[left, right]: &[Vec<Complex>; 2]| {
        lag_of_spectra_s(&left[range.clone()], &right[range.clone()], LOW_HZ, STEP_HZ)
    };
    let errors = raw
        .iter()
        .zip(rendered)
        .map(|(raw, rendered)| (lag_s(rendered) - lag_s(raw)).abs());
    let errors: Vec<f64> = errors.collect();
    let count = errors.len() as f64;
    DelayErrors {
        within_20_us: errors.iter().filter(|error| **error <= NEAR_S).count() as f64 / count,
        mean_s: errors.iter().sum::<f64>() / count,
        worst_s: errors.iter().copied().fold(0.0, f64::max),
    }
}

fn phase_delay_error_s(raw: &[[Vec<Complex>; 2]], rendered: &[[Vec<Complex>; 2]], hz: f64) -> f64 {
    let at = bin(hz);
    let phase = |[left, right]: &[Vec<Complex>; 2]| {
        let [[a, b], [c, d]] = [left[at], right[at]];
        (b * c - a * d).atan2(a * c + b * d) / TAU
    };
    let errors = raw.iter().zip(rendered).map(|(raw, rendered)| {
        let turns = phase(rendered) - phase(raw);
        (turns - turns.round()).abs() / hz
    });
    errors.sum::<f64>() / raw.len() as f64
}

fn level_errors(
    raw: &[[Vec<Complex>; 2]],
    rendered: &[[Vec<Complex>; 2]],
    diffuse: &[f64],
    bands: &[[f64; 2]],
) -> LevelErrors {
    let mut errors = Vec::with_capacity(2 * raw.len() * bands.len());
    for (raw, rendered) in raw.iter().flatten().zip(rendered.iter().flatten()) {
        for &[low_hz, high_hz] in bands {
            let in_band = (0..bins()).filter(|n| (low_hz..high_hz).contains(&frequency(*n)));
            let sums = in_band.fold([0.0; 2], |[a, b], n| {
                [
                    a + power(&raw[n]) / diffuse[n].max(1e-30),
                    b + power(&rendered[n]),
                ]
            });
            errors.push((10.0 * (sums[1] / sums[0].max(1e-30)).log10()).abs());
        }
    }
    let count = errors.len() as f64;
    LevelErrors {
        within_1_db: errors.iter().filter(|error| **error <= NEAR_DB).count() as f64 / count,
        mean_db: errors.iter().sum::<f64>() / count,
        worst_db: errors.iter().copied().fold(0.0, f64::max),
    }
}
