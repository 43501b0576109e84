//! From where it is looked whether a bounce reaches the listener: places that stand still while the listener walks.
//!
//! Own. Were it looked from the listener's own place, but not at every step, the tail would depend on when it was looked
//! at last, and two listeners at one place would hear two tails. So space is divided into cells, a division of its own
//! for each of [`VIEWPOINTS`] groups of bounces, and a group is looked at from the middle of the cell that the listener is
//! in. A group's view changes where the listener leaves its cell, another one's somewhere else; a bounce is asked once a
//! cell, and a listener at rest costs nothing. Where something stands between listener and middle, the cell is too large:
//! a smaller one is taken, so that nobody hears a room through its wall.

use glam::{DVec3, Vec3};

use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;

/// Groups of bounces of one rotation.
pub const VIEWS: usize = 4;

/// Groups of all rotations.
pub const VIEWPOINTS: usize = VIEWS * ROTATIONS as usize;

/// Edges of the cells in metres, the largest first; the middle of the smallest is not asked for. Smaller cells cost more
/// shadow rays a step, larger ones blur a shadow's edge.
const CELLS_M: [f32; 3] = [0.5, 0.125, 0.031_25];

/// The places for one listener.
#[derive(Debug, Clone)]
pub struct VisibilityCells {
    /// The listener and the state of the scene that they are for.
    of: Option<(Vec3, u64)>,
    places: [Vec3; VIEWPOINTS],
}

impl Default for VisibilityCells {
    fn default() -> Self {
        Self {
            of: None,
            places: [Vec3::ZERO; VIEWPOINTS],
        }
    }
}

impl VisibilityCells {
    /// Finds the places for a listener, local coordinates; they are the same whatever was asked for before. A scene of the
    /// same `scene_state` is the same. Gives the number of rays cast, none if nothing is new.
    pub fn renew(&mut self, scene: &Scene, listener: Vec3, scene_state: u64) -> u64 {
        if self.of == Some((listener, scene_state)) {
            return 0;
        }
        self.of = Some((listener, scene_state));
        let mut rays = 0;
        for (group, place) in self.places.iter_mut().enumerate() {
            *place = viewpoint(scene, listener, group, &mut rays);
        }
        rays
    }

    /// Those of a rotation's groups.
    pub(crate) fn of_rotation(&self, rotation: usize) -> &[Vec3] {
        &self.places[rotation * VIEWS..][..VIEWS]
    }
}

/// A place that stands still while a source moves, near it and in its sight, another one for each rotation; local
/// coordinates. Adds the rays it cast to `rays`.
pub fn still_place(scene: &Scene, source: DVec3, rotation: u64, rays: &mut u64) -> DVec3 {
    let group = (rotation % ROTATIONS) as usize * VIEWS;
    viewpoint(scene, source.as_vec3(), group, rays).as_dvec3()
}

/// The middle of the largest cell that can be seen from the listener, of one group's divisions.
fn viewpoint(scene: &Scene, listener: Vec3, group: usize, rays: &mut u64) -> Vec3 {
    let corner = corner(group);
    let mut place = listener;
    for (size, cell_m) in CELLS_M.into_iter().enumerate() {
        let cell = ((listener - corner * cell_m) / cell_m).floor();
        place = (cell + corner + 0.5) * cell_m;
        if size + 1 == CELLS_M.len() || place == listener {
            break;
        }
        *rays += 1;
        if !scene.any_hit(&Ray::between(listener, place), [NO_GROUP; 2]) {
            break;
        }
    }
    place
}

/// Where a group's cells begin, as shares of their edges: an R3 low-discrepancy sequence (\[ROBERTS18\]).
fn corner(group: usize) -> Vec3 {
    const STEP: [f64; 3] = [
        0.819_172_513_396_164_5,
        0.671_043_606_703_789_2,
        0.549_700_477_901_970_3,
    ];
    let n = group as f64;
    Vec3::from(STEP.map(|step| (0.5 + n * step).fract() as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{MaterialTable, SceneSettings, procedural};

    fn room() -> Scene {
        let mesh = procedural::shoebox(Vec3::new(4.0, 2.5, 3.0), "concrete");
        Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default())
            .expect("commits")
    }

    /// Not through walls, not where the listener was before, and few of them change in a step.
    #[test]
    fn viewpoints_are_near_in_sight_and_stand_still() {
        let scene = room();
        let at = |x: f32| scene.to_local(Vec3::new(x, 1.3, 1.4)).as_vec3();
        let mut walking = VisibilityCells::default();
        let mut changed = 0;
        for step in 0..300 {
            let listener = at(0.02 + 0.013 * step as f32);
            let before = walking.places;
            walking.renew(&scene, listener, 0);
            let mut fresh = VisibilityCells::default();
            fresh.renew(&scene, listener, 0);
            assert_eq!(walking.places, fresh.places);
            for (place, before) in walking.places.iter().zip(before) {
                assert!(place.distance(listener) <= 0.5 * 3f32.sqrt() * CELLS_M[0]);
                let leg = Ray::between(listener, *place);
                let blocked = scene.any_hit(&leg, [NO_GROUP; 2]);
                let least = 0.5 * 3f32.sqrt() * CELLS_M[2];
                assert!(!blocked || place.distance(listener) <= least);
                changed += usize::from(step > 0 && *place != before);
            }
        }
        // 3.9 m of cells of 0.5 m, each left once; near the two walls smaller ones.
        assert!(changed < 12 * VIEWPOINTS, "{changed}");
        assert_eq!(walking.renew(&scene, at(0.02 + 0.013 * 299.0), 0), 0);
        assert!(walking.renew(&scene, at(0.02 + 0.013 * 299.0), 1) > 0);
    }
}
