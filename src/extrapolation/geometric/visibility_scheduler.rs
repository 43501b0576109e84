//! Selects candidates for the visibility tests of a graphics frame, and tests them.
//!
//! Candidates of all sources share one ray budget. Their priority is the expected benefit per ray: energy times squared time
//! since the last test times likelihood of a change. Time is squared because both the probability and the duration of a
//! stale result grow with it. An update describes a position ahead on the listener's trajectory: a path that it has is
//! about to become visible, and one that it lacks is about to become blocked. For other paths the likelihood of a change is
//! inverse to the time since the last change.

use std::collections::BinaryHeap;

use crate::extrapolation::geometric::FrameInputs;
use crate::extrapolation::geometric::candidate::{Candidate, VisibilityState};
use crate::extrapolation::geometric::frame_geometry::{FrameGeometry, GeometryArena};
use crate::extrapolation::geometric::source_poses::{FrameSource, FrameSources};
use crate::extrapolation::work_budget::{WorkBudget, cost};
use crate::propagation::diffraction::revalidate;
use crate::propagation::image_source::image_path::ImagePath;
use crate::scene::Scene;

/// Age in graphics frames of a candidate that was never tested.
const UNTESTED_FRAMES: u64 = 64;

/// Graphics frames for which a new candidate counts as unchanged.
const INITIAL_UNCHANGED_FRAMES: f32 = 16.0;

/// Least energy of a visible path as a share of its peak: a faded path may return.
const FADED_SHARE: f32 = 0.1;

/// A candidate's priority and index in one number: greater for higher priority, then for lower index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Priority(u64);

impl Priority {
    #[inline]
    fn new(priority: f32, index: u32) -> Self {
        let bits = priority.to_bits();
        // The order of `f32::total_cmp`: inverts all bits of negative numbers, and the sign bit of the others.
        let ordered = bits ^ ((bits.cast_signed() >> 31).cast_unsigned() | 1 << 31);
        Self(u64::from(ordered) << 32 | u64::from(!index))
    }

    #[inline]
    fn index(self) -> usize {
        !(self.0 as u32) as usize
    }
}

/// Graphics frames between two evaluations of a blocked candidate whose points miss its surfaces: if the newest update has
/// it, and if not.
const EVALUATE_EVERY: [u64; 2] = [2, 6];

/// Factor on the rays of a frame of whose paths earlier frames tell nothing. Between two rooms with four sources twice the rays
/// find half of what is missing in the next frame, and four times all but the quietest paths.
const ELSEWHERE_RAYS: u64 = 4;

/// The visibility tests of one graphics frame.
#[derive(Debug, Default)]
pub struct VisibilityScheduler {
    /// A heap: only the tested candidates are sorted.
    queue: BinaryHeap<Priority>,
    budget: u64,
    frame: u64,
    rays: u64,
    tests: u64,
}

impl VisibilityScheduler {
    /// Reserves capacity for this many candidates.
    pub(crate) fn reserve(&mut self, candidates: usize) {
        self.queue.reserve(candidates);
    }

    /// Queues the candidates of a graphics frame for up to `budget` rays; `is_elsewhere` is whether earlier frames tell nothing of
    /// this one: all are evaluated then, with [`ELSEWHERE_RAYS`] times the rays.
    pub(crate) fn begin(
        &mut self,
        (budget, is_elsewhere): (u64, bool),
        frame: u64,
        states: &[VisibilityState],
        geometries: &[FrameGeometry],
    ) {
        let times = if is_elsewhere { ELSEWHERE_RAYS } else { 1 };
        (self.budget, self.frame) = (times * budget, frame);
        (self.rays, self.tests) = (0, 0);
        self.queue.clear();
        if budget == 0 {
            return;
        }
        let mut queue = std::mem::take(&mut self.queue).into_vec();
        for (index, (state, geometry)) in states.iter().zip(geometries).enumerate() {
            let may_be_testable = match geometry {
                // A path whose points missed its surfaces is evaluated again after some frames.
                FrameGeometry::Unevaluated => {
                    let every = EVALUATE_EVERY[usize::from(!state.in_update)];
                    is_elsewhere
                        || state.tested.is_some()
                        || (frame + index as u64).is_multiple_of(every)
                }
                geometry => geometry.is_testable(),
            };
            if !may_be_testable || state.tested == Some(frame) {
                continue;
            }
            queue.push(Priority::new(priority(state, frame), index as u32));
        }
        self.queue = BinaryHeap::from(queue);
    }

