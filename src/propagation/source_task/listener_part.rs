//! What depends on the listener in the state of a source, for several listeners in turn.

use crate::propagation::diffraction::{LastSearch, NearEdges};
use crate::propagation::diffuse::{LateEstimate, ListenerView};
use crate::propagation::image_source::nearby_gate::NearbyGate;
use crate::propagation::image_source::occluder_cache::OccluderCache;
use crate::propagation::image_source::valid_cache::ValidCache;
use crate::propagation::path::Path;
use crate::propagation::settings::PropagationSettings;

/// What depends on the listener in the state of a source, while it is the turn of others.
#[derive(Debug)]
pub(super) struct ListenerPart {
    pub(super) cache: ValidCache,
    pub(super) occluders: OccluderCache,
    pub(super) paths: Vec<Path>,
    pub(super) nearby: Vec<Path>,
    pub(super) nearby_gate: NearbyGate,
    pub(super) last_search: LastSearch,
    pub(super) near_edges: NearEdges,
    pub(super) latest_late: Option<LateEstimate>,
    pub(super) predicted_late: Vec<LateEstimate>,
    pub(super) late: ListenerView,
}

impl ListenerPart {
    pub(super) fn new(settings: &PropagationSettings) -> Self {
        Self {
            cache: ValidCache::with_capacity(settings.cache_capacity),
            occluders: OccluderCache::default(),
            paths: Vec::new(),
            nearby: Vec::new(),
            nearby_gate: NearbyGate::default(),
            last_search: LastSearch::default(),
            near_edges: NearEdges::default(),
            latest_late: None,
            predicted_late: Vec::new(),
            late: ListenerView::default(),
        }
    }
}
