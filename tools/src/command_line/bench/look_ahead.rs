//! What an update for a predictor finds besides, as the engine asks for it.

use foresound::extrapolation::PredictorKind;
use foresound::glam::Vec3;
use foresound::propagation::Propagator;
use foresound::scene::{ListenerPose, SourcePose};

use super::walk::STEP_M;

/// Radius in metres within which closed paths are asked for: the way to the next update and what the engine adds to it.
const NEARBY_M: f64 = STEP_M as f64 + 0.05;

/// Asks for nearby paths, and for late energy halfway between the positions of an update and those of the one before.
pub(super) struct LookAhead {
    predictor: PredictorKind,
    /// Positions of the last update.
    listener: Option<Vec3>,
    sources: Vec<Vec3>,
}

impl LookAhead {
    pub(super) fn new(predictor: PredictorKind) -> Self {
        Self {
            predictor,
            listener: None,
            sources: Vec::new(),
        }
    }

    /// Before the update at these poses.
    pub(super) fn ask(
        &mut self,
        propagator: &mut Propagator,
        listener: &ListenerPose,
        sources: &[SourcePose],
    ) {
        if !self.predictor.uses_nearby() {
            return;
        }
        let present = || sources.iter().map(|source| source.position);
        if self.sources.len() != sources.len() {
            self.sources = present().collect();
        }
        let last = self.listener.replace(listener.position);
        let halfway = last
            .unwrap_or(listener.position)
            .midpoint(listener.position);
        let between = self.sources.iter().zip(present());
        let between: Vec<Vec3> = between.map(|(last, now)| last.midpoint(now)).collect();
        propagator.set_nearby_radius(Some(NEARBY_M));
        propagator.set_predicted_positions(&[halfway], &between);
        self.sources.clear();
        self.sources.extend(present());
    }
}
