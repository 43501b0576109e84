//! Signals with their recent past, contiguous in memory.
//!
//! Audio side; wait-free; allocates at construction only.

use crate::generation::CHUNK;

/// Chunks that are appended before the past is moved to the front.
const ROOM: usize = 3 * CHUNK;

/// Signals of the same length, each with a past of a fixed number of frames.
#[derive(Debug)]
pub(crate) struct History {
    past: usize,
    /// Signals one after the other.
    samples: Vec<f32>,
    /// Length of a signal.
    length: usize,
    /// Index of the present chunk's first frame in each signal.
    now: usize,
}

impl History {
    /// Silent signals that keep `past` frames before the present chunk.
    pub(crate) fn new(signals: usize, past: usize) -> Self {
        let length = past + ROOM;
        let mut samples = Vec::with_capacity(signals * length);
        samples.resize(signals * length, 0.0);
        Self {
            past,
            samples,
            length,
            now: past,
        }
    }

    /// Ends the present chunk after `frames` frames and makes room for the next.
    pub(crate) fn advance(&mut self, frames: usize) {
        self.now += frames;
        if self.now + CHUNK > self.length {
            for signal in self.samples.chunks_exact_mut(self.length) {
                signal.copy_within(self.now - self.past..self.now, 0);
            }
            self.now = self.past;
        }
    }

    /// The present chunk of a signal.
    pub(crate) fn present(&mut self, signal: usize) -> &mut [f32] {
        &mut self.samples[signal * self.length + self.now..][..CHUNK]
    }

    /// A chunk of a signal from `delay` frames before the present one on.
    pub(crate) fn delayed(&self, signal: usize, delay: usize) -> &[f32] {
        &self.samples[signal * self.length + self.now - delay.min(self.past)..][..CHUNK]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_past_can_be_read_at_every_delay() {
        let mut history = History::new(2, 300);
        let mut time = 0usize;
        for round in 0..100 {
            let frames = 1 + round * 37 % CHUNK;
            for signal in 0..2 {
                for (n, value) in history.present(signal)[..frames].iter_mut().enumerate() {
                    *value = (1000 * signal + (time + n) % 1000) as f32;
                }
            }
            for delay in [0, 5, 299, 300] {
                for signal in 0..2 {
                    let read = history.delayed(signal, delay);
                    for n in (0..frames).filter(|n| time + n >= delay) {
                        let expected = 1000 * signal + (time + n - delay) % 1000;
                        assert_eq!(read[n], expected as f32);
                    }
                }
            }
            time += frames;
            history.advance(frames);
        }
    }
}
