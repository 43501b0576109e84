//! Which candidates are asked in a graphics frame whether something blocks them.
//!
//! Over all sources together, until the budget is spent, those first whose answer is worth most a ray: the louder a path
//! is, the longer nobody has asked, and the likelier it has changed. What an update has, which speaks of a place on the
//! listener's way, is open before he is there, and what it has not is closed; other paths change the likelier the shorter
//! they have been as they are. What is wrong of a path that nobody asks about grows with the time, and so does the chance
//! that it is, so that time counts squared.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::candidate::{Candidate, Course, Standing};
use super::{BestSettings, Now, cost_of};
use crate::extrapolation::effort::{Effort, cost};
use crate::propagation::diffraction::{Spot, way};
use crate::scene::Scene;

/// Graphics frames that a candidate counts as unasked for if it never was asked.
const NEVER_FRAMES: u64 = 64;

/// Graphics frames that a candidate counts as open, or closed, at first.
const AT_FIRST_FRAMES: f32 = 16.0;

/// How loud an open path counts at least, as a share of the energy that it once had: what fades may come back.
const FADED: f32 = 0.1;

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

/// Graphics frames from one look at a closed candidate that misses its surfaces to the next, one in so many a frame: if the
/// newest update has it, and if not.
const LOOK_EVERY: [u64; 2] = [2, 6];

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
                    let every = LOOK_EVERY[usize::from(!candidate.named)];
                    candidate.tested.is_some() || (frame + index as u64).is_multiple_of(every)
                }
                standing => has_way(standing),
            };
            if !may_have_way || candidate.tested == Some(frame) {
                continue;
            }
            queue.push(Urgent {
                urgency: urgency(candidate, frame),
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
            let open = is_open(standing, &spot, now.scene, first, &mut self.rays);
            candidate.note_visibility(open, self.frame);
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

/// What an answer is worth a ray.
fn urgency(candidate: &Candidate, frame: u64) -> f32 {
    let age = candidate
        .tested
        .map_or(NEVER_FRAMES, |tested| frame - tested.min(frame)) as f32;
    let lasting = (frame - candidate.since.min(frame)) as f32 + AT_FIRST_FRAMES;
    let rays = match candidate.open {
        true => f32::from(candidate.path.order + candidate.path.bends) + 1.0,
        // What is blocked mostly stays so by the leg that is asked first.
        false => 1.0,
    };
    let energy = match candidate.open {
        true => candidate.energy.max(FADED * candidate.most_energy),
        false => candidate.most_energy,
    };
    let likely = match candidate.named == candidate.open {
        true => 1.0 / lasting,
        false => 1.0,
    };
    energy * age * age * likely / rays
}

/// Whether there is something to cast rays along.
fn has_way(standing: &Standing) -> bool {
    matches!(standing, Standing::Image(_) | Standing::Bent(_))
}

/// Rays that a look along a way takes at most.
fn most_rays(standing: &Standing) -> u64 {
    match standing {
        Standing::Image(image) => image.order as u64 + 1,
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
        Standing::Image(image) => {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acoustics::BANDS;
    use crate::extrapolation::best::candidate::Grounds;
    use crate::propagation::{Path, PathId, PathSet};
    use crate::scene::SourceId;
    use glam::Vec3;

    fn candidate(level: f32) -> Candidate {
        let path = Path {
            id: PathId(1),
            source: SourceId::default(),
            order: 2,
            bends: 0,
            surfaces: [0; 4],
            edges: [0; 2],
            points: [Vec3::ZERO; 4],
            image: Vec3::X,
            length_m: 1.0,
            amplitude: [level; BANDS],
        };
        let mut candidate =
            Candidate::new(&path, &PathSet::default(), &Grounds::unknown(PathId(1)), 0);
        candidate.tested = Some(100);
        candidate
    }

    #[test]
    fn what_counts_is_how_loud_a_path_is_now() {
        let (mut faded, loud) = (candidate(0.001), candidate(0.1));
        assert!(urgency(&faded, 110) < urgency(&loud, 110));
        // It faded at a surface's end where the update was computed for, not where the listener is.
        faded.note_level(&[0.2; BANDS]);
        assert!(urgency(&faded, 110) > urgency(&loud, 110));
        // It fades again, and may come back.
        faded.note_level(&[0.001; BANDS]);
        assert!(urgency(&faded, 110) > urgency(&candidate(0.001), 110));
    }

    #[test]
    fn what_an_update_contradicts_and_what_has_just_changed_comes_first() {
        let quiet = candidate(0.1);
        let mut contradicted = quiet;
        contradicted.named = false;
        assert!(urgency(&contradicted, 110) > 4.0 * urgency(&quiet, 110));
        let mut restless = quiet;
        restless.note_visibility(false, 90);
        restless.note_visibility(true, 100);
        assert!(urgency(&restless, 110) > urgency(&quiet, 110));
        // Twice the time, four times as urgent, but for how long it has lasted.
        let [early, late] = [104, 108].map(|frame| urgency(&contradicted, frame));
        assert_eq!(late, 4.0 * early);
    }
}
