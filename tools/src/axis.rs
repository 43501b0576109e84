//! Round numbers for axes, scale bars and colour bars.

/// Round steps (1, 2 or 5 times a power of ten) for a range: the finest that gives at most `most` intervals.
/// A range that is empty or no number has a step of 1.
pub fn round_step(range: f64, most: usize) -> f64 {
    if !(range.is_finite() && range > 0.0) {
        return 1.0;
    }
    let least = range / most.max(1) as f64;
    let decade = 10f64.powf(least.log10().floor());
    // A hair of slack keeps a step that is exact from falling to the next one by rounding.
    let factor = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(|f| f * decade >= least * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * decade
}

/// Multiples of a round step from `low` to `high`, at most `most` + 1 of them.
pub fn ticks(low: f64, high: f64, most: usize) -> Vec<f64> {
    let step = round_step(high - low, most);
    let first = (low / step - 1e-9).ceil();
    let count = ((high / step + 1e-9).floor() - first).max(-1.0) as i64 + 1;
    (0..count).map(|k| (first + k as f64) * step).collect()
}

/// A number with as many decimals as a step needs, without a negative zero.
pub fn tick_text(value: f64, step: f64) -> String {
    let decimals = (-step.abs().max(1e-9).log10() - 1e-9).ceil().max(0.0) as usize;
    let value = if value.abs() < step.abs() / 1e6 {
        0.0
    } else {
        value
    };
    format!("{value:.decimals$}")
}

/// A frequency in Hz, or in kHz from 1000 Hz on.
pub fn hz_text(hz: f64) -> String {
    if hz >= 1000.0 {
        format!("{} kHz", hz / 1000.0)
    } else {
        format!("{hz} Hz")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_few() {
        for range in [0.013, 0.7, 1.0, 9.99, 60.0, 12_345.0] {
            for most in [4, 8, 12] {
                let step = round_step(range, most);
                let mantissa = step / 10f64.powf((step.log10() + 1e-9).floor());
                assert!(
                    [1.0, 2.0, 5.0].iter().any(|m| (mantissa - m).abs() < 1e-6),
                    "{step}"
                );
                assert!(range / step <= most as f64 + 1e-6);
            }
        }
        assert_eq!(round_step(10.0, 10), 1.0);
        assert_eq!(round_step(0.0, 5), 1.0);
        assert_eq!(round_step(f64::NAN, 5), 1.0);
    }

    #[test]
    fn ticks_cover_the_range_and_no_more() {
        assert_eq!(ticks(0.0, 10.0, 5), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(ticks(-80.0, 0.0, 4), [-80.0, -60.0, -40.0, -20.0, 0.0]);
        assert_eq!(ticks(0.3, 0.9, 3), [0.4, 0.6000000000000001, 0.8]);
    }

    #[test]
    fn texts_have_the_decimals_of_the_step() {
        assert_eq!(tick_text(0.6000000000000001, 0.2), "0.6");
        assert_eq!(tick_text(-0.0, 0.5), "0.0");
        assert_eq!(tick_text(40.0, 20.0), "40");
        assert_eq!(tick_text(3.0, 1.0), "3");
        assert_eq!(hz_text(250.0), "250 Hz");
        assert_eq!(hz_text(16_000.0), "16 kHz");
    }
}
