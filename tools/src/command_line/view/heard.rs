//! What the engine has played lately, for the page: the last seconds of stereo, as 16-bit samples.
//!
//! The device's thread writes, the page's requests read. The writer never waits: what it could not write while a request
//! reads is written with the next block.

use std::sync::{Arc, PoisonError};

/// Seconds that are kept.
const KEPT_S: usize = 4;
/// Audio frames that the writer holds back at most while a request reads.
const HELD_FRAMES: usize = 1 << 15;

#[expect(
    clippy::disallowed_types,
    reason = "the writer only tries the lock, and its device is a null device"
)]
type Locked<T> = std::sync::Mutex<T>;

/// The last seconds of sound.
pub(crate) struct Heard {
    rate_hz: u32,
    ring: Locked<Ring>,
}

struct Ring {
    samples: Vec<i16>,
    /// Audio frames written so far.
    total: u64,
}

/// The end that the device's thread writes into.
pub(crate) struct HeardWriter {
    heard: Arc<Heard>,
    held: Vec<i16>,
}

impl Heard {
    pub(crate) fn new(rate_hz: u32) -> Arc<Self> {
        let samples = vec![0; 2 * KEPT_S * rate_hz as usize];
        Arc::new(Self {
            rate_hz,
            ring: Locked::new(Ring { samples, total: 0 }),
        })
    }

    pub(crate) fn writer(self: &Arc<Self>) -> HeardWriter {
        HeardWriter {
            heard: Arc::clone(self),
            held: Vec::with_capacity(2 * HELD_FRAMES),
        }
    }

    pub(crate) fn rate_hz(&self) -> u32 {
        self.rate_hz
    }

    /// The number of the first audio frame returned, and interleaved samples from audio frame `from` on: the oldest kept
    /// where that is gone, none where it has not come.
    pub(crate) fn since(&self, from: u64) -> (u64, Vec<i16>) {
        let ring = self.ring.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = ring.samples.len() as u64 / 2;
        let first = from.clamp(ring.total.saturating_sub(kept), ring.total);
        let at = |frame: u64| 2 * (frame % kept) as usize;
        let frames = first..ring.total;
        let samples = frames.flat_map(|frame| [0, 1].map(|ear| ring.samples[at(frame) + ear]));
        (first, samples.collect())
    }
}

impl HeardWriter {
    /// Writes a block of interleaved stereo. Never waits, never allocates.
    pub(crate) fn write(&mut self, block: &[f32]) {
        let room = self.held.capacity() - self.held.len();
        let samples = block.iter().take(room);
        self.held
            .extend(samples.map(|s| (s.clamp(-1.0, 1.0) * f32::from(i16::MAX)) as i16));
        let Ok(mut ring) = self.heard.ring.try_lock() else {
            return;
        };
        let length = ring.samples.len();
        let mut at = (2 * ring.total) as usize % length;
        for &sample in &self.held {
            ring.samples[at] = sample;
            at = (at + 1) % length;
        }
        ring.total += self.held.len() as u64 / 2;
        self.held.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_was_written_and_no_more_than_is_kept() {
        let heard = Heard::new(100);
        let mut writer = heard.writer();
        assert_eq!(heard.since(0), (0, vec![]));
        writer.write(&[0.0, 1.0, 0.5, -0.5]);
        assert_eq!(heard.since(1), (1, vec![16_383, -16_383]));
        assert_eq!(heard.since(9), (2, vec![]));
        for _ in 0..300 {
            writer.write(&[0.25; 6]);
        }
        let (first, samples) = heard.since(0);
        assert_eq!((first, samples.len()), (902 - 400, 800));
    }
}
