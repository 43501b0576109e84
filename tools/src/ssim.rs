//! Structural similarity of two pictures, and of two sounds by their log-mel spectrograms.
//!
//! Literal after Wang et al. 2004 with the choices of scikit-image's `structural_similarity(gaussian_weights=True,
//! sigma=1.5, use_sample_covariance=False, data_range=1)`: 11 taps, the mean over pixels whose window lies inside.

use super::mel::MelAnalyser;
use foresound::{Error, Result};

/// Standard deviation of the Gaussian window, in pixels.
const SIGMA: f64 = 1.5;
/// Pixels on each side of the window's centre: 3.5 [`SIGMA`], rounded.
const RADIUS: usize = 5;
/// Least width and height of a picture, in pixels: one window.
pub const LEAST_SIZE: usize = 2 * RADIUS + 1;
/// (0.01 × range)² and (0.03 × range)² keep the ratios finite in flat regions; the range is 1.
const C1: f64 = 1e-4;
const C2: f64 = 9e-4;

/// Mean structural similarity of two pictures of `columns` values a row, on a scale from 0 to 1.
///
/// # Errors
/// [`Error::Setting`] if the pictures differ in size or are smaller than [`LEAST_SIZE`].
pub fn ssim(a: &[f64], b: &[f64], columns: usize) -> Result<f64> {
    let map = ssim_map(a, b, columns)?;
    Ok(map.iter().sum::<f64>() / map.len() as f64)
}

/// Structural similarity around each pixel whose window lies inside: [`LEAST_SIZE`] − 1 rows and columns fewer than the
/// pictures have.
///
/// # Errors
/// As [`ssim`].
pub fn ssim_map(a: &[f64], b: &[f64], columns: usize) -> Result<Vec<f64>> {
    let rows = a.len().checked_div(columns).unwrap_or(0);
    if a.len() != b.len() || a.len() != rows * columns {
        return Err(Error::setting(
            "SSIM",
            format!("pictures of {} and {} pixels", a.len(), b.len()),
            "give two pictures of one size",
        ));
    }
    if rows < LEAST_SIZE || columns < LEAST_SIZE {
        return Err(Error::setting(
            "SSIM",
            format!("pictures of {columns} by {rows} pixels"),
            "give longer sounds: a third of a second at least",
        ));
    }
    let product =
        |x: &[f64], y: &[f64]| -> Vec<f64> { x.iter().zip(y).map(|(x, y)| x * y).collect() };
    let [mean_a, mean_b, mean_aa, mean_bb, mean_ab] = [
        a.to_vec(),
        b.to_vec(),
        product(a, a),
        product(b, b),
        product(a, b),
    ]
    .map(|picture| blurred(&picture, columns));
    let map = (0..mean_a.len())
        .map(|i| {
            let (a, b) = (mean_a[i], mean_b[i]);
            let (variance_a, variance_b) = (mean_aa[i] - a * a, mean_bb[i] - b * b);
            let covariance = mean_ab[i] - a * b;
            (2.0 * a * b + C1) * (2.0 * covariance + C2)
                / ((a * a + b * b + C1) * (variance_a + variance_b + C2))
        })
        .collect();
    Ok(map)
}

/// Structural similarity of one channel of two sounds: their log-mel spectrograms, scaled to the 80 dB below the
/// reference's loudest point. The longer sound is cut to the shorter one's length.
///
/// # Errors
/// [`Error::Setting`] if the sounds are too short for one window of the picture.
pub fn mel_ssim(analyser: &MelAnalyser, reference: &[f32], estimate: &[f32]) -> Result<f64> {
    let length = reference.len().min(estimate.len());
    let [a, b] = [reference, estimate].map(|channel| analyser.analyse(&[&channel[..length]]));
    let top_db = a.peak_db();
    ssim(&a.scaled(top_db), &b.scaled(top_db), a.columns)
}

