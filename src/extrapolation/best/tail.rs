//! The late field between two updates.
//!
//! Own. An update's estimate is a smooth function of where source and listener are ([`crate::propagation::late`]), so
//! between the places of the last two updates it lies on the line between theirs; where updates lag behind, the line goes
//! on, by its own length at most. When the first sound can be there follows from the places themselves.

use glam::Vec3;

use super::Now;
use crate::acoustics::BANDS;
use crate::propagation::{LateSource, PathSet};
use crate::scene::{SourceId, SourcePose};

/// Motion between two updates in metres from which their estimates lie on a line.
const LEAST_MOTION_M: f32 = 1e-3;

/// How far the line goes on, in its own lengths from the older update.
const FARTHEST: f32 = 2.0;

/// The late field of a source of the newest update, as it is now.
pub(in super::super) fn late_now(
    current: &PathSet,
    previous: &PathSet,
    late: &LateSource,
    now: &Now<'_>,
) -> LateSource {
    let id = late.source;
    let mut result = *late;
    let Some(spot) = now.spot(id) else {
        return result;
    };
    let [from, to] = [spot.from, spot.to].map(|place| now.scene.to_local(place));
    result.start_s = (from.distance(to) / now.scene.speed_of_sound_m_s()) as f32;
    let before = previous.late.iter().find(|late| late.source == id);
    let (Some(before), Some(first), Some(last)) = (
        before.filter(|late| late.mean_free_time_s > 0.0),
        source_in(previous, id),
        source_in(current, id),
    ) else {
        return result;
    };
    if late.mean_free_time_s <= 0.0 {
        return result;
    }
    let way = [
        last - first,
        current.listener.position - previous.listener.position,
    ];
    let done = [spot.from - first, spot.to - previous.listener.position];
    let length_squared: f32 = way.iter().map(|step| step.length_squared()).sum();
    if length_squared < LEAST_MOTION_M * LEAST_MOTION_M {
        return result;
    }
    let along: f32 = way.iter().zip(done).map(|(way, done)| way.dot(done)).sum();
    let share = (along / length_squared).clamp(0.0, FARTHEST);
    let between = |a: f32, b: f32| (a + (b - a) * share).max(0.0);
    for (step, (energy, before)) in result.energy.iter_mut().zip(before.energy).enumerate() {
        for b in 0..BANDS {
            energy[b] = between(before[b], late.energy[step][b]);
        }
    }
    for b in 0..BANDS {
        result.decay_time_s[b] = between(before.decay_time_s[b], late.decay_time_s[b]);
    }
    result.mean_free_time_s = between(before.mean_free_time_s, late.mean_free_time_s);
    result
}

fn source_in(update: &PathSet, id: SourceId) -> Option<Vec3> {
    let pose = |pose: &&SourcePose| pose.id == id;
    update.sources.iter().find(pose).map(|pose| pose.position)
}
