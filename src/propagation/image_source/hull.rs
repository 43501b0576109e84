//! Bounds of a surface and of its images in mirrors that may come before or after it: where reflections commute, the line decides.
//!
//! Across an axis the images in one mirror are told by the distance from it, with the gap between a small surface and its image;
//! images in more than one are a hull. Pure arithmetic in local coordinates; any thread; allocates nothing. Own.

use glam::DVec3;

use crate::propagation::path::MAX_ORDER;
use crate::scene::Surface;

/// A plane as a mirror.
#[derive(Clone, Copy)]
pub(crate) enum Mirror<'a> {
    /// Across an axis, at a coordinate.
    Across(usize, f64),
    Oblique(&'a Surface),
}

impl<'a> Mirror<'a> {
    #[inline(always)]
    pub(crate) fn of(surface: &'a Surface) -> Self {
        let n = surface.normal;
        for axis in 0..3 {
            if n[axis].abs() == 1.0 {
                return Self::Across(axis, surface.offset_m * n[axis]);
            }
        }
        Self::Oblique(surface)
    }
}

/// Bounds of a surface and its images.
pub(crate) struct Hull {
    pub(crate) low: [f64; 3],
    pub(crate) high: [f64; 3],
    /// Coordinates of mirrors across the axes, behind which the image of these bounds is. The bounds are above them. 0 without one.
    pub(crate) mirror: [f64; 3],
    /// 1 where there is a mirror, 0 otherwise.
    pub(crate) is_mirrored: [f64; 3],
}

impl Hull {
    #[inline(always)]
    pub(crate) fn of(surface: &Surface) -> Self {
        Self {
            low: surface.bounds_min.as_dvec3().to_array(),
            high: surface.bounds_max.as_dvec3().to_array(),
            mirror: [0.0; 3],
            is_mirrored: [0.0; 3],
        }
    }

    /// Adds the images in the `unordered` ones of a sequence's mirrors, with and without each of them: those after the surface
    /// number `index`, the last one first, and those before it.
    #[inline(always)]
    pub(crate) fn add_images(
        &mut self,
        mirrors: &[Mirror<'_>; MAX_ORDER],
        index: usize,
        unordered: u8,
    ) {
        let mut earlier = unordered & ((1 << index) - 1);
        let mut later = unordered ^ earlier;
        while later != 0 {
            let last = later.ilog2() as usize;
            self.add_image(mirrors[last % MAX_ORDER]);
            later ^= 1 << last;
        }
        while earlier != 0 {
            self.add_image(mirrors[earlier.trailing_zeros() as usize % MAX_ORDER]);
            earlier &= earlier - 1;
        }
    }

    #[inline(always)]
    fn add_image(&mut self, mirror: Mirror<'_>) {
        match mirror {
            Mirror::Across(axis, plane) => self.add_image_across(axis % 3, plane),
            Mirror::Oblique(surface) => self.add_oblique_image(surface),
        }
    }

    fn add_oblique_image(&mut self, mirror: &Surface) {
        let n = mirror.normal;
        (0..3).for_each(|axis| self.fill(axis));
        let (low, high) = (DVec3::from(self.low), DVec3::from(self.high));
        let middle = mirror.mirror(0.5 * (low + high));
        let half = 0.5 * (high - low);
        // |1 − 2 n nᵀ| times the half lengths: the extent of the mirrored box along each axis.
        let row = |axis: DVec3, along: f64| (axis - 2.0 * along * n).abs().dot(half);
        let reach = DVec3::new(row(DVec3::X, n.x), row(DVec3::Y, n.y), row(DVec3::Z, n.z));
        self.low = low.min(middle - reach).to_array();
        self.high = high.max(middle + reach).to_array();
    }

    /// Adds the image in the plane of this coordinate.
    #[inline(always)]
    fn add_image_across(&mut self, axis: usize, plane: f64) {
        self.fill(axis);
        let (low, high) = (self.low[axis], self.high[axis]);
        let (image_low, image_high) = (2.0 * plane - high, 2.0 * plane - low);
        if low >= plane {
            (self.mirror[axis], self.is_mirrored[axis]) = (plane, 1.0);
        } else if high <= plane {
            (self.low[axis], self.high[axis]) = (image_low, image_high);
            (self.mirror[axis], self.is_mirrored[axis]) = (plane, 1.0);
        } else {
            (self.low[axis], self.high[axis]) = (low.min(image_low), high.max(image_high));
        }
    }

    /// Fills the gap between the bounds and their image across an axis.
    #[inline(always)]
    fn fill(&mut self, axis: usize) {
        if self.is_mirrored[axis] > 0.0 {
            self.low[axis] = 2.0 * self.mirror[axis] - self.high[axis];
            (self.mirror[axis], self.is_mirrored[axis]) = (0.0, 0.0);
        }
    }
}
