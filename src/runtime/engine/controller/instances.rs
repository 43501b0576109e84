//! Instances: parts of the scene that move.

use std::sync::Arc;

use super::Controller;
use crate::error::Result;
use crate::scene::{InstanceId, InstancePose, Scene};

impl Controller {
    /// Adds an instance of a part ([`Scene::commit`] makes one, in coordinates of its own) from the next tick on, for
    /// direct sound as soon as the next update is there. The pose's own handle does not count. Instances stay when the
    /// scene is replaced. Allocates.
    ///
    /// # Errors
    /// As [`Scene::add_instance`].
    pub fn add_instance(&mut self, part: Arc<Scene>, pose: &InstancePose) -> Result<InstanceId> {
        let mut scene = self.posed_scene();
        let id = scene.add_instance(part, pose)?;
        self.take_scene(scene);
        Ok(id)
    }

    /// Moves an instance from the next tick on: direct sound in that graphics frame, reflections as updates follow.
    ///
    /// # Errors
    /// [`crate::Error::StaleInstance`]; [`crate::Error::Setting`] for a pose that is not rigid, and the last good one is
    /// kept.
    pub fn set_instance_pose(&mut self, pose: &InstancePose) -> Result<()> {
        self.scene.check_instance_pose(pose)?;
        let slot = |known: &InstancePose| known.id.slot();
        let place = self.instances.binary_search_by_key(&pose.id.slot(), slot);
        if let Some(known) = place.ok().and_then(|at| self.instances.get_mut(at)) {
            *known = *pose;
        }
        Ok(())
    }

    /// Removes an instance from the next tick on; its handle is stale at once. Allocates.
    ///
    /// # Errors
    /// [`crate::Error::StaleInstance`].
    pub fn remove_instance(&mut self, id: InstanceId) -> Result<()> {
        let mut scene = self.posed_scene();
        scene.remove_instance(id)?;
        self.take_scene(scene);
        Ok(())
    }

    /// Handles of all instances and where they stand, by slot.
    pub fn instances(&self) -> &[InstancePose] {
        &self.instances
    }

    /// A copy of the scene with instances where they stand now.
    fn posed_scene(&self) -> Scene {
        let mut scene = Scene::clone(&self.scene);
        scene.set_instance_poses(&self.instances);
        scene
    }

    fn take_scene(&mut self, scene: Scene) {
        self.instances.clear();
        self.instances.extend(scene.instance_poses());
        self.scene = Arc::new(scene);
    }

    /// Another fixed scene with the instances of this one.
    pub(super) fn with_instances(&self, scene: Arc<Scene>) -> Arc<Scene> {
        match self.instances.is_empty() {
            true => scene,
            false => Arc::new(scene.with_instances_of(&self.posed_scene())),
        }
    }
}
