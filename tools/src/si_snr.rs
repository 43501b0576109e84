//! Scale-invariant signal-to-noise ratio of an estimate against a reference.
//!
//! Literal after Eq. 5 and 6 of the paper: the mean of each channel is removed, the estimate is projected onto the
//! reference, the remainder is noise. Accumulated in f64.

/// Highest printed ratio in dB; the paper prints "> 40" above.
pub const CAP_DB: f64 = 40.0;

/// Least energy of numerator and denominator: keeps silence and identity finite.
const LEAST_ENERGY: f64 = 1e-20;

/// SI-SNR of one channel in dB, not capped. The longer signal is cut to the shorter one's length.
///
/// Identical signals give a large finite figure (above 150 dB for speech), a silent reference a large negative one.
pub fn si_snr_db<S: Copy + Into<f64>>(reference: &[S], estimate: &[S]) -> f64 {
    let length = reference.len().min(estimate.len());
    if length == 0 {
        return 0.0;
    }
    let mean = |x: &[S]| x.iter().map(|&s| s.into()).sum::<f64>() / length as f64;
    let (reference, estimate) = (&reference[..length], &estimate[..length]);
    let (reference_mean, estimate_mean) = (mean(reference), mean(estimate));
    let pairs = || {
        let pairs = reference.iter().zip(estimate);
        pairs.map(|(&r, &e)| (r.into() - reference_mean, e.into() - estimate_mean))
    };
    let (product, energy) = pairs().fold((0.0, 0.0), |(p, n), (r, e)| (p + r * e, n + r * r));
    let scale = product / energy.max(LEAST_ENERGY);
    let (target, noise) = pairs().fold((0.0, 0.0), |(t, n), (r, e)| {
        let target = scale * r;
        (t + target * target, n + (e - target) * (e - target))
    });
    10.0 * (target.max(LEAST_ENERGY) / noise.max(LEAST_ENERGY)).log10()
}

/// SI-SNR in dB of each ear by itself, averaged, not capped.
pub fn si_snr_ears_db<S: Copy + Into<f64>>(reference: [&[S]; 2], estimate: [&[S]; 2]) -> f64 {
    (si_snr_db(reference[0], estimate[0]) + si_snr_db(reference[1], estimate[1])) / 2.0
}

/// The ratio as the paper prints it: two decimals, or "> 40".
pub fn capped_text(si_snr_db: f64) -> String {
    if si_snr_db > CAP_DB {
        format!("> {CAP_DB:.0}")
    } else {
        format!("{si_snr_db:.2}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // The oracle is si_snr_db() of shared/tools/metrics.py (numpy 2, f64), called on these two vectors.
    const REFERENCE: [f64; 12] = [
        0.31, -0.42, 0.07, 0.55, -0.63, 0.18, 0.02, -0.27, 0.44, 0.36, -0.51, 0.09,
    ];
    const ESTIMATE: [f64; 12] = [
        0.28, -0.35, 0.11, 0.49, -0.66, 0.25, -0.04, -0.22, 0.47, 0.28, -0.43, 0.15,
    ];

    const ORACLE_DB: f64 = 16.622_204_816_348_48;

    #[test]
    fn agrees_with_the_oracle() {
        assert!((si_snr_db(&REFERENCE, &ESTIMATE) - ORACLE_DB).abs() < 1e-9);
    }

    #[test]
    fn ears_are_averaged_in_decibels() {
        let same_db = si_snr_db(&REFERENCE, &REFERENCE);
        let ears_db = si_snr_ears_db([&REFERENCE, &REFERENCE], [&ESTIMATE, &REFERENCE]);
        assert!((ears_db - (ORACLE_DB + same_db) / 2.0).abs() < 1e-9);
    }

    #[test]
    fn scale_and_offset_of_the_estimate_do_not_matter() {
        let plain = si_snr_db(&REFERENCE, &ESTIMATE);
        let changed = ESTIMATE.map(|s| -3.7 * s + 0.2);
        assert!((si_snr_db(&REFERENCE, &changed) - plain).abs() < 1e-9);
    }

    #[test]
    fn known_noise_has_its_own_ratio() {
        // Noise orthogonal to the reference with a tenth of its amplitude: 20 dB, exactly.
        let reference: Vec<f32> = (0..400).map(|i| [1.0, 1.0, -1.0, -1.0][i % 4]).collect();
        let estimate: Vec<f32> = (0..400)
            .map(|i| reference[i] + [0.125, -0.125, -0.125, 0.125][i % 4])
            .collect();
        let expected_db = 20.0 * 8f64.log10();
        assert!((si_snr_db(&reference, &estimate) - expected_db).abs() < 1e-9);
    }

    #[test]
    fn silence_and_identity_stay_finite_and_are_capped() {
        let same = si_snr_db(&REFERENCE, &REFERENCE);
        assert!(same.is_finite() && same > 150.0);
        assert_eq!(capped_text(same), "> 40");
        assert_eq!(capped_text(12.345), "12.35");
        let silence = [0.0f64; 12];
        for (r, e) in [
            (silence, REFERENCE),
            (REFERENCE, silence),
            (silence, silence),
        ] {
            assert!(si_snr_db(&r, &e).is_finite());
        }
        assert_eq!(si_snr_db::<f32>(&[], &[]), 0.0);
    }
}