    /// Tests queued candidates until the work budget is spent; returns the rays cast in this call, and whether the frame's
    /// tests are done. Evaluates [`FrameGeometry::Unevaluated`] and extrapolated candidates. The candidates must be those of
    /// [`Self::begin`].
    pub(crate) fn resume(
        &mut self,
        updates: u64,
        (candidates, states): (&mut [Candidate], &mut [VisibilityState]),
        (geometries, arena): (&mut [FrameGeometry], &mut GeometryArena),
        (inputs, sources): (&FrameInputs<'_>, &FrameSources),
        work: &mut WorkBudget,
    ) -> (u64, bool) {
        let before = self.rays;
        // Every test casts at least one ray, which bounds the number of tests by the ray budget.
        while self.tests < self.budget {
            if work.is_spent() {
                return (self.rays - before, false);
            }
            let Some(next) = self.queue.pop() else {
                break;
            };
            let candidate = &mut candidates[next.index()];
            let state = &mut states[next.index()];
            let geometry = &mut geometries[next.index()];
            let source = sources.get(candidate.source);
            let is_extrapolated = *geometry == FrameGeometry::ExtrapolatedReflection;
            let mut legs = *geometry;
            if is_extrapolated || legs == FrameGeometry::Unevaluated {
                legs = candidate.evaluate(inputs, source, arena);
                work.spend(legs.cost());
                // Tested soon after its points are on their surfaces again.
                if legs == FrameGeometry::Invalid && state.is_reflection {
                    state.tested = None;
                }
            }
            // An extrapolated path remains one as long as its points are on their surfaces.
            if !is_extrapolated || legs == FrameGeometry::Invalid {
                *geometry = legs;
            }
            if !legs.is_testable() {
                continue;
            }
            self.tests += 1;
            if self.rays + max_rays(legs, arena) > self.budget {
                break;
            }
            let Some(source) = source else {
                continue;
            };
            let (first, cast) = (&mut state.blocked_segment, self.rays);
            let is_visible =
                is_unoccluded(legs, arena, source, inputs.scene, first, &mut self.rays);
            state.record_visibility(is_visible, self.frame);
            work.spend(cost::RAY * (self.rays - cast) as usize);
            // A blocked path needs only its points.
            if is_visible && *geometry == FrameGeometry::Unfolded {
                *geometry = arena.push_unfolded(inputs.scene);
            }
            // Updates select the loudest diffracted paths: a ray does not extend the validity of one.
            if is_visible && state.is_reflection {
                candidate.valid_in = updates;
            }
        }
        self.queue.clear();
        (self.rays - before, true)
    }
}

/// Expected benefit of a test per ray.
fn priority(state: &VisibilityState, frame: u64) -> f32 {
    let age = state
        .tested
        .map_or(UNTESTED_FRAMES, |tested| frame - tested.min(frame)) as f32;
    let unchanged = (frame - state.changed.min(frame)) as f32 + INITIAL_UNCHANGED_FRAMES;
    let (rays, energy) = match state.is_visible {
        true => (
            f32::from(state.segments),
            state.energy.max(FADED_SHARE * state.peak_energy),
        ),
        // A blocked path usually remains blocked at the segment tested first.
        false => (1.0, state.peak_energy),
    };
    let likelihood = match state.in_update == state.is_visible {
        true => 1.0 / unchanged,
        false => 1.0,
    };
    energy * age * age * likelihood / rays
}

/// Most rays of a test.
fn max_rays(geometry: FrameGeometry, arena: &GeometryArena) -> u64 {
    match geometry {
        FrameGeometry::Unfolded => arena.unfolded.legs().order as u64 + 1,
        FrameGeometry::Image(index) => arena.image(index).order as u64 + 1,
        FrameGeometry::Diffracted(_) | FrameGeometry::ExtrapolatedDiffraction(_) => {
            revalidate::MAX_RAYS
        }
        _ => 0,
    }
}

fn is_unoccluded(
    geometry: FrameGeometry,
    arena: &GeometryArena,
    source: &FrameSource,
    scene: &Scene,
    blocked_segment: &mut u8,
    rays: &mut u64,
) -> bool {
    let path = match geometry {
        FrameGeometry::Unfolded => arena.unfolded.legs(),
        FrameGeometry::Image(index) => arena.image(index),
        FrameGeometry::Diffracted(index) | FrameGeometry::ExtrapolatedDiffraction(index) => {
            let path = arena.diffracted(index);
            return path.is_unoccluded(scene, &source.endpoints, rays);
        }
        _ => return true,
    };
    are_segments_clear(path, source, scene, blocked_segment, rays)
}

/// Tests the last blocked segment first: most blocked paths remain blocked there and take one ray.
fn are_segments_clear(
    path: &ImagePath,
    source: &FrameSource,
    scene: &Scene,
    blocked_segment: &mut u8,
    rays: &mut u64,
) -> bool {
    let first = usize::from(*blocked_segment).min(path.order);
    let others = (0..=path.order).filter(|segment| *segment != first);
    let blocked = std::iter::once(first).chain(others).find(|&segment| {
        *rays += 1;
        let (line, ignored) = path.leg(source.local, segment);
        scene.any_hit(&line, ignored)
    });
    *blocked_segment = blocked.map_or(*blocked_segment, |segment| segment as u8);
    blocked.is_none()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acoustics::BANDS;
    use crate::propagation::{Path, PathId};
    use crate::scene::SourceId;
    use glam::Vec3;

    fn state(level: f32) -> VisibilityState {
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
        let mut state = VisibilityState::new(&path, true, 0);
        state.tested = Some(100);
        state
    }

    #[test]
    fn priorities_sort_as_numbers_and_equal_ones_by_index() {
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
            assert!(Priority::new(lower, 1) > Priority::new(lower, 2));
            assert_eq!(Priority::new(lower, 7).index(), 7);
            for higher in &values[a + 1..] {
                assert!(lower.total_cmp(higher).is_lt());
                assert!(
                    Priority::new(lower, 1) < Priority::new(*higher, 2),
                    "{lower} {higher}"
                );
            }
        }
    }

