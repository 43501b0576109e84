//! Similarity of two binaural sounds in the paper's three figures, and means over repeats.

use serde::{Deserialize, Serialize};

use super::mel::MelAnalyser;
use super::pesq::pesq_ears;
use super::si_snr::si_snr_ears_db;
use super::ssim::mel_ssim_ears;
use foresound::Result;

/// Seconds at the start that are not scored: filters and reverb build up.
pub const SKIP_S: f64 = 0.5;

/// One comparison.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Wideband PESQ; `None` where the sound is no speech or the model finds no utterance in it.
    pub pesq: Option<f64>,
    /// Structural similarity of log-mel spectrograms.
    pub ssim: f64,
    /// SI-SNR in dB, not capped.
    pub si_snr_db: f64,
}

impl Scores {
    /// Compares an estimate with a reference, both as left and right ear, without the first [`SKIP_S`] seconds.
    ///
    /// # Errors
    /// Those of the figures: too short a sound.
    pub fn of(
        reference: [&[f32]; 2],
        estimate: [&[f32]; 2],
        rate_hz: u32,
        speech: bool,
    ) -> Result<Self> {
        let skip = (SKIP_S * f64::from(rate_hz)) as usize;
        let [reference, estimate] =
            [reference, estimate].map(|ears| ears.map(|ear| &ear[skip.min(ear.len())..]));
        let analyser = MelAnalyser::new(rate_hz);
        let pesq = if speech {
            pesq_ears(reference, estimate, rate_hz)?
        } else {
            None
        };
        Ok(Self {
            pesq,
            ssim: mel_ssim_ears(&analyser, reference, estimate)?,
            si_snr_db: si_snr_ears_db(reference, estimate),
        })
    }
}

/// Mean and standard deviation over repeats.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The mean.
    pub mean: f64,
    /// The standard deviation with Bessel's correction; 0 of a single value.
    pub sd: f64,
}

impl Spread {
    /// Of some values; `None` of none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.into_iter().collect();
        let count = values.len() as f64;
        if values.is_empty() {
            return None;
        }
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
        let sd = (squares / (count - 1.0).max(1.0)).sqrt();
        Some(Self { mean, sd })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_is_mean_and_deviation() {
        let spread = Spread::of([1.0, 2.0, 3.0]).unwrap();
        assert_eq!((spread.mean, spread.sd), (2.0, 1.0));
        assert_eq!(Spread::of([4.0]).unwrap().sd, 0.0);
        assert!(Spread::of([]).is_none());
    }
}
