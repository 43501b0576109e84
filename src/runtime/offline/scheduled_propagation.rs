//! Runs propagation by a schedule, on a virtual clock that counts graphics frames. No thread, no clock.

use crate::extrapolation::{PredictorKind, PreparedUpdate};
use crate::propagation::{PathSet, Propagator, Serial};
use crate::runtime::offline::schedule::{Latency, Poses, Schedule};
use crate::runtime::pipeline::pose_prediction::UseInterval;
use crate::runtime::pipeline::update_pipeline::{UpdatePipeline, UpdateRequest};

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
    pipeline: UpdatePipeline,
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
            schedule,
            propagator,
            graphics_rate_hz,
            frame: 0,
            pending: None,
            prepared: PreparedUpdate::default(),
            newest_prepared: PreparedUpdate::default(),
            predictor,
            spare: PathSet::default(),
            pipeline: UpdatePipeline::default(),
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
        let time_s = self.time_s();
        let history = self.pipeline.history_mut();
        history.push(time_s, &poses.listener, &poses.sources);
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
        self.frame += 1;
        arrived
    }

    fn compute(&mut self, poses: &Poses) -> PathSet {
        let mut result = std::mem::take(&mut self.spare);
        let request = UpdateRequest {
            listener: &poses.listener,
            sources: &poses.sources,
            time_s: self.time_s(),
            predictor: self.predictor,
            in_use: self.in_use(),
            max_paths: usize::MAX,
            max_nearby: usize::MAX,
        };
        let output = (&mut result, &mut self.newest_prepared);
        self.pipeline
            .update((&mut self.propagator, &Serial), &request, output);
        result
    }

    fn time_s(&self) -> f64 {
        self.frame as f64 / self.graphics_rate_hz
    }

    /// When an update that begins now is in use.
    fn in_use(&self) -> Option<UseInterval> {
        let Schedule::Asynchronous {
            extrapolation_level,
            latency,
        } = self.schedule
        else {
            return None;
        };
        let seconds = |frames: u32| f64::from(frames) / self.graphics_rate_hz;
        Some(UseInterval {
            arrival_s: match latency {
                Latency::Modelled => seconds(extrapolation_level + 1),
                Latency::None => 0.0,
            },
            // The last graphics frame of an interval comes one frame before its end.
            used_s: seconds(extrapolation_level),
        })
    }
}
