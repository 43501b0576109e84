//! Predicts poses for the time at which an update is used, from poses known at its start.
//!
//! A predicted position stops in front of a surface. Own.

use glam::Vec3;

use crate::extrapolation::{PredictionTarget, PredictorKind};
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::runtime::offline::motion_model::{MotionModel, position_of, straight_displacement};
use crate::runtime::offline::schedule::{Latency, Poses, Schedule};
use crate::scene::{ListenerPose, Scene, SourcePose};

/// Distance kept from a surface, in metres.
const CLEARANCE_M: f32 = 0.1;

/// Range in metres of the radius within which nearby paths are requested.
const MIN_NEARBY_RADIUS_M: f64 = 0.05;
const MAX_NEARBY_RADIUS_M: f64 = 0.5;

/// Distance in metres between positions at which late energy is estimated, and their greatest number.
const SAMPLE_SPACING_M: f32 = 0.15;
const MAX_STEPS: f32 = 16.0;

/// Predicts poses some graphics frames ahead.
#[derive(Debug)]
pub(crate) struct PosePrediction {
    frames_ahead: f32,
    /// Graphics frames until the result arrives.
    arrival_frames: f32,
    /// Graphics frames from the computed poses to the farthest use of the result; `None` if the predictor does not use
    /// nearby paths.
    farthest_frames: Option<f32>,
    last: Option<Poses>,
    sources: MotionModel,
    predicted: Poses,
    /// Further positions of the listener while the result is used.
    sampled_listener: Vec<Vec3>,
    /// Positions of all sources for each of those.
    sampled_sources: Vec<Vec3>,
    /// Position of a listener beyond the surface at which [`advance_to_surface`] stops.
    beyond_surface: Option<Vec3>,
}

impl PosePrediction {
    pub(crate) fn new(schedule: Schedule, predictor: PredictorKind) -> Self {
        let target = predictor.prediction_target();
        let interval = schedule.extrapolation_level() as f32 + 1.0;
        let late = match schedule {
            Schedule::Asynchronous {
                latency: Latency::Modelled,
                ..
            } => interval,
            _ => 0.0,
        };
        // The last graphics frame of an interval comes one frame before its end.
        let used = interval - 1.0;
        let frames_ahead = match (schedule, target) {
            (Schedule::Synchronous, _) | (_, PredictionTarget::None) => 0.0,
            (_, PredictionTarget::Arrival) => late,
            (_, PredictionTarget::Middle) => late + 0.5 * used,
            (_, PredictionTarget::End) => late + used,
        };
        let farthest = (late + used - frames_ahead).max(frames_ahead - late);
        let off = matches!(schedule, Schedule::Asynchronous { .. }) && predictor.uses_nearby();
        Self {
            frames_ahead,
            arrival_frames: late,
            farthest_frames: off.then_some(farthest),
            last: None,
            sources: MotionModel::new(interval as usize),
            predicted: Poses::default(),
            sampled_listener: Vec::new(),
            sampled_sources: Vec::new(),
            beyond_surface: None,
        }
    }

    /// The poses to compute for; `now` if nothing is predicted.
    pub(crate) fn predict<'a>(&'a mut self, now: &'a Poses, scene: &Scene) -> &'a Poses {
        self.beyond_surface = None;
        self.sampled_listener.clear();
        self.sampled_sources.clear();
        let Some(last) = self.last.as_ref().filter(|_| self.frames_ahead > 0.0) else {
            return now;
        };
        self.predicted.clone_from(now);
        let (before, at) = (last.listener.position, now.listener.position);
        let displacement = straight_displacement(before, at, self.frames_ahead);
        let ahead = advance_to_surface(at, displacement, scene);
        self.predicted.listener.position = ahead;
        let unobstructed = displacement.map(|displacement| at + displacement);
        self.beyond_surface = unobstructed.filter(|position| *position != ahead);
        for (source, pose) in self.predicted.sources.iter_mut().zip(&now.sources) {
            let displacement = self.sources.displacement(last, pose, self.frames_ahead);
            source.position = advance_to_surface(pose.position, displacement, scene);
        }
        self.sample_ahead(now, scene);
        &self.predicted
    }

