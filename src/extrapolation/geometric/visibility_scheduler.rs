//! Which candidates are asked in a graphics frame whether something blocks them.
//!
//! Over all sources together, until the budget is spent, those first whose answer is worth most a ray: the louder a path
//! is, the longer nobody has asked, and the likelier it has changed. What an update has, which speaks of a place on the
//! listener's way, is open before he is there, and what it has not is closed; other paths change the likelier the shorter
//! they have been as they are. What is wrong of a path that nobody asks about grows with the time, and so does the chance
//! that it is, so that time counts squared.

use std::collections::BinaryHeap;

use crate::extrapolation::geometric::candidate::{Candidate, Course, Mark};
use crate::extrapolation::geometric::frame_geometry::{Shapes, Standing};
use crate::extrapolation::geometric::source_poses::{Place, Places};
use crate::extrapolation::geometric::{GeometricSettings, Now};
use crate::extrapolation::work_budget::{WorkBudget, cost};
use crate::propagation::diffraction::revalidate;
use crate::propagation::image_source::image_path::ImagePath;
use crate::scene::Scene;

/// Graphics frames that a candidate counts as unasked for if it never was asked.
const NEVER_FRAMES: u64 = 64;

/// Graphics frames that a candidate counts as open, or closed, at first.
const AT_FIRST_FRAMES: f32 = 16.0;

/// How loud an open path counts at least, as a share of the energy that it once had: what fades may come back.
const FADED: f32 = 0.1;

/// A candidate that may be asked, as a number: what is more urgent is greater, and of what is as urgent the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Urgent(u64);

impl Urgent {
    #[inline]
    fn of(urgency: f32, index: u32) -> Self {
        let bits = urgency.to_bits();
        // The order of `f32::total_cmp`: of negative numbers all bits are turned, of the others the sign.
        let ordered = bits ^ ((bits.cast_signed() >> 31).cast_unsigned() | 1 << 31);
        Self(u64::from(ordered) << 32 | u64::from(!index))
    }

    #[inline]
    fn index(self) -> usize {
        !(self.0 as u32) as usize
    }
}

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
    pub(crate) fn reserve(&mut self, candidates: usize) {
        self.queue.reserve(candidates);
    }

    /// Chooses whom up to `budget` rays of a graphics frame are for.
    pub(crate) fn begin(
        &mut self,
        budget: u64,
        frame: u64,
        marks: &[Mark],
        standings: &[Standing],
    ) {
        (self.budget, self.frame) = (budget, frame);
        (self.rays, self.asked) = (0, 0);
        self.queue.clear();
        if budget == 0 {
            return;
        }
        let mut queue = std::mem::take(&mut self.queue).into_vec();
        for (index, (mark, standing)) in marks.iter().zip(standings).enumerate() {
            let may_have_way = match standing {
                // What missed its surfaces when it was looked at last comes onto them sooner or later.
                Standing::Unasked => {
                    let every = LOOK_EVERY[usize::from(!mark.named)];
                    mark.tested.is_some() || (frame + index as u64).is_multiple_of(every)
                }
                standing => has_way(*standing),
            };
            if !may_have_way || mark.tested == Some(frame) {
                continue;
            }
            queue.push(Urgent::of(urgency(mark, frame), index as u32));
        }
        self.queue = BinaryHeap::from(queue);
    }

    /// Casts rays for them until the effort is spent; gives how many were cast now, and whether none is left to cast. Looks
    /// at those that stand [`Standing::Unasked`] when their turn comes. The candidates have to be those that were chosen
    /// from.
    pub(crate) fn go_on(
        &mut self,
        updates: u64,
        (candidates, marks): (&mut [Candidate], &mut [Mark]),
        (standings, shapes): (&mut [Standing], &mut Shapes),
        (now, places, settings): (&Now<'_>, &Places, &GeometricSettings),
        effort: &mut WorkBudget,
    ) -> (u64, bool) {
        let before = self.rays;
        // Every test casts a ray or more, so no more than the budget of them can be made.
        while self.asked < self.budget {
            if effort.is_spent() {
                return (self.rays - before, false);
            }
            let Some(urgent) = self.queue.pop() else {
                break;
            };
            let candidate = &mut candidates[urgent.index()];
            let mark = &mut marks[urgent.index()];
            let standing = &mut standings[urgent.index()];
            let place = places.of(candidate.path.source);
            if *standing == Standing::Unasked {
                *standing = candidate.stand(now, place, settings, shapes);
                effort.spend(standing.cost());
                // What comes back onto its surfaces is asked soon.
                if let (Standing::Out, Course::Mirrors(_)) = (*standing, candidate.course) {
                    mark.tested = None;
                }
            }
            if !has_way(*standing) {
                continue;
            }
            self.asked += 1;
            if self.rays + most_rays(*standing, shapes) > self.budget {
                break;
            }
            let Some(place) = place else {
                continue;
            };
            let (first, cast) = (&mut mark.blocked_leg, self.rays);
            let open = is_open(*standing, shapes, place, now.scene, first, &mut self.rays);
            mark.note_visibility(open, self.frame);
            effort.spend(cost::RAY * (self.rays - cast) as usize);
            // Of what stays closed nobody asks for more than its points.
            if open && *standing == Standing::Legs {
                *standing = shapes.finish(now.scene);
            }
            // Of bent paths the updates choose, which see more of them.
            if open && matches!(candidate.course, Course::Mirrors(_)) {
                candidate.valid_in = updates;
            }
        }
        self.queue.clear();
        (self.rays - before, true)
    }
}

