//! Room-acoustic parameters of an impulse response, in octave bands.
//!
//! Source: \[ISO3382-1\] for the definitions; own octave filters: raised-cosine masks in the frequency domain, of zero
//! phase and half amplitude at the band edges, which keeps all bands free of delay.

use realfft::RealFftPlanner;

use foresound::acoustics::bands::{BANDS, CENTRES_HZ};

/// Width of a mask's flank on either side of the band edge, in octaves.
const FLANK_OCTAVES: f64 = 1.0 / 6.0;

/// Level below the peak at which the response begins (\[ISO3382-1\] A.3.1), in dB.
const ONSET_DB: f64 = -20.0;

/// Parameters of one band. `None` where the response does not decay far enough.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BandParameters {
    /// Reverberation time in seconds, from the decay between −5 and −25 dB.
    pub t20_s: Option<f64>,
    /// Reverberation time in seconds, from the decay between −5 and −35 dB.
    pub t30_s: Option<f64>,
    /// Early decay time in seconds, from the first 10 dB.
    pub edt_s: Option<f64>,
    /// Clarity in dB, energy of the first 50 ms against the rest.
    pub c50_db: Option<f64>,
    /// Clarity in dB, energy of the first 80 ms against the rest.
    pub c80_db: Option<f64>,
    /// Definition, share of the energy in the first 50 ms, 0 to 1.
    pub d50: Option<f64>,
}

/// Parameters of a mono impulse response.
#[derive(Debug, Clone, PartialEq)]
pub struct RoomParameters {
    /// In each octave band.
    pub bands: [BandParameters; BANDS],
    /// Of the whole response.
    pub broadband: BandParameters,
    /// Level of the energy that is still to come, in dB re all of it, every 10 ms from the onset: of each band, then of
    /// the whole response (Schroeder's decay curve).
    pub decays_db: Vec<Vec<f64>>,
}

/// Time between the points of a decay curve in seconds.
pub const DECAY_STEP_S: f64 = 0.01;

/// Parameters of a mono impulse response, in each band and altogether.
pub fn room_parameters(response: &[f32], rate_hz: u32) -> RoomParameters {
    let peak = response.iter().fold(0f32, |m, s| m.max(s.abs()));
    let threshold = peak * 10f32.powf(ONSET_DB as f32 / 20.0);
    let onset = response
        .iter()
        .position(|s| s.abs() >= threshold)
        .unwrap_or(0);
    let rate_hz_exact = f64::from(rate_hz);
    let mut decays_db = Vec::with_capacity(BANDS + 1);
    let mut of = |samples: &mut dyn Iterator<Item = f64>| {
        let energy: Vec<f64> = samples.map(|s| s * s).collect();
        let decay_db = decay_curve(&energy[onset..]);
        let parameters = parameters(&energy, &decay_db, onset, rate_hz_exact);
        let step = ((DECAY_STEP_S * rate_hz_exact) as usize).max(1);
        decays_db.push(decay_db.into_iter().step_by(step).collect());
        parameters
    };
    let bands = std::array::from_fn(|band| of(&mut octave(response, rate_hz, band).into_iter()));
    let broadband = of(&mut response.iter().map(|sample| f64::from(*sample)));
    RoomParameters {
        bands,
        broadband,
        decays_db,
    }
}

/// Level of the energy still to come at each sample, in dB re all of it; empty without energy.
fn decay_curve(energy: &[f64]) -> Vec<f64> {
    let total: f64 = energy.iter().sum();
    if total <= 0.0 {
        return Vec::new();
    }
    let mut rest = total;
    let level = |e: &f64| {
        let level = 10.0 * (rest / total).max(1e-30).log10();
        rest -= e;
        level
    };
    energy.iter().map(level).collect()
}

/// The response in one octave band, of unchanged length.
fn octave(response: &[f32], rate_hz: u32, band: usize) -> Vec<f64> {
    let length = (2 * response.len()).next_power_of_two().max(2);
    let mut planner = RealFftPlanner::<f64>::new();
    let forward = planner.plan_fft_forward(length);
    let inverse = planner.plan_fft_inverse(length);
    let mut samples = vec![0.0; length];
    for (sample, value) in samples.iter_mut().zip(response) {
        *sample = f64::from(*value);
    }
    let mut spectrum = forward.make_output_vec();
    let transformed = forward.process(&mut samples, &mut spectrum);
    for (bin, value) in spectrum.iter_mut().enumerate() {
        let hz = bin as f64 * f64::from(rate_hz) / length as f64;
        *value *= mask(hz, CENTRES_HZ[band]) / length as f64;
    }
    // The first and last bins of a real spectrum are real; the mask preserves this.
    let back = inverse.process(&mut spectrum, &mut samples);
    debug_assert!(
        transformed.is_ok() && back.is_ok(),
        "buffers are the planner's own"
    );
    samples.truncate(response.len());
    samples
}

