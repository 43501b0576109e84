//! Since when a scene is what it is, for what rays found of it in earlier updates. Own.

use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;
use crate::scene::instances::{SceneChange, SceneSnapshot};

/// Counts a scene's states.
#[derive(Debug, Default)]
pub(crate) struct SceneState {
    standing: SceneSnapshot,
    /// Another one whenever the scene is.
    now: u64,
    /// The state after the last change of more than poses.
    fixed: u64,
    /// While instances move: the state after their first move, and the last update that saw one.
    moving: Option<(u64, u64)>,
}

impl SceneState {
    /// Looks at a scene that may have changed. Allocates while the number of instances is new.
    pub(crate) fn look(&mut self, scene: &Scene, update: u64) {
        let change = self.standing.renew(scene);
        self.now += u64::from(change != SceneChange::Nothing);
        if change == SceneChange::Everything {
            self.fixed = self.now;
        }
        self.moving = match (change, self.moving) {
            (SceneChange::Nothing, moving) => moving,
            (SceneChange::Poses, Some((since, _))) => Some((since, update)),
            (SceneChange::Poses, None) => Some((self.now, update)),
            (SceneChange::Everything, _) => None,
        };
    }

    /// Notes an update. Apps move things once a graphics frame, and updates may come oftener: what has not moved for as many
    /// updates as there are rotations rests.
    pub(crate) fn go_on(&mut self, update: u64) {
        self.moving = self
            .moving
            .filter(|(_, last)| update.saturating_sub(*last) < ROTATIONS);
    }

    /// The present state, by number.
    pub(crate) fn now(&self) -> u64 {
        self.now
    }

    /// The first state from which on nothing but poses of instances has changed.
    pub(crate) fn fixed_since(&self) -> u64 {
        self.fixed
    }

    /// The same from their first move on, while they move; the present one else.
    pub(crate) fn poses_since(&self) -> u64 {
        self.moving.map_or(self.now, |(since, _)| since)
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
    fn moves_count_until_they_have_rested() {
        let commit = |size: f32| {
            let mesh = procedural::shoebox(Vec3::splat(size), "wood");
            Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
                .expect("commits")
        };
        let (mut scene, part) = (commit(5.0), Arc::new(commit(0.5)));
        let at = |id, x: f64| InstancePose::at(id, DVec3::new(x, 1.0, 1.0));
        let mut state = SceneState::default();
        let mut look = |scene: &Scene, update| {
            state.look(scene, update);
            state.go_on(update);
            (state.now(), state.poses_since())
        };
        assert_eq!(look(&scene, 0), (1, 1));
        assert_eq!(look(&scene, 1), (1, 1));
        let id = scene
            .add_instance(part, &at(InstanceId::default(), 1.0))
            .expect("one");
        assert_eq!(look(&scene, 2), (2, 2));
        // What was found before the first move is of another place.
        scene.set_instance_poses(&[at(id, 1.1)]);
        assert_eq!(look(&scene, 3), (3, 3));
        assert_eq!(look(&scene, 4), (3, 3));
        scene.set_instance_poses(&[at(id, 1.2)]);
        assert_eq!(look(&scene, 5), (4, 3));
        assert_eq!(look(&scene, 5 + ROTATIONS - 1), (4, 3));
        assert_eq!(look(&scene, 5 + ROTATIONS), (4, 4));
        scene.set_instance_poses(&[at(id, 1.3)]);
        assert_eq!(look(&scene, 30), (5, 5));
        scene.set_instance_poses(&[at(id, 1.4)]);
        assert_eq!(look(&scene, 31), (6, 5));
        scene.remove_instance(id).expect("there");
        assert_eq!(look(&scene, 32), (7, 7));
    }
}
