//! Patches: clusters of samples that see each other.
//!
//! Own. Centres lie far from each other, though not where samples are sparse, and depend on the samples alone, so a patch keeps
//! its index while instances move. A sample belongs to the nearest centre that it sees, past fixed surfaces and instances; a
//! centre that sees other centres than the sample does counts as farther. A sample that sees no centre belongs with the nearest
//! sample that it sees. So no patch reaches through a wall or a shut door. A sample that sees neither, or in a narrow gap, as
//! behind a door leaf, belongs to no patch: the gap's two ends are in different rooms.

use crate::geometry::Ray;
use crate::geometry::bvh::NO_GROUP;
use crate::propagation::diffuse::surface_samples::{
    MAX_PATCHES, MAX_TRIES, NO_PATCH, SurfaceSample, SurfaceSamples,
};
use crate::scene::Scene;

/// Samples of a patch on average.
const SAMPLES_PER_PATCH: usize = 10;

/// By how much a squared distance is longer to a centre that sees none of the other centres that a sample sees. Across a door the nearest
/// centre may be in the other room; in three rooms in a row such patches let through energy that made the middle one 4 dB too loud.
const OTHER_VIEW: f32 = 4.0;

// Views are bits of a number.
const _: () = assert!(MAX_PATCHES <= u32::BITS as usize);

/// Rounds in which samples that see no centre join what they see.
const ROUNDS: usize = 4;

impl SurfaceSamples {
    /// Samples of a patch in the mean.
    fn patch_size(&self) -> f32 {
        let count = (self.all.len() / SAMPLES_PER_PATCH).clamp(1, MAX_PATCHES);
        self.all.len() as f32 / count as f32
    }

    /// Chooses centres far from each other.
    pub(super) fn choose_centres(&mut self) {
        let count = (self.all.len() / SAMPLES_PER_PATCH).clamp(1, MAX_PATCHES);
        let size = self.patch_size();
        let is_sparse = self.sparse_samples(size);
        let mut nearest = vec![f32::INFINITY; self.all.len()];
        while self.centres.len() < count {
            let far = nearest.iter().enumerate();
            let far = far.filter(|(index, _)| !is_sparse[*index]);
            let far = far.max_by(|(_, a), (_, b)| a.total_cmp(b));
            let Some((far, _)) = far else { return };
            self.centres.push(far);
            let centre = self.all[far];
            for (nearest, sample) in nearest.iter_mut().zip(&self.all) {
                // Relative to the area: patches have about the same number of samples.
                let area_m2 = sample.area_m2.max(centre.area_m2);
                *nearest = nearest.min(distance(sample, &centre, size) / area_m2);
            }
        }
    }

