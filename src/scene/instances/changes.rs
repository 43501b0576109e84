//! How a scene stands, kept to see whether that has changed: what was found of it before is then no longer true.

use std::sync::Arc;

use crate::scene::instances::pose::InstancePose;
use crate::scene::{CommittedMesh, Scene};

/// What of a scene has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SceneChange {
    /// Nothing: it answers every ray alike.
    Nothing,
    /// Where instances stand, and no more.
    Poses,
    /// More than that.
    Everything,
}

/// A scene's fixed part, and what its instances are made of and where they are. Keeps them from being freed.
#[derive(Debug, Clone, Default)]
pub struct SceneSnapshot {
    fixed: Option<Arc<CommittedMesh>>,
    placed: Vec<(InstancePose, Arc<Scene>)>,
}

impl SceneSnapshot {
    /// Notes how a scene stands; gives what has changed since that was last noted. Allocates while the number of instances
    /// is new.
    pub fn renew(&mut self, scene: &Scene) -> SceneChange {
        let change = self.change_to(scene);
        if change != SceneChange::Nothing {
            self.fixed = Some(Arc::clone(&scene.mesh));
            self.placed.clear();
            let placed = scene.instances.placed();
            self.placed
                .extend(placed.map(|placed| (placed.pose, Arc::clone(&placed.part))));
        }
        change
    }

    fn change_to(&self, scene: &Scene) -> SceneChange {
        let fixed = self.fixed.as_ref();
        let placed = || scene.instances.placed().zip(&self.placed);
        let is_same = fixed.is_some_and(|fixed| Arc::ptr_eq(fixed, &scene.mesh))
            && scene.instances.count == self.placed.len()
            && placed()
                .all(|(now, (pose, part))| now.pose.id == pose.id && Arc::ptr_eq(&now.part, part));
        if !is_same {
            return SceneChange::Everything;
        }
        match placed().all(|(now, (pose, _))| now.pose == *pose) {
            true => SceneChange::Nothing,
            false => SceneChange::Poses,
        }
    }
}
