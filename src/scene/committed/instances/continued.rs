//! Surfaces of the fixed part that go on in joined parts: two numbers, but one mirror plane.

use crate::geometry::Aabb;
use crate::scene::committed::instances::numbering;
use crate::scene::surface::{SAME_PLANE_DISTANCE_M, Surface, is_parallel};

/// Pairs among the largest surfaces of a scene, and those surfaces with each pair in one.
#[derive(Debug, Clone, Default)]
pub(super) struct ContinuedSurfaces {
    /// The fixed part's surface and the common one.
    pairs: Vec<[u32; 2]>,
    /// Largest first; a pair is under its first number. Empty without pairs.
    merged: Vec<(u32, Surface)>,
}

impl ContinuedSurfaces {
    /// Pairs among the largest surfaces.
    pub(super) fn among<'a>(large: &[u32], surface: impl Fn(u32) -> &'a Surface) -> Self {
        let fixed = || large.iter().filter(|&&s| !numbering::is_instance(s));
        let common = large.iter().filter(|&&s| numbering::as_common(s).is_some());
        let pair = |&number: &u32| {
            let goes_on = |&&own: &&u32| is_one_plane(surface(own), surface(number));
            Some([*fixed().find(goes_on)?, number])
        };
        let pairs: Vec<[u32; 2]> = common.filter_map(pair).collect();
        if pairs.is_empty() {
            return Self::default();
        }
        let second = |number: u32| pairs.iter().any(|pair| pair[1] == number);
        let merge = |&number: &u32| {
            let own = surface(number);
            let mut merged = *own;
            if let Some([_, other]) = pairs.iter().find(|pair| pair[0] == number) {
                let other = surface(*other);
                merged.area_m2 += other.area_m2;
                merged.bounds_min = own.bounds_min.min(other.bounds_min);
                merged.bounds_max = own.bounds_max.max(other.bounds_max);
            }
            (number, merged)
        };
        let all = large.iter().filter(|number| !second(**number));
        let mut merged: Vec<(u32, Surface)> = all.map(merge).collect();
        merged.sort_by(|a, b| b.1.area_m2.total_cmp(&a.1.area_m2).then(a.0.cmp(&b.0)));
        Self { pairs, merged }
    }

    /// The surface in the same plane that goes on where this one ends.
    pub(super) fn other(&self, surface: u32) -> Option<u32> {
        let pair = self.pairs.iter().find(|pair| pair.contains(&surface))?;
        Some(if pair[0] == surface { pair[1] } else { pair[0] })
    }

    /// The surface that both of a pair are named by: the fixed part's.
    pub(super) fn name(&self, surface: u32) -> u32 {
        let pair = self.pairs.iter().find(|pair| pair[1] == surface);
        pair.map_or(surface, |pair| pair[0])
    }

    pub(super) fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// The largest surfaces with pairs in one, if there is any pair.
    pub(super) fn merged(&self) -> Option<&[(u32, Surface)]> {
        (!self.pairs.is_empty()).then_some(&self.merged)
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.pairs.as_slice()) + size_of_val(self.merged.as_slice())
    }
}

/// Whether two surfaces are of one plane and material.
fn is_one_plane(a: &Surface, b: &Surface) -> bool {
    let bounds = |surface: &Surface| Aabb {
        min: surface.bounds_min,
        max: surface.bounds_max,
    };
    let box_of_b = bounds(b);
    let middle = (0.5 * (box_of_b.min + box_of_b.max)).as_dvec3();
    // The middle of the box of a plane surface lies in its plane.
    a.material == b.material
        && is_parallel(a.normal, b.normal)
        && a.distance_m(middle).abs() <= SAME_PLANE_DISTANCE_M
}
