//! What source rays met in the fixed scene, so that while instances move only these are asked.
//!
//! Where a ray goes until it meets an instance depends on the source and the fixed scene alone. So the first hits of that
//! way are kept, rotation by rotation, as far as rays have come; a ray that an instance turns aside asks the fixed scene
//! anew from there on. Answers are those of [`Scene::closest_hit`], to the bit. Only used in scenes with instances. Own.

use crate::geometry::bvh::NO_GROUP;
use crate::geometry::{Hit, Ray};
use crate::scene::Scene;

/// What the fixed scene answered to a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Kept {
    /// Below 0 where nobody has asked.
    t: f32,
    triangle: u32,
    /// [`NO_GROUP`] where nothing was met.
    group: u32,
}

impl Kept {
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

    /// What was met, if that is known.
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

/// The ways of one rotation's rays, all of the same source, in the same fixed scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct FixedWay {
    /// A place a leg.
    kept: Vec<Kept>,
    /// Whether each ray has left its way.
    has_left: Vec<bool>,
}

impl FixedWay {
    /// Room for so many rays and legs.
    pub(crate) fn reserve(&mut self, rays: usize, legs: usize) {
        self.kept.reserve(legs - self.kept.len().min(legs));
        self.has_left.reserve(rays - self.has_left.len().min(rays));
    }

    /// All rays begin anew; `is_known` says whether they go where those went that were kept.
    pub(crate) fn begin(&mut self, rays: usize, legs: usize, is_known: bool) {
        if !is_known || self.kept.len() != legs {
            self.kept.clear();
            self.kept.resize(legs, Kept::UNKNOWN);
        }
        self.has_left.clear();
        self.has_left.resize(rays, false);
    }

    /// What ray number `index` meets first on a leg from surface `last`; `place` is the leg's.
    #[inline(always)]
    pub(crate) fn closest_hit(
        &mut self,
        scene: &Scene,
        ray: &Ray,
        last: u32,
        [index, place]: [usize; 2],
    ) -> Option<Hit> {
        let ignored = [last, NO_GROUP];
        let has_left = &mut self.has_left[index];
        if *has_left {
            return scene.closest_hit(ray, ignored);
        }
        let kept = &mut self.kept[place];
        let fixed = kept.hit().unwrap_or_else(|| {
            let fixed = scene.bvh().closest_hit(ray, ignored);
            *kept = Kept::of(fixed);
            fixed
        });
        let hit = scene.closest_hit_beside(ray, ignored, fixed);
        *has_left = hit != fixed;
        hit
    }
}