/// Amplitude of the octave filter about `centre_hz`.
fn mask(hz: f64, centre_hz: f64) -> f64 {
    if hz <= 0.0 {
        return 0.0;
    }
    let beyond_edge = (hz / centre_hz).log2().abs() - 0.5;
    let position = (0.5 - 0.5 * beyond_edge / FLANK_OCTAVES).clamp(0.0, 1.0);
    // Amplitudes of neighbours add up to one in energy: sin² + cos².
    (position * std::f64::consts::FRAC_PI_2).sin()
}

fn parameters(energy: &[f64], decay_db: &[f64], onset: usize, rate_hz: f64) -> BandParameters {
    let total: f64 = energy[onset..].iter().sum();
    if total <= 0.0 {
        return BandParameters::default();
    }
    let early = |window_s: f64| {
        let count = ((window_s * rate_hz) as usize).min(energy.len() - onset);
        energy[onset..onset + count].iter().sum::<f64>()
    };
    let clarity = |window_s: f64| {
        let first = early(window_s);
        (total - first > 1e-12 * total).then(|| 10.0 * (first / (total - first)).log10())
    };
    BandParameters {
        t20_s: decay_time(decay_db, -5.0, -25.0, rate_hz),
        t30_s: decay_time(decay_db, -5.0, -35.0, rate_hz),
        edt_s: decay_time(decay_db, 0.0, -10.0, rate_hz),
        c50_db: clarity(0.05),
        c80_db: clarity(0.08),
        d50: Some(early(0.05) / total),
    }
}

/// Time for 60 dB by a straight line through the decay between two levels; `None` if the lower one is not reached in
/// the first 95 % of the response; truncation distorts the curve after that.
fn decay_time(decay_db: &[f64], from_db: f64, to_db: f64, rate_hz: f64) -> Option<f64> {
    let first = decay_db.iter().position(|d| *d <= from_db)?;
    let last = decay_db.iter().position(|d| *d <= to_db)?;
    if last < first + 2 || last as f64 > 0.95 * decay_db.len() as f64 {
        return None;
    }
    let count = (last - first) as f64;
    let mean_index = (count - 1.0) / 2.0;
    let mean_db = decay_db[first..last].iter().sum::<f64>() / count;
    let (mut covariance, mut variance) = (0.0, 0.0);
    for (i, level) in decay_db[first..last].iter().enumerate() {
        let offset = i as f64 - mean_index;
        covariance += offset * (level - mean_db);
        variance += offset * offset;
    }
    let db_per_s = covariance / variance * rate_hz;
    (db_per_s < 0.0).then(|| -60.0 / db_per_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use foresound::propagation::rays::directions::{mix, unit};

    #[test]
    fn an_exponential_decay_has_its_reverberation_time() {
        let rate_hz = 44_100;
        let t60_s = 0.8;
        let response: Vec<f32> = (0..2 * rate_hz)
            .map(|n| {
                let noise = 2.0 * unit(mix(n)) - 1.0;
                noise * 10f32.powf(-3.0 * n as f32 / (t60_s * rate_hz as f32))
            })
            .collect();
        let found = room_parameters(&response, rate_hz as u32);
        for time_s in [
            found.broadband.t20_s,
            found.broadband.t30_s,
            found.broadband.edt_s,
        ] {
            let error = (time_s.unwrap_or(0.0) / f64::from(t60_s) - 1.0).abs();
            assert!(error < 0.02, "broadband: {error}");
        }
        // The curve falls by 60 dB in the reverberation time.
        let point = (f64::from(t60_s) / 2.0 / DECAY_STEP_S) as usize;
        let fallen_db = found.decays_db[BANDS][point];
        assert!((fallen_db + 30.0).abs() < 0.5, "{fallen_db}");
        for (band, found) in found.bands.iter().enumerate().skip(1) {
            // Noise in a narrow band fluctuates: about 1 / sqrt(bandwidth × time), four of them.
            let spread = 4.0 / (0.7 * CENTRES_HZ[band] * f64::from(t60_s)).sqrt();
            let error = (found.t30_s.unwrap_or(0.0) / f64::from(t60_s) - 1.0).abs();
            assert!(error < spread.min(0.2), "band {band}: {error}");
        }
    }

    #[test]
    fn octave_bands_sum_to_the_total_energy() {
        for hz in [70.0, 90.0, 500.0, 1412.0, 5000.0] {
            let sum: f64 = CENTRES_HZ.iter().map(|c| mask(hz, *c).powi(2)).sum();
            // Bands of the base-ten rule lie less than an octave apart, so flanks overlap by `beyond`; sin² rises by π/2 at most.
            let beyond = 0.5 * (1.0 - 0.3 * 10f64.log2()) / FLANK_OCTAVES;
            let most = std::f64::consts::FRAC_PI_2 * beyond;
            assert!((sum - 1.0).abs() < most, "{hz}: {sum}");
        }
    }

    #[test]
    fn silence_has_no_parameters() {
        assert_eq!(
            room_parameters(&[0.0; 64], 44_100).bands[3],
            BandParameters::default()
        );
    }
}
