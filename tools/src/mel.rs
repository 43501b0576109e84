//! Log-mel spectrograms.
//!
//! Same figures as `tools/metrics.py` of the measuring rules: Hann window (symmetric), no padding at the ends, mel
//! scale 2595 log10(1 + f / 700) (HTK), triangles of unit area, power in dB above 1e-10. In f64 throughout.

use std::f64::consts::TAU;
use std::sync::Arc;

use realfft::{RealFftPlanner, RealToComplex};

/// Samples a window.
pub const FFT_LENGTH: usize = 2048;
/// Samples from one column to the next.
pub const HOP_LENGTH: usize = 512;
/// Mel bands, lowest first, from 0 Hz to half the sample rate.
pub const MEL_BANDS: usize = 128;
/// Range below the reference's loudest point that counts, in dB.
pub const RANGE_DB: f64 = 80.0;
/// Added to the power before the logarithm: a silent point has −100 dB.
const FLOOR_POWER: f64 = 1e-10;

/// Mel value of a frequency in Hz.
pub fn mel_of_hz(hz: f64) -> f64 {
    2595.0 * (1.0 + hz / 700.0).log10()
}

/// Frequency in Hz of a mel value.
pub fn hz_of_mel(mel: f64) -> f64 {
    700.0 * (10f64.powf(mel / 2595.0) - 1.0)
}

/// Mel spectrogram in dB.
#[derive(Debug, Clone, PartialEq)]
pub struct LogMel {
    /// Number of columns, [`HOP_LENGTH`] samples apart.
    pub columns: usize,
    /// Sample rate of the sound in Hz.
    pub rate_hz: u32,
    /// [`MEL_BANDS`] rows of [`Self::columns`] values, lowest band first.
    pub values_db: Vec<f64>,
}

impl LogMel {
    /// One point in dB.
    pub fn at(&self, band: usize, column: usize) -> f64 {
        self.values_db[band * self.columns + column]
    }

    /// The loudest point in dB; −∞ without columns.
    pub fn peak_db(&self) -> f64 {
        self.values_db
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// Mel band (fractional) whose centre is a frequency: the inverse of the band centres.
    pub fn band_of_hz(&self, hz: f64) -> f64 {
        let top_mel = mel_of_hz(f64::from(self.rate_hz) / 2.0);
        mel_of_hz(hz) / top_mel * (MEL_BANDS + 1) as f64 - 1.0
    }

    /// Every point on a scale from 0 ([`RANGE_DB`] below `top_db`) to 1 (`top_db`), clipped.
    pub fn scaled(&self, top_db: f64) -> Vec<f64> {
        let scale = |db: &f64| ((db - top_db) / RANGE_DB + 1.0).clamp(0.0, 1.0);
        self.values_db.iter().map(scale).collect()
    }
}

/// One triangular filter: weights of neighbouring FFT bins.
struct MelFilter {
    first_bin: usize,
    weights: Vec<f64>,
}

/// Makes log-mel spectrograms of one sample rate.
pub struct MelAnalyser {
    rate_hz: u32,
    window: Vec<f64>,
    filters: Vec<MelFilter>,
    fft: Arc<dyn RealToComplex<f64>>,
}

impl MelAnalyser {
    /// An analyser for a sample rate in Hz.
    pub fn new(rate_hz: u32) -> Self {
        let last = (FFT_LENGTH - 1) as f64;
        Self {
            rate_hz,
            window: (0..FFT_LENGTH)
                .map(|n| 0.5 - 0.5 * (TAU * n as f64 / last).cos())
                .collect(),
            filters: mel_filters(f64::from(rate_hz)),
            fft: RealFftPlanner::new().plan_fft_forward(FFT_LENGTH),
        }
    }

    /// The spectrogram of one or more channels, whose powers are averaged. Cut to the shortest channel; a sound
    /// shorter than [`FFT_LENGTH`] samples has no columns.
    pub fn analyse(&self, channels: &[&[f32]]) -> LogMel {
        let length = channels.iter().map(|c| c.len()).min().unwrap_or(0);
        let columns = (length + HOP_LENGTH).saturating_sub(FFT_LENGTH) / HOP_LENGTH;
        let mut values_db = vec![0.0; MEL_BANDS * columns];
        for column in 0..columns {
            let power = self.power(channels, column * HOP_LENGTH);
            for (band, filter) in self.filters.iter().enumerate() {
                let bins = &power[filter.first_bin..];
                let energy: f64 = filter.weights.iter().zip(bins).map(|(w, p)| w * p).sum();
                values_db[band * columns + column] = 10.0 * (energy + FLOOR_POWER).log10();
            }
        }
        LogMel {
            columns,
            rate_hz: self.rate_hz,
            values_db,
        }
    }

