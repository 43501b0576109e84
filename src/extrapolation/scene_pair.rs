//! The scene with the instance poses of this graphics frame, and with those of the newest update.
//!
//! Constructed on the control side. The sound thread moves instances and swaps pairs without allocation: it has the only
//! reference to these copies. A scene without instances is shared, not copied.

use std::sync::Arc;

use crate::scene::{InstancePose, Scene};

/// A scene with two sets of instance poses.
#[derive(Debug, Clone)]
pub struct ScenePair {
    current: Arc<Scene>,
    at_update: Arc<Scene>,
}

impl ScenePair {
    /// A pair with the scene's poses in both. Control side; allocates.
    pub fn of(scene: &Arc<Scene>) -> Self {
        let copy = || match scene.has_instances() {
            true => Arc::new(Scene::clone(scene)),
            false => Arc::clone(scene),
        };
        Self {
            current: copy(),
            at_update: copy(),
        }
    }

    /// With the poses of this graphics frame.
    #[inline]
    pub(crate) fn current(&self) -> &Scene {
        &self.current
    }

    /// With the poses of the newest update.
    #[inline]
    pub(crate) fn at_update(&self) -> &Scene {
        &self.at_update
    }

    pub(crate) fn set_current_poses(&mut self, poses: &[InstancePose]) {
        set_poses(&mut self.current, poses);
    }

    pub(crate) fn set_update_poses(&mut self, poses: &[InstancePose]) {
        set_poses(&mut self.at_update, poses);
    }
}

/// Whether two copies of a scene differ in instance poses.
pub(crate) fn has_moved(current: &Scene, at_update: &Scene) -> bool {
    current.has_instances() && !current.instance_poses().eq(at_update.instance_poses())
}

fn set_poses(scene: &mut Arc<Scene>, poses: &[InstancePose]) {
    // A scene with instances is not shared: `make_mut` does not copy.
    if scene.has_instances() && !poses.is_empty() {
        Arc::make_mut(scene).set_instance_poses(poses);
    }
}
