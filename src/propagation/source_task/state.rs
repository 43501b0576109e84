//! The state of a source: made, reused, and exchanged between listeners in turn. Rays are common to all, paths and caches are each
//! listener's.

use super::SourceTask;
use super::listener_part::ListenerPart;
use super::listener_walk::ListenerWalk;
use super::near_casts::NearCasts;
use super::rest::SourceRest;
use crate::propagation::diffraction::{LastSearch, NearEdges};
use crate::propagation::diffuse::{LateEstimator, ListenerView};
use crate::propagation::image_source::nearby_gate::NearbyGate;
use crate::propagation::image_source::occluder_cache::OccluderCache;
use crate::propagation::image_source::valid_cache::ValidCache;
use crate::propagation::rays::directions::ROTATIONS;
use crate::propagation::settings::PropagationSettings;
use crate::scene::SourceId;

impl SourceTask {
    pub(in crate::propagation) fn new(id: SourceId, settings: &PropagationSettings) -> Self {
        Self {
            id,
            last_position: None,
            is_idle: false,
            is_searched: false,
            view: 0,
            keeps_others: false,
            listener: 0,
            parts: Vec::new(),
            cast_in: None,
            jumped_in: None,
            near_casts: NearCasts::default(),
            missing_rotations: 0,
            late: LateEstimator::default(),
            walk: ListenerWalk::default(),
            cache: ValidCache::with_capacity(settings.cache_capacity),
            occluders: OccluderCache::default(),
            rotation: None,
            paths: Vec::new(),
            nearby: Vec::new(),
            nearby_gate: NearbyGate::default(),
            nearby_estimates: Vec::new(),
            last_search: LastSearch::default(),
            near_edges: NearEdges::default(),
            latest_late: None,
            predicted_late: Vec::new(),
            rays: 0,
            has_cast: false,
            rest: SourceRest::default(),
            is_kept: false,
            searches: 0,
        }
    }

    /// Whether the state is of this source.
    pub(in crate::propagation) fn belongs_to(&self, id: SourceId) -> bool {
        self.id == id && !self.is_idle
    }

    /// Resets the task for another source; keeps the memory.
    pub(in crate::propagation) fn reset(&mut self, id: SourceId) {
        self.id = id;
        self.last_position = None;
        self.is_idle = false;
        self.late = LateEstimator::default();
        self.latest_late = None;
        self.missing_rotations = 0;
        self.cache.clear();
        self.nearby_gate = NearbyGate::default();
        self.parts.clear();
        (self.cast_in, self.jumped_in) = (None, None);
        self.near_casts = NearCasts::default();
        self.rest = SourceRest::default();
    }

    /// Takes up the state of a listener, whose turn it is. Allocates in its first turn.
    pub(in crate::propagation) fn select_listener(
        &mut self,
        listener: usize,
        settings: &PropagationSettings,
    ) {
        if listener == self.listener {
            return;
        }
        let count = listener.max(self.listener) + 1;
        while self.parts.len() < count {
            self.parts.push(ListenerPart::new(settings));
        }
        self.late.store_view(&mut self.parts[self.listener].late);
        self.exchange(self.listener);
        self.exchange(listener);
        self.late.load_view(&self.parts[listener].late);
        self.listener = listener;
    }

    /// Exchanges the state with a part.
    fn exchange(&mut self, part: usize) {
        let part = &mut self.parts[part];
        std::mem::swap(&mut self.cache, &mut part.cache);
        std::mem::swap(&mut self.occluders, &mut part.occluders);
        std::mem::swap(&mut self.paths, &mut part.paths);
        std::mem::swap(&mut self.nearby, &mut part.nearby);
        std::mem::swap(&mut self.nearby_gate, &mut part.nearby_gate);
        std::mem::swap(&mut self.last_search, &mut part.last_search);
        std::mem::swap(&mut self.near_edges, &mut part.near_edges);
        std::mem::swap(&mut self.latest_late, &mut part.latest_late);
        std::mem::swap(&mut self.predicted_late, &mut part.predicted_late);
    }

    /// Drops the late field's estimate, and with it what other listeners see of it: a new one counts its selections of bounces from the
    /// beginning, and would take what they saw of the old one's for its own.
    pub(super) fn drop_estimate(&mut self) {
        self.late = LateEstimator::default();
        for part in &mut self.parts {
            part.late = ListenerView::default();
        }
    }

    /// Drops all rays, which were cast elsewhere, unless another listener's turn of this round did.
    pub(super) fn drop_rays(&mut self, round: u64) {
        if self.jumped_in == Some(round) && !self.parts.is_empty() {
            return;
        }
        self.jumped_in = Some(round);
        self.drop_estimate();
        self.missing_rotations = ROTATIONS as usize;
        self.last_position = None;
        self.cast_in = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_estimate_knows_nothing_of_what_listeners_saw_of_the_last_one() {
        let settings = PropagationSettings::default();
        let forgotten = format!("{:?}", ListenerView::default());
        let drops: [fn(&mut SourceTask); 2] = [SourceTask::forget_late, |task| task.drop_rays(7)];
        for drop in drops {
            let mut task = SourceTask::new(SourceId::default(), &settings);
            task.select_listener(1, &settings);
            let seen = |task: &SourceTask| format!("{:?}", task.parts[0].late);
            assert_ne!(seen(&task), forgotten);
            drop(&mut task);
            assert_eq!(seen(&task), forgotten);
        }
    }
}
