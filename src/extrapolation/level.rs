//! The extrapolation level: graphics frames between two updates.

/// The target extrapolation level L: the number of graphics frames without an update between the arrivals of two updates.
///
/// `propagation_s` is the duration of an update, `graphics_frame_s` that of a graphics frame, both in seconds. 0 if an
/// update fits in a frame, and for NaN.
///
/// # References
/// The paper's Eq. 1, literal: L = max(0, ⌈T_SPS / T_g⌉ − 1).
pub fn extrapolation_level(propagation_s: f64, graphics_frame_s: f64) -> u32 {
    let frames = (propagation_s / graphics_frame_s).ceil() - 1.0;
    // NaN compares false and returns 0; the cast saturates.
    if frames > 0.0 { frames as u32 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::extrapolation_level;

    #[test]
    fn level_follows_equation_one() {
        assert_eq!(extrapolation_level(0.005, 0.010), 0);
        assert_eq!(extrapolation_level(0.010, 0.010), 0);
        assert_eq!(extrapolation_level(0.011, 0.010), 1);
        assert_eq!(extrapolation_level(0.1243, 0.010), 12);
    }

    #[test]
    fn invalid_durations_have_level_zero() {
        assert_eq!(extrapolation_level(f64::NAN, 0.01), 0);
        assert_eq!(extrapolation_level(0.0, 0.0), 0);
        assert_eq!(extrapolation_level(1.0, 0.0), u32::MAX);
    }
}
