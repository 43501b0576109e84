//! Origins of the guide rays: centres of grid cells around the listener, another grid for each rotation.
//!
//! Rays of a rotation are cast when the listener enters its cell, so what they hit depends on the position, and a listener at
//! rest casts none. Sixteen grids place the origins all around the listener. Own.

use glam::Vec3;

use crate::propagation::diffuse::stable_viewpoint;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;

/// The origins of one listener's rays.
#[derive(Debug, Clone, Default)]
pub(crate) struct GuideOrigins {
    /// Their listener and scene revision.
    of: Option<(Vec3, u64)>,
    origins: [Vec3; ROTATIONS as usize],
}

impl GuideOrigins {
    /// Finds the origins for a listener in local coordinates, independently of earlier calls. Returns the number of rays cast.
    pub(crate) fn renew(&mut self, scene: &Scene, listener: Vec3, scene_state: u64) -> u64 {
        if self.of == Some((listener, scene_state)) {
            return 0;
        }
        self.of = Some((listener, scene_state));
        let mut rays = 0;
        for (rotation, origin) in (0..).zip(&mut self.origins) {
            *origin = stable_viewpoint(scene, listener.as_dvec3(), rotation, &mut rays).as_vec3();
        }
        rays
    }

    /// The origin of a rotation.
    pub(crate) fn of(&self, rotation: usize) -> Vec3 {
        self.origins[rotation]
    }
}
