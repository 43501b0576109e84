//! The eight octave bands of every spectrum.

/// Number of octave bands. Moves with: `CENTRES_HZ`, `EDGES_HZ`, the band filter and every file format.
pub const BANDS: usize = 8;

/// One value per band, lowest band first.
pub type BandArray = [f32; BANDS];

/// Exact midband frequencies, nominally 63 Hz to 8 kHz: 1000 × 10^(0.3 k), k = −4 … 3 (IEC 61260-1, base ten).
pub const CENTRES_HZ: [f64; BANDS] = [
    63.095_734_448_019_3,
    125.892_541_179_416_7,
    251.188_643_150_958,
    501.187_233_627_272_2,
    1_000.0,
    1_995.262_314_968_88,
    3_981.071_705_534_972,
    7_943.282_347_242_815,
];

/// Nominal midband frequencies in Hz, by which bands are named (IEC 61260-1).
pub const NOMINAL_HZ: [u32; BANDS] = [63, 125, 250, 500, 1000, 2000, 4000, 8000];

/// Crossover frequencies between neighbouring bands: 1000 × 10^(0.3 (k + 0.5)), the geometric means of [`CENTRES_HZ`].
/// The lowest band reaches down to 0 Hz and the highest up to half the sample rate.
pub const EDGES_HZ: [f64; BANDS - 1] = [
    89.125_093_813_374_55,
    177.827_941_003_892_28,
    354.813_389_233_575_46,
    707.945_784_384_137_9,
    1_412.537_544_622_754_3,
    2_818.382_931_264_454,
    5_623.413_251_903_491,
];

/// Pressure ratio of an energy ratio: its square root, 0 below 0. All conversions from energy to amplitude use it.
///
/// ```
/// use foresound::acoustics::bands::amplitude_of_energy;
/// assert_eq!(amplitude_of_energy(0.25), 0.5);
/// ```
#[inline]
pub fn amplitude_of_energy(energy: f32) -> f32 {
    energy.max(0.0).sqrt()
}

/// e^(−x) of each band: the attenuation of x nepers.
///
/// Range: x ≥ 0. The relative error is below 1e-6 (1 + x) up to x = 87; beyond, the result stays at 1e-38. The evaluation
/// is 2^k 2^f with whole k and |f| ≤ ½, the latter by seven terms of its series. It has sums and products only: bands are
/// vector lanes, and all machines give the same bits.
#[inline]
pub fn exp_neg(nepers: &BandArray) -> BandArray {
    /// ln(2)^k / k!
    const SERIES: [f32; 7] = [
        1.0,
        std::f32::consts::LN_2,
        0.240_226_5,
        0.055_504_11,
        0.009_618_129,
        0.001_333_355_8,
        0.000_154_035_3,
    ];
    /// 1.5 × 2²³: adding it rounds to the nearest integer, which the low mantissa bits then hold.
    const WHOLE: f32 = 12_582_912.0;
    let mut left = [0.0; BANDS];
    for b in 0..BANDS {
        let power = -std::f32::consts::LOG2_E * nepers[b];
        let power = if power > -126.0 { power } else { -126.0 };
        let whole = power + WHOLE;
        let rest = power - (whole - WHOLE);
        let mut sum = SERIES[6];
        for k in (0..6).rev() {
            sum = sum * rest + SERIES[k];
        }
        let exponent = whole
            .to_bits()
            .wrapping_shl(23)
            .wrapping_add(1.0f32.to_bits());
        left[b] = sum * f32::from_bits(exponent);
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_neg_is_the_exponential() {
        for step in 0..8700 {
            let x = step as f32 * 0.01;
            let left = exp_neg(&[x, 0.0, 0.5 * x, 0.0, 0.0, 0.0, 0.0, 1e9]);
            for (got, x) in [(left[0], x), (left[2], 0.5 * x)] {
                let exact = (-f64::from(x)).exp();
                let error = (f64::from(got) / exact - 1.0).abs();
                assert!(error < 1e-6 * (1.0 + f64::from(x)), "{x}: {error}");
            }
            assert_eq!(left[1], 1.0);
            assert!(left[7] > 0.0 && left[7] < 1e-37);
        }
    }

    #[test]
    fn centres_and_edges_follow_the_base_ten_rule() {
        for (b, centre) in CENTRES_HZ.iter().enumerate() {
            let exact = 1000.0 * 10f64.powf(0.3 * (b as f64 - 4.0));
            assert!((centre / exact - 1.0).abs() < 1e-12);
        }
        for (b, edge) in EDGES_HZ.iter().enumerate() {
            let mean = (CENTRES_HZ[b] * CENTRES_HZ[b + 1]).sqrt();
            assert!((edge / mean - 1.0).abs() < 1e-12);
        }
    }
}
