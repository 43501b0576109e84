//! Samples of a source: a clip, or a stream that the app fills.
//!
//! [`SampleSource::fill`] and [`SampleSource::skip`] run on the audio side and are wait-free; made and freed on the
//! control side.

use std::sync::Arc;

use crate::runtime::engine::stream::Stream;

/// Samples of a source.
#[derive(Default)]
pub(crate) enum SampleSource {
    #[default]
    Silence,
    Clip {
        samples: Arc<[f32]>,
        next: usize,
        looped: bool,
    },
    Stream(Stream),
}

impl SampleSource {
    /// Fills a block with the next samples; returns the number of samples missing in a stream. A finished clip and a
    /// stream without a writer are silent and miss none.
    pub(crate) fn fill(&mut self, block: &mut [f32]) -> u32 {
        match self {
            Self::Silence => block.fill(0.0),
            Self::Clip {
                samples,
                next,
                looped,
            } => {
                let mut done = 0;
                while done < block.len() && *next < samples.len() {
                    let count = (samples.len() - *next).min(block.len() - done);
                    block[done..done + count].copy_from_slice(&samples[*next..*next + count]);
                    done += count;
                    *next += count;
                    if *looped && *next == samples.len() {
                        *next = 0;
                    }
                }
                block[done..].fill(0.0);
            }
            Self::Stream(stream) => return stream.fill(block),
        }
        0
    }

    /// Discards samples; returns the number of samples missing in a stream.
    pub(crate) fn skip(&mut self, frames: usize) -> u32 {
        match self {
            Self::Silence => 0,
            Self::Clip {
                samples,
                next,
                looped,
            } => {
                *next = match (*looped, samples.len()) {
                    (true, length) if length > 0 => (*next + frames) % length,
                    (_, length) => (*next + frames).min(length),
                };
                0
            }
            Self::Stream(stream) => stream.skip(frames),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(samples: &[f32], looped: bool) -> SampleSource {
        SampleSource::Clip {
            samples: samples.into(),
            next: 0,
            looped,
        }
    }

    #[test]
    fn a_clip_ends_and_a_loop_repeats() {
        let mut block = [9.0; 5];
        clip(&[1.0, 2.0], false).fill(&mut block);
        assert_eq!(block, [1.0, 2.0, 0.0, 0.0, 0.0]);
        clip(&[1.0, 2.0], true).fill(&mut block);
        assert_eq!(block, [1.0, 2.0, 1.0, 2.0, 1.0]);
        clip(&[], true).fill(&mut block);
        assert_eq!(block, [0.0; 5]);
    }

    #[test]
    fn skipped_samples_advance_the_clip() {
        for looped in [false, true] {
            for length in [0, 1, 3, 7, 100] {
                let samples: Vec<f32> = (0..length).map(|n| n as f32).collect();
                let (mut heard, mut skipped) = (clip(&samples, looped), clip(&samples, looped));
                let mut blocks = [[0.0; 5]; 2];
                for _ in 0..4 {
                    heard.fill(&mut blocks[0]);
                    assert_eq!(skipped.skip(5), 0);
                }
                heard.fill(&mut blocks[0]);
                skipped.fill(&mut blocks[1]);
                assert_eq!(blocks[0], blocks[1]);
            }
        }
    }
}
