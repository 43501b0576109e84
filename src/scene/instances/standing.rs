//! How a scene stands, kept to see whether that has changed: what was found of it before is then no longer true.

use std::sync::Arc;

use super::pose::InstancePose;
use crate::scene::{CommittedMesh, Scene};

/// A scene's fixed part, and what its instances are made of and where they are. Keeps them from being freed.
#[derive(Debug, Clone, Default)]
pub struct Standing {
    fixed: Option<Arc<CommittedMesh>>,
    placed: Vec<(InstancePose, Arc<Scene>)>,
}

impl Standing {
    /// Notes how a scene stands; gives whether it stood otherwise when that was last noted. Equal ones answer every ray
    /// alike. Allocates while the number of instances is new.
    pub fn renew(&mut self, scene: &Scene) -> bool {
        if self.is_of(scene) {
            return false;
        }
        self.fixed = Some(Arc::clone(&scene.mesh));
        self.placed.clear();
        let placed = scene.instances.placed();
        self.placed
            .extend(placed.map(|placed| (placed.pose, Arc::clone(&placed.part))));
        true
    }

    fn is_of(&self, scene: &Scene) -> bool {
        let fixed = self.fixed.as_ref();
        let same =
            |(placed, (pose, part)): (&super::placed::Placed, &(InstancePose, Arc<Scene>))| {
                placed.pose == *pose && Arc::ptr_eq(&placed.part, part)
            };
        fixed.is_some_and(|fixed| Arc::ptr_eq(fixed, &scene.mesh))
            && scene.instances.count == self.placed.len()
            && scene.instances.placed().zip(&self.placed).all(same)
    }
}
