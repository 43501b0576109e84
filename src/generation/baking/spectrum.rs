//! Levels of measured responses at the frequencies of another sample rate, and minimum-phase responses of levels.
//!
//! Resampling is no step of its own: two transforms of lengths in the ratio of the sample rates have the same frequency step.

use std::f64::consts::PI;

use realfft::RealFftPlanner;
use realfft::num_complex::Complex as FftComplex;

use crate::error::{Error, Result};

use super::interaural::{Complex, HIGH_HZ, LOW_HZ, lag_of_spectra_s};
use super::sofa_file::Measurement;

/// Least and greatest length of a transform.
const LENGTHS: [u32; 2] = [2048, 16_384];
/// Measurements carry little below: loudspeakers roll off. From here down the level in dB falls linearly to 0 at 0 Hz, where
/// the head casts no shadow.
const LOWEST_HZ: f64 = 200.0;
/// From [`BLEND_HZ`] to [`HELD_ABOVE_HZ`] the level goes over to its mean from [`HELD_FROM_HZ`] on, which holds above: beyond
/// are the filters of the measurement. Lower in proportion for sets of low sample rates.
const HELD_FROM_HZ: f64 = 14_000.0;
const BLEND_HZ: f64 = 16_000.0;
const HELD_ABOVE_HZ: f64 = 18_000.0;
/// Highest measured frequency that is used, as a share of the sample rate.
const HIGHEST_SHARE: f64 = 0.41;
/// Least magnitude relative to the largest: −100 dB.
const FLOOR: f64 = 1e-5;

/// Levels and interaural delays of measurements, for a sample rate.
pub(super) struct Spectra {
    /// Length of transforms at the wanted rate.
    length: usize,
    step_hz: f64,
    /// Natural logarithms of magnitudes by direction, of both ears.
    levels: [Vec<Vec<f64>>; 2],
    interaural_delays_s: Vec<f64>,
}

impl Spectra {
    /// Errors: [`Error::Format`] with `name` for two sample rates without a ratio of small numbers.
    pub(super) fn new(measured: &Measurement, rate_hz: u32, name: &str) -> Result<Self> {
        let divisor = gcd(measured.rate_hz, rate_hz);
        let unit = rate_hz / divisor;
        // Even lengths: the highest frequency is then a bin.
        let times = LENGTHS[0].div_ceil(unit).next_multiple_of(2);
        if unit.saturating_mul(times) > LENGTHS[1] {
            let problem = format!(
                "a sample rate of {} Hz, which {rate_hz} Hz has no ratio of small numbers to",
                measured.rate_hz
            );
            return Err(Error::format(
                name,
                None,
                problem,
                "resample the file to 44100 or 48000 Hz",
            ));
        }
        let length = (unit * times) as usize;
        let measured_length = (measured.rate_hz / divisor * times) as usize;
        let step_hz = f64::from(divisor) / f64::from(times);
        let mut spectra = Self {
            length,
            step_hz,
            levels: [Vec::new(), Vec::new()],
            interaural_delays_s: Vec::with_capacity(measured.directions.len()),
        };
        let mut planner = RealFftPlanner::<f64>::new();
        let transform = planner.plan_fft_forward(measured_length);
        let mut signal = transform.make_input_vec();
        let mut bins = transform.make_output_vec();
        let band = (LOW_HZ / step_hz).ceil() as usize..(HIGH_HZ / step_hz) as usize + 1;
        for direction in 0..measured.directions.len() {
            let mut in_band: [Vec<Complex>; 2] = [Vec::new(), Vec::new()];
            for ear in 0..2 {
                fill(&mut signal, measured.response(direction, ear));
                // Lengths fit by construction.
                if transform.process(&mut signal, &mut bins).is_err() {
                    continue;
                }
                spectra.levels[ear].push(spectra.levels_of(&bins, f64::from(measured.rate_hz)));
                in_band[ear] = band
                    .clone()
                    .map(|bin| [bins[bin].re, bins[bin].im])
                    .collect();
            }
            let [left, right] = &in_band;
            let [left_delay_s, right_delay_s] = measured.delays_s[direction];
            let lag_s = lag_of_spectra_s(left, right, band.start as f64 * step_hz, step_hz);
            spectra
                .interaural_delays_s
                .push(lag_s + right_delay_s - left_delay_s);
        }
        Ok(spectra)
    }

    /// Natural logarithms of an ear's magnitudes by direction.
    pub(super) fn levels(&self, ear: usize) -> &[Vec<f64>] {
        &self.levels[ear]
    }

    /// By direction, right less left.
    pub(super) fn interaural_delays_s(&self) -> &[f64] {
        &self.interaural_delays_s
    }

