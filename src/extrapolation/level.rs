//! How many graphics frames lie between two updates.

/// The target extrapolation level L: graphics frames after an update that are heard before the next one arrives.
///
/// `propagation_s` is the time one update took, `graphics_frame_s` the time between two graphics frames, both in
/// seconds. 0 where an update fits in a frame; 0 also for times that are no times.
///
/// # References
/// The paper's Eq. 1, literal: L = max(0, ⌈T_SPS / T_g⌉ − 1).
pub fn extrapolation_level(propagation_s: f64, graphics_frame_s: f64) -> u32 {
    let frames = (propagation_s / graphics_frame_s).ceil() - 1.0;
    // A NaN compares false and ends as 0; the cast saturates.
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
    fn no_time_is_no_level() {
        assert_eq!(extrapolation_level(f64::NAN, 0.01), 0);
        assert_eq!(extrapolation_level(0.0, 0.0), 0);
        assert_eq!(extrapolation_level(1.0, 0.0), u32::MAX);
    }
}