    /// Samples the motion to the predicted poses, in even steps while the result is used, and the position beyond a
    /// surface.
    fn sample_ahead(&mut self, now: &Poses, scene: &Scene) {
        let Some(last) = &self.last else { return };
        let used = self.frames_ahead - self.arrival_frames;
        let (before, at) = (last.listener.position, now.listener.position);
        let step_of = |pose: &SourcePose| {
            let before = position_of(last, pose.id);
            before.and_then(|before| straight_displacement(before, pose.position, 1.0))
        };
        let listener_step = straight_displacement(before, at, 1.0).unwrap_or_default();
        let fastest = now.sources.iter().filter_map(step_of);
        let fastest = fastest.map(Vec3::length).fold(0.0, f32::max);
        let distance_m = used * listener_step.length().max(0.5 * fastest);
        let steps = (distance_m / SAMPLE_SPACING_M).ceil().min(MAX_STEPS);
        for step in 0..steps as u16 {
            let frames = self.arrival_frames + used * f32::from(step) / steps;
            self.sampled_listener.push(at + listener_step * frames);
            for pose in &now.sources {
                let displacement = self.sources.displacement(last, pose, frames);
                self.sampled_sources
                    .push(advance_to_surface(pose.position, displacement, scene));
            }
        }
        if let Some(beyond) = self.beyond_surface {
            self.sampled_listener.push(beyond);
            let ahead = self.predicted.sources.iter().map(|pose| pose.position);
            self.sampled_sources.extend(ahead);
        }
    }

    /// Further listener positions for late energy, and the source positions for each.
    pub(crate) fn sampled_positions(&self) -> (&[Vec3], &[Vec3]) {
        (&self.sampled_listener, &self.sampled_sources)
    }

    /// The predicted listener beyond a surface, if the predicted poses stop at one.
    pub(crate) fn beyond_surface(&self) -> Option<ListenerPose> {
        let position = self.beyond_surface?;
        Some(ListenerPose {
            position,
            ..self.predicted.listener
        })
    }

    /// Radius in metres around the predicted listener within which the result is used; `None` without nearby paths.
    pub(crate) fn nearby_radius_m(&self, now: &Poses) -> Option<f64> {
        let frames = self.farthest_frames?;
        let Some(last) = &self.last else {
            return Some(MAX_NEARBY_RADIUS_M);
        };
        let step_of = |pose: &SourcePose| Some(pose.position.distance(position_of(last, pose.id)?));
        let fastest = now.sources.iter().filter_map(step_of).fold(0.0, f32::max);
        let step = now.listener.position.distance(last.listener.position) + fastest;
        let distance_m = f64::from(step * frames) + MIN_NEARBY_RADIUS_M;
        Some(distance_m.min(MAX_NEARBY_RADIUS_M))
    }

    /// Stores the poses of a completed graphics frame.
    pub(crate) fn push(&mut self, poses: &Poses) {
        if self.frames_ahead > 0.0 || self.farthest_frames.is_some() {
            self.last.get_or_insert_default().clone_from(poses);
            self.sources.push(poses);
        }
    }
}

/// Advances a position by a displacement, at most to [`CLEARANCE_M`] in front of a surface.
fn advance_to_surface(at: Vec3, displacement: Option<Vec3>, scene: &Scene) -> Vec3 {
    let Some(displacement) = displacement.filter(|d| *d != Vec3::ZERO) else {
        return at;
    };
    let local = scene.to_local(at).as_vec3();
    let clearance = CLEARANCE_M / displacement.length();
    let scale = 1.0 + clearance;
    let ray = Ray::between(local, local + displacement * scale);
    match scene.closest_hit(&ray, [NO_GROUP; 2]) {
        None => at + displacement,
        Some(hit) => at + displacement * (hit.t * scale - clearance).max(0.0),
    }
}