    /// Levels of measured bins, held above their highest valid frequency.
    fn levels_of(&self, bins: &[FftComplex<f64>], measured_rate_hz: f64) -> Vec<f64> {
        let highest_hz = HELD_ABOVE_HZ.min(HIGHEST_SHARE * measured_rate_hz);
        let [from_hz, blend_hz] =
            [HELD_FROM_HZ, BLEND_HZ].map(|hz| hz * highest_hz / HELD_ABOVE_HZ);
        let largest = bins.iter().map(|bin| bin.norm()).fold(1e-30, f64::max);
        let count = self.length / 2 + 1;
        let mut levels: Vec<f64> = bins
            .iter()
            .take(count)
            .map(|bin| bin.norm().max(FLOOR * largest).ln())
            .collect();
        let bin = |hz: f64| ((hz / self.step_hz) as usize).min(levels.len());
        let held = &levels[bin(from_hz)..bin(highest_hz)];
        let mean = held.iter().sum::<f64>() / held.len().max(1) as f64;
        levels.resize(count, mean);
        for (bin, level) in levels.iter_mut().enumerate() {
            let hz = bin as f64 * self.step_hz;
            let share = ((hz - blend_hz) / (highest_hz - blend_hz)).clamp(0.0, 1.0);
            *level += share * (mean - *level);
        }
        levels
    }

    /// Minimum-phase responses of levels, by the cepstrum; the last quarter of the taps fades out.
    pub(super) fn minimum_phase(&self, levels: &[Vec<f64>], taps: usize) -> Vec<Vec<f64>> {
        let mut planner = RealFftPlanner::<f64>::new();
        let forward = planner.plan_fft_forward(self.length);
        let inverse = planner.plan_fft_inverse(self.length);
        let mut time = forward.make_input_vec();
        let mut bins = forward.make_output_vec();
        let (half, scale) = (self.length / 2, 1.0 / self.length as f64);
        let mut responses = Vec::with_capacity(levels.len());
        for levels in levels {
            for (bin, level) in bins.iter_mut().zip(levels) {
                *bin = FftComplex::new(*level, 0.0);
            }
            let mut done = inverse.process(&mut bins, &mut time).is_ok();
            // The cepstrum's second half is folded onto its first.
            for (index, value) in time.iter_mut().enumerate() {
                *value *= match index {
                    0 => scale,
                    _ if index < half => 2.0 * scale,
                    _ if index == half => scale,
                    _ => 0.0,
                };
            }
            done &= forward.process(&mut time, &mut bins).is_ok();
            for bin in &mut bins {
                *bin = bin.exp();
            }
            for edge in [0, half] {
                bins[edge].im = 0.0;
            }
            done &= inverse.process(&mut bins, &mut time).is_ok();
            debug_assert!(done, "transforms of their own buffers");
            let fade = taps / 4;
            let response = time[..taps].iter().enumerate().map(|(tap, value)| {
                let faded = (tap + fade).saturating_sub(taps) as f64;
                let gain = match tap + fade >= taps {
                    true => 0.5 + 0.5 * (PI * (faded + 0.5) / fade as f64).cos(),
                    false => 1.0,
                };
                scale * gain * value
            });
            responses.push(response.collect());
        }
        responses
    }
}

/// Makes the mean power over the sphere and both ears flat, and the low end transparent.
pub(super) fn equalise(
    mut levels: [Vec<Vec<f64>>; 2],
    areas: &[f64],
    spectra: &Spectra,
) -> [Vec<Vec<f64>>; 2] {
    let count = spectra.length / 2 + 1;
    let mut power = vec![0.0; count];
    for ear in &levels {
        for (row, area) in ear.iter().zip(areas) {
            for (sum, level) in power.iter_mut().zip(row) {
                *sum += 0.5 * area * (2.0 * level).exp();
            }
        }
    }
    let common: Vec<f64> = power.iter().map(|power| 0.5 * power.ln()).collect();
    let lowest = (LOWEST_HZ / spectra.step_hz).ceil() as usize;
    for row in levels.iter_mut().flatten() {
        for (level, common) in row.iter_mut().zip(&common) {
            *level -= common;
        }
        let edge = row[lowest];
        for (bin, level) in row[..lowest].iter_mut().enumerate() {
            *level = edge * bin as f64 / lowest as f64;
        }
    }
    levels
}

/// Copies a response into a transform's input; one that is longer fades out within its last eighth.
fn fill(signal: &mut [f64], response: &[f32]) {
    signal.fill(0.0);
    let length = signal.len();
    for (sample, value) in signal.iter_mut().zip(response) {
        *sample = f64::from(*value);
    }
    if response.len() > length {
        let fade = length / 8;
        for (index, sample) in signal[length - fade..].iter_mut().enumerate() {
            *sample *= 0.5 + 0.5 * (PI * (index as f64 + 0.5) / fade as f64).cos();
        }
    }
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
