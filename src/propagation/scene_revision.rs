//! Revision counter of a scene, for caches of rays. Own.

use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;
use crate::scene::instances::{SceneChange, SceneSnapshot};

/// Counts the states of a scene.
#[derive(Debug, Default)]
pub(crate) struct SceneRevision {
    snapshot: SceneSnapshot,
    /// Increases with every change.
    current: u64,
    /// The revision after the last change of more than poses.
    fixed_since: u64,
    /// While instances move: the revision after their first move, and the last update with a move.
    moving: Option<(u64, u64)>,
}

impl SceneRevision {
    /// Compares a scene with its last state. Allocates while the number of instances is new.
    pub(crate) fn refresh(&mut self, scene: &Scene, update: u64) {
        let change = self.snapshot.renew(scene);
        self.current += u64::from(change != SceneChange::Nothing);
        if change == SceneChange::Everything {
            self.fixed_since = self.current;
        }
        self.moving = match (change, self.moving) {
            (SceneChange::Nothing, moving) => moving,
            (SceneChange::Poses, Some((since, _))) => Some((since, update)),
            (SceneChange::Poses, None) => Some((self.current, update)),
            (SceneChange::Everything, _) => None,
        };
    }

    /// Begins an update. Instances count as at rest after as many updates without a move as there are rotations: apps move
    /// them once per graphics frame, and updates may be more frequent.
    pub(crate) fn begin_update(&mut self, update: u64) {
        self.moving = self
            .moving
            .filter(|(_, last)| update.saturating_sub(*last) < ROTATIONS);
    }

    /// The present revision.
    pub(crate) fn current(&self) -> u64 {
        self.current
    }

    /// The first revision since which only poses of instances have changed.
    pub(crate) fn fixed_since(&self) -> u64 {
        self.fixed_since
    }

    /// While instances move, the revision after their first move; otherwise the present one.
    pub(crate) fn poses_since(&self) -> u64 {
        self.moving.map_or(self.current, |(since, _)| since)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DVec3, Vec3};

    use super::*;
    use crate::scene::instances::{InstanceId, InstancePose};
    use crate::scene::{MaterialTable, SceneSettings, procedural};

    #[test]
    fn instances_count_as_moving_until_at_rest() {
        let commit = |size: f32| {
            let mesh = procedural::shoebox(Vec3::splat(size), "wood");
            Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
                .expect("commits")
        };
        let (mut scene, part) = (commit(5.0), Arc::new(commit(0.5)));
        let at = |id, x: f64| InstancePose::at(id, DVec3::new(x, 1.0, 1.0));
        let mut revision = SceneRevision::default();
        let mut refresh = |scene: &Scene, update| {
            revision.refresh(scene, update);
            revision.begin_update(update);
            (revision.current(), revision.poses_since())
        };
        assert_eq!(refresh(&scene, 0), (1, 1));
        assert_eq!(refresh(&scene, 1), (1, 1));
        let id = scene
            .add_instance(part, &at(InstanceId::default(), 1.0))
            .expect("one");
        assert_eq!(refresh(&scene, 2), (2, 2));
        // The revision before the first move has other poses.
        scene.set_instance_poses(&[at(id, 1.1)]);
        assert_eq!(refresh(&scene, 3), (3, 3));
        assert_eq!(refresh(&scene, 4), (3, 3));
        scene.set_instance_poses(&[at(id, 1.2)]);
        assert_eq!(refresh(&scene, 5), (4, 3));
        assert_eq!(refresh(&scene, 5 + ROTATIONS - 1), (4, 3));
        assert_eq!(refresh(&scene, 5 + ROTATIONS), (4, 4));
        scene.set_instance_poses(&[at(id, 1.3)]);
        assert_eq!(refresh(&scene, 30), (5, 5));
        scene.set_instance_poses(&[at(id, 1.4)]);
        assert_eq!(refresh(&scene, 31), (6, 5));
        scene.remove_instance(id).expect("there");
        assert_eq!(refresh(&scene, 32), (7, 7));
    }
}