/// [`mel_ssim`] of each ear by itself, averaged.
///
/// # Errors
/// As [`mel_ssim`].
pub fn mel_ssim_ears(
    analyser: &MelAnalyser,
    reference: [&[f32]; 2],
    estimate: [&[f32]; 2],
) -> Result<f64> {
    let left = mel_ssim(analyser, reference[0], estimate[0])?;
    let right = mel_ssim(analyser, reference[1], estimate[1])?;
    Ok((left + right) / 2.0)
}

/// Gaussian means of all windows that lie inside: [`RADIUS`] rows and columns fewer on each side.
fn blurred(picture: &[f64], columns: usize) -> Vec<f64> {
    let taps = gaussian();
    let across: Vec<f64> = picture
        .chunks_exact(columns)
        .flat_map(|row| row.windows(LEAST_SIZE))
        .map(|window| window.iter().zip(&taps).map(|(p, t)| p * t).sum())
        .collect();
    let width = columns + 1 - LEAST_SIZE;
    let height = picture.len() / columns + 1 - LEAST_SIZE;
    let mut blurred = vec![0.0; width * height];
    for (row, out) in blurred.chunks_exact_mut(width).enumerate() {
        for (k, tap) in taps.iter().enumerate() {
            let line = &across[(row + k) * width..][..width];
            out.iter_mut().zip(line).for_each(|(o, p)| *o += tap * p);
        }
    }
    blurred
}

fn gaussian() -> [f64; LEAST_SIZE] {
    let weight = |k: usize| {
        let x = (k as f64 - RADIUS as f64) / SIGMA;
        (-0.5 * x * x).exp()
    };
    let sum: f64 = (0..LEAST_SIZE).map(weight).sum();
    std::array::from_fn(|k| weight(k) / sum)
}

#[cfg(test)]
mod tests {
    use super::super::mel::tests::oracle_pair;
    use super::*;

    // The oracle is ssim() of shared/tools/metrics.py (numpy 2, scikit-image 0.26) on mel::tests::oracle_pair.
    #[test]
    fn agrees_with_the_oracle() {
        for (rate_hz, length, oracle) in [
            (44_100, 44_100, 0.843_022_695_871_849_9),
            (16_000, 24_000, 0.839_112_694_647_153_7),
        ] {
            let [reference, estimate] = oracle_pair(rate_hz, length);
            let analyser = MelAnalyser::new(rate_hz);
            let found = mel_ssim(&analyser, &reference, &estimate).unwrap();
            assert!(
                (found - oracle).abs() < 1e-9,
                "{rate_hz} Hz: {found} for {oracle}"
            );
        }
    }

    #[test]
    fn similarity_is_highest_for_identical_pictures() {
        let [reference, estimate] = oracle_pair(44_100, 22_050);
        let analyser = MelAnalyser::new(44_100);
        let same = mel_ssim(&analyser, &reference, &reference).unwrap();
        assert!((same - 1.0).abs() < 1e-12);
        let both = [&reference[..], &reference[..]];
        let mixed = mel_ssim_ears(&analyser, both, [&reference, &estimate]).unwrap();
        let other = mel_ssim(&analyser, &reference, &estimate).unwrap();
        assert!((mixed - (1.0 + other) / 2.0).abs() < 1e-12);
    }

    #[test]
    fn unequal_or_tiny_pictures_are_refused() {
        assert!(ssim(&[0.0; 121], &[0.0; 132], 11).is_err());
        assert!(ssim(&[0.0; 110], &[0.0; 110], 11).is_err());
        assert!(ssim(&[], &[], 0).is_err());
        assert!((ssim(&[0.5; 121], &[0.5; 121], 11).unwrap() - 1.0).abs() < 1e-12);
        let analyser = MelAnalyser::new(44_100);
        assert!(mel_ssim(&analyser, &[0.0; 3000], &[0.0; 3000]).is_err());
    }
}
