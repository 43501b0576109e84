//! When propagation runs and when its results are heard, on a virtual clock that counts graphics frames.
//!
//! Source: the paper's section III-B and Figure 2 for the asynchronous schedule, its reference 18 for the synchronous one.

use crate::error::{Error, Result};
use crate::extrapolation::{PredictorKind, PreparedUpdate};
use crate::propagation::{Path, PathSet, Propagator};
use crate::runtime::offline::pose_prediction::PosePrediction;
use crate::scene::{ListenerPose, SourcePose};

/// Everybody's place at one graphics frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Poses {
    /// The listener.
    pub listener: ListenerPose,
    /// The sources, one a slot at most.
    pub sources: Vec<SourcePose>,
}

/// When the asynchronous schedule may use a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Latency {
    /// L + 1 graphics frames after the poses that it was computed from, as on a real machine.
    #[default]
    Modelled,
    /// At once, although the next one follows only L + 1 graphics frames later.
    None,
}

/// The two schedules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Schedule {
    /// A whole propagation in every graphics frame.
    Synchronous,
    /// A propagation every L + 1 graphics frames, extrapolation in between.
    Asynchronous {
        /// Extrapolation level L.
        level: u32,
        /// When a result may be used.
        latency: Latency,
    },
}

/// Highest level that is accepted: ten seconds of graphics frames at 100 Hz.
const HIGHEST_LEVEL: u32 = 1000;

impl Schedule {
    /// The level L of an interval of this schedule.
    pub fn level(&self) -> u32 {
        match self {
            Self::Synchronous => 0,
            Self::Asynchronous { level, .. } => *level,
        }
    }

    pub(crate) fn check(&self) -> Result<()> {
        let level = self.level();
        if level <= HIGHEST_LEVEL {
            return Ok(());
        }
        let problem = format!("{level} graphics frames without an update");
        Err(Error::setting(
            "level",
            problem,
            "choose a level up to 1000",
        ))
    }
}

/// Runs a propagator by a schedule, frame by frame: no thread, no clock.
#[derive(Debug)]
pub(crate) struct ScheduledPropagation {
    schedule: Schedule,
    propagator: Propagator,
    graphics_rate_hz: f64,
    frame: u64,
    /// A result that is computed but, on the virtual clock, not there yet.
    pending: Option<PathSet>,
    /// What has been worked out of the result given last, and of the one computed last.
    groundwork: PreparedUpdate,
    newest_groundwork: PreparedUpdate,
    predictor: PredictorKind,
    spare: PathSet,
    /// The paths behind a surface that the listener comes near.
    through: PathSet,
    predicted: PosePrediction,
}

impl ScheduledPropagation {
    /// `predictor` says for which poses a late result is computed, and how much it names.
    pub(crate) fn new(
        schedule: Schedule,
        propagator: Propagator,
        graphics_rate_hz: f64,
        predictor: PredictorKind,
    ) -> Self {
        Self {
            predicted: PosePrediction::new(schedule, predictor),
            schedule,
            propagator,
            graphics_rate_hz,
            frame: 0,
            pending: None,
            groundwork: PreparedUpdate::default(),
            newest_groundwork: PreparedUpdate::default(),
            predictor,
            spare: PathSet::default(),
            through: PathSet::default(),
        }
    }

    /// What has been worked out of the result that [`Self::next_frame`] gave last.
    pub(crate) fn groundwork_mut(&mut self) -> &mut PreparedUpdate {
        &mut self.groundwork
    }

    /// The propagator, to change its scene's instances.
    pub(crate) fn propagator_mut(&mut self) -> &mut Propagator {
        &mut self.propagator
    }

    /// Gives memory back that an earlier result used.
    pub(crate) fn recycle(&mut self, retired: PathSet) {
        self.spare = retired;
    }

    /// Whether the next graphics frame starts an update, so that the caller can time it.
    pub(crate) fn starts_update(&self) -> bool {
        let interval = u64::from(self.schedule.level()) + 1;
        match self.is_late() {
            // What is known of frame 0 need not be computed again, so late updates start from frame 1 on.
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

    /// Advances to the next graphics frame; gives the result that becomes usable in it, if one does.
    ///
    /// In frame 0 both schedules have the result for the poses of frame 0, from a propagation that has looked at them
    /// for sixteen updates: the walk begins with a listener who has been standing there. Late updates follow from frame
    /// 1 on, every L + 1 frames.
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
            std::mem::swap(&mut self.groundwork, &mut self.newest_groundwork);
        }
        if !first && self.is_late() && self.starts_update() {
            self.pending = Some(self.compute(poses));
        }
        self.predicted.remember(poses);
        self.frame += 1;
        arrived
    }

    fn compute(&mut self, poses: &Poses) -> PathSet {
        let mut result = std::mem::take(&mut self.spare);
        let time_s = self.frame as f64 / self.graphics_rate_hz;
        let reach_m = self.predicted.reach_m(poses);
        let poses = self.predicted.poses(poses, self.propagator.scene()).clone();
        let Poses { listener, sources } = &poses;
        let through = self.predicted.beyond().filter(|_| reach_m.is_some());
        if let Some(through) = &through {
            self.propagator.set_nearby_radius(None);
            self.propagator.set_predicted_positions(&[], &[]);
            self.propagator
                .update(through, sources, time_s, &mut self.through);
        }
        self.propagator.set_nearby_radius(reach_m);
        let (way, predicted_sources) = self.predicted.way();
        self.propagator
            .set_predicted_positions(way, predicted_sources);
        self.propagator
            .update(listener, sources, time_s, &mut result);
        if through.is_some() {
            add_nearby(&mut result, &self.through);
        }
        // As the engine does, of the scene as it stands for this update.
        match self.predictor {
            PredictorKind::Geometric(_) => {
                self.newest_groundwork
                    .prepare(&result, self.propagator.scene());
            }
            PredictorKind::Hold | PredictorKind::Linear => self.newest_groundwork.clear(),
        }
        result
    }
}

/// Adds another update's paths to those nearby, and the edges that it follows direct fields at.
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
    result.rays += other.rays;
}
