//! The late field between two updates.
//!
//! Own. An update's estimate is a smooth function of where source and listener are ([`crate::propagation::late`]), so
//! between the places of the last two updates it lies on the line between theirs; where updates lag behind, the line goes
//! on, by its own length at most. A wall ends what is smooth: only estimates for places count that the listener sees, and
//! behind a wall those that an update has made there ([`crate::propagation::PathSet::beyond`]). When the first sound can be
//! there follows from the places themselves.

use glam::Vec3;

use super::Now;
use crate::acoustics::BANDS;
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::{LateSource, PathSet};
use crate::scene::{SourceId, SourcePose};

/// Motion between two updates in metres from which their estimates lie on a line.
const LEAST_MOTION_M: f32 = 1e-3;

/// How far the line goes on, in its own lengths from the older update.
const FARTHEST: f32 = 2.0;

/// An update's estimates for one place.
#[derive(Clone, Copy)]
struct Estimates<'a> {
    place: Vec3,
    late: &'a [LateSource],
    sources: &'a [SourcePose],
}

/// Gives every source of the newest update, with its late field as it is now; gives the number of rays cast.
pub(in super::super) fn late_now(
    current: &PathSet,
    previous: &PathSet,
    now: &Now<'_>,
    mut give: impl FnMut(LateSource),
) -> u64 {
    let mut rays = 0;
    let both = [current, previous].into_iter().flat_map(of_update);
    let mut seen = both.filter(|estimates| {
        !estimates.late.is_empty() && is_in_sight(estimates.place, now, &mut rays)
    });
    let (newer, older) = (seen.next(), seen.next());
    drop(seen);
    if let Some(newer) = newer.or(of_update(current).next()) {
        for late in newer.late {
            give(between(late, &newer, older.as_ref(), now));
        }
    }
    rays
}

/// What an update has estimated: for where its listener is, and for the place behind a wall.
fn of_update(update: &PathSet) -> impl Iterator<Item = Estimates<'_>> {
    let here = Estimates {
        place: update.listener.position,
        late: &update.late,
        sources: &update.sources,
    };
    let beyond = update.beyond.map(|place| Estimates {
        place,
        late: &update.late_beyond,
        sources: &update.sources,
    });
    std::iter::once(here).chain(beyond)
}

fn is_in_sight(place: Vec3, now: &Now<'_>, rays: &mut u64) -> bool {
    if place == now.listener.position {
        return true;
    }
    *rays += 1;
    let [from, to] = [now.listener.position, place].map(|at| now.scene.to_local(at).as_vec3());
    !now.scene.any_hit(&Ray::between(from, to), [NO_GROUP; 2])
}

/// A source's late field on the line between two estimates.
fn between(
    late: &LateSource,
    newer: &Estimates<'_>,
    older: Option<&Estimates<'_>>,
    now: &Now<'_>,
) -> LateSource {
    let id = late.source;
    let mut result = *late;
    let Some(spot) = now.spot(id) else {
        return result;
    };
    let [from, to] = [spot.from, spot.to].map(|place| now.scene.to_local(place));
    result.start_s = (from.distance(to) / now.scene.speed_of_sound_m_s()) as f32;
    let Some(older) = older else {
        return result;
    };
    let before = older.late.iter().find(|late| late.source == id);
    let (Some(before), Some(first), Some(last)) = (
        before.filter(|late| late.mean_free_time_s > 0.0),
        source_in(older.sources, id),
        source_in(newer.sources, id),
    ) else {
        return result;
    };
    if late.mean_free_time_s <= 0.0 {
        return result;
    }
    let way = [last - first, newer.place - older.place];
    let done = [spot.from - first, spot.to - older.place];
    let length_squared: f32 = way.iter().map(|step| step.length_squared()).sum();
    if length_squared < LEAST_MOTION_M * LEAST_MOTION_M {
        return result;
    }
    let along: f32 = way.iter().zip(done).map(|(way, done)| way.dot(done)).sum();
    let share = (along / length_squared).clamp(0.0, FARTHEST);
    let at = |a: f32, b: f32| (a + (b - a) * share).max(0.0);
    for (step, (energy, before)) in result.energy.iter_mut().zip(before.energy).enumerate() {
        for b in 0..BANDS {
            energy[b] = at(before[b], late.energy[step][b]);
        }
    }
    for b in 0..BANDS {
        result.decay_time_s[b] = at(before.decay_time_s[b], late.decay_time_s[b]);
    }
    result.mean_free_time_s = at(before.mean_free_time_s, late.mean_free_time_s);
    result
}

fn source_in(sources: &[SourcePose], id: SourceId) -> Option<Vec3> {
    let pose = sources.iter().find(|pose| pose.id == id);
    pose.map(|pose| pose.position)
}
