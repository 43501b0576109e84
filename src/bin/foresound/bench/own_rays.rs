//! The rays of an update without the update: as many, of the same kinds, from the same places.
//!
//! Guide rays are the update's own. Source rays have its origins, directions and number of bounces, far ones too, all of
//! them specular. Occlusion rays are the legs of the paths that it found, repeated up to the number that it cast.

use foresound::geometry::Ray;
use foresound::geometry::bvh::NO_GROUP;
use foresound::propagation::late::source_rays::{FAR_BOUNCES, is_far};
use foresound::propagation::sampling::{ROTATIONS, fibonacci_direction, mix, rotation};
use foresound::propagation::{PathSet, PropagationSettings};
use foresound::scene::Scene;
use glam::Vec3;

/// Rays ready to be cast.
pub(super) struct OwnRays {
    closest: Vec<(Ray, u32)>,
    any: Vec<(Ray, [u32; 2])>,
}

impl OwnRays {
    /// Those of the update that gave `set`.
    pub(super) fn of(scene: &Scene, settings: &PropagationSettings, set: &PathSet) -> Self {
        let mut closest = Vec::new();
        let turn = rotation(set.update, settings.seed);
        let ear = scene.to_local(set.listener.position).as_vec3();
        for i in 0..settings.guide_rays {
            let direction = turn * fibonacci_direction(i, settings.guide_rays);
            follow(
                scene,
                Ray::new(ear, direction),
                settings.depth,
                true,
                &mut closest,
            );
        }
        for source in &set.sources {
            let origin = scene.to_local(source.position).as_vec3();
            let seed = settings.seed ^ mix(u64::from(source.id.bits()));
            let turn = rotation(set.update, seed);
            for i in 0..settings.source_rays {
                let direction = turn * fibonacci_direction(i, settings.source_rays);
                let far = is_far(
                    i as usize,
                    settings.source_rays as usize,
                    set.update % ROTATIONS,
                );
                follow(
                    scene,
                    Ray::new(origin, direction),
                    if far { FAR_BOUNCES } else { settings.depth },
                    false,
                    &mut closest,
                );
            }
        }
        let mut legs = Vec::new();
        for path in &set.paths {
            let source = set.sources.iter().find(|s| s.id == path.source);
            let Some(source) = source else { continue };
            let mut from = (source.position, NO_GROUP);
            let points = path
                .points()
                .iter()
                .copied()
                .zip(path.surfaces().iter().copied());
            for to in points.chain([(set.listener.position, NO_GROUP)]) {
                let local = |p: Vec3| scene.to_local(p).as_vec3();
                legs.push((Ray::between(local(from.0), local(to.0)), [from.1, to.1]));
                from = to;
            }
        }
        let rest = (set.rays as usize).saturating_sub(closest.len());
        let any = legs
            .iter()
            .copied()
            .cycle()
            .take(if legs.is_empty() { 0 } else { rest });
        Self {
            closest,
            any: any.collect(),
        }
    }

    /// Casts all of them; gives the number of hits, so that nothing is left out.
    pub(super) fn cast(&self, scene: &Scene) -> usize {
        let tree = scene.bvh();
        let closest = self
            .closest
            .iter()
            .filter(|(ray, last)| tree.closest_hit(ray, [*last, NO_GROUP]).is_some());
        let any = self
            .any
            .iter()
            .filter(|(ray, ends)| tree.any_hit(ray, *ends));
        closest.count() + any.count()
    }
}

/// A ray and its specular bounces, to the first hit on something small if `panels_only`.
fn follow(
    scene: &Scene,
    mut ray: Ray,
    depth: usize,
    panels_only: bool,
    rays: &mut Vec<(Ray, u32)>,
) {
    let mut last = NO_GROUP;
    for _ in 0..depth {
        rays.push((ray, last));
        let Some(hit) = scene.bvh().closest_hit(&ray, [last, NO_GROUP]) else {
            return;
        };
        if panels_only && !scene.is_panel(hit.triangle) {
            return;
        }
        let normal = scene.surface(hit.group).normal.as_vec3();
        let onward = ray.direction - 2.0 * normal.dot(ray.direction) * normal;
        ray = Ray::new(ray.at(hit.t), onward);
        last = hit.group;
    }
}
