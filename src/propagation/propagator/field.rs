//! When the scene's late field is made, and made anew.

use glam::Vec3;

use super::listeners::invalidate_fields;
use super::{ListenerState, Propagator};
use crate::propagation::diffuse::listener_field::ListenerField;
use crate::propagation::diffuse::{FieldRenewal, SceneField};
use crate::scene::{ListenerPose, SourcePose};

/// Samples of the late field for each source ray, and their most.
const SAMPLES_PER_RAY: usize = 4;
const MAX_SAMPLES: usize = 512;

/// Remoteness of a listener from which on the field is made anew in few steps: it has not walked there.
const URGENT: f32 = 2.0;

impl Propagator {
    /// Takes the late field of another propagator of the same scene and number of source rays, in place of making its own in the
    /// first update: half a second of a core. A field depends neither on sources nor on listeners, but for closed spaces without
    /// any of them. What it takes is what it would make (`tests/late_field.rs`).
    #[cfg(feature = "testing")]
    pub fn share_field(&mut self, other: &Self) {
        self.field = other.field.clone();
        self.field_of = other.field_of;
    }

    /// Makes the late field for the first update, traces it anew when instances have come to rest, and makes it anew step by
    /// step when joined parts have come or gone, or a source or listener has entered a space that it leaves out or has few samples
    /// of. Returns the number of rays cast.
    pub(super) fn renew_field(
        &mut self,
        listener: &ListenerPose,
        sources: &[SourcePose],
        is_at_rest: bool,
    ) -> u64 {
        self.drop_renewal_elsewhere(listener);
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
        let remoteness = self.remoteness(listener);
        let has_uncovered = self.renewal.is_none() && {
            let uncovered = self.count_uncovered(sources);
            self.uncovered.require_renewal(uncovered) || remoteness > 1.0
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
            self.has_dropped_renewal = false;
            for task in &mut self.tasks {
                task.forget_late();
            }
        } else if is_due || has_uncovered {
            let occupants = self.occupants(listener, sources);
            let is_urgent = remoteness > URGENT;
            let renewal =
                FieldRenewal::new(scene, count, &occupants, &self.field, is_urgent, &mut rays);
            // An occupant outside of all that has samples, behind the walls of a hall, is not covered by another field.
            if !is_stale && renewal.has_samples_of(&mut self.field) {
                return rays;
            }
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

    /// Drops a field under way if the listener has jumped from where it is made for. Not twice in a row: a fast listener would never
    /// have one.
    fn drop_renewal_elsewhere(&mut self, listener: &ListenerPose) {
        let position = self.scene.to_local(listener.position).as_vec3();
        let renewal = self.renewal.as_ref();
        let remoteness = renewal.and_then(|(renewal, _)| renewal.remoteness(position));
        if remoteness > Some(URGENT) && !std::mem::replace(&mut self.has_dropped_renewal, true) {
            self.renewal = None;
        }
    }

    /// How far the most remote listener is from where the field's samples are closest, relative to how far they are close.
    fn remoteness(&self, listener: &ListenerPose) -> f32 {
        let own = self.scene.to_local(listener.position).as_vec3();
        let others = self.other_listeners().filter_map(|other| other.field.of);
        let positions = others.map(|(position, _)| position).chain([own]);
        let remoteness = positions.filter_map(|position| self.field.remoteness(position));
        remoteness.fold(0.0, f32::max)
    }

    /// Number of listeners and sources in spaces that the field leaves out, and of sources where its samples are far apart.
    fn count_uncovered(&self, sources: &[SourcePose]) -> usize {
        let is_remote = |source: &SourcePose| {
            let position = self.scene.to_local(source.position).as_vec3();
            self.field.remoteness(position) > Some(1.0)
        };
        let leaves_out = self.field.leaves_out();
        let tasks = self.tasks[..sources.len()].iter().zip(sources);
        let of_tasks = tasks
            .filter(|(task, source)| leaves_out && task.is_outside_field() || is_remote(source));
        let is_outside = |field: &ListenerField| leaves_out && field.is_outside();
        let others = self
            .other_listeners()
            .filter(|other| is_outside(&other.field));
        of_tasks.count() + others.count() + usize::from(is_outside(&self.listener_field))
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
