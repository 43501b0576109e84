//! The past of one source, eight bands.
//!
//! Audio side; wait-free; allocates at birth only. Takes band samples in order, gives slices of any past stretch.
//!
//! Positions are audio frames since the generator began. A band is one ring whose head is repeated behind its end, so
//! that every read of up to [`MAX_READ`] frames is one slice.

use crate::acoustics::BANDS;
use crate::simd::F32x8;

use super::CHUNK;

/// Longest slice a reader may ask for: a chunk read at the steepest glide, with room for rounding.
pub(super) const MAX_READ: usize = CHUNK + CHUNK / 4 + 16;

/// Bands of one ring start this many floats apart modulo a page of 1024, so that eight streams read side by side do
/// not share the sets of a first-level cache.
const STAGGER: usize = 136;

/// Eight rings of band samples.
#[derive(Debug)]
pub(super) struct DelayLine {
    /// Frames of the ring, without the repeated head.
    length: usize,
    /// Floats from one band to the next.
    stride: usize,
    samples: Vec<f32>,
    /// Position behind the last frame that is not silent.
    sound_end: i64,
}

impl DelayLine {
    /// A silent line that remembers at least `history` frames besides the chunk that is being written.
    pub(super) fn new(history: usize) -> Self {
        let length = history + CHUNK + MAX_READ;
        let stride = (length + MAX_READ).next_multiple_of(1024) + STAGGER;
        // Written rather than asked for as zeros: the pages are touched here and not in the first blocks.
        let mut samples = Vec::with_capacity(stride * BANDS);
        samples.resize(stride * BANDS, 0.0);
        Self {
            length,
            stride,
            samples,
            sound_end: i64::MIN / 2,
        }
    }

    /// Whether nothing but silence is left in the line.
    pub(super) fn is_empty(&self, now: i64) -> bool {
        now - self.sound_end > (self.length + CHUNK) as i64
    }

    /// Whether everything from `position` on is silent.
    pub(super) fn is_silent_from(&self, position: i64) -> bool {
        position >= self.sound_end
    }

    /// Appends a chunk of at most [`CHUNK`] frames at position `now`.
    pub(super) fn write(&mut self, now: i64, bands: &[F32x8]) {
        let start = now.rem_euclid(self.length as i64) as usize;
        for (b, ring) in self.samples.chunks_exact_mut(self.stride).enumerate() {
            let first = bands.len().min(self.length - start);
            for (place, value) in ring[start..start + first].iter_mut().zip(bands) {
                *place = value.0[b];
            }
            for (place, value) in ring.iter_mut().zip(&bands[first..]) {
                *place = value.0[b];
            }
        }
        self.repeat_head(start, bands.len());
        self.sound_end = now + bands.len() as i64;
    }

    /// Appends a chunk of silence at position `now`. An empty line need not be told.
    pub(super) fn write_silence(&mut self, now: i64, frames: usize) {
        let start = now.rem_euclid(self.length as i64) as usize;
        let first = frames.min(self.length - start);
        for ring in self.samples.chunks_exact_mut(self.stride) {
            ring[start..start + first].fill(0.0);
            ring[..frames - first].fill(0.0);
        }
        self.repeat_head(start, frames);
    }

    /// One band's `frames` samples from `position` on, at most [`MAX_READ`] of them, none older than the history.
    #[inline]
    pub(super) fn band(&self, band: usize, position: i64, frames: usize) -> &[f32] {
        let start = position.rem_euclid(self.length as i64) as usize;
        &self.samples[band * self.stride + start..][..frames]
    }

    /// All bands' `frames` samples from `position` on.
    #[inline]
    pub(super) fn bands(&self, position: i64, frames: usize) -> [&[f32]; BANDS] {
        let start = position.rem_euclid(self.length as i64) as usize;
        std::array::from_fn(|b| &self.samples[b * self.stride + start..][..frames])
    }

    fn repeat_head(&mut self, start: usize, frames: usize) {
        if start < MAX_READ || start + frames > self.length {
            for ring in self.samples.chunks_exact_mut(self.stride) {
                ring.copy_within(..MAX_READ, self.length);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stretch_of_the_past_is_one_slice() {
        let mut line = DelayLine::new(1000);
        let mut now = 0i64;
        for round in 0..60 {
            let frames = 1 + (round * 37) % CHUNK;
            let bands: Vec<F32x8> = (0..frames)
                .map(|i| F32x8([(now + i as i64) as f32; 8]))
                .collect();
            line.write(now, &bands);
            now += frames as i64;
            for back in (MAX_READ as i64..1000).step_by(13) {
                let position = now - back;
                if position < 0 {
                    continue;
                }
                for (i, &value) in line
                    .band(5, position, MAX_READ.min(back as usize))
                    .iter()
                    .enumerate()
                {
                    assert_eq!(value, (position + i as i64) as f32);
                }
            }
        }
    }

    #[test]
    fn line_runs_empty_after_its_length() {
        let mut line = DelayLine::new(300);
        assert!(line.is_empty(0));
        line.write(0, &[F32x8::splat(1.0); CHUNK]);
        let mut now = CHUNK as i64;
        while !line.is_empty(now) {
            line.write_silence(now, 100);
            now += 100;
        }
        assert!(line.samples.iter().all(|&s| s == 0.0));
    }
}
