//! Runs propagation by a schedule, on a virtual clock that counts graphics frames. No thread, no clock.

use crate::extrapolation::{PredictorKind, PreparedUpdate};
use crate::propagation::{PathSet, Propagator, Serial};
use crate::runtime::offline::schedule::{Latency, Poses, Schedule};
use crate::runtime::pipeline::jumps::UpdateKind;
use crate::runtime::pipeline::pose_prediction::UseInterval;
use crate::runtime::pipeline::update_pipeline::{UpdatePipeline, UpdateRequest};
use crate::runtime::pipeline::update_timing::delay_frames;

/// A propagator with its schedule.
#[derive(Debug)]
pub(crate) struct ScheduledPropagation {
    schedule: Schedule,
    propagator: Propagator,
    graphics_rate_hz: f64,
    frame: u64,
    /// A computed result and the frame from which it is usable.
    pending: Option<(u64, PathSet)>,
    /// Whether the last graphics frame computed a result.
    has_computed: bool,
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
            has_computed: false,
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

    /// Whether the last graphics frame computed a result.
    pub(crate) fn has_computed(&self) -> bool {
        self.has_computed
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

    /// Graphics frames from the poses of a result to its use in the delayed schedule: L + 1 for a whole update.
    fn delay(&self, kind: UpdateKind, sources: usize) -> u64 {
        let interval = u64::from(self.schedule.extrapolation_level()) + 1;
        delay_frames(kind.share(self.predictor, sources), interval)
    }

    /// Advances to the next graphics frame; returns the result that becomes usable in it, if any.
    ///
    /// In frame 0 both schedules use a result for the poses of frame 0, after a warm-up of sixteen updates. Delayed
    /// updates follow from frame 1 on, each when the last one arrives, or at a jump or a fast listener's turn, which drop what
    /// is under way.
    pub(crate) fn next_frame(&mut self, poses: &Poses) -> Option<PathSet> {
        let time_s = self.time_s();
        let history = self.pipeline.history_mut();
        history.push(time_s, &poses.listener, &poses.sources);
        self.has_computed = true;
        let arrived = if self.frame == 0 {
            self.propagator.warm_up(&poses.listener, &poses.sources);
            self.compute(poses, UpdateKind::Whole);
            self.take_computed()
        } else if self.is_late() {
            if self.pipeline.is_overtaken(&poses.sources)
                && let Some((_, dropped)) = self.pending.take()
            {
                self.spare = dropped;
                self.pipeline.drop_last();
            }
            let arrived = match self.pending.take_if(|(usable, _)| *usable <= self.frame) {
                Some((_, result)) => {
                    std::mem::swap(&mut self.prepared, &mut self.newest_prepared);
                    Some(result)
                }
                None => None,
            };
            self.has_computed = self.pending.is_none();
            if self.has_computed {
                self.compute(poses, self.pipeline.next_kind(&poses.sources));
            }
            arrived
        } else if self
            .frame
            .is_multiple_of(u64::from(self.schedule.extrapolation_level()) + 1)
        {
            self.compute(poses, UpdateKind::Whole);
            self.take_computed()
        } else {
            self.has_computed = false;
            None
        };
        self.frame += 1;
        arrived
    }

    /// Takes the computed result for use at once.
    fn take_computed(&mut self) -> Option<PathSet> {
        std::mem::swap(&mut self.prepared, &mut self.newest_prepared);
        self.pending.take().map(|(_, result)| result)
    }

    /// Computes the next result.
    fn compute(&mut self, poses: &Poses, kind: UpdateKind) {
        let mut result = std::mem::take(&mut self.spare);
        let sources = poses.sources.len();
        let request = UpdateRequest {
            listener: &poses.listener,
            sources: &poses.sources,
            time_s: self.time_s(),
            predictor: self.predictor,
            kind,
            in_use: self.in_use(kind, sources),
            max_paths: usize::MAX,
            max_nearby: usize::MAX,
        };
        let output = (&mut result, &mut self.newest_prepared);
        self.pipeline
            .update((&mut self.propagator, &Serial), &request, output);
        self.pending = Some((self.frame + self.delay(kind, sources), result));
    }

    fn time_s(&self) -> f64 {
        self.frame as f64 / self.graphics_rate_hz
    }

    /// When an update that begins now is in use.
    fn in_use(&self, kind: UpdateKind, sources: usize) -> Option<UseInterval> {
        let Schedule::Asynchronous {
            extrapolation_level,
            latency,
        } = self.schedule
        else {
            return None;
        };
        let seconds = |frames: u64| frames as f64 / self.graphics_rate_hz;
        Some(UseInterval {
            arrival_s: match latency {
                Latency::Modelled => seconds(self.delay(kind, sources)),
                Latency::None => 0.0,
            },
            // The last graphics frame of an interval comes one frame before its end.
            used_s: match latency {
                Latency::Modelled => seconds(self.delay(kind.next(), sources) - 1),
                Latency::None => seconds(extrapolation_level.into()),
            },
        })
    }
}
