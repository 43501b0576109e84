//! Samples of a source: a clip, or a stream that the app fills.
//!
//! [`SampleSource::fill`] and [`SampleSource::skip`] run on the audio side and are wait-free; made and freed on the
//! control side.

use crate::runtime::engine::clip_player::{ClipPlayer, OTHERS};
use crate::runtime::engine::playback::PlayState;
use crate::runtime::engine::stream::Stream;

/// Samples of a source.
#[derive(Default)]
pub(crate) enum SampleSource {
    #[default]
    Silence,
    Clip(Box<ClipPlayer>),
    Stream(Stream),
}

/// Result of [`SampleSource::fill`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Filled {
    /// Samples missing in a stream.
    pub(crate) missing: u32,
    /// Number of signals: 1, of a stereo clip 2, of a sound field 4.
    pub(crate) signals: usize,
}

impl SampleSource {
    /// Fills a block with the next samples, and `others` with the further signals of a stereo clip or a sound field. A finished
    /// clip and a stream without a writer are silent and miss none. `now` is the engine's audio frame at the block's start.
    pub(crate) fn fill(
        &mut self,
        block: &mut [f32],
        others: [&mut [f32]; OTHERS],
        play: &PlayState,
        now: u64,
    ) -> Filled {
        match self {
            Self::Silence => {
                block.fill(0.0);
                Filled::default()
            }
            Self::Clip(player) => Filled {
                missing: 0,
                signals: player.fill(block, others, play, now),
            },
            Self::Stream(stream) => Filled {
                missing: stream.fill(block),
                signals: 1,
            },
        }
    }

    /// Discards samples; returns the number of samples missing in a stream.
    pub(crate) fn skip(&mut self, frames: usize, play: &PlayState, now: u64) -> u32 {
        match self {
            Self::Silence => 0,
            Self::Clip(player) => {
                player.skip(frames, play, now);
                0
            }
            Self::Stream(stream) => stream.skip(frames),
        }
    }
}
