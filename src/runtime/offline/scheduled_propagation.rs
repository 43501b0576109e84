//! Runs propagation by a schedule, on a virtual clock that counts graphics frames. No thread, no clock.

use crate::extrapolation::{PredictorKind, PreparedUpdate};
use crate::propagation::{Path, PathSet, Propagator};
use crate::runtime::offline::pose_prediction::PosePrediction;
use crate::runtime::offline::schedule::{Latency, Poses, Schedule};

/// A propagator with its schedule.
#[derive(Debug)]
pub(crate) struct ScheduledPropagation {
    schedule: Schedule,
    propagator: Propagator,
    graphics_rate_hz: f64,
    frame: u64,
    /// A computed result that is not usable yet on the virtual clock.
    pending: Option<PathSet>,
    /// Prepared values of the result returned last, and of the one computed last.
    prepared: PreparedUpdate,
    newest_prepared: PreparedUpdate,
    predictor: PredictorKind,
    spare: PathSet,
    /// The paths behind a surface that the listener comes near.
    beyond_surface: PathSet,
    prediction: PosePrediction,
}

impl ScheduledPropagation {
    /// `predictor` determines the poses for which a result is computed.
    pub(crate) fn new(
        schedule: Schedule,
        propagator: Propagator,
        graphics_rate_hz: f64,
        predictor: PredictorKind,
    ) -> Self {
        Self {
            prediction: PosePrediction::new(schedule, predictor),
            schedule,
            propagator,
            graphics_rate_hz,
            frame: 0,
            pending: None,
            prepared: PreparedUpdate::default(),
            newest_prepared: PreparedUpdate::default(),
            predictor,
            spare: PathSet::default(),
            beyond_surface: PathSet::default(),
        }
    }

    /// Prepared values of the result that [`Self::next_frame`] returned last.
    pub(crate) fn prepared_mut(&mut self) -> &mut PreparedUpdate {
        &mut self.prepared
    }

    /// The propagator, to change its scene's instances.
    pub(crate) fn propagator_mut(&mut self) -> &mut Propagator {
        &mut self.propagator
    }

    /// Takes memory of an earlier result for reuse.
    pub(crate) fn recycle(&mut self, retired: PathSet) {
        self.spare = retired;
    }

    /// Whether the next graphics frame starts an update.
    pub(crate) fn starts_update(&self) -> bool {
        let interval = u64::from(self.schedule.extrapolation_level()) + 1;
        match self.is_late() {
            // Frame 0 has a result of its own, so delayed updates start from frame 1 on.
            true => self.frame == 0 || (self.frame - 1).is_multiple_of(interval),
            false => self.frame.is_multiple_of(interval),
        }
    }

    fn is_late(&self) -> bool {
        matches!(
            self.schedule,
            Schedule::Asynchronous {
                latency: Latency::Modelled,
                ..
            }
        )
    }

    /// Advances to the next graphics frame; returns the result that becomes usable in it, if any.
    ///
    /// In frame 0 both schedules use a result for the poses of frame 0, after a warm-up of sixteen updates. Delayed
    /// updates follow every L + 1 frames from frame 1 on.
    pub(crate) fn next_frame(&mut self, poses: &Poses) -> Option<PathSet> {
        let first = self.frame == 0;
        let arrived = if first {
            self.propagator.warm_up(&poses.listener, &poses.sources);
            Some(self.compute(poses))
        } else if !self.starts_update() {
            None
        } else {
            match self.is_late() {
                true => self.pending.take(),
                false => Some(self.compute(poses)),
            }
        };
        if arrived.is_some() {
            std::mem::swap(&mut self.prepared, &mut self.newest_prepared);
        }
        if !first && self.is_late() && self.starts_update() {
            self.pending = Some(self.compute(poses));
        }
        self.prediction.push(poses);
        self.frame += 1;
        arrived
    }

    fn compute(&mut self, poses: &Poses) -> PathSet {
        let mut result = std::mem::take(&mut self.spare);
        let time_s = self.frame as f64 / self.graphics_rate_hz;
        let radius_m = self.prediction.nearby_radius_m(poses);
        let poses = self
            .prediction
            .predict(poses, self.propagator.scene())
            .clone();
        let Poses { listener, sources } = &poses;
        let beyond = self
            .prediction
            .beyond_surface()
            .filter(|_| radius_m.is_some());
        if let Some(beyond) = &beyond {
            self.propagator.set_nearby_radius(None);
            self.propagator.set_predicted_positions(&[], &[]);
            self.propagator
                .update(beyond, sources, time_s, &mut self.beyond_surface);
        }
        self.propagator.set_nearby_radius(radius_m);
        let (positions, source_positions) = self.prediction.sampled_positions();
        self.propagator
            .set_predicted_positions(positions, source_positions);
        self.propagator
            .update(listener, sources, time_s, &mut result);
        if beyond.is_some() {
            add_nearby(&mut result, &self.beyond_surface);
        }
        // As the engine does.
        match self.predictor {
            PredictorKind::Geometric(_) => {
                self.newest_prepared
                    .prepare(&result, self.propagator.scene());
            }
            PredictorKind::Hold | PredictorKind::Linear => self.newest_prepared.clear(),
        }
        result
    }
}

/// Adds the paths of another update to the nearby paths, and its direct edges.
fn add_nearby(result: &mut PathSet, other: &PathSet) {
    let known = |path: &Path| {
        let by_id = |known: &Path| known.id.cmp(&path.id);
        result.paths.binary_search_by(by_id).is_ok()
            || result.nearby.binary_search_by(by_id).is_ok()
    };
    let paths = other.paths.iter();
    let new = paths.filter(|path| !path.is_frame_validated() && !known(path));
    let new: Vec<Path> = new.copied().collect();
    result.nearby.extend(new);
    result.nearby.sort_unstable_by_key(|path| path.id);
    result.direct_edges.extend(&other.direct_edges);
    let known = result.reflection_edges.len();
    for edge in &other.reflection_edges {
        if !result.reflection_edges[..known].contains(edge) {
            result.reflection_edges.push(*edge);
        }
    }
    result.rays += other.rays;
}
