//! One update, from the poses known at its start to values prepared for the predictor.
//!
//! Control side. Steps: prediction of the poses at which the update is used, propagation for those, with closed paths nearby
//! and late energy along the way, an update behind a surface that the listener comes near, a limit on the number of paths,
//! preparation. The caller says when the update will be in use.

use crate::extrapolation::{PredictorKind, PreparedUpdate};
use crate::propagation::{Path, PathSet, Propagator, Workers};
use crate::runtime::pipeline::expected_listener::ExpectedListener;
use crate::runtime::pipeline::jumps::{Jumps, UpdateKind};
use crate::runtime::pipeline::loudest_paths::{keep_loudest, keep_loudest_nearby};
use crate::runtime::pipeline::pose_history::PoseHistory;
use crate::runtime::pipeline::pose_prediction::{PredictedPoses, UseInterval};
use crate::scene::{ListenerPose, SourcePose};

/// What an update is computed for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UpdateRequest<'a> {
    /// Present poses: those of the newest graphics frame that was recorded.
    pub(crate) listener: &'a ListenerPose,
    pub(crate) sources: &'a [SourcePose],
    /// Time of those in seconds.
    pub(crate) time_s: f64,
    pub(crate) predictor: PredictorKind,
    /// What it searches for: [`UpdatePipeline::next_kind`], or whole.
    pub(crate) kind: UpdateKind,
    /// When the update is in use; `None` if every graphics frame has its own.
    pub(crate) in_use: Option<UseInterval>,
    /// Greatest numbers of paths, and of nearby paths.
    pub(crate) max_paths: usize,
    pub(crate) max_nearby: usize,
}

/// Updates for one propagator.
#[derive(Debug, Default)]
pub(crate) struct UpdatePipeline {
    history: PoseHistory,
    poses: PredictedPoses,
    /// The paths behind a surface that the listener comes near.
    beyond_surface: PathSet,
    /// Time of the poses of the last update in seconds, and its kind.
    last: Option<(f64, UpdateKind)>,
    /// Jumps that only a first update has followed yet, or one for their sources alone.
    recent: Jumps,
    /// Where the last update expects the listener.
    expected: Option<ExpectedListener>,
    /// Whether the last update was dropped.
    is_dropped: bool,
}

impl UpdatePipeline {
    /// Positions of the last graphics frames; the caller records each before an update.
    pub(crate) fn history_mut(&mut self) -> &mut PoseHistory {
        &mut self.history
    }

    /// The same, to read.
    pub(crate) fn history(&self) -> &PoseHistory {
        &self.history
    }

    /// Jumps since the poses of the last update; none before the first.
    fn jumps(&self, sources: &[SourcePose]) -> Jumps {
        match self.last {
            Some((time_s, _)) => Jumps::after(time_s, &self.history, sources),
            None => Jumps::default(),
        }
    }

    /// Whether the listener or one of these sources has jumped since the poses of a whole update, or the listener has turned
    /// away from where that expects it: if it is under way, it is for another position.
    pub(crate) fn is_overtaken(&self, sources: &[SourcePose]) -> bool {
        let is_whole = matches!(self.last, Some((_, UpdateKind::Whole)));
        let has_turned = || {
            let expected = self.expected.as_ref();
            expected.is_some_and(|expected| expected.is_missed(&self.history))
        };
        is_whole && (has_turned() || !self.jumps(sources).is_empty())
    }

    /// The last update does not arrive.
    pub(crate) fn drop_last(&mut self) {
        self.is_dropped = true;
    }

    /// Where an update expects the listener while it is in use. Nowhere unless a whole one has arrived before it: a listener
    /// that turns all the time has every other one.
    pub(crate) fn expected_listener(
        &self,
        request: &UpdateRequest<'_>,
    ) -> Option<ExpectedListener> {
        let after_whole = matches!(self.last, Some((_, UpdateKind::Whole)));
        let interval = request.in_use.filter(|_| after_whole && !self.is_dropped)?;
        let target = request.predictor.prediction_target();
        ExpectedListener::after(interval.target_s(target), &self.history)
    }

    /// The kind of an asynchronous update that begins now.
    pub(crate) fn next_kind(&self, sources: &[SourcePose]) -> UpdateKind {
        let Some((_, last)) = self.last else {
            return UpdateKind::Whole;
        };
        let jumps = self.jumps(sources);
        let next = match jumps.is_empty() {
            // The listener has turned, and is fast.
            true if last == UpdateKind::Whole && self.is_dropped => UpdateKind::Plain,
            true => last.next(),
            false => last.next_after_jump(),
        };
        match next {
            UpdateKind::Urgent if !jumps.listener && !self.recent.listener => {
                UpdateKind::UrgentSources
            }
            other => other,
        }
    }

    /// Computes an update; returns the number of paths dropped as too many. If the workers are interrupted there is no result.
    pub(crate) fn update(
        &mut self,
        (propagator, workers): (&mut Propagator, &impl Workers),
        request: &UpdateRequest<'_>,
        (result, prepared): (&mut PathSet, &mut PreparedUpdate),
    ) -> usize {
        let poses = &mut self.poses;
        let present = (request.listener, request.sources);
        match request.in_use {
            Some(interval) => {
                let target = request.predictor.prediction_target();
                let scene = propagator.scene();
                poses.predict(present, &self.history, (interval, target), scene);
            }
            None => poses.set_present(present.0, present.1),
        }
        self.expected = self.expected_listener(request);
        self.is_dropped = false;
        let jumps = self.jumps(request.sources);
        self.last = Some((request.time_s, request.kind));
        let is_whole = request.kind == UpdateKind::Whole;
        let uses_nearby = request.in_use.is_some() && request.predictor.uses_nearby() && is_whole;
        let poses = &mut self.poses;
        if !is_whole {
            poses.sampled_listener.clear();
            poses.sampled_sources.clear();
        }
        let (time_s, sources) = (request.time_s, &poses.sources);
        let beyond = poses.beyond_surface.filter(|_| uses_nearby);
        if let Some(beyond) = &beyond {
            let result = &mut self.beyond_surface;
            propagator.set_nearby_radius(None);
            propagator.set_predicted_positions(&[], &[]);
            propagator.update_with(workers, beyond, sources, time_s, result);
        }
        propagator.set_nearby_radius(uses_nearby.then_some(poses.nearby_radius_m));
        propagator.set_predicted_positions(&poses.sampled_listener, &poses.sampled_sources);
        let before = std::mem::take(&mut self.recent);
        match request.kind {
            UpdateKind::First => self.recent = jumps.clone(),
            UpdateKind::UrgentSources => {
                self.recent = before.clone();
                self.recent.sources.extend(&jumps.sources);
            }
            _ => {}
        }
        propagator.set_scope(jumps.scope(request.kind, &before));
        propagator.update_with(workers, &poses.listener, sources, time_s, result);
        if workers.is_interrupted() {
            self.drop_last();
            return 0;
        }
        if beyond.is_some() {
            add_nearby(result, &self.beyond_surface);
        }
        keep_loudest_nearby(&mut result.nearby, request.max_nearby);
        let dropped = keep_loudest(&mut result.paths, request.max_paths);
        match request.predictor {
            PredictorKind::Geometric(_) => prepared.prepare(result, propagator.scene()),
            PredictorKind::Hold | PredictorKind::Linear => prepared.clear(),
        }
        dropped
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
