//! Perceptual evaluation of speech quality, wideband: similarity of two sounds for a listener to speech.
//!
//! The model of P.862.2 is the crate `pesq`'s (MIT or Apache-2.0, a clean-room implementation). This file prepares its
//! input: 16 kHz, one ear at a time, the reference's peak at `PEAK`.
//!
//! Deviations from the standard's own program (ITU-T's C code as PyPI pesq 0.0.4):
//! - noise, filters, clipping, coarse steps, loss, echo, a fixed delay: by less than 0.01 (`tests/pesq.rs` holds it to 0.02);
//! - a delay that varies slowly within the sound: by up to 0.13 (held to 0.15);
//! - `evaluate`'s own pairs, three predictors in four scenes with four sources: by 0.0009 at most;
//! - no utterance: both refuse (sixteen voices in a hall without a pause; `talk` adds pauses).

use super::clip::resample;
use foresound::{Error, Result};

/// Rate of the wideband model in Hz.
const MODEL_RATE_HZ: u32 = 16_000;

/// Level of the reference's peak, of full scale; the estimate is scaled by the same gain.
const PEAK: f32 = 0.8;

/// Peak below which a reference is silence: −180 dB of full scale.
const SILENCE: f32 = 1e-9;

/// Score of two identical sounds: the end of P.862.2's scale.
pub const HIGHEST: f64 = 4.644;

/// Wideband PESQ (MOS-LQO, about 1.04 to [`HIGHEST`]) of one channel. The longer sound is cut to the shorter one's length.
/// `None` if the model finds no utterance: silence, or a few seconds of many voices without a pause.
///
/// # Errors
/// [`Error::Setting`] if the sounds are shorter than a quarter of a second.
pub fn pesq_wideband(reference: &[f32], estimate: &[f32], rate_hz: u32) -> Result<Option<f64>> {
    let length = reference.len().min(estimate.len());
    let at_model_rate = |samples: &[f32]| {
        resample(&samples[..length], rate_hz, MODEL_RATE_HZ)
            .map_err(|problem| Error::setting("PESQ", problem, "give a rate above zero"))
    };
    let (reference, estimate) = (at_model_rate(reference)?, at_model_rate(estimate)?);
    let peak = reference.iter().fold(0f32, |peak, s| peak.max(s.abs()));
    if peak < SILENCE && !reference.is_empty() {
        return Ok(None);
    }
    let gain = PEAK / peak * f32::from(i16::MAX);
    // The cast saturates, as a converter does.
    let pcm = |samples: &[f32]| -> Vec<i16> {
        samples.iter().map(|s| (s * gain).round() as i16).collect()
    };
    match pesq::pesq_wb(&pcm(&reference), &pcm(&estimate)) {
        Ok(score) => Ok(Some(f64::from(score))),
        Err(pesq::PesqError::NoUtterancesFound) => Ok(None),
        Err(problem) => Err(Error::setting("PESQ", problem, "give longer sounds")),
    }
}

/// [`pesq_wideband`] of each ear by itself, averaged over the ears that have a score.
///
/// # Errors
/// As [`pesq_wideband`].
pub fn pesq_ears(
    reference: [&[f32]; 2],
    estimate: [&[f32]; 2],
    rate_hz: u32,
) -> Result<Option<f64>> {
    let left = pesq_wideband(reference[0], estimate[0], rate_hz)?;
    let right = pesq_wideband(reference[1], estimate[1], rate_hz)?;
    Ok(match (left, right) {
        (Some(left), Some(right)) => Some((left + right) / 2.0),
        (one, other) => one.or(other),
    })
}
