//! What blocked a path in the last update most likely blocks it now: that triangle is asked before the tree.
//!
//! A remembered triangle counts only by the test that the tree itself makes of it, so the answer is the tree's, whatever
//! is remembered; only the number of rays depends on the past. Own; one table a source, so that threads share none.

use glam::DVec3;

use crate::propagation::image_source::image_path::ImagePath;
use crate::scene::Scene;
use crate::simd::prefetch;

/// Slots a source, a power of two; paths that share one displace each other.
const SLOTS: usize = 2048;

/// Bits of a tag that say which leg was blocked.
const LEG_BITS: u64 = 7;

#[derive(Debug, Clone, Copy, Default)]
struct Slot {
    /// The path's hash and, in its low bits, the leg; 0 if empty.
    tag: u32,
    triangle: u32,
}

/// The triangles that last blocked a source's candidates.
#[derive(Debug)]
pub(crate) struct Occluders {
    slots: Vec<Slot>,
}

impl Default for Occluders {
    fn default() -> Self {
        Self {
            slots: vec![Slot::default(); SLOTS],
        }
    }
}

impl Occluders {
    /// Asks for the slot of a candidate's hash.
    #[inline(always)]
    pub(crate) fn prefetch(&self, hash: u64) {
        prefetch(&self.slots[hash as usize % SLOTS]);
    }

    /// What blocked the candidate of this hash, if that is remembered.
    #[inline(always)]
    pub(crate) fn recall(&self, hash: u64) -> Option<Blocked> {
        let slot = self.slots[hash as usize % SLOTS];
        let leg = slot.tag & LEG_BITS as u32;
        let known = slot.tag != 0 && slot.tag & !(LEG_BITS as u32) == tag(hash);
        known.then(|| Blocked {
            step: leg as usize - 1,
            triangle: slot.triangle,
        })
    }

    /// Whether nothing stands between the points of a path; `hash` tells candidates apart. Adds the rays cast to `rays`.
    pub(crate) fn is_clear(
        &mut self,
        scene: &Scene,
        hash: u64,
        path: &ImagePath,
        ends: [DVec3; 2],
        rays: &mut u64,
    ) -> bool {
        for step in 0..=path.order {
            let (leg, ignored) = path.leg(ends, step);
            *rays += 1;
            if let Some(triangle) = scene.blocker(&leg, ignored) {
                // Most blocked candidates come again.
                self.slots[hash as usize % SLOTS] = Slot {
                    tag: tag(hash) | (step as u32 + 1),
                    triangle,
                };
                return false;
            }
        }
        true
    }
}

/// What blocked a candidate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Blocked {
    /// Which of its legs.
    step: usize,
    triangle: u32,
}

impl Blocked {
    /// Asks for where it is said which corners the triangle has.
    #[inline(always)]
    pub(crate) fn prefetch_triangle(&self, scene: &Scene) {
        if let Some(triangle) = scene.fixed_triangle(self.triangle) {
            prefetch(triangle);
        }
    }

    /// Asks for the triangle's corners, which lie anywhere.
    #[inline(always)]
    pub(crate) fn prefetch_corners(&self, scene: &Scene) {
        let corners = scene.fixed_corners(self.triangle);
        corners.into_iter().flatten().for_each(prefetch);
    }

    /// Whether it blocks the candidate's path again. `ends` are source and listener.
    #[inline(never)]
    pub(crate) fn again(&self, scene: &Scene, path: &ImagePath, ends: [DVec3; 2]) -> bool {
        // Another candidate of the same tag may be longer.
        if self.step > path.order {
            return false;
        }
        let (leg, ignored) = path.leg(ends, self.step);
        let group = scene.surface_of(self.triangle);
        !ignored.contains(&group) && scene.blocks(self.triangle, &leg)
    }
}

/// What of a candidate's hash a slot keeps.
fn tag(hash: u64) -> u32 {
    (hash >> 32 & !LEG_BITS) as u32
}