    /// Whether samples have fewer others around them than the median one. On open ground a few lie far from each other: with a
    /// patch each, what rings in a shelter there had three. Where samples are even none is sparse.
    fn sparse_samples(&self, size: f32) -> Vec<bool> {
        if !self.has_gaps {
            return vec![false; self.all.len()];
        }
        let around = |centre: &SurfaceSample| {
            let is_near = |sample: &&SurfaceSample| {
                let area_m2 = centre.area_m2.max(sample.area_m2);
                distance(sample, centre, size) < size * area_m2
            };
            self.all.iter().filter(is_near).count()
        };
        let counts: Vec<usize> = self.all.iter().map(around).collect();
        let mut sorted = counts.clone();
        sorted.sort_unstable();
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0);
        counts.iter().map(|count| *count < median).collect()
    }

    /// Gives every sample to the nearest centre that it sees; centres with another view count as farther.
    pub(super) fn form_patches(&mut self, scene: &Scene, rays: &mut u64) {
        let size = self.patch_size();
        let centres: Vec<SurfaceSample> = self.centres.iter().map(|c| self.all[*c]).collect();
        let mut view_of = |index: usize, sample: &SurfaceSample| {
            let mut view = 0u32;
            for (patch, centre) in centres.iter().enumerate() {
                if sample.is_in_gap() || centre.is_in_gap() {
                    continue;
                }
                let is_seen = self.centres[patch] == index || sees(scene, sample, centre, rays);
                view |= u32::from(is_seen) << patch;
            }
            view
        };
        let samples = self.all.iter().enumerate();
        let views: Vec<u32> = samples
            .map(|(index, sample)| view_of(index, sample))
            .collect();
        for (sample, view) in self.all.iter_mut().zip(&views) {
            let seen = (0..centres.len()).filter(|patch| view & (1 << patch) != 0);
            // The square hardly counts where a few centres are hidden, as behind furniture.
            let to = |patch: usize| {
                let others = views[self.centres[patch]];
                let [both, either] = [view & others, view | others].map(u32::count_ones);
                let other_view = 1.0 - both as f32 / either as f32;
                distance(sample, &centres[patch], size)
                    * (1.0 + OTHER_VIEW * other_view * other_view)
            };
            let nearest = seen.min_by(|a, b| to(*a).total_cmp(&to(*b)));
            sample.patch = nearest.map_or(NO_PATCH, |patch| patch as u16);
        }
        for _ in 0..ROUNDS {
            if !self.join_what_is_seen(scene, rays) {
                break;
            }
        }
        self.weigh_patches();
    }

    /// Gives samples without a patch to that of a sample that they see; returns whether there were any.
    fn join_what_is_seen(&mut self, scene: &Scene, rays: &mut u64) -> bool {
        let mut joined = Vec::new();
        for (index, sample) in self.all.iter().enumerate() {
            if sample.patch != NO_PATCH || sample.is_in_gap() {
                continue;
            }
            let (point, normal) = (sample.point, sample.normal);
            let nearest = self.search.nearest::<{ 2 * MAX_TRIES }>(point, normal);
            let others = nearest.filter(|found| *found != index);
            for found in others.take(2 * MAX_TRIES - 1) {
                let other = &self.all[found];
                if other.patch != NO_PATCH && sees(scene, sample, other, rays) {
                    joined.push((index, other.patch));
                    break;
                }
            }
        }
        for (index, patch) in &joined {
            self.all[*index].patch = *patch;
        }
        !joined.is_empty()
    }

    /// Shares, areas and mean legs of the patches.
    fn weigh_patches(&mut self) {
        self.patches = self.centres.len();
        let mut counts = vec![0.0f32; self.patches];
        self.leg_m.clear();
        self.leg_m.resize(self.patches, 0.0);
        self.patch_m2.clear();
        self.patch_m2.resize(self.patches, 0.0);
        for sample in self.all.iter().filter(|sample| sample.patch != NO_PATCH) {
            self.leg_m[usize::from(sample.patch)] += sample.leg_m;
            self.patch_m2[usize::from(sample.patch)] += sample.area_m2;
            counts[usize::from(sample.patch)] += 1.0;
        }
        for (leg_m, count) in self.leg_m.iter_mut().zip(&counts) {
            *leg_m /= count.max(1.0);
        }
        let total = self.all.len() as f32;
        self.share.clear();
        self.share.extend(counts.iter().map(|count| count / total));
    }
}

/// Squared distance of a sample and a patch's centre by place and normal, with patches of `size` samples.
fn distance(sample: &SurfaceSample, centre: &SurfaceSample, size: f32) -> f32 {
    let turn = 1.0 - sample.normal.dot(centre.normal);
    sample.point.distance_squared(centre.point) + 2.0 * size * centre.area_m2 * turn
}

/// Whether nothing is between two samples. Adds the ray cast to `rays`.
fn sees(scene: &Scene, from: &SurfaceSample, to: &SurfaceSample, rays: &mut u64) -> bool {
    *rays += 1;
    !scene.any_hit(&Ray::between(from.raised, to.raised), [NO_GROUP; 2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Samples every half metre under a shelter, and a fifth as many 16 m apart beside it.
    fn shelter_on_open_ground() -> SurfaceSamples {
        let at = |x: f32, z: f32| SurfaceSample {
            point: Vec3::new(x, 0.0, z),
            normal: Vec3::Y,
            area_m2: 0.25,
            ..SurfaceSample::default()
        };
        let near = (0..400).map(|n| at(0.5 * (n % 20) as f32, 0.5 * (n / 20) as f32));
        let far = (0..80).map(|n| at(100.0 + 16.0 * (n % 10) as f32, 16.0 * (n / 10) as f32));
        SurfaceSamples {
            all: near.chain(far).collect(),
            has_gaps: true,
            ..SurfaceSamples::default()
        }
    }

    #[test]
    fn sparse_samples_have_no_patches_of_their_own() {
        let mut samples = shelter_on_open_ground();
        samples.choose_centres();
        assert_eq!(samples.centres.len(), MAX_PATCHES);
        assert!(samples.centres.iter().all(|centre| *centre < 400));
    }

    #[test]
    fn even_samples_may_all_be_centres() {
        let mut samples = shelter_on_open_ground();
        samples.has_gaps = false;
        samples.choose_centres();
        assert!(samples.centres.iter().any(|centre| *centre >= 400));
    }
}
