//! The ends of sounds that were taken away, faded to nothing in the slots where they were heard.
//!
//! Audio side; wait-free, bounded by the block; allocates at birth only. Any number of ends may overlap in a slot.

/// Audio frames over which a sound fades that is taken away: long enough not to click, short enough to be over before a
/// slot has another tenant.
pub(crate) const RELEASE_FRAMES: usize = 256;

/// What is still to come of one slot's ended sounds: a ring.
struct Ring {
    samples: [f32; RELEASE_FRAMES],
    next: usize,
    /// How many of them may be other than zero.
    remaining: usize,
}

/// The ends of all slots.
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

    /// Adds the samples that a sound would have had next, at a gain that goes to nothing. Slots that are none are silent.
    pub(crate) fn add(&mut self, slot: u16, samples: &[f32; RELEASE_FRAMES], gain: f32) {
        let Some(ring) = self.rings.get_mut(usize::from(slot)) else {
            return;
        };
        if gain == 0.0 {
            return;
        }
        ring.remaining = RELEASE_FRAMES;
        for (n, sample) in samples.iter().enumerate() {
            // From one to nothing without a bend at either end.
            let left = 1.0 - (n + 1) as f32 / RELEASE_FRAMES as f32;
            let faded = sample * gain * left * left * (3.0 - 2.0 * left);
            ring.samples[(ring.next + n) % RELEASE_FRAMES] += faded;
        }
    }

    /// Whether anything is left in a slot.
    pub(crate) fn is_active(&self, slot: usize) -> bool {
        self.rings.get(slot).is_some_and(|ring| ring.remaining > 0)
    }

    /// Adds the next samples of a slot to its mixture.
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
