//! The paper's predictor: linear in the amplitude, clamped (Eq. 2 to 4).

use super::frame::FramePath;
use super::predictor::{FrameContext, Predictor, TrackedPath};
use crate::acoustics::{BANDS, BandArray};

/// Extrapolates each band's amplitude linearly from the last two updates. Delay and direction are held, as in the paper, in
/// which only the direct path follows the listener.
#[derive(Debug, Clone, Copy, Default)]
pub struct Linear;

impl Predictor for Linear {
    fn predict(&mut self, path: &TrackedPath<'_>, at: &FrameContext<'_>) -> FramePath {
        let mut frame = FramePath::of(path.current, path.source, path.listener, at.scene);
        if let Some(previous) = path.previous {
            frame.amplitude = extrapolate(
                &path.current.amplitude,
                &previous.amplitude,
                at.frames_since_update,
                at.level,
            );
        }
        frame
    }
}

/// Amplitudes `frames` graphics frames after the update of `current`, at level L = `level`.
///
/// Eq. 2 in frame k = `frames` − 1, then Eq. 3 and 4. In the frame of the update's arrival the amplitudes are unchanged.
/// After the interval's last frame the value of frame L − 1 is held, since the paper defines no later one. Amplitudes are
/// signed, unlike the paper's: the equations apply to amplitudes times the sign of `current`. Real-time.
pub fn extrapolate(
    current: &BandArray,
    previous: &BandArray,
    frames: u32,
    level: u32,
) -> BandArray {
    let step = frames.min(level) as f32 / (level as f32 + 1.0);
    let mut result = *current;
    if step == 0.0 {
        return result;
    }
    for b in 0..BANDS {
        let sign = 1f32.copysign(current[b]);
        let now = current[b] * sign;
        let before = previous[b] * sign;
        let raw = now + step * (now - before);
        let upper = now.max(before) + (now - before).abs();
        result[b] = sign * raw.max(0.0).min(upper);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bands(value: f32) -> BandArray {
        [value; BANDS]
    }

    #[test]
    fn extrapolates_by_equation_two() {
        // L = 3, k = 1: 0.5 + 2/4 × (0.5 − 0.4).
        let result = extrapolate(&bands(0.5), &bands(0.4), 2, 3);
        assert!((result[0] - 0.55).abs() < 1e-6);
    }

    #[test]
    fn an_arriving_update_is_unchanged() {
        assert_eq!(extrapolate(&bands(0.5), &bands(0.4), 0, 3), bands(0.5));
        assert_eq!(extrapolate(&bands(0.5), &bands(0.4), 0, 0), bands(0.5));
    }

    #[test]
    fn amplitudes_stay_between_zero_and_the_bound() {
        assert_eq!(extrapolate(&bands(0.1), &bands(0.9), 12, 12), bands(0.0));
        let risen = extrapolate(&bands(0.9), &bands(0.1), 12, 12)[0];
        assert!(risen <= 0.9 + 0.8 && risen > 1.6);
    }

    #[test]
    fn a_negative_amplitude_mirrors_a_positive_one() {
        let up = extrapolate(&bands(0.5), &bands(0.4), 2, 3);
        let down = extrapolate(&bands(-0.5), &bands(-0.4), 2, 3);
        assert_eq!(up.map(|a| -a), down);
    }

    #[test]
    fn a_late_update_keeps_the_last_frame() {
        let last = extrapolate(&bands(0.5), &bands(0.4), 3, 3);
        assert_eq!(extrapolate(&bands(0.5), &bands(0.4), 9, 3), last);
    }
}