    #[test]
    fn priority_follows_the_present_energy() {
        let (mut faded, loud) = (state(0.001), state(0.1));
        assert!(priority(&faded, 110) < priority(&loud, 110));
        // The path fades at a surface's end at the update's position, not at the listener's.
        faded.record_amplitude(&[0.2; BANDS]);
        assert!(priority(&faded, 110) > priority(&loud, 110));
        // The path fades again and may return.
        faded.record_amplitude(&[0.001; BANDS]);
        assert!(priority(&faded, 110) > priority(&state(0.001), 110));
    }

    #[test]
    fn extrapolated_reflections_are_tested_in_every_frame() {
        let geometries = [
            FrameGeometry::Extrapolated,
            FrameGeometry::ExtrapolatedReflection,
            FrameGeometry::Invalid,
        ];
        let mut scheduler = VisibilityScheduler::default();
        scheduler.begin((8, false), 101, &[state(0.1); 3], &geometries);
        let queued: Vec<usize> = scheduler.queue.iter().map(|next| next.index()).collect();
        assert_eq!(queued, [1]);
    }

    #[test]
    fn contradicted_and_recently_changed_paths_come_first() {
        let quiet = state(0.1);
        let mut contradicted = quiet;
        contradicted.in_update = false;
        assert!(priority(&contradicted, 110) > 4.0 * priority(&quiet, 110));
        let mut recently_changed = quiet;
        recently_changed.record_visibility(false, 90);
        recently_changed.record_visibility(true, 100);
        assert!(priority(&recently_changed, 110) > priority(&quiet, 110));
        // Twice the time quadruples the priority.
        let [early, late] = [104, 108].map(|frame| priority(&contradicted, frame));
        assert_eq!(late, 4.0 * early);
    }
}
