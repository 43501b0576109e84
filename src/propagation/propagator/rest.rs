//! What all sources of an update depend on, and whether it has changed since the update before. Own.

use glam::Vec3;

use super::Propagator;
use crate::propagation::quality_level::PropagationQuality;
use crate::propagation::update_scope::UpdateScope;
use crate::scene::{ListenerPose, SourcePose};

/// What the results of every source depend on, besides what earlier updates have found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CommonInputs {
    /// The listener's orientation has no effect.
    listener: Vec3,
    quality: PropagationQuality,
    /// Whether there are nearby paths. Their radius has no effect on a listener that stands.
    has_nearby: bool,
    /// Revision of the scene, and those since which rays are valid.
    scene_states: [u64; 3],
    /// Revision of the late field.
    field_of: Option<u64>,
}

impl Propagator {
    /// Decides for each source whether the update keeps its results, as the state of rest in its task says. Returns
    /// whether it keeps all.
    pub(super) fn keep_sources_at_rest(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        (scope, has_cast): (&UpdateScope, bool),
    ) -> bool {
        let is_plain = *scope == UpdateScope::default()
            && self.listeners.is_empty()
            && self.renewal.is_none()
            && !has_cast;
        let stands = |position: Vec3| position == listener.position;
        let stands = self.predicted.iter().all(|there| stands(there.position));
        let inputs = (is_plain && stands).then(|| CommonInputs {
            listener: listener.position,
            quality: self.quality,
            has_nearby: self.nearby_m.is_some(),
            scene_states: [
                self.revision.current(),
                self.revision.poses_since(),
                self.revision.fixed_since(),
            ],
            field_of: self.field_of,
        });
        let is_same = inputs.is_some() && self.last_inputs == inputs;
        self.last_inputs = inputs;
        let mut keeps_all = is_same;
        let tasks = self.tasks[..sources.len()].iter_mut().zip(sources);
        for (index, (task, source)) in tasks.enumerate() {
            let mut ahead = self.predicted.iter().filter_map(|at| at.sources.get(index));
            let stands = ahead.all(|position| *position == source.position);
            let quality = &self.quality;
            task.is_kept = task.rest.begin_update(source, is_same && stands, quality);
            keeps_all &= task.is_kept;
        }
        keeps_all
    }
}
