//! A listener who walks by the keys of a terminal. A terminal reports presses without releases: a press counts for a
//! moment, and a held key repeats.

use foresound::geometry::Ray;
use foresound::geometry::bvh::NO_GROUP;
use foresound::scene::layout::Walk;
use foresound::scene::{ListenerPose, Scene};
use glam::{Quat, Vec3};
use std::sync::Arc;

use crate::inputs::LoadedScene;

/// Seconds that a press counts for: a little longer than a held key takes to repeat.
const HELD_S: f32 = 0.15;
/// Walking speed in m/s and turning speed in rad/s.
const WALK_M_S: f32 = 1.4;
const TURN_PER_S: f32 = 1.5;
/// Minimum distance to a wall, in metres.
const CLEARANCE_M: f32 = 0.3;

/// The direction of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pressed {
    Ahead,
    Back,
    Left,
    Right,
    TurnLeft,
    TurnRight,
}

/// The listener.
pub(crate) struct Walker {
    scene: Arc<Scene>,
    walk: Option<Walk>,
    position: Vec3,
    yaw: f32,
    /// Seconds for which each press still counts.
    held_s: [f32; 6],
}

impl Walker {
    /// At the initial position of the scene's walk.
    pub(crate) fn new(loaded: &LoadedScene) -> Self {
        let walk = loaded.walk();
        let report = loaded.scene.report();
        let middle = (report.bounds_min + report.bounds_max) / 2.0;
        Self {
            scene: Arc::clone(&loaded.scene),
            walk,
            position: walk.map_or(middle, |walk| walk.standing),
            yaw: 0.0,
            held_s: [0.0; 6],
        }
    }

    /// Where the listener is, in metres.
    pub(crate) fn position(&self) -> Vec3 {
        self.position
    }

    pub(crate) fn press(&mut self, pressed: Pressed) {
        self.held_s[pressed as usize] = HELD_S;
    }

    /// Walks on for some seconds.
    pub(crate) fn step(&mut self, seconds: f32) -> ListenerPose {
        let held = |pressed: Pressed| self.held_s[pressed as usize].min(seconds).max(0.0);
        let turned = held(Pressed::TurnLeft) - held(Pressed::TurnRight);
        let step = Vec3::new(
            held(Pressed::Right) - held(Pressed::Left),
            0.0,
            held(Pressed::Back) - held(Pressed::Ahead),
        );
        for left_s in &mut self.held_s {
            *left_s = (*left_s - seconds).max(0.0);
        }
        self.yaw += TURN_PER_S * turned;
        self.go(Quat::from_rotation_y(self.yaw) * (WALK_M_S * step));
        ListenerPose::facing(self.position, self.yaw)
    }

    /// A step, unless a wall blocks it.
    fn go(&mut self, step: Vec3) {
        let Some(ahead) = step.try_normalize() else {
            return;
        };
        let local = |at: Vec3| self.scene.to_local(at).as_vec3();
        let far = self.position + step + CLEARANCE_M * ahead;
        let ray = Ray::between(local(self.position), local(far));
        if !self.scene.bvh().any_hit(&ray, [NO_GROUP; 2]) {
            self.position += step;
        }
    }

    /// Takes the scene's own walk at a time in seconds.
    pub(crate) fn follow(&mut self, time_s: f64) -> ListenerPose {
        if let Some(walk) = self.walk {
            self.position = walk.position_at(time_s, 0.0);
        }
        ListenerPose::facing(self.position, self.yaw)
    }
}
