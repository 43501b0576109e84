//! Cache of source rays' hits in the fixed scene: while instances move, only the instances are intersected.
//!
//! Up to its first hit of an instance a ray depends on the source and the fixed scene alone. These hits are cached per
//! rotation; a ray that has hit an instance is cast against the whole scene afterwards. The results are those of
//! [`Scene::closest_hit`], to the bit. Used in scenes with instances only. Own.

use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Hit, Ray};
use crate::propagation::diffuse::source_rays::FAR_RAYS;
use crate::scene::Scene;

/// The hit of a leg in the fixed scene.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CachedHit {
    /// Negative if unknown.
    t: f32,
    triangle: u32,
    /// [`NO_GROUP`] for a miss.
    group: u32,
}

impl CachedHit {
    const UNKNOWN: Self = Self {
        t: -1.0,
        triangle: 0,
        group: NO_GROUP,
    };

    #[inline]
    fn of(hit: Option<Hit>) -> Self {
        hit.map_or(
            Self {
                t: 0.0,
                ..Self::UNKNOWN
            },
            |hit| Self {
                t: hit.t,
                triangle: hit.triangle,
                group: hit.group,
            },
        )
    }

    /// The hit or miss, if known.
    #[inline]
    fn hit(self) -> Option<Option<Hit>> {
        let hit = Hit {
            t: self.t,
            triangle: self.triangle,
            group: self.group,
        };
        (self.t >= 0.0).then_some((self.group != NO_GROUP).then_some(hit))
    }
}

/// The hits of one rotation's rays.
#[derive(Debug, Clone, Default)]
pub(crate) struct StaticHitCache {
    /// One per leg.
    hits: Vec<CachedHit>,
    /// Whether each ray has hit an instance.
    has_diverged: Vec<bool>,
    /// Ray of each far one's legs.
    far_rays: [u32; FAR_RAYS],
}

impl StaticHitCache {
    /// Reserves memory for so many rays and legs.
    pub(crate) fn reserve(&mut self, rays: usize, legs: usize) {
        self.hits.reserve(legs.saturating_sub(self.hits.len()));
        self.has_diverged
            .reserve(rays - self.has_diverged.len().min(rays));
    }

    /// Starts all rays; without `is_valid` cached hits are dropped.
    pub(crate) fn begin(&mut self, rays: usize, legs: usize, is_valid: bool) {
        if !is_valid || self.hits.len() != legs {
            self.hits.clear();
            self.hits.resize(legs, CachedHit::UNKNOWN);
            self.far_rays = [u32::MAX; FAR_RAYS];
        }
        self.has_diverged.clear();
        self.has_diverged.resize(rays, false);
    }

    /// Continues a ray as a far one, whose `legs` are those of another ray unless it was that far one before.
    pub(crate) fn begin_far_ray(&mut self, far: usize, ray: u32, legs: std::ops::Range<usize>) {
        if std::mem::replace(&mut self.far_rays[far], ray) != ray {
            self.hits[legs].fill(CachedHit::UNKNOWN);
        }
    }

    /// First hit of ray `index` on the leg of index `leg` from surface `last`.
    #[inline(always)]
    pub(crate) fn closest_hit(
        &mut self,
        scene: &Scene,
        ray: &Ray,
        last: u32,
        [index, leg]: [usize; 2],
    ) -> Option<Hit> {
        let ignored = [last, NO_GROUP];
        let has_diverged = &mut self.has_diverged[index];
        if *has_diverged {
            return scene.closest_hit(ray, ignored);
        }
        let hit = &mut self.hits[leg];
        let fixed = hit.hit().unwrap_or_else(|| {
            let fixed = scene.bvh().closest_hit(ray, ignored);
            *hit = CachedHit::of(fixed);
            fixed
        });
        let hit = scene.closest_hit_beside(ray, ignored, fixed);
        *has_diverged = hit != fixed;
        hit
    }
}
