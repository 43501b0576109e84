//! Instances in offline rendering: added, moved and removed between graphics frames.
//!
//! Control side. Changes apply to known paths in the next graphics frame, to propagation in the next update that
//! starts.

use std::sync::Arc;

use crate::error::Result;
use crate::extrapolation::ScenePair;
use crate::runtime::offline::renderer::OfflineRenderer;
use crate::scene::{InstanceId, InstancePose, Scene};

impl OfflineRenderer {
    /// Adds an instance of a part; the handle inside `pose` is ignored.
    ///
    /// # Errors
    /// As [`Scene::add_instance`].
    pub fn add_instance(&mut self, part: Arc<Scene>, pose: &InstancePose) -> Result<InstanceId> {
        let propagator = self.propagation.propagator_mut();
        let id = propagator.scene_mut().add_instance(part, pose)?;
        self.follow_scene();
        Ok(id)
    }

    /// Adds an instance that stays where it is and is joined with the fixed scene and with all such instances that it touches.
    ///
    /// # Errors
    /// As [`Scene::add_joined_instance`].
    pub fn add_joined_instance(
        &mut self,
        part: Arc<Scene>,
        pose: &InstancePose,
    ) -> Result<InstanceId> {
        let propagator = self.propagation.propagator_mut();
        let id = propagator.scene_mut().add_joined_instance(part, pose)?;
        self.follow_scene();
        Ok(id)
    }

    /// Moves instances. Valid poses are applied even if others are invalid.
    ///
    /// # Errors
    /// The first of: [`Error::StaleInstance`](crate::Error::StaleInstance); [`Error::Setting`](crate::Error::Setting) for
    /// a pose that is not rigid: the last good one stays.
    pub fn set_instance_poses(&mut self, poses: &[InstancePose]) -> Result<()> {
        let scene = self.propagation.propagator_mut().scene_mut();
        let checked = poses.iter().map(|pose| scene.check_instance_pose(pose));
        let result = checked.fold(Ok(()), Result::and);
        scene.set_instance_poses(poses);
        self.extrapolator.set_instance_poses(poses);
        result
    }

    /// Removes an instance; its handle is stale at once.
    ///
    /// # Errors
    /// [`Error::StaleInstance`](crate::Error::StaleInstance).
    pub fn remove_instance(&mut self, id: InstanceId) -> Result<()> {
        let propagator = self.propagation.propagator_mut();
        propagator.scene_mut().remove_instance(id)?;
        self.follow_scene();
        Ok(())
    }

    fn follow_scene(&mut self) {
        let scene = self.propagation.propagator_mut().scene();
        self.extrapolator.swap_scene(&mut ScenePair::of(scene));
    }
}