/// What an answer is worth a ray.
fn urgency(mark: &Mark, frame: u64) -> f32 {
    let age = mark
        .tested
        .map_or(NEVER_FRAMES, |tested| frame - tested.min(frame)) as f32;
    let lasting = (frame - mark.since.min(frame)) as f32 + AT_FIRST_FRAMES;
    let rays = match mark.open {
        true => f32::from(mark.legs),
        // What is blocked mostly stays so by the leg that is asked first.
        false => 1.0,
    };
    let energy = match mark.open {
        true => mark.energy.max(FADED * mark.most_energy),
        false => mark.most_energy,
    };
    let likely = match mark.named == mark.open {
        true => 1.0 / lasting,
        false => 1.0,
    };
    energy * age * age * likely / rays
}

/// Whether there is something to cast rays along.
fn has_way(standing: Standing) -> bool {
    matches!(
        standing,
        Standing::Legs | Standing::Image(_) | Standing::Bent(_)
    )
}

/// Rays that a look along a way takes at most.
fn most_rays(standing: Standing, shapes: &Shapes) -> u64 {
    match standing {
        Standing::Legs => shapes.unfolded.legs().order as u64 + 1,
        Standing::Image(number) => shapes.image_of(number).order as u64 + 1,
        Standing::Bent(_) => revalidate::MAX_RAYS,
        Standing::Path(_) | Standing::Continued(_) | Standing::Out | Standing::Unasked => 0,
    }
}

fn is_open(
    standing: Standing,
    shapes: &Shapes,
    place: &Place,
    scene: &Scene,
    blocked_leg: &mut u8,
    rays: &mut u64,
) -> bool {
    match standing {
        Standing::Legs => are_clear(shapes.unfolded.legs(), place, scene, blocked_leg, rays),
        Standing::Image(number) => {
            are_clear(shapes.image_of(number), place, scene, blocked_leg, rays)
        }
        Standing::Bent(number) => shapes
            .way_of(number)
            .is_unoccluded(scene, &place.spot, rays),
        Standing::Path(_) | Standing::Continued(_) | Standing::Out | Standing::Unasked => true,
    }
}

/// Asks the leg first that was blocked last: most that are blocked stay so, and need one ray.
fn are_clear(
    legs: &ImagePath,
    place: &Place,
    scene: &Scene,
    blocked_leg: &mut u8,
    rays: &mut u64,
) -> bool {
    let first = usize::from(*blocked_leg).min(legs.order);
    let others = (0..=legs.order).filter(|leg| *leg != first);
    let blocked = std::iter::once(first).chain(others).find(|&leg| {
        *rays += 1;
        let (line, ignored) = legs.leg(place.ends, leg);
        scene.any_hit(&line, ignored)
    });
    *blocked_leg = blocked.map_or(*blocked_leg, |leg| leg as u8);
    blocked.is_none()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acoustics::BANDS;
    use crate::propagation::{Path, PathId};
    use crate::scene::SourceId;
    use glam::Vec3;

    fn mark(level: f32) -> Mark {
        let path = Path {
            id: PathId(1),
            source: SourceId::default(),
            order: 2,
            diffraction_order: 0,
            surfaces: [0; 4],
            edges: [0; 2],
            points: [Vec3::ZERO; 4],
            image: Vec3::X,
            length_m: 1.0,
            amplitude: [level; BANDS],
        };
        let mut mark = Mark::new(&path, 0);
        mark.tested = Some(100);
        mark
    }

    #[test]
    fn what_is_urgent_comes_in_the_order_of_numbers_and_then_the_first() {
        let values = [
            f32::NEG_INFINITY,
            -2.0,
            -0.0,
            0.0,
            1e-40,
            1e-3,
            2.0,
            f32::INFINITY,
            f32::NAN,
        ];
        for (a, lower) in values.into_iter().enumerate() {
            assert!(Urgent::of(lower, 1) > Urgent::of(lower, 2));
            assert_eq!(Urgent::of(lower, 7).index(), 7);
            for higher in &values[a + 1..] {
                assert!(lower.total_cmp(higher).is_lt());
                assert!(
                    Urgent::of(lower, 1) < Urgent::of(*higher, 2),
                    "{lower} {higher}"
                );
            }
        }
    }

    #[test]
    fn what_counts_is_how_loud_a_path_is_now() {
        let (mut faded, loud) = (mark(0.001), mark(0.1));
        assert!(urgency(&faded, 110) < urgency(&loud, 110));
        // It faded at a surface's end where the update was computed for, not where the listener is.
        faded.note_level(&[0.2; BANDS]);
        assert!(urgency(&faded, 110) > urgency(&loud, 110));
        // It fades again, and may come back.
        faded.note_level(&[0.001; BANDS]);
        assert!(urgency(&faded, 110) > urgency(&mark(0.001), 110));
    }

    #[test]
    fn what_an_update_contradicts_and_what_has_just_changed_comes_first() {
        let quiet = mark(0.1);
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
