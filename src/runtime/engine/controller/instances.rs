//! Instances: moving parts of the scene.

use std::sync::Arc;

use super::Controller;
use crate::acoustics::Material;
use crate::error::Result;
use crate::scene::{InstanceId, InstancePose, Scene};

impl Controller {
    /// Adds an instance of a part, a scene in local coordinates, from the next tick on; audible with the next update.
    /// The handle inside `pose` is ignored. Instances stay when the scene is replaced. Allocates.
    ///
    /// ```
    /// use std::sync::Arc;
    /// use foresound::glam::{DVec3, Vec3};
    /// use foresound::{InstanceId, InstancePose, MaterialTable, Scene, SceneSettings, shoebox};
    ///
    /// # fn main() -> foresound::Result<()> {
    /// # let (mut controller, _renderer) = foresound::Engine::new(Default::default())?;
    /// let door = shoebox(Vec3::new(1.0, 2.0, 0.05), "door_wood");
    /// let part = Scene::commit(&door, &MaterialTable::built_in(), &SceneSettings::default())?;
    /// let mut pose = InstancePose::at(InstanceId::default(), DVec3::new(2.0, 1.0, -3.0));
    /// pose.id = controller.add_instance(Arc::new(part), &pose)?;
    /// pose.position.x += 0.5;
    /// controller.set_instance_pose(&pose)?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`Scene::add_instance`].
    pub fn add_instance(&mut self, part: Arc<Scene>, pose: &InstancePose) -> Result<InstanceId> {
        let mut scene = self.posed_scene();
        let id = scene.add_instance(part, pose)?;
        self.take_scene(scene);
        Ok(id)
    }

    /// Adds an instance that stays where it is and is joined with the fixed scene and with all such instances that it touches, as
    /// if they had been committed in one piece: for chunks of a streamed world. From the next tick on; audible with the next
    /// update, and in the late reverb
    /// some tens of updates later. [`Self::remove_instance`] removes it. Allocates.
    ///
    /// # Errors
    /// As [`Scene::add_joined_instance`].
    pub fn add_joined_instance(
        &mut self,
        part: Arc<Scene>,
        pose: &InstancePose,
    ) -> Result<InstanceId> {
        let mut scene = self.posed_scene();
        let id = scene.add_joined_instance(part, pose)?;
        self.take_scene(scene);
        Ok(id)
    }

    /// Moves an instance from the next tick on: direct sound follows in that graphics frame, reflections with updates.
    ///
    /// # Errors
    /// [`Error::StaleInstance`](crate::Error::StaleInstance); [`Error::Setting`](crate::Error::Setting) for a pose that
    /// is not rigid: the last good one stays.
    pub fn set_instance_pose(&mut self, pose: &InstancePose) -> Result<()> {
        self.scene.check_instance_pose(pose)?;
        let slot = |known: &InstancePose| known.id.slot();
        let index = self.instances.binary_search_by_key(&pose.id.slot(), slot);
        if let Some(known) = index.ok().and_then(|at| self.instances.get_mut(at)) {
            *known = *pose;
        }
        Ok(())
    }

    /// Removes an instance from the next tick on; its handle is stale at once. Allocates.
    ///
    /// # Errors
    /// [`Error::StaleInstance`](crate::Error::StaleInstance).
    pub fn remove_instance(&mut self, id: InstanceId) -> Result<()> {
        let mut scene = self.posed_scene();
        scene.remove_instance(id)?;
        self.take_scene(scene);
        Ok(())
    }

    /// Gives all surfaces of a material's name, in the scene and in instances, another absorption, scattering and transmission
    /// from the next tick on; audible with the next update: a window breaks, a curtain closes. The late reverb follows. Another
    /// scene has its own materials, and so has an instance that is added later. Allocates.
    ///
    /// # Errors
    /// As [`Scene::set_material`]: the materials stay.
    pub fn set_material(&mut self, material: &Material) -> Result<()> {
        let mut scene = self.posed_scene();
        scene.set_material(material)?;
        self.take_scene(scene);
        Ok(())
    }

    /// Poses of all instances, by slot.
    pub fn instances(&self) -> &[InstancePose] {
        &self.instances
    }

    /// A copy of the scene with the current poses of instances.
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
