//! When the scene's late field is made, and made anew.

use glam::Vec3;

use super::listeners::invalidate_fields;
use super::{ListenerState, Propagator};
use crate::propagation::diffuse::{FieldRenewal, SceneField};
use crate::scene::{ListenerPose, SourcePose};

/// Samples of the late field for each source ray, and their most.
const SAMPLES_PER_RAY: usize = 4;
const MAX_SAMPLES: usize = 512;

impl Propagator {
    /// Makes the late field for the first update, traces it anew when instances have come to rest, and makes it anew step by
    /// step when joined parts have come or gone, or a source or listener has entered a space that it leaves out. Returns
    /// the number of rays cast.
    pub(super) fn renew_field(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        is_at_rest: bool,
    ) -> u64 {
        let scene = &*self.scene;
        let scene_state = self.revision.current();
        let mut rays = 0;
        let samples = SAMPLES_PER_RAY * self.settings.source_rays as usize;
        let count = samples.min(MAX_SAMPLES);
        if self.field_of.is_none() {
            self.field_of = Some(scene_state);
            let occupants = self.occupants(listener, sources);
            self.field = SceneField::new(scene, count, &occupants, &mut rays);
            return rays;
        }
        let has_uncovered = self.renewal.is_none() && self.field.leaves_out() && {
            let tasks = self.tasks[..sources.len()].iter();
            let of_tasks = tasks.filter(|task| task.is_outside_field()).count();
            let others = self
                .other_listeners()
                .filter(|other| other.field.is_outside());
            let of_listeners = others.count() + usize::from(self.listener_field.is_outside());
            self.uncovered.require_renewal(of_tasks + of_listeners)
        };
        let is_stale = self.field_of != Some(scene_state);
        // Parts come while the listener walks, and the field takes many updates' time.
        let has_parts_changed = self.field_of < Some(self.revision.fixed_since());
        let is_due = scene.has_joined_instances() && (has_parts_changed || is_at_rest && is_stale);
        if let Some((renewal, of)) = &mut self.renewal {
            let Some(field) = renewal.step(scene, &mut rays) else {
                return rays;
            };
            self.field_of = Some(*of);
            self.field = field;
            self.renewal = None;
            for task in &mut self.tasks {
                task.forget_late();
            }
        } else if is_due || has_uncovered {
            let occupants = self.occupants(listener, sources);
            let renewal = FieldRenewal::new(scene, count, &occupants, &self.field, &mut rays);
            self.renewal = Some((renewal, scene_state));
            return rays;
        } else if is_at_rest && is_stale && !scene.has_joined_instances() {
            self.field_of = Some(scene_state);
            if self.field.renew(scene, &mut rays) {
                for task in &mut self.tasks {
                    task.follow_patches(scene, scene_state);
                }
            }
        } else {
            return rays;
        }
        invalidate_fields(
            &mut self.listener_field,
            &mut self.predicted,
            &mut self.listeners,
        );
        rays
    }

    /// Positions of all listeners and sources, in local coordinates.
    fn occupants(&self, listener: &ListenerPose, sources: &[SourcePose]) -> Vec<Vec3> {
        let positions = sources.iter().map(|source| source.position);
        let positions = positions.chain([listener.position]);
        let local = positions.map(|position| self.scene.to_local(position).as_vec3());
        let others = self.other_listeners().filter_map(|other| other.field.of);
        local.chain(others.map(|(position, _)| position)).collect()
    }

    /// What depends on the listeners whose turn it is not.
    fn other_listeners(&self) -> impl Iterator<Item = &ListenerState> {
        let all = self.listeners.iter().enumerate();
        let others = all.filter(|(index, _)| *index != self.listener);
        others.map(|(_, state)| state)
    }
}