    /// Power a bin of the window that begins at a sample, averaged over channels.
    fn power(&self, channels: &[&[f32]], start: usize) -> Vec<f64> {
        let mut power = vec![0.0; FFT_LENGTH / 2 + 1];
        let mut spectrum = self.fft.make_output_vec();
        for channel in channels {
            let mut frame: Vec<f64> = channel[start..start + FFT_LENGTH]
                .iter()
                .zip(&self.window)
                .map(|(&s, w)| f64::from(s) * w)
                .collect();
            // The lengths are the plan's own, the only source of errors.
            if self.fft.process(&mut frame, &mut spectrum).is_ok() {
                for (sum, bin) in power.iter_mut().zip(&spectrum) {
                    *sum += bin.norm_sqr() / channels.len() as f64;
                }
            }
        }
        power
    }
}

fn mel_filters(rate_hz: f64) -> Vec<MelFilter> {
    let top_mel = mel_of_hz(rate_hz / 2.0);
    let edge = |i: usize| hz_of_mel(top_mel * i as f64 / (MEL_BANDS + 1) as f64);
    let bin_hz = rate_hz / FFT_LENGTH as f64;
    (0..MEL_BANDS)
        .map(|band| {
            let (low, centre, high) = (edge(band), edge(band + 1), edge(band + 2));
            let weight = |bin: usize| {
                let hz = bin as f64 * bin_hz;
                let rising = (hz - low) / (centre - low);
                let falling = (high - hz) / (high - centre);
                rising.min(falling).max(0.0) * 2.0 / (high - low)
            };
            let first_bin = (low / bin_hz) as usize;
            let last_bin = ((high / bin_hz) as usize).min(FFT_LENGTH / 2);
            MelFilter {
                first_bin,
                weights: (first_bin..=last_bin).map(weight).collect(),
            }
        })
        .collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Noise in ±0.5 by a 32-bit congruential generator, exact in f64 and so the same in every language.
    fn noise(seed: u32, length: usize) -> Vec<f64> {
        let mut state = seed;
        (0..length)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1 << 24) - 0.5
            })
            .collect()
    }

    /// The oracle's pair of sounds: three swelling tones in noise, and the same tones, wavering, in more
    /// noise.
    pub(crate) fn oracle_pair(rate_hz: u32, length: usize) -> [Vec<f32>; 2] {
        let (quiet, loud) = (noise(1, length), noise(2, length));
        let tone = |hz: f64, t: f64| (TAU * hz * t).sin();
        (0..length)
            .map(|n| {
                let t = n as f64 / f64::from(rate_hz);
                let swell = 0.5 - 0.5 * (TAU * 3.0 * t).cos();
                let tones = 0.4 * tone(220.0, t) + 0.2 * tone(1330.0, t) + 0.1 * tone(5100.0, t);
                let reference = swell * tones + 0.02 * quiet[n];
                let estimate = 0.9 * reference * (1.0 + 0.3 * tone(7.0, t)) + 0.01 * loud[n];
                (reference as f32, estimate as f32)
            })
            .fold([Vec::new(), Vec::new()], |[mut r, mut e], (a, b)| {
                r.push(a);
                e.push(b);
                [r, e]
            })
    }

    // The oracle is log_mel() of shared/tools/metrics.py (numpy 2) on oracle_pair: five points and the highest of
    // the reference, the sum over the estimate.
    #[test]
    fn agrees_with_the_oracle() {
        let cells = [(0, 0), (3, 10), (17, 5), (60, 20), (127, 40)];
        let cases = [
            (
                (44_100, 44_100, 83),
                [
                    -41.494_288_342_344_53,
                    -31.879_715_852_766_99,
                    -32.296_256_332_953_93,
                    -30.878_561_256_490_464,
                    -29.217_368_799_931_97,
                ],
                (32.137_593_256_417_254, -281_726.982_280_771_54),
            ),
            (
                (16_000, 24_000, 43),
                [
                    -26.533_447_704_776_91,
                    -24.705_131_921_514_262,
                    -28.625_724_468_083_888,
                    -22.396_362_322_577_19,
                    -24.778_997_311_961_348,
                ],
                (34.200_751_963_559_526, -125_242.261_696_015_44),
            ),
        ];
        for ((rate_hz, length, columns), points, (peak_db, sum_db)) in cases {
            let [reference, estimate] = oracle_pair(rate_hz, length);
            let analyser = MelAnalyser::new(rate_hz);
            let mel = analyser.analyse(&[&reference]);
            assert_eq!(mel.columns, columns);
            for ((band, column), db) in cells.iter().zip(points) {
                assert!(
                    (mel.at(*band, *column) - db).abs() < 1e-6,
                    "{band} {column}"
                );
            }
            assert!((mel.peak_db() - peak_db).abs() < 1e-6);
            let sum: f64 = analyser.analyse(&[&estimate]).values_db.iter().sum();
            assert!((sum - sum_db).abs() < 1e-2, "{sum}");
        }
    }

    #[test]
    fn a_tone_peaks_in_its_own_band() {
        let analyser = MelAnalyser::new(44_100);
        for hz in [500.0, 1000.0, 4000.0, 12_000.0] {
            let tone: Vec<f32> = (0..4096)
                .map(|n| (TAU * hz * f64::from(n) / 44_100.0).sin() as f32)
                .collect();
            let mel = analyser.analyse(&[&tone]);
            let loudest = (0..MEL_BANDS).max_by(|&a, &b| mel.at(a, 2).total_cmp(&mel.at(b, 2)));
            let expected = mel.band_of_hz(hz);
            assert!((loudest.unwrap() as f64 - expected).abs() <= 1.0, "{hz} Hz");
        }
    }

    #[test]
    fn powers_of_channels_are_averaged() {
        let [reference, _] = oracle_pair(44_100, 8192);
        let analyser = MelAnalyser::new(44_100);
        let one = analyser.analyse(&[&reference]);
        let both = analyser.analyse(&[&reference, &reference]);
        let half = analyser.analyse(&[&reference, &vec![0.0; 8192]]);
        assert!((one.peak_db() - both.peak_db()).abs() < 1e-9);
        assert!((one.peak_db() - half.peak_db() - 10.0 * 2f64.log10()).abs() < 1e-6);
    }

    #[test]
    fn short_sounds_have_no_columns() {
        let analyser = MelAnalyser::new(44_100);
        assert_eq!(analyser.analyse(&[&[0.0; FFT_LENGTH - 1]]).columns, 0);
        assert_eq!(analyser.analyse(&[&[0.0; FFT_LENGTH]]).columns, 1);
        assert_eq!(analyser.analyse(&[]).columns, 0);
    }
}
