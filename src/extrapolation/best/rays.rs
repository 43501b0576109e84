//! Which candidates are asked in a graphics frame whether something blocks them.
//!
//! The loudest and longest unasked first, over all sources together, until the budget is spent. A candidate that was
//! never asked comes before one that was.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::candidate::{Candidate, Standing};
use super::{BestSettings, Now};
use crate::propagation::diffraction::{Spot, way};
use crate::propagation::image_source::is_clear;
use crate::scene::Scene;

/// Graphics frames that a candidate counts as unasked for if it never was asked.
const NEVER_FRAMES: u64 = 64;

/// A candidate that may be asked: louder and longer unasked ones are greater.
#[derive(Debug, Clone, Copy)]
struct Urgent {
    urgency: f32,
    index: u32,
}

impl Ord for Urgent {
    fn cmp(&self, other: &Self) -> Ordering {
        let urgency = self.urgency.total_cmp(&other.urgency);
        urgency.then(other.index.cmp(&self.index))
    }
}

impl PartialOrd for Urgent {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Urgent {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Urgent {}

/// Scratch memory of the choice.
#[derive(Debug, Default)]
pub struct Inspection {
    queue: Vec<Urgent>,
}

impl Inspection {
    /// Makes room for this many candidates.
    pub(super) fn reserve(&mut self, candidates: usize) {
        self.queue.reserve(candidates);
    }

    /// Casts rays for up to `budget` of them; gives how many were cast. Looks at those that stand [`Standing::Unasked`]
    /// when their turn comes.
    pub(super) fn spend(
        &mut self,
        budget: u64,
        frame: u64,
        updates: u64,
        candidates: &mut [Candidate],
        standings: &mut [Standing],
        (now, settings): (&Now<'_>, &BestSettings),
    ) -> u64 {
        self.queue.clear();
        if budget == 0 {
            return 0;
        }
        for (index, (candidate, standing)) in candidates.iter().zip(&*standings).enumerate() {
            let may_have_way = has_way(standing) || matches!(standing, Standing::Unasked);
            if !may_have_way || candidate.tested == Some(frame) {
                continue;
            }
            let age = candidate
                .tested
                .map_or(NEVER_FRAMES, |tested| frame - tested.min(frame));
            self.queue.push(Urgent {
                urgency: candidate.energy() * age as f32,
                index: index as u32,
            });
        }
        // A heap in the queue's own memory: only as many are put in order as there are rays for.
        let mut queue = BinaryHeap::from(std::mem::take(&mut self.queue));
        let mut rays = 0;
        let mut asked = 0;
        // Every test casts a ray or more, so no more than `budget` of them can be made.
        while asked < budget
            && let Some(Urgent { index, .. }) = queue.pop()
        {
            let candidate = &mut candidates[index as usize];
            let standing = &mut standings[index as usize];
            if matches!(standing, Standing::Unasked) {
                *standing = candidate.stand(now, settings);
            }
            if !has_way(standing) {
                continue;
            }
            asked += 1;
            if rays + most_rays(standing) > budget {
                break;
            }
            let Some(spot) = now.spot(candidate.path.source) else {
                continue;
            };
            candidate.open = is_open(standing, &spot, now.scene, &mut rays);
            candidate.tested = Some(frame);
            if candidate.open {
                candidate.valid_in = updates;
            }
        }
        self.queue = queue.into_vec();
        rays
    }
}

/// Whether there is something to cast rays along.
fn has_way(standing: &Standing) -> bool {
    matches!(standing, Standing::Image(..) | Standing::Bent(_))
}

/// Rays that a look along a way takes at most.
fn most_rays(standing: &Standing) -> u64 {
    match standing {
        Standing::Image(_, image) => image.order as u64 + 1,
        Standing::Bent(_) => way::MOST_RAYS,
        Standing::Path(_) | Standing::Out | Standing::Unasked => 0,
    }
}

fn is_open(standing: &Standing, spot: &Spot, scene: &Scene, rays: &mut u64) -> bool {
    let [from, ear] = [spot.from, spot.to].map(|place| scene.to_local(place));
    match standing {
        Standing::Image(_, image) => is_clear(scene, image, from, ear, rays),
        Standing::Bent(way) => way.is_clear(scene, spot, rays),
        Standing::Path(_) | Standing::Out | Standing::Unasked => true,
    }
}
