//! The input of one slot, a chunk at a time.
//!
//! Audio side; wait-free, bounded by the chunk; allocates nothing. Invalid samples become zero. A new owner whose sound plays
//! already, because none of its paths was known before, fades in: its signal would begin with a step.

/// Input samples of at least this magnitude and NaN are replaced by zero: squares stay finite.
pub(super) const MAX_SAMPLE: f32 = 1e6;

/// Audio frames of the fade.
const FADE_FRAMES: usize = 256;

/// State between chunks.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SlotInput {
    /// Whether the last chunk was not silent.
    is_playing: bool,
    /// Frames left of a fade-in.
    fade_left: usize,
}

/// What a chunk had.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TakenInput {
    pub(super) is_silent: bool,
    /// Samples that were replaced.
    pub(super) non_finite: u32,
}

impl SlotInput {
    /// The slot has another owner from the next chunk on.
    pub(super) fn begin(&mut self) {
        self.fade_left = if self.is_playing { FADE_FRAMES } else { 0 };
    }

    /// Copies the next chunk of `input` to `clean`, padded with silence.
    pub(super) fn take(&mut self, input: &[f32], clean: &mut [f32]) -> TakenInput {
        let mut taken = TakenInput {
            is_silent: true,
            non_finite: 0,
        };
        let given = input.len().min(clean.len());
        clean[given..].fill(0.0);
        for (clean, &sample) in clean.iter_mut().zip(input) {
            let is_sample = sample.abs() < MAX_SAMPLE;
            *clean = if is_sample { sample } else { 0.0 };
            taken.is_silent &= *clean == 0.0;
            taken.non_finite += u32::from(!is_sample);
        }
        let fading = self.fade_left.min(clean.len());
        for sample in &mut clean[..fading] {
            let left = self.fade_left as f32 / FADE_FRAMES as f32;
            // Cubic, with zero slope at both ends.
            *sample *= 1.0 - left * left * (3.0 - 2.0 * left);
            self.fade_left -= 1;
        }
        self.is_playing = !taken.is_silent;
        taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first chunk of another owner after a chunk of `before`.
    fn first_chunk(before: f32) -> Vec<f32> {
        let mut input = SlotInput::default();
        let mut clean = vec![0.0; 300];
        input.take(&[before; 300], &mut clean);
        input.begin();
        input.take(&[1.0; 300], &mut clean);
        clean
    }

    #[test]
    fn a_sound_that_begins_with_its_owner_keeps_its_onset() {
        assert_eq!(first_chunk(0.0), [1.0; 300]);
    }

    #[test]
    fn a_sound_that_plays_already_begins_without_a_step() {
        let clean = first_chunk(0.5);
        // The slope of the cubic is at most 3/2.
        let step = 1.5 / FADE_FRAMES as f32 + 2.0 * f32::EPSILON;
        let mut last = 0.0;
        for &sample in &clean {
            assert!(sample >= last && sample - last < step, "{last} {sample}");
            last = sample;
        }
        assert_eq!(clean[FADE_FRAMES..], [1.0; 300 - FADE_FRAMES]);
    }

    #[test]
    fn invalid_samples_are_silent_and_counted() {
        let mut clean = [1.0; 5];
        let taken = SlotInput::default().take(&[f32::NAN, f32::INFINITY, 1e7], &mut clean);
        assert_eq!(clean, [0.0; 5]);
        assert_eq!((taken.is_silent, taken.non_finite), (true, 3));
    }
}
