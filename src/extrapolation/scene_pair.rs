//! The scene as it stands now and as it stood for the newest update.
//!
//! Made on the control side; the sound thread moves instances in it and swaps it, which allocates nothing, since nobody
//! else has these copies. A scene without instances is not copied.

use std::sync::Arc;

use crate::scene::{InstancePose, Scene};

/// A scene twice, with its instances at two poses.
#[derive(Debug, Clone)]
pub struct ScenePair {
    now: Arc<Scene>,
    then: Arc<Scene>,
}

impl ScenePair {
    /// Of a scene, both as it stands. Control side; allocates.
    pub fn of(scene: &Arc<Scene>) -> Self {
        let copy = || match scene.has_instances() {
            true => Arc::new(Scene::clone(scene)),
            false => Arc::clone(scene),
        };
        Self {
            now: copy(),
            then: copy(),
        }
    }

    /// As it stands in this graphics frame.
    #[inline]
    pub(crate) fn now(&self) -> &Scene {
        &self.now
    }

    /// As it stood for the newest update.
    #[inline]
    pub(crate) fn then(&self) -> &Scene {
        &self.then
    }

    pub(crate) fn stand_at(&mut self, poses: &[InstancePose]) {
        set(&mut self.now, poses);
    }

    pub(crate) fn update_is_of(&mut self, poses: &[InstancePose]) {
        set(&mut self.then, poses);
    }
}

/// Whether instances of two copies of a scene stand at other poses.
pub(crate) fn has_moved(now: &Scene, then: &Scene) -> bool {
    now.has_instances() && !now.instance_poses().eq(then.instance_poses())
}

fn set(scene: &mut Arc<Scene>, poses: &[InstancePose]) {
    // Unshared since it has instances, so nothing is copied here.
    if scene.has_instances() && !poses.is_empty() {
        Arc::make_mut(scene).set_instance_poses(poses);
    }
}
