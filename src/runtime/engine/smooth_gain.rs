//! Gains that follow their targets with a continuous slope.
//!
//! Audio side; wait-free. The kinks of piecewise linear gains are audible as clicks on a loud sound. Own.

/// Time constant in seconds: 1 % of a change remains after 27 ms.
const TIME_S: f32 = 0.004;

/// Remainder of a change that counts as zero, relative to the larger of the target and 1: −100 dB.
const NOTHING: f32 = 1e-5;

/// A gain and its slope per audio frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SmoothedGain {
    pub(super) value: f32,
    pub(super) slope: f32,
}

impl SmoothedGain {
    /// A constant gain.
    pub(super) fn at(value: f32) -> Self {
        Self { value, slope: 0.0 }
    }

    /// The gain `frames` later: a critically damped approach to `target`, independent of the division into blocks.
    pub(super) fn after(self, frames: usize, target: f32, rate_hz: f32) -> Self {
        if self == Self::at(target) {
            return self;
        }
        let per_frame = 1.0 / (TIME_S * rate_hz);
        let time = frames as f32;
        let left = self.value - target;
        let pull = self.slope + left * per_frame;
        let decay = (-time * per_frame).exp();
        let left = (left + pull * time) * decay;
        let slope = (self.slope - pull * time * per_frame) * decay;
        let nothing = NOTHING * target.abs().max(1.0);
        if left.abs() < nothing && (slope / per_frame).abs() < nothing {
            return Self::at(target);
        }
        Self {
            value: target + left,
            slope,
        }
    }
}

/// Position in a fade before its first frame, 0 (silent) to 1, and slope per audio frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct CrossFade {
    pub(super) position: f32,
    pub(super) slope: f32,
}

impl CrossFade {
    /// The gain after `frames`: smoothstep: a fade in and a fade out sum to 1.
    pub(super) fn gain(self, frames: usize) -> f32 {
        let position = (self.position + self.slope * frames as f32).clamp(0.0, 1.0);
        position * position * (3.0 - 2.0 * position)
    }

    fn is_constant(self) -> bool {
        (self.position <= 0.0 && self.slope <= 0.0) || (self.position >= 1.0 && self.slope >= 0.0)
    }
}

/// Adds samples times `fade` and a gain that moves from `from` to `to` with a continuous slope.
pub(super) fn mix_into(
    input: &mut [f32],
    samples: &[f32],
    [from, to]: [SmoothedGain; 2],
    fade: CrossFade,
) {
    let count = input.len().min(samples.len());
    let pairs = input.iter_mut().zip(samples);
    if from == to && from.slope == 0.0 && fade.is_constant() {
        let gain = from.value * fade.gain(0);
        pairs.for_each(|(sum, sample)| *sum += sample * gain);
        return;
    }
    // Cubic Hermite interpolation over the block.
    let length = count as f32;
    let (first, last) = (from.slope * length, to.slope * length);
    let rise = to.value - from.value;
    let cubed = first + last - 2.0 * rise;
    let squared = 3.0 * rise - 2.0 * first - last;
    for (n, (sum, sample)) in pairs.enumerate() {
        let position = (n + 1) as f32 / length;
        let gain = from.value + position * (first + position * (squared + position * cubed));
        *sum += sample * gain * fade.gain(n + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f32 = 44_100.0;
    const WHOLE: CrossFade = CrossFade {
        position: 1.0,
        slope: 0.0,
    };

    /// The gain at every frame, mixed in blocks of one length.
    fn course(mut gain: SmoothedGain, target: f32, block: usize, frames: usize) -> Vec<f32> {
        let mut heard = vec![0.0; frames];
        for part in heard.chunks_mut(block) {
            let next = gain.after(part.len(), target, RATE_HZ);
            mix_into(part, &vec![1.0; part.len()], [gain, next], WHOLE);
            gain = next;
        }
        heard
    }

    fn sharpest(course: &[f32], before: f32) -> f32 {
        let all: Vec<f32> = [before; 2].iter().chain(course).copied().collect();
        let kinks = all.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs());
        kinks.fold(0.0, f32::max)
    }

    #[test]
    fn gain_converges_without_overshoot_or_kink() {
        for (from, to) in [(0.0, 1.0), (1.0, 0.0), (1.0, 8.0), (8.0, 0.5)] {
            for block in [16, 64, 256, 1000] {
                let heard = course(SmoothedGain::at(from), to, block, 4410);
                // The cubic over a block of some five time constants overshoots by 0.24 %; shorter ones do not.
                let swing = if block > 512 { 2.5e-3 } else { 1e-5 };
                let swing = swing * (from - to).abs();
                let (low, high) = (from.min(to) - swing, from.max(to) + swing);
                let beyond = heard.iter().find(|gain| !(low..high).contains(*gain));
                assert_eq!(beyond, None, "{from} to {to}, blocks of {block}");
                assert_eq!(heard.last(), Some(&to));
                let late = heard[1200];
                assert!((late - to).abs() < 0.011 * (from - to).abs(), "{late}");
                // A line over a block of 256 has a kink of 1/256 of the change.
                let kink = sharpest(&heard, from) / (from - to).abs();
                assert!(kink < 1e-4, "{kink} with blocks of {block}");
            }
        }
    }

    #[test]
    fn gain_reverses_without_a_kink() {
        let risen = SmoothedGain::at(0.0).after(150, 1.0, RATE_HZ);
        let mut heard = vec![0.0; 150];
        mix_into(
            &mut heard,
            &[1.0; 150],
            [SmoothedGain::at(0.0), risen],
            WHOLE,
        );
        heard.extend(course(risen, 0.0, 64, 4410));
        assert!(sharpest(&heard, 0.0) < 2e-4);
        assert_eq!(heard.last(), Some(&0.0));
    }

    #[test]
    fn gain_is_independent_of_the_block_division() {
        let whole = SmoothedGain::at(0.3).after(300, 2.0, RATE_HZ);
        let mut parts = SmoothedGain::at(0.3);
        for frames in [1, 49, 100, 150] {
            parts = parts.after(frames, 2.0, RATE_HZ);
        }
        assert!((whole.value - parts.value).abs() < 1e-6);
        assert!((whole.slope - parts.slope).abs() < 1e-7);
    }

    #[test]
    fn fades_in_and_out_sum_to_one() {
        let slope = 1.0 / 50.0;
        let rises = |position| CrossFade { position, slope };
        let falls = |position| CrossFade {
            position,
            slope: -slope,
        };
        let [mut low, mut high] = [vec![0.0f32; 80], vec![0.0f32; 80]];
        let gain = [SmoothedGain::at(2.0); 2];
        mix_into(&mut low, &[1.0; 80], gain, rises(0.0));
        mix_into(&mut high, &[1.0; 80], gain, falls(1.0));
        for (low, high) in low.iter().zip(&high) {
            assert!((low + high - 2.0).abs() < 1e-6);
        }
        assert_eq!((low[49], low[79], high[49], high[79]), (2.0, 2.0, 0.0, 0.0));
        // A line has a kink of 1/50 at each end.
        assert!(sharpest(&low, 0.0) < 2.0 * 6.1 / 2500.0);
        // Constant at either end.
        assert!(rises(1.0).is_constant() && falls(0.0).is_constant());
        assert!(!rises(0.0).is_constant() && !falls(1.0).is_constant());
    }
}
