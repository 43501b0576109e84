//! Viewpoints for the visibility of bounces, and origins of a moving source's rays: centres of grid cells around listener and source.
//!
//! Own. Visibility from the listener's own position, if not tested at every step, would depend on the time of the last
//! test. Each of [`GROUPS`] groups of bounces therefore has its own grid, and its visibility is tested from the centre of
//! the listener's cell. Groups change cells at different positions; a bounce is tested once per cell, and a listener at
//! rest costs no rays. Where an obstacle separates listener and centre, a smaller cell is used, and beside a wall the position
//! itself: rooms must not be audible through walls.

use glam::{DVec3, Vec3};

use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::rays::directions::ROTATIONS;
use crate::scene::Scene;

/// Groups of bounces per rotation.
pub const GROUPS_PER_ROTATION: usize = 4;

/// Groups of all rotations.
pub const GROUPS: usize = GROUPS_PER_ROTATION * ROTATIONS as usize;

/// Edge lengths of the cells in metres, largest first. Smaller cells cost more shadow rays per step, larger ones blur shadow
/// boundaries.
const CELLS_M: [f32; 3] = [0.5, 0.125, 0.031_25];

/// The same around a source that moves, and around the listener for guide rays: rays start at a cell's centre, another cell for each
/// rotation, and are cast again in the next cell. Smaller cells cost more rays, larger ones blur the source's position (`tests/moving_late.rs`).
pub(crate) const SOURCE_CELLS_M: [f32; 3] = [2.0, 0.5, 0.125];

/// Distance in metres behind a centre up to which nothing may be: a centre on a wall would see both sides of it.
const BEYOND_M: f32 = 1e-3;

/// The viewpoints of one listener.
#[derive(Debug, Clone)]
pub struct VisibilityCells {
    /// Their listener and scene revision.
    of: Option<(Vec3, u64)>,
    viewpoints: [Vec3; GROUPS],
}

impl Default for VisibilityCells {
    fn default() -> Self {
        Self {
            of: None,
            viewpoints: [Vec3::ZERO; GROUPS],
        }
    }
}

impl VisibilityCells {
    /// Finds the viewpoints of a listener in local coordinates, independently of earlier calls. `scene_state` is the scene's
    /// revision. Returns the number of rays cast, 0 if neither has changed. Allocates nothing.
    pub fn renew(&mut self, scene: &Scene, listener: Vec3, scene_state: u64) -> u64 {
        if self.of == Some((listener, scene_state)) {
            return 0;
        }
        self.of = Some((listener, scene_state));
        let mut rays = 0;
        for (group, viewpoint) in self.viewpoints.iter_mut().enumerate() {
            *viewpoint = find_viewpoint(scene, listener, group, &CELLS_M, &mut rays);
        }
        rays
    }

    /// The viewpoints of a rotation's groups.
    pub(crate) fn of_rotation(&self, rotation: usize) -> &[Vec3] {
        &self.viewpoints[rotation * GROUPS_PER_ROTATION..][..GROUPS_PER_ROTATION]
    }

    /// The viewpoint of a group.
    pub(crate) fn viewpoint(&self, group: usize) -> Vec3 {
        self.viewpoints[group]
    }
}

/// A viewpoint near a position and visible from it, constant within a cell, one per rotation; local coordinates. Adds the
/// rays cast to `rays`.
pub fn stable_viewpoint(scene: &Scene, source: DVec3, rotation: u64, rays: &mut u64) -> DVec3 {
    let group = (rotation % ROTATIONS) as usize * GROUPS_PER_ROTATION;
    find_viewpoint(scene, source.as_vec3(), group, &SOURCE_CELLS_M, rays).as_dvec3()
}

/// The centre of the largest of a group's cells, of the edge lengths `cells_m`, that is visible from a position; the position itself
/// if none is.
fn find_viewpoint(
    scene: &Scene,
    position: Vec3,
    group: usize,
    cells_m: &[f32],
    rays: &mut u64,
) -> Vec3 {
    let offset = offset_of(group);
    for cell_m in cells_m {
        let cell = ((position - offset * cell_m) / cell_m).floor();
        let viewpoint = (cell + offset + 0.5) * cell_m;
        if viewpoint == position {
            break;
        }
        *rays += 1;
        let beyond = viewpoint + BEYOND_M * (viewpoint - position).normalize_or_zero();
        if !scene.any_hit(&Ray::between(position, beyond), [NO_GROUP; 2]) {
            return viewpoint;
        }
    }
    position
}

/// Offset of a group's grid in cells: an R3 low-discrepancy sequence (\[ROBERTS18\]).
fn offset_of(group: usize) -> Vec3 {
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

    /// The bounds' centre is the origin, so a wall in the middle lies on centres of the first group.
    #[test]
    fn no_viewpoint_is_behind_a_wall_or_on_it() {
        let mut mesh = procedural::shoebox(Vec3::new(4.0, 2.5, 3.0), "concrete");
        let first = mesh.vertices.len() as u32;
        for (y, z) in [(0.0, 0.0), (2.5, 0.0), (2.5, 3.0), (0.0, 3.0)] {
            mesh.vertices.push(Vec3::new(2.0, y, z));
        }
        for corners in [[0, 1, 2], [0, 2, 3]] {
            mesh.triangles.push(corners.map(|corner| first + corner));
            mesh.triangle_materials.push(mesh.triangle_materials[0]);
        }
        let scene = Scene::commit(&mesh, &MaterialTable::built_in(), &SceneSettings::default());
        let scene = scene.expect("commits");
        for distance_m in [0.001, 0.005, 0.02, 0.04, 0.1, 0.24] {
            for side in [-1.0, 1.0] {
                let listener = Vec3::new(side * distance_m, 0.13, -0.24);
                let mut cells = VisibilityCells::default();
                cells.renew(&scene, listener, 0);
                for viewpoint in cells.viewpoints {
                    assert!(viewpoint.x * side > 1e-6, "{listener}: {viewpoint}");
                }
            }
        }
    }

    #[test]
    fn viewpoints_are_near_visible_and_stable() {
        let scene = room();
        let at = |x: f32| scene.to_local(Vec3::new(x, 1.3, 1.4)).as_vec3();
        let mut walking = VisibilityCells::default();
        let mut changed = 0;
        for step in 0..300 {
            let listener = at(0.02 + 0.013 * step as f32);
            let before = walking.viewpoints;
            walking.renew(&scene, listener, 0);
            let mut fresh = VisibilityCells::default();
            fresh.renew(&scene, listener, 0);
            assert_eq!(walking.viewpoints, fresh.viewpoints);
            for (viewpoint, before) in walking.viewpoints.iter().zip(before) {
                assert!(viewpoint.distance(listener) <= 0.5 * 3f32.sqrt() * CELLS_M[0]);
                let leg = Ray::between(listener, *viewpoint);
                assert!(*viewpoint == listener || !scene.any_hit(&leg, [NO_GROUP; 2]));
                changed += usize::from(step > 0 && *viewpoint != before);
            }
        }
        // 3.9 m of cells of 0.5 m are left 8 times; the smaller ones near the two walls 4 times more at most.
        assert!(changed < 12 * GROUPS, "{changed}");
        assert_eq!(walking.renew(&scene, at(0.02 + 0.013 * 299.0), 0), 0);
        assert!(walking.renew(&scene, at(0.02 + 0.013 * 299.0), 1) > 0);
    }
}
