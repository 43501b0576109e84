//! Where everybody will be when an update is used: poses carried on along the last step, by poses known at its start.
//!
//! Own work. A place is never carried through a surface: the way there stops short of it.

use glam::Vec3;

use super::schedule::{Latency, Poses, Schedule};
use crate::extrapolation::Lead;
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::scene::Scene;

/// Distance kept from a surface that the predicted way meets, in metres.
const CLEARANCE_M: f32 = 0.1;

/// Longest step between two graphics frames that counts as motion, in metres; beyond it somebody was put elsewhere.
const LONGEST_STEP_M: f32 = 0.5;

/// Predicts poses some graphics frames ahead.
#[derive(Debug)]
pub(super) struct Predicted {
    frames_ahead: f32,
    last: Option<Poses>,
    ahead: Poses,
}

impl Predicted {
    pub(super) fn new(schedule: Schedule, lead: Lead) -> Self {
        let interval = schedule.level() as f32 + 1.0;
        let late = match schedule {
            Schedule::Asynchronous {
                latency: Latency::Modelled,
                ..
            } => interval,
            _ => 0.0,
        };
        // The last graphics frame of an interval comes one frame before its end.
        let used = interval - 1.0;
        let frames_ahead = match (schedule, lead) {
            (Schedule::Synchronous, _) | (_, Lead::None) => 0.0,
            (_, Lead::Arrival) => late,
            (_, Lead::Middle) => late + 0.5 * used,
            (_, Lead::End) => late + used,
        };
        Self {
            frames_ahead,
            last: None,
            ahead: Poses::default(),
        }
    }

    /// The poses to compute for; the same ones where nothing is predicted or nothing moves.
    pub(super) fn poses<'a>(&'a mut self, now: &'a Poses, scene: &Scene) -> &'a Poses {
        let Some(last) = self.last.as_ref().filter(|_| self.frames_ahead > 0.0) else {
            return now;
        };
        self.ahead.clone_from(now);
        let carry = |before: Vec3, at: Vec3| carried(before, at, self.frames_ahead, scene);
        self.ahead.listener.position = carry(last.listener.position, now.listener.position);
        for source in &mut self.ahead.sources {
            if let Some(before) = last.sources.iter().find(|pose| pose.id == source.id) {
                source.position = carry(before.position, source.position);
            }
        }
        &self.ahead
    }

    /// Keeps the poses of a graphics frame that is over.
    pub(super) fn remember(&mut self, poses: &Poses) {
        if self.frames_ahead > 0.0 {
            self.last.get_or_insert_default().clone_from(poses);
        }
    }
}

fn carried(before: Vec3, at: Vec3, frames: f32, scene: &Scene) -> Vec3 {
    let step = at - before;
    if step == Vec3::ZERO || step.length() > LONGEST_STEP_M {
        return at;
    }
    let way = step * frames;
    let local = scene.to_local(at).as_vec3();
    let reach = 1.0 + CLEARANCE_M / way.length();
    let ray = Ray::between(local, local + way * reach);
    match scene.closest_hit(&ray, [NO_GROUP; 2]) {
        None => at + way,
        Some(hit) => at + way * (hit.t * reach - CLEARANCE_M / way.length()).max(0.0),
    }
}
