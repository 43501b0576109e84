//! Origins of the guide rays: centres of grid cells around the listener, another grid for each rotation.
//!
//! Rays of a rotation are cast when the listener enters its cell, so what they hit depends on the position, and a listener at
//! rest casts none. Sixteen grids place the origins all around the listener. Own.

use glam::Vec3;

use crate::propagation::diffuse::visibility_cells::{GROUPS_PER_ROTATION, find_viewpoint};
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;

/// Edge lengths of the cells in metres, largest first; the centre of the smallest is not tested.
const CELLS_M: [f32; 3] = [2.0, 0.5, 0.125];

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
        for (rotation, origin) in self.origins.iter_mut().enumerate() {
            let group = rotation * GROUPS_PER_ROTATION;
            *origin = find_viewpoint(scene, listener, group, &CELLS_M, &mut rays);
        }
        rays
    }

    /// The origin of a rotation.
    pub(crate) fn of(&self, rotation: usize) -> Vec3 {
        self.origins[rotation]
    }
}
