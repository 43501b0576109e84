//! Any number of sources in a scene: its own sixteen, then positions around and visible from them.

use foresound::geometry::Ray;
use foresound::geometry::bvh::NO_GROUP;
use foresound::propagation::rays::directions::{mix, unit};
use foresound::scene::{Scene, SourceId, SourcePose};
use glam::Vec3;

/// Farthest that a further source is from one of the scene's own, in metres along an axis.
const REACH_M: f32 = 4.0;

/// `count` sources; fewer if the scene has none of its own.
pub(super) fn sources(scene: &Scene, own: &[Vec3], count: usize) -> Vec<SourcePose> {
    let mut positions: Vec<Vec3> = own.iter().copied().take(count).collect();
    let mut draw = 0u64;
    while positions.len() < count && !own.is_empty() && draw < 1000 * count as u64 {
        let near = own[(draw % own.len() as u64) as usize];
        let shift = |k: u64| REACH_M * (2.0 * unit(mix(draw << 2 | k)) - 1.0);
        let position = near + Vec3::new(shift(0), 0.25 * shift(1), shift(2));
        draw += 1;
        let local = |p: Vec3| scene.to_local(p).as_vec3();
        // A little farther keeps sources off the faces of walls.
        let beyond = Ray::between(local(near), local(near + 1.1 * (position - near)));
        if !scene.bvh().any_hit(&beyond, [NO_GROUP; 2]) {
            positions.push(position);
        }
    }
    (0..)
        .zip(positions)
        .map(|(slot, position)| SourcePose::at(SourceId::new(slot, 0), position))
        .collect()
}
