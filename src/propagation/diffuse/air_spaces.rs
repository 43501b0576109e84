//! Spaces of air: sets of samples between which rays pass.
//!
//! Own. Rays from the samples find what is hit; the sample there is in the same space. A space is open if a ray leaves it. A
//! closed one without listener and sources has no part in the late field: the inside of a solid wall, of a stone or a
//! column, and a room that nothing leads into. Its size tells nothing, as rooms are as narrow as walls are thick, and winding
//! tells nothing either.

use glam::Vec3;

use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Hit, Ray};
use crate::propagation::diffuse::surface_samples::{
    MAX_TRIES, SurfaceSamples, facing, probe_ray, raised,
};
use crate::propagation::rays::directions::lattice;
use crate::scene::Scene;

/// Rays of a sample that find out whether sound reaches it.
const PROBES: usize = 8;

/// Rays of a listener or source that find out which space it is in.
const OCCUPANT_RAYS: u32 = 16;

/// Mean free path in metres below which a space is a cavity, and a sample is in a gap.
const CAVITY_M: f32 = 0.5;

/// Rays of a sample or space.
#[derive(Debug, Clone, Copy, Default)]
struct Legs {
    /// Sum of their lengths, and number of those that hit something.
    length_m: f32,
    count: u32,
    /// Number of those that leave the scene.
    missed: u32,
}

impl Legs {
    fn add(&mut self, other: Self) {
        self.length_m += other.length_m;
        self.count += other.count;
        self.missed += other.missed;
    }

    fn mean_m(self) -> f32 {
        self.length_m / self.count.max(1) as f32
    }
}

impl SurfaceSamples {
    /// Drops sides from which nothing is hit, closed spaces without any of the `occupants` (listener and sources, in local
    /// coordinates), cavities, and narrow gaps that are open at an end: no listener is in them, and
    /// their short legs would set the time base of the whole scene. What is reflected there belongs to the nearest sample.
    pub(super) fn drop_unreachable(&mut self, scene: &Scene, occupants: &[Vec3], rays: &mut u64) {
        let mut spaces = Forest::new(self.all.len());
        let mut legs = vec![Legs::default(); self.all.len()];
        let mut all_m = Vec::new();
        for index in 0..self.all.len() {
            for probe in 0..PROBES {
                let ray = probe_ray(&self.all[index], index, probe, PROBES);
                *rays += 1;
                let own = self.all[index].surface;
                let Some(hit) = scene.closest_static_hit(&ray, [own, NO_GROUP]) else {
                    legs[index].missed += 1;
                    continue;
                };
                all_m.push((index, hit.t));
                legs[index].length_m += hit.t;
                legs[index].count += 1;
                self.join_space(scene, &mut spaces, index, (&ray, &hit), rays);
            }
        }
        let mut of_space = vec![Legs::default(); self.all.len()];
        for (index, legs) in legs.iter().enumerate() {
            of_space[spaces.root(index)].add(*legs);
        }
        let is_occupied = self.occupied(scene, &mut spaces, occupants, rays);
        let mut left_out = Vec::new();
        let is_kept: Vec<bool> = (0..self.all.len())
            .map(|index| {
                let space = spaces.root(index);
                let is_wide =
                    legs[index].mean_m() > CAVITY_M && of_space[space].mean_m() > CAVITY_M;
                let is_left_out = of_space[space].missed == 0 && !is_occupied[space];
                if is_wide && is_left_out {
                    left_out.push(space);
                }
                is_wide && !is_left_out
            })
            .collect();
        left_out.sort_unstable();
        left_out.dedup();
        self.left_out = left_out.len();
        all_m.retain(|(index, _)| is_kept[*index]);
        if !all_m.is_empty() {
            let quarter = all_m.len() / 4;
            let by_length = |a: &(usize, f32), b: &(usize, f32)| a.1.total_cmp(&b.1);
            self.short_leg_m = all_m.select_nth_unstable_by(quarter, by_length).1.1;
        }
        let mut index = 0;
        self.all.retain_mut(|sample| {
            sample.leg_m = legs[index].mean_m();
            index += 1;
            is_kept[index - 1]
        });
    }

    /// Spaces with occupants, by index of their root.
    fn occupied(
        &self,
        scene: &Scene,
        spaces: &mut Forest,
        occupants: &[Vec3],
        rays: &mut u64,
    ) -> Vec<bool> {
        let mut is_occupied = vec![false; self.all.len()];
        for occupant in occupants.iter().filter(|occupant| occupant.is_finite()) {
            for direction in lattice(OCCUPANT_RAYS) {
                let ray = Ray::new(*occupant, direction);
                *rays += 1;
                let Some(hit) = scene.closest_static_hit(&ray, [NO_GROUP; 2]) else {
                    continue;
                };
                if let Some(found) = self.seen_from(scene, (&ray, &hit), |_| false, rays) {
                    is_occupied[spaces.root(found)] = true;
                }
            }
        }
        is_occupied
    }

    /// Joins the space of a sample with that of the nearest one seen from where its ray hits.
    fn join_space(
        &self,
        scene: &Scene,
        spaces: &mut Forest,
        index: usize,
        hit: (&Ray, &Hit),
        rays: &mut u64,
    ) {
        let own = spaces.root(index);
        let mut is_joined = |found| spaces.root(found) == own;
        if let Some(found) = self.seen_from(scene, hit, &mut is_joined, rays) {
            spaces.join(own, found);
        }
    }

    /// The sample nearest to where a ray hits a surface, that is seen from there or `is_known` to be.
    fn seen_from(
        &self,
        scene: &Scene,
        (ray, hit): (&Ray, &Hit),
        mut is_known: impl FnMut(usize) -> bool,
        rays: &mut u64,
    ) -> Option<usize> {
        let (point, normal) = (ray.at(hit.t), facing(scene, hit.group, ray.direction));
        let mut origin = None;
        for found in self.search.nearest::<MAX_TRIES>(point, normal) {
            if is_known(found) {
                return Some(found);
            }
            let from = *origin.get_or_insert_with(|| {
                let own = [hit.group, NO_GROUP];
                raised(point, normal, rays, |ray| {
                    scene.closest_static_hit(ray, own)
                })
            });
            *rays += 1;
            let leg = Ray::between(from, self.all[found].raised);
            if !scene.is_statically_blocked(&leg, [NO_GROUP; 2]) {
                return Some(found);
            }
        }
        None
    }
}

/// Sets of indices.
struct Forest {
    parents: Vec<usize>,
}

impl Forest {
    /// Each index is a set of its own.
    fn new(count: usize) -> Self {
        Self {
            parents: (0..count).collect(),
        }
    }

    /// The index that stands for a set.
    fn root(&mut self, mut index: usize) -> usize {
        let parents = &mut self.parents;
        while parents[index] != index {
            parents[index] = parents[parents[index]];
            index = parents[index];
        }
        index
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b)] = a.min(b);
    }
}
