//! Where a source's samples come from: a clip, or a stream that the app fills.
//!
//! Audio side: [`Feed::fill`] is wait-free. Made and freed on the control side.

use std::sync::Arc;

/// A source's sound.
#[derive(Default)]
pub(super) enum Feed {
    #[default]
    Silence,
    Clip {
        samples: Arc<[f32]>,
        next: usize,
        looped: bool,
    },
    Stream(rtrb::Consumer<f32>),
}

impl Feed {
    /// Fills a block with the next samples; gives the number of samples that a stream owed. A clip at its end and a
    /// stream without a writer are silent and owe nothing.
    pub(super) fn fill(&mut self, block: &mut [f32]) -> u32 {
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
            Self::Stream(ring) => {
                let count = ring.slots().min(block.len());
                if let Ok(chunk) = ring.read_chunk(count) {
                    let (first, second) = chunk.as_slices();
                    block[..first.len()].copy_from_slice(first);
                    block[first.len()..count].copy_from_slice(second);
                    chunk.commit_all();
                }
                block[count..].fill(0.0);
                if !ring.is_abandoned() {
                    return (block.len() - count) as u32;
                }
            }
        }
        0
    }

    /// Goes on without being heard; gives the number of samples that a stream owed.
    pub(super) fn skip(&mut self, frames: usize) -> u32 {
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
            Self::Stream(ring) => {
                let count = ring.slots().min(frames);
                if let Ok(chunk) = ring.read_chunk(count) {
                    chunk.commit_all();
                }
                if ring.is_abandoned() {
                    0
                } else {
                    (frames - count) as u32
                }
            }
        }
    }
}

/// The app's end of a stream: a ring of mono samples at the engine's rate. May move to any one thread; wait-free.
pub struct StreamWriter {
    ring: rtrb::Producer<f32>,
}

impl StreamWriter {
    /// A ring for this many samples, and the feed that reads it.
    pub(super) fn new(capacity: usize) -> (Self, Feed) {
        let (ring, reader) = rtrb::RingBuffer::new(capacity);
        (Self { ring }, Feed::Stream(reader))
    }

    /// Samples that fit now.
    pub fn free(&self) -> usize {
        self.ring.slots()
    }

    /// Appends as many samples as fit and gives their number.
    pub fn write(&mut self, samples: &[f32]) -> usize {
        let count = self.ring.slots().min(samples.len());
        match self.ring.write_chunk_uninit(count) {
            Ok(chunk) => chunk.fill_from_iter(samples.iter().copied()),
            Err(_) => 0,
        }
    }

    /// Whether nobody reads any more: the source has other sound or is gone.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clip(samples: &[f32], looped: bool) -> Feed {
        Feed::Clip {
            samples: samples.into(),
            next: 0,
            looped,
        }
    }

    #[test]
    fn a_clip_ends_and_a_loop_goes_on() {
        let mut block = [9.0; 5];
        clip(&[1.0, 2.0], false).fill(&mut block);
        assert_eq!(block, [1.0, 2.0, 0.0, 0.0, 0.0]);
        clip(&[1.0, 2.0], true).fill(&mut block);
        assert_eq!(block, [1.0, 2.0, 1.0, 2.0, 1.0]);
        clip(&[], true).fill(&mut block);
        assert_eq!(block, [0.0; 5]);
    }

    #[test]
    fn what_is_skipped_goes_on_as_if_it_was_heard() {
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
        let (mut writer, mut feed) = StreamWriter::new(4);
        writer.write(&[1.0, 2.0, 3.0]);
        assert_eq!((feed.skip(2), feed.skip(2)), (0, 1));
    }

    #[test]
    fn a_stream_owes_what_its_writer_is_late_with() {
        let (mut writer, mut feed) = StreamWriter::new(4);
        assert_eq!(writer.write(&[1.0, 2.0, 3.0, 4.0, 5.0]), 4);
        let mut block = [9.0; 3];
        assert_eq!(feed.fill(&mut block), 0);
        assert_eq!((block, writer.free()), ([1.0, 2.0, 3.0], 3));
        assert_eq!(feed.fill(&mut block), 2);
        drop(writer);
        assert_eq!(feed.fill(&mut block), 0);
        assert_eq!(block, [0.0; 3]);
    }
}
