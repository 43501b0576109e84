//! The triangles that last blocked a source's candidates, tested before the tree.
//!
//! A cached triangle is tested by the tree's own triangle test, so the cache changes the number of rays and never the result.
//! Own. One table a source: threads share none.

use glam::DVec3;

use crate::propagation::image_source::image_path::ImagePath;
use crate::scene::Scene;
use crate::simd::prefetch;

/// Slots of a source, a power of two. Candidates of one slot displace each other.
const SLOTS: usize = 2048;

/// Low bits of a tag, which hold the leg.
const LEG_BITS: u64 = 7;

#[derive(Debug, Clone, Copy, Default)]
struct Slot {
    /// Part of the candidate's hash and, in the low bits, the leg plus one; 0 if empty.
    tag: u32,
    triangle: u32,
}

/// Last occluder of each candidate, by its hash. Fixed memory; newer entries displace older ones.
#[derive(Debug)]
pub(crate) struct OccluderCache {
    slots: Vec<Slot>,
}

impl Default for OccluderCache {
    fn default() -> Self {
        Self {
            slots: vec![Slot::default(); SLOTS],
        }
    }
}

impl OccluderCache {
    /// Prefetches the slot of a hash.
    #[inline(always)]
    pub(crate) fn prefetch(&self, hash: u64) {
        prefetch(&self.slots[hash as usize % SLOTS]);
    }

    /// The last occluder of the candidate with this hash. Rarely that of another candidate with the same tag.
    #[inline(always)]
    pub(crate) fn get(&self, hash: u64) -> Option<Occluder> {
        let slot = self.slots[hash as usize % SLOTS];
        let leg = slot.tag & LEG_BITS as u32;
        let is_stored = slot.tag != 0 && slot.tag & !(LEG_BITS as u32) == tag(hash);
        is_stored.then(|| Occluder {
            step: leg as usize - 1,
            triangle: slot.triangle,
        })
    }

    /// Whether a path is unoccluded; stores the occluder otherwise. Adds the number of rays cast to `rays`.
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

/// A triangle that blocked one leg of a candidate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Occluder {
    /// The leg.
    step: usize,
    triangle: u32,
}

impl Occluder {
    /// Prefetches the triangle's corner indices.
    #[inline(always)]
    pub(crate) fn prefetch_triangle(&self, scene: &Scene) {
        if let Some(triangle) = scene.fixed_triangle(self.triangle) {
            prefetch(triangle);
        }
    }

    /// Prefetches the triangle's corners.
    #[inline(always)]
    pub(crate) fn prefetch_corners(&self, scene: &Scene) {
        let corners = scene.fixed_corners(self.triangle);
        corners.into_iter().flatten().for_each(prefetch);
    }

    /// Whether it blocks the path now. `ends` are source and listener.
    #[inline(never)]
    pub(crate) fn blocks(&self, scene: &Scene, path: &ImagePath, ends: [DVec3; 2]) -> bool {
        // Another candidate with the same tag may be longer.
        if self.step > path.order {
            return false;
        }
        let (leg, ignored) = path.leg(ends, self.step);
        let group = scene.surface_of(self.triangle);
        !ignored.contains(&group) && scene.blocks(self.triangle, &leg)
    }
}

/// The part of a hash that a slot stores.
fn tag(hash: u64) -> u32 {
    (hash >> 32 & !LEG_BITS) as u32
}
