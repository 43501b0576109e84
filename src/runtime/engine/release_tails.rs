//! Fade-outs of sources that ended, in the slots where they were audible.
//!
//! Audio side; wait-free, bounded by the block; allocates in `new` only. Fades may overlap in a slot.

/// Audio frames of a fade-out: long enough to avoid a click, shorter than the release of a slot.
pub(crate) const RELEASE_FRAMES: usize = 256;

/// Remaining samples of one slot's fades, as a ring.
struct Ring {
    samples: [f32; RELEASE_FRAMES],
    next: usize,
    /// Number of samples that may be nonzero.
    remaining: usize,
}

/// The fade-outs of all slots.
pub(crate) struct ReleaseTails {
    rings: Vec<Ring>,
}

impl ReleaseTails {
    pub(crate) fn new(slots: usize) -> Self {
        let ring = || Ring {
            samples: [0.0; RELEASE_FRAMES],
            next: 0,
            remaining: 0,
        };
        Self {
            rings: (0..slots).map(|_| ring()).collect(),
        }
    }

    /// Adds the next samples of a source, faded out from `gain`. An invalid slot is ignored.
    pub(crate) fn add(&mut self, slot: u16, samples: &[f32; RELEASE_FRAMES], gain: f32) {
        let Some(ring) = self.rings.get_mut(usize::from(slot)) else {
            return;
        };
        if gain == 0.0 {
            return;
        }
        ring.remaining = RELEASE_FRAMES;
        for (n, sample) in samples.iter().enumerate() {
            // Cubic fade with zero slope at both ends.
            let left = 1.0 - (n + 1) as f32 / RELEASE_FRAMES as f32;
            let faded = sample * gain * left * left * (3.0 - 2.0 * left);
            ring.samples[(ring.next + n) % RELEASE_FRAMES] += faded;
        }
    }

    /// Whether a slot has samples left.
    pub(crate) fn is_active(&self, slot: usize) -> bool {
        self.rings.get(slot).is_some_and(|ring| ring.remaining > 0)
    }

    /// Adds the next samples of a slot to its input.
    pub(crate) fn mix(&mut self, slot: usize, input: &mut [f32]) {
        let Some(ring) = self.rings.get_mut(slot) else {
            return;
        };
        let count = ring.remaining.min(input.len());
        for sum in &mut input[..count] {
            *sum += std::mem::take(&mut ring.samples[ring.next]);
            ring.next = (ring.next + 1) % RELEASE_FRAMES;
        }
        ring.remaining -= count;
    }
}
