//! Which candidates are asked in a graphics frame whether something blocks them.
//!
//! The loudest and longest unasked first, over all sources together, until the budget is spent. A candidate that was
//! never asked comes before one that was.

use super::Now;
use super::candidate::{Candidate, Course, Standing};
use crate::propagation::diffraction::{Spot, way};
use crate::scene::Scene;

/// Graphics frames that a candidate counts as unasked for if it never was asked.
const NEVER_FRAMES: u64 = 64;

/// Scratch memory of the choice.
#[derive(Debug, Default)]
pub struct Inspection {
    queue: Vec<(f32, u32)>,
}

impl Inspection {
    /// Makes room for this many candidates.
    pub(super) fn reserve(&mut self, candidates: usize) {
        self.queue.reserve(candidates);
    }

    /// Casts rays for up to `budget` of them; gives how many were cast.
    pub(super) fn spend(
        &mut self,
        budget: u64,
        frame: u64,
        updates: u64,
        candidates: &mut [Candidate],
        standings: &[Standing],
        now: &Now<'_>,
    ) -> u64 {
        self.queue.clear();
        for (index, (candidate, standing)) in candidates.iter().zip(standings).enumerate() {
            let has_way = matches!(standing, Standing::Image(..) | Standing::Bent(_));
            if !has_way || candidate.tested == Some(frame) {
                continue;
            }
            let age = candidate
                .tested
                .map_or(NEVER_FRAMES, |tested| frame - tested.min(frame));
            self.queue
                .push((candidate.energy() * age as f32, index as u32));
        }
        // Every test casts a ray or more, so no more than `budget` of them can be made.
        let most = usize::try_from(budget).unwrap_or(usize::MAX);
        let urgent = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        if most == 0 {
            return 0;
        }
        if self.queue.len() > most {
            self.queue.select_nth_unstable_by(most - 1, urgent);
            self.queue.truncate(most);
        }
        self.queue.sort_unstable_by(urgent);
        let mut rays = 0;
        for &(_, index) in &self.queue {
            let candidate = &mut candidates[index as usize];
            let standing = &standings[index as usize];
            if rays + most_rays(standing) > budget {
                break;
            }
            let Some(spot) = now.spot(candidate.path.source) else {
                continue;
            };
            let first = &mut candidate.blocked_leg;
            candidate.open = is_open(standing, &spot, now.scene, first, &mut rays);
            candidate.tested = Some(frame);
            // Of bent paths the updates choose, which see more of them.
            if candidate.open && matches!(candidate.course, Course::Mirrors(_)) {
                candidate.valid_in = updates;
            }
        }
        rays
    }
}

/// Rays that a look along a way takes at most.
fn most_rays(standing: &Standing) -> u64 {
    match standing {
        Standing::Image(_, image) => image.order as u64 + 1,
        Standing::Bent(_) => way::MOST_RAYS,
        Standing::Path(_) | Standing::Out => 0,
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
        Standing::Path(_) | Standing::Out => true,
    }
}
