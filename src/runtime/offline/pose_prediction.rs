//! Where everybody will be when an update is used: poses carried on along the last step, by poses known at its start.
//!
//! Own work. A place is never carried through a surface: the way there stops short of it.

use glam::Vec3;

use crate::extrapolation::{PredictionTarget, PredictorKind};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::runtime::offline::motion_model::{MotionModel, place_in, way};
use crate::runtime::offline::schedule::{Latency, Poses, Schedule};
use crate::scene::{ListenerPose, Scene, SourcePose};

/// Distance kept from a surface that the predicted way meets, in metres.
const CLEARANCE_M: f32 = 0.1;

/// Least and farthest distance in metres within which paths are asked for that are not there.
const LEAST_REACH_M: f64 = 0.05;
const FARTHEST_REACH_M: f64 = 0.5;

/// Distance in metres between places that late fields are asked for, and most of those.
const WAY_STEP_M: f32 = 0.15;
const MOST_STEPS: f32 = 16.0;

/// Predicts poses some graphics frames ahead.
#[derive(Debug)]
pub(crate) struct PosePrediction {
    frames_ahead: f32,
    /// Until the result arrives, in graphics frames.
    frames_late: f32,
    /// From the poses that are computed for to the farthest of those that the result is used for, in graphics frames;
    /// `None` if nobody asks what is nearby.
    frames_off: Option<f32>,
    last: Option<Poses>,
    sources: MotionModel,
    ahead: Poses,
    /// Where the listener will be while the result is used, besides [`Self::poses`].
    way: Vec<Vec3>,
    /// Where the sources will be then: for each place all of them.
    predicted_sources: Vec<Vec3>,
    /// Where the listener will be who walks through what [`carried`] stops at.
    beyond: Option<Vec3>,
}

impl PosePrediction {
    pub(crate) fn new(schedule: Schedule, predictor: PredictorKind) -> Self {
        let lead = predictor.prediction_target();
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
            (Schedule::Synchronous, _) | (_, PredictionTarget::None) => 0.0,
            (_, PredictionTarget::Arrival) => late,
            (_, PredictionTarget::Middle) => late + 0.5 * used,
            (_, PredictionTarget::End) => late + used,
        };
        let farthest = (late + used - frames_ahead).max(frames_ahead - late);
        let off = matches!(schedule, Schedule::Asynchronous { .. }) && predictor.uses_nearby();
        Self {
            frames_ahead,
            frames_late: late,
            frames_off: off.then_some(farthest),
            last: None,
            sources: MotionModel::new(interval as usize),
            ahead: Poses::default(),
            way: Vec::new(),
            predicted_sources: Vec::new(),
            beyond: None,
        }
    }

    /// The poses to compute for; the same ones where nothing is predicted or nothing moves.
    pub(crate) fn poses<'a>(&'a mut self, now: &'a Poses, scene: &Scene) -> &'a Poses {
        self.beyond = None;
        self.way.clear();
        self.predicted_sources.clear();
        let Some(last) = self.last.as_ref().filter(|_| self.frames_ahead > 0.0) else {
            return now;
        };
        self.ahead.clone_from(now);
        let (before, at) = (last.listener.position, now.listener.position);
        let through = way(before, at, self.frames_ahead);
        let ahead = carried(at, through, scene);
        self.ahead.listener.position = ahead;
        let through = through.map(|way| at + way);
        self.beyond = through.filter(|place| *place != ahead);
        for (source, pose) in self.ahead.sources.iter_mut().zip(&now.sources) {
            let way = self.sources.way(last, pose, self.frames_ahead);
            source.position = carried(pose.position, way, scene);
        }
        self.look_along(now, scene);
        &self.ahead
    }

    /// Plans where tails are to be estimated: on the way to [`Self::poses`] while the result is heard, in even steps, and
    /// through what that stops at.
    fn look_along(&mut self, now: &Poses, scene: &Scene) {
        let Some(last) = &self.last else { return };
        let used = self.frames_ahead - self.frames_late;
        let (before, at) = (last.listener.position, now.listener.position);
        let step_of = |pose: &SourcePose| {
            let before = place_in(last, pose.id);
            before.and_then(|before| way(before, pose.position, 1.0))
        };
        let listener_step = way(before, at, 1.0).unwrap_or_default();
        let fastest = now.sources.iter().filter_map(step_of);
        let fastest = fastest.map(Vec3::length).fold(0.0, f32::max);
        let way_m = used * listener_step.length().max(0.5 * fastest);
        let steps = (way_m / WAY_STEP_M).ceil().min(MOST_STEPS);
        for step in 0..steps as u16 {
            let frames = self.frames_late + used * f32::from(step) / steps;
            self.way.push(at + listener_step * frames);
            for pose in &now.sources {
                let way = self.sources.way(last, pose, frames);
                self.predicted_sources
                    .push(carried(pose.position, way, scene));
            }
        }
        if let Some(beyond) = self.beyond {
            self.way.push(beyond);
            let ahead = self.ahead.sources.iter().map(|pose| pose.position);
            self.predicted_sources.extend(ahead);
        }
    }

    /// The places that tails are to be estimated for besides [`Self::poses`], and where the sources are then.
    pub(crate) fn way(&self) -> (&[Vec3], &[Vec3]) {
        (&self.way, &self.predicted_sources)
    }

    /// Where the listener will be, if not at [`Self::poses`] but through what those stop at.
    pub(crate) fn beyond(&self) -> Option<ListenerPose> {
        let position = self.beyond?;
        Some(ListenerPose {
            position,
            ..self.ahead.listener
        })
    }

    /// How far from [`Self::poses`] the result of an update is used, in metres; `None` if nobody asks what is nearby.
    pub(crate) fn reach_m(&self, now: &Poses) -> Option<f64> {
        let frames = self.frames_off?;
        let Some(last) = &self.last else {
            return Some(FARTHEST_REACH_M);
        };
        let mut steps = now.listener.position.distance(last.listener.position);
        let mut fastest = 0.0f32;
        for source in &now.sources {
            if let Some(before) = last.sources.iter().find(|pose| pose.id == source.id) {
                fastest = fastest.max(source.position.distance(before.position));
            }
        }
        steps += fastest;
        let way_m = f64::from(steps * frames) + LEAST_REACH_M;
        Some(way_m.min(FARTHEST_REACH_M))
    }

    /// Keeps the poses of a graphics frame that is over.
    pub(crate) fn remember(&mut self, poses: &Poses) {
        if self.frames_ahead > 0.0 || self.frames_off.is_some() {
            self.last.get_or_insert_default().clone_from(poses);
            self.sources.remember(poses);
        }
    }
}

fn carried(at: Vec3, way: Option<Vec3>, scene: &Scene) -> Vec3 {
    let Some(way) = way.filter(|way| *way != Vec3::ZERO) else {
        return at;
    };
    let local = scene.to_local(at).as_vec3();
    let reach = 1.0 + CLEARANCE_M / way.length();
    let ray = Ray::between(local, local + way * reach);
    match scene.closest_hit(&ray, [NO_GROUP; 2]) {
        None => at + way,
        Some(hit) => at + way * (hit.t * reach - CLEARANCE_M / way.length()).max(0.0),
    }
}
