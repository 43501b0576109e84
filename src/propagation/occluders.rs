//! What blocked a path in the last update most likely blocks it now: that triangle is asked before the tree.
//!
//! A remembered triangle counts only by the test that the tree itself makes of it, so the answer is the tree's, whatever
//! is remembered; only the number of rays depends on the past. Own; one table a source, so that threads share none.

use glam::DVec3;

use super::image_source::ImagePath;
use crate::scene::Scene;

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
pub(super) struct Occluders {
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
    /// Whether it is remembered what blocked the candidate of this hash.
    pub(super) fn remembers(&self, hash: u64) -> bool {
        let slot = &self.slots[hash as usize % SLOTS];
        slot.tag != 0 && slot.tag & !(LEG_BITS as u32) == tag(hash)
    }

    /// Whether what is remembered blocks the candidate's path again.
    pub(super) fn blocks_again(
        &self,
        scene: &Scene,
        hash: u64,
        path: &ImagePath,
        ends: [DVec3; 2],
    ) -> bool {
        let slot = &self.slots[hash as usize % SLOTS];
        let step = (slot.tag & LEG_BITS as u32) as usize;
        if !self.remembers(hash) || step > path.order + 1 {
            return false;
        }
        let (leg, ignored) = path.leg(ends, step - 1);
        let group = scene.surface_of(slot.triangle);
        !ignored.contains(&group) && scene.blocks(slot.triangle, &leg)
    }

    /// Whether nothing stands between the points of a path; `hash` tells candidates apart. Adds the rays cast to `rays`.
    pub(super) fn is_clear(
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
            if !scene.any_hit(&leg, ignored) {
                continue;
            }
            // Once more for the name of what is in the way: most blocked candidates come again.
            *rays += 1;
            if let Some(hit) = scene.closest_hit(&leg, ignored) {
                self.slots[hash as usize % SLOTS] = Slot {
                    tag: tag(hash) | (step as u32 + 1),
                    triangle: hit.triangle,
                };
            }
            return false;
        }
        true
    }
}

/// What of a candidate's hash a slot keeps.
fn tag(hash: u64) -> u32 {
    (hash >> 32 & !LEG_BITS) as u32
}
