//! Whether an update would find for a source what the one before found: nothing that it depends on has changed, and all rays
//! are cast.
//!
//! With the same positions in the same scene, sixteen updates without a new ray have tried the sequences of all rotations, and
//! what was valid stays remembered. A further one finds the same valid paths and the same late energy; of nearby paths, which
//! depend on the rotation in turn, those of the last one are kept. Own.

use super::SourceTask;
use crate::propagation::quality_level::PropagationQuality;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::SourcePose;

/// A source's pose in the last update, and for how long nothing has changed.
#[derive(Debug, Default)]
pub(in crate::propagation) struct SourceRest {
    pose: Option<SourcePose>,
    /// Updates with this pose in which nothing else has changed and no ray was cast.
    updates: u64,
}

impl SourceRest {
    /// Whether the update that begins would have the results of the last one. `is_same` is whether everything besides the pose
    /// is as in the last one.
    pub(in crate::propagation) fn begin_update(
        &mut self,
        pose: &SourcePose,
        is_same: bool,
        quality: &PropagationQuality,
    ) -> bool {
        if !is_same || self.pose.as_ref() != Some(pose) {
            self.pose = Some(*pose);
            self.updates = 0;
        }
        self.updates >= ROTATIONS * quality.late_interval
    }

    /// After an update that was not kept; `has_cast` is whether it cast rays that later ones would not.
    pub(in crate::propagation) fn end_update(&mut self, has_cast: bool) {
        self.updates = match has_cast {
            true => 0,
            false => self.updates + 1,
        };
    }
}

impl SourceTask {
    /// Instead of a search that would have the results of the last update.
    pub(in crate::propagation) fn keep(&mut self, predicted: usize, time_s: f64) {
        self.rays = 0;
        self.is_searched = false;
        self.near_casts.most(time_s);
        // Source and listener are expected where they are.
        self.predicted_late.clear();
        let late = self.latest_late.into_iter().cycle().take(predicted);
        self.predicted_late.extend(late);
    }

    /// After an update; `has_cast` is whether rays were cast for all sources.
    pub(in crate::propagation) fn end_update(&mut self, has_cast: bool) {
        if !self.is_kept {
            self.rest.end_update(has_cast || self.has_cast);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::settings::PropagationSettings;
    use crate::scene::SourceId;
    use glam::Vec3;

    #[test]
    fn results_are_kept_after_all_rotations_until_something_changes() {
        let quality = PropagationQuality::full(&PropagationSettings::default());
        let mut pose = SourcePose::at(SourceId::new(0, 0), Vec3::X);
        let mut rest = SourceRest::default();
        let mut is_kept = |pose: &SourcePose, is_same, has_cast| {
            let is_kept = rest.begin_update(pose, is_same, &quality);
            if !is_kept {
                rest.end_update(has_cast);
            }
            is_kept
        };
        for update in 0..40 {
            // The third casts rays.
            let is_kept = is_kept(&pose, update > 0, update == 2);
            assert_eq!(is_kept, update > 2 + ROTATIONS, "update {update}");
        }
        assert!(!is_kept(&pose, false, false));
        for _ in 1..ROTATIONS {
            assert!(!is_kept(&pose, true, false));
        }
        assert!(is_kept(&pose, true, false));
        pose.position = Vec3::Y;
        assert!(!is_kept(&pose, true, false));
    }
}
