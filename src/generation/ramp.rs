//! Linear ramps between the values of two graphics frames.
//!
//! Audio side; arithmetic. A ramp stores its target and its growth per frame; its present value is
//! `target − growth × frames left`. A render call may end anywhere in a ramp, the value does not drift, and at the end it is
//! the target bit for bit.

use crate::generation::CHUNK;
use crate::generation::settings::MAX_LISTENERS;
use crate::simd::F32x8;

/// The chunk being rendered.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChunkSpan {
    /// Time of its first frame.
    pub(crate) now: i64,
    /// Frames of the ramp left at its start.
    pub(crate) left: u32,
    /// Number of frames, at most [`CHUNK`].
    pub(crate) frames: usize,
}

/// A chunk of a block, with its first frame in the block and the frames left of each listener's ramp.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chunk {
    pub(crate) start: usize,
    pub(crate) now: i64,
    pub(crate) frames: usize,
    left: [u32; MAX_LISTENERS],
}

impl Chunk {
    /// The chunk for a listener's voices.
    pub(crate) fn span(&self, listener: usize) -> ChunkSpan {
        ChunkSpan {
            now: self.now,
            left: self.left[listener],
            frames: self.frames,
        }
    }
}

/// The chunks of a block: no ramp ends within a chunk.
pub(crate) struct Chunks {
    next: Chunk,
    end: usize,
}

impl Chunks {
    /// Of a block of `frames` frames from time `now` on, with `left` frames of each listener's ramp left.
    pub(crate) fn new(now: i64, left: [u32; MAX_LISTENERS], frames: usize) -> Self {
        let next = Chunk {
            start: 0,
            now,
            frames: 0,
            left,
        };
        Self { next, end: frames }
    }
}

impl Iterator for Chunks {
    type Item = Chunk;

    fn next(&mut self) -> Option<Chunk> {
        let next = &mut self.next;
        let ramps = next.left.iter().filter(|left| **left > 0);
        let most = (self.end - next.start).min(CHUNK);
        let frames = ramps.fold(most, |frames, left| frames.min(*left as usize));
        if frames == 0 {
            return None;
        }
        let chunk = Chunk { frames, ..*next };
        next.start += frames;
        next.now += frames as i64;
        for left in &mut next.left {
            *left = left.saturating_sub(frames as u32);
        }
        Some(chunk)
    }
}

/// A value that moves linearly to its target.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LinearRamp {
    target: f64,
    growth: f64,
}

impl LinearRamp {
    pub(crate) fn at_rest(value: f64) -> Self {
        Self {
            target: value,
            growth: 0.0,
        }
    }

    /// The value with `left` frames of the ramp left.
    pub(crate) fn value(&self, left: u32) -> f64 {
        self.target - self.growth_now(left) * f64::from(left)
    }

    /// The growth per frame with `left` frames of the ramp left.
    pub(crate) fn growth_now(&self, left: u32) -> f64 {
        if left > 0 { self.growth } else { 0.0 }
    }

    /// Ramps from the value with `left` frames left to `target` within `ramp` frames.
    /// Where it ends.
    pub(crate) fn target(&self) -> f64 {
        self.target
    }

    pub(crate) fn retarget(&mut self, target: f64, left: u32, ramp: u32) {
        self.growth = (target - self.value(left)) / f64::from(ramp);
        self.target = target;
    }

    pub(crate) fn stop(&mut self, left: u32) {
        *self = Self::at_rest(self.value(left));
    }
}

/// Gains of eight bands that move linearly to their targets.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BandRamp {
    pub(crate) target: F32x8,
    growth: F32x8,
    /// Whether the target is not zero, and whether the gains grow.
    sounds: bool,
    grows: bool,
}

impl BandRamp {
    /// The gains with `left` frames of the ramp left.
    pub(crate) fn value(&self, left: u32) -> F32x8 {
        self.target - self.growth_now(left) * F32x8::splat(left as f32)
    }

    /// The growth per frame with `left` frames of the ramp left.
    pub(crate) fn growth_now(&self, left: u32) -> F32x8 {
        if left > 0 { self.growth } else { F32x8::ZERO }
    }

    /// Ramps from the gains with `left` frames left to `target` within `ramp` frames.
    pub(crate) fn retarget(&mut self, target: F32x8, left: u32, ramp: u32) {
        self.growth = (target - self.value(left)) * F32x8::splat(1.0 / ramp as f32);
        self.target = target;
        (self.sounds, self.grows) = (target != F32x8::ZERO, self.growth != F32x8::ZERO);
    }

    /// Whether the gains are zero now and until the end of the ramp.
    pub(crate) fn is_silent(&self, left: u32) -> bool {
        !(self.sounds || self.grows && left > 0)
    }
}
