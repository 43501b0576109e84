//! Converts target amplitudes at the band centres into gains of overlapping bands.
//!
//! Construction: control side. [`BandCorrection::gains`]: audio side (64 multiplications per path and graphics frame).
//!
//! Linkwitz-Riley bands overlap: a single band at unit gain has a response of only 0.64 at its own centre, and its
//! neighbours contribute the rest. All bands are in phase: the response at centre b is `Σ_k M_bk h_k` with real shares M,
//! and `h = M⁻¹ g` makes it exactly the target `g_b`. Rows of M sum to one: equal amplitudes remain equal gains.
//! Between the centres the response may overshoot: by 0.83 dB at a step from 1 to 0, less for smooth spectra. Below the
//! lowest and above the highest centre it continues with its slope there.

use crate::acoustics::bands::CENTRES_HZ;
use crate::acoustics::{BANDS, BandArray};
use crate::simd::F32x8;

use crate::generation::bands::band_filter::band_shares;

/// The inverse of the shares each band has at each band centre.
#[derive(Debug, Clone)]
pub struct BandCorrection {
    columns: [F32x8; BANDS],
}

impl BandCorrection {
    /// The correction for one sample rate. Control side. Range: as [`crate::generation::BandFilter::new`].
    pub fn new(rate_hz: u32) -> Self {
        let shares = CENTRES_HZ.map(|centre_hz| band_shares(f64::from(rate_hz), centre_hz));
        let inverse = invert(shares);
        let mut columns = [F32x8::ZERO; BANDS];
        for (k, column) in columns.iter_mut().enumerate() {
            for (b, row) in inverse.iter().enumerate() {
                column.0[b] = row[k] as f32;
            }
        }
        Self { columns }
    }

    /// No correction: gains are amplitudes.
    #[cfg(test)]
    pub(crate) fn none() -> Self {
        let mut columns = [F32x8::ZERO; BANDS];
        for (k, column) in columns.iter_mut().enumerate() {
            column.0[k] = 1.0;
        }
        Self { columns }
    }

    /// Linear gains of the bands for which the response at every centre is `amplitude`. Real-time: no allocation.
    #[inline]
    pub fn gains(&self, amplitude: &BandArray) -> F32x8 {
        let mut gains = F32x8::ZERO;
        for (column, &value) in self.columns.iter().zip(amplitude) {
            gains += *column * F32x8::splat(value);
        }
        gains
    }
}

/// Inverse of a matrix whose pivots lie on its diagonal: Gauss-Jordan.
pub(crate) fn invert(mut matrix: [[f64; BANDS]; BANDS]) -> [[f64; BANDS]; BANDS] {
    let mut inverse = [[0.0; BANDS]; BANDS];
    for (i, row) in inverse.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for pivot in 0..BANDS {
        let scale = 1.0 / matrix[pivot][pivot];
        matrix[pivot] = matrix[pivot].map(|v| v * scale);
        inverse[pivot] = inverse[pivot].map(|v| v * scale);
        for row in (0..BANDS).filter(|&row| row != pivot) {
            let factor = matrix[row][pivot];
            for k in 0..BANDS {
                matrix[row][k] -= factor * matrix[pivot][k];
                inverse[row][k] -= factor * inverse[pivot][k];
            }
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn response_at_every_centre_is_the_target_amplitude() {
        for rate_hz in [44_100, 48_000] {
            let correction = BandCorrection::new(rate_hz);
            let targets = [1.0, 0.9, 0.5, 0.7, 0.2, 0.1, -0.3, 0.05];
            let gains = correction.gains(&targets);
            for (centre_hz, &target) in CENTRES_HZ.iter().zip(&targets) {
                let shares = band_shares(f64::from(rate_hz), *centre_hz);
                let response: f64 = shares
                    .iter()
                    .zip(gains.0)
                    .map(|(share, gain)| share * f64::from(gain))
                    .sum();
                // Eight products of f32 gains below 2 in magnitude: 8 × 2 × 6e-8.
                assert!((response - f64::from(target)).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn equal_amplitudes_are_equal_gains() {
        let gains = BandCorrection::new(48_000).gains(&[0.5; BANDS]);
        for gain in gains.0 {
            assert!((gain - 0.5).abs() < 1e-6);
        }
    }

    #[test]
    fn response_between_centres_overshoots_little() {
        let correction = BandCorrection::new(44_100);
        let mut worst = 0.0f64;
        let mut worst_step = 0.0f64;
        for i in 0..=1600 {
            let frequency_hz = 20.0 * 10f64.powf(3.0 * f64::from(i) / 1600.0);
            let shares = band_shares(44_100.0, frequency_hz);
            let mut sum = 0.0;
            let mut step = 0.0;
            for b in 0..BANDS {
                let mut unit = [0.0; BANDS];
                unit[b] = 1.0;
                let gains = correction.gains(&unit);
                let response: f64 = (0..BANDS).map(|k| shares[k] * f64::from(gains.0[k])).sum();
                sum += response.abs();
                if b < 4 {
                    step += response;
                }
            }
            worst = worst.max(sum);
            worst_step = worst_step.max(step);
        }
        // The first occurs below 63 Hz for amplitudes of one and alternating sign, the second at a step from 1 to 0.
        assert!(worst < 2.0, "{worst}");
        assert!(worst_step < 1.11, "{worst_step}");
    }
}
