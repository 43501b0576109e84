//! Predicts poses for the time at which an update is used, from poses known at its start.
//!
//! A predicted position stops in front of a surface. Own.

use glam::Vec3;

use crate::extrapolation::PredictionTarget;
use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::runtime::pipeline::motion_model::Motion;
use crate::runtime::pipeline::pose_history::PoseHistory;
use crate::scene::{ListenerPose, Scene, SourcePose};

/// Distance kept from a surface, in metres.
const CLEARANCE_M: f32 = 0.1;

/// Range in metres of the radius within which nearby paths are requested.
const MIN_NEARBY_RADIUS_M: f64 = 0.05;
const MAX_NEARBY_RADIUS_M: f64 = 0.5;

/// Distance in metres between positions at which late energy is estimated, and their greatest number.
const SAMPLE_SPACING_M: f32 = 0.15;
const MAX_STEPS: f32 = 16.0;

/// When an update is in use, in seconds after its poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct UseInterval {
    /// The first graphics frame that uses it.
    pub(crate) arrival_s: f64,
    /// From there to the last graphics frame that uses it.
    pub(crate) used_s: f64,
}

impl UseInterval {
    /// Time of the poses to predict.
    pub(crate) fn target_s(&self, target: PredictionTarget) -> f64 {
        match target {
            PredictionTarget::None => 0.0,
            PredictionTarget::Arrival => self.arrival_s,
            PredictionTarget::Middle => self.arrival_s + 0.5 * self.used_s,
            PredictionTarget::End => self.arrival_s + self.used_s,
        }
    }
}

/// Poses for which an update is computed.
#[derive(Debug, Default)]
pub(crate) struct PredictedPoses {
    pub(crate) listener: ListenerPose,
    pub(crate) sources: Vec<SourcePose>,
    /// Further positions of the listener while the result is used, for late energy.
    pub(crate) sampled_listener: Vec<Vec3>,
    /// Positions of all sources for each of those.
    pub(crate) sampled_sources: Vec<Vec3>,
    /// A listener beyond the surface at which the prediction stops.
    pub(crate) beyond_surface: Option<ListenerPose>,
    /// Radius in metres around the predicted listener within which the result is used.
    pub(crate) nearby_radius_m: f64,
    motions: Vec<Motion>,
}

impl PredictedPoses {
    /// Poses for use at once.
    pub(crate) fn set_present(&mut self, listener: &ListenerPose, sources: &[SourcePose]) {
        self.listener = *listener;
        self.sources.clear();
        self.sources.extend_from_slice(sources);
        self.sampled_listener.clear();
        self.sampled_sources.clear();
        self.beyond_surface = None;
        self.nearby_radius_m = MAX_NEARBY_RADIUS_M;
    }

    /// Poses for a result that is used in an interval; the newest frame of `history` has the present positions.
    pub(crate) fn predict(
        &mut self,
        (listener, sources): (&ListenerPose, &[SourcePose]),
        history: &PoseHistory,
        (interval, target): (UseInterval, PredictionTarget),
        scene: &Scene,
    ) {
        self.set_present(listener, sources);
        let Some(frame_s) = history.frame_s() else {
            return;
        };
        let frames = |seconds: f64| (seconds / frame_s) as f32;
        let arrival = frames(interval.arrival_s);
        let used = frames(interval.used_s);
        let ahead = frames(interval.target_s(target));
        self.nearby_radius_m = nearby_radius_m(
            history,
            (listener, sources),
            (arrival + used - ahead).max(ahead - arrival),
        );
        if ahead <= 0.0 {
            return;
        }
        let motion = Motion::of_listener(history);
        let at = listener.position;
        let displacement = motion.displacement(ahead);
        self.listener.position = advance_to_surface(at, displacement, scene);
        let unobstructed = displacement.map(|displacement| at + displacement);
        let beyond = unobstructed.filter(|position| *position != self.listener.position);
        self.beyond_surface = beyond.map(|position| ListenerPose {
            position,
            ..*listener
        });
        let each = sources.iter().enumerate();
        let motion_of = |each| Motion::of_source(history, each, used + 1.0);
        self.motions.clear();
        self.motions.extend(each.map(motion_of));
        for (source, motion) in self.sources.iter_mut().zip(&self.motions) {
            let displacement = motion.displacement(ahead);
            source.position = advance_to_surface(source.position, displacement, scene);
        }
        let step = motion.displacement(1.0).unwrap_or_default();
        self.sample_ahead((at, step), sources, [arrival, ahead - arrival], scene);
    }

    /// Samples the motion to the predicted poses, in even steps while the result is used, and the position beyond a
    /// surface.
    fn sample_ahead(
        &mut self,
        (at, step): (Vec3, Vec3),
        sources: &[SourcePose],
        [arrival, used]: [f32; 2],
        scene: &Scene,
    ) {
        let fastest = self.motions.iter().map(Motion::step_m).fold(0.0, f32::max);
        let distance_m = used * step.length().max(0.5 * fastest);
        let steps = (distance_m / SAMPLE_SPACING_M).ceil().min(MAX_STEPS);
        for index in 0..steps as u16 {
            let frames = arrival + used * f32::from(index) / steps;
            self.sampled_listener.push(at + step * frames);
            for (pose, motion) in sources.iter().zip(&self.motions) {
                let displacement = motion.displacement(frames);
                let position = advance_to_surface(pose.position, displacement, scene);
                self.sampled_sources.push(position);
            }
        }
        if let Some(beyond) = &self.beyond_surface {
            self.sampled_listener.push(beyond.position);
            let ahead = self.sources.iter().map(|pose| pose.position);
            self.sampled_sources.extend(ahead);
        }
    }
}

/// Radius in metres that listener and sources leave within so many graphics frames.
fn nearby_radius_m(
    history: &PoseHistory,
    (listener, sources): (&ListenerPose, &[SourcePose]),
    frames: f32,
) -> f64 {
    let Some(last) = history.get(1) else {
        return MAX_NEARBY_RADIUS_M;
    };
    let step_of = |(index, pose): (usize, &SourcePose)| {
        Some(pose.position.distance(last.source(pose.id, index)?))
    };
    let steps = sources.iter().enumerate().filter_map(step_of);
    let fastest = steps.fold(0.0, f32::max);
    let step = listener.position.distance(last.listener) + fastest;
    let distance_m = f64::from(step * frames) + MIN_NEARBY_RADIUS_M;
    distance_m.min(MAX_NEARBY_RADIUS_M)
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
