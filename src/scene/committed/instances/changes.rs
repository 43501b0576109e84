//! Detects changes of a scene, which invalidate earlier results.

use std::sync::Arc;

use crate::acoustics::material::Reflectance;
use crate::scene::committed::instances::pose::InstancePose;
use crate::scene::{CommittedMesh, Scene};

/// Change of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SceneChange {
    /// None: every query has the same result.
    Nothing,
    /// Poses of instances only.
    Poses,
    /// Geometry or materials.
    Everything,
}

/// The fixed part of a scene and the parts and poses of its instances. Holds references to them.
#[derive(Debug, Clone, Default)]
pub struct SceneSnapshot {
    fixed: Option<Arc<CommittedMesh>>,
    reflectances: Option<Arc<[Reflectance]>>,
    placed: Vec<(InstancePose, Arc<Scene>)>,
}

impl SceneSnapshot {
    /// Stores the state of a scene and returns its change since the last call. Allocates if there are more instances than
    /// before.
    pub fn renew(&mut self, scene: &Scene) -> SceneChange {
        let change = self.change_to(scene);
        if change != SceneChange::Nothing {
            self.fixed = Some(Arc::clone(&scene.mesh));
            self.reflectances = Some(Arc::clone(scene.reflectances()));
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
        let materials = self.reflectances.as_ref();
        let is_same = fixed.is_some_and(|fixed| Arc::ptr_eq(fixed, &scene.mesh))
            && materials.is_some_and(|materials| Arc::ptr_eq(materials, scene.reflectances()))
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
