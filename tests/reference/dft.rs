//! The discrete Fourier transform by its definition.

/// Real and imaginary part of a signal's spectrum at one frequency.
pub fn at(signal: &[f64], frequency_hz: f64, rate_hz: f64) -> (f64, f64) {
    let step = std::f64::consts::TAU * frequency_hz / rate_hz;
    signal
        .iter()
        .enumerate()
        .fold((0.0, 0.0), |(re, im), (n, x)| {
            let angle = step * n as f64;
            (re + x * angle.cos(), im - x * angle.sin())
        })
}

/// Magnitude in dB re one.
pub fn magnitude_db(signal: &[f64], frequency_hz: f64, rate_hz: f64) -> f64 {
    let (re, im) = at(signal, frequency_hz, rate_hz);
    10.0 * (re * re + im * im).log10()
}
