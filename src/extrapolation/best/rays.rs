//! Which candidates are asked in a graphics frame whether something blocks them.
//!
//! The loudest and longest unasked first, over all sources together, until the budget is spent. A candidate that was
//! never asked comes before one that was.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::candidate::{Candidate, Course, Standing};
use super::{BestSettings, Now, cost_of};
use crate::extrapolation::effort::{Effort, cost};
use crate::propagation::diffraction::{Spot, way};
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

/// Graphics frames from one look at a closed candidate that misses its surfaces to the next, one in so many a frame.
const LOOK_EVERY: u64 = 4;

/// The choice of one graphics frame, and how far it has got.
#[derive(Debug, Default)]
pub struct Inspection {
    /// A heap: only as many are put in order as there are rays for.
    queue: BinaryHeap<Urgent>,
    budget: u64,
    frame: u64,
    /// Rays cast, and candidates asked.
    rays: u64,
    asked: u64,
}

impl Inspection {
    /// Makes room for this many candidates.
    pub(super) fn reserve(&mut self, candidates: usize) {
        self.queue.reserve(candidates);
    }

    /// Chooses whom up to `budget` rays of a graphics frame are for.
    pub(super) fn begin(
        &mut self,
        budget: u64,
        frame: u64,
        candidates: &[Candidate],
        standings: &[Standing],
    ) {
        (self.budget, self.frame) = (budget, frame);
        (self.rays, self.asked) = (0, 0);
        self.queue.clear();
        if budget == 0 {
            return;
        }
        let mut queue = std::mem::take(&mut self.queue).into_vec();
        for (index, (candidate, standing)) in candidates.iter().zip(standings).enumerate() {
            let may_have_way = match standing {
                // What missed its surfaces when it was looked at last comes onto them sooner or later.
                Standing::Unasked => {
                    candidate.tested.is_some() || (frame + index as u64).is_multiple_of(LOOK_EVERY)
                }
                standing => has_way(standing),
            };
            if !may_have_way || candidate.tested == Some(frame) {
                continue;
            }
            let age = candidate
                .tested
                .map_or(NEVER_FRAMES, |tested| frame - tested.min(frame));
            queue.push(Urgent {
                urgency: candidate.energy() * age as f32,
                index: index as u32,
            });
        }
        self.queue = BinaryHeap::from(queue);
    }

    /// Casts rays for them until the effort is spent; gives how many were cast now, and whether none is left to cast. Looks
    /// at those that stand [`Standing::Unasked`] when their turn comes. The candidates have to be those that were chosen
    /// from.
    pub(super) fn go_on(
        &mut self,
        updates: u64,
        candidates: &mut [Candidate],
        standings: &mut [Standing],
        (now, settings): (&Now<'_>, &BestSettings),
        effort: &mut Effort,
    ) -> (u64, bool) {
        let before = self.rays;
        // Every test casts a ray or more, so no more than the budget of them can be made.
        while self.asked < self.budget {
            if effort.is_spent() {
                return (self.rays - before, false);
            }
            let Some(Urgent { index, .. }) = self.queue.pop() else {
                break;
            };
            let candidate = &mut candidates[index as usize];
            let standing = &mut standings[index as usize];
            if matches!(standing, Standing::Unasked) {
                *standing = candidate.stand(now, settings);
                effort.spend(cost_of(standing));
                // What comes back onto its surfaces is asked soon.
                if let (Standing::Out, Course::Mirrors(_)) = (&*standing, candidate.course) {
                    candidate.tested = None;
                }
            }
            if !has_way(standing) {
                continue;
            }
            self.asked += 1;
            if self.rays + most_rays(standing) > self.budget {
                break;
            }
            let Some(spot) = now.spot(candidate.path.source) else {
                continue;
            };
            let (first, cast) = (&mut candidate.blocked_leg, self.rays);
            candidate.open = is_open(standing, &spot, now.scene, first, &mut self.rays);
            candidate.tested = Some(self.frame);
            effort.spend(cost::RAY * (self.rays - cast) as usize);
            // Of bent paths the updates choose, which see more of them.
            if candidate.open && matches!(candidate.course, Course::Mirrors(_)) {
                candidate.valid_in = updates;
            }
        }
        self.queue.clear();
        (self.rays - before, true)
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
        Standing::Path(_) | Standing::Continued(_) | Standing::Out | Standing::Unasked => 0,
    }
}

/// Asks the leg first that was blocked last: most that are blocked stay so, and need one ray.
fn is_open(
    standing: &Standing,
    spot: &Spot,
    scene: &Scene,
    blocked_leg: &mut u8,
    rays: &mut u64,
) -> bool {
    let ends = [spot.from, spot.to].map(|place| scene.to_local(place));
    match standing {
        Standing::Image(_, image) => {
            let first = usize::from(*blocked_leg).min(image.order);
            let others = (0..=image.order).filter(|leg| *leg != first);
            let blocked = std::iter::once(first).chain(others).find(|&leg| {
                *rays += 1;
                let (line, ignored) = image.leg(ends, leg);
                scene.any_hit(&line, ignored)
            });
            *blocked_leg = blocked.map_or(*blocked_leg, |leg| leg as u8);
            blocked.is_none()
        }
        Standing::Bent(way) => way.is_clear(scene, spot, rays),
        Standing::Path(_) | Standing::Continued(_) | Standing::Out | Standing::Unasked => true,
    }
}
