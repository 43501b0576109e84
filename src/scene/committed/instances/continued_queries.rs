//! Queries of the fixed part about what joined parts make of it: surfaces that they continue, and border pieces that are panels
//! together with theirs.
//!
//! Any thread; all take `&self`, neither allocate nor block.

use glam::DVec3;

use crate::scene::Scene;

impl Scene {
    /// The other one of two large surfaces in one plane of which the fixed part has one and joined parts the other.
    #[inline]
    pub fn continued_by(&self, surface: u32) -> Option<u32> {
        self.instances.continued.other(surface)
    }

    /// Whether joined parts continue any large surface of the fixed part.
    #[inline]
    pub(crate) fn has_continued_surfaces(&self) -> bool {
        !self.instances.continued.is_empty()
    }

    /// The surface that names a reflection: of two large ones in one plane the fixed part's, so that a path keeps its identity where its
    /// reflection crosses the border.
    #[inline]
    pub(crate) fn naming_surface(&self, surface: u32) -> u32 {
        self.instances.continued.name(surface)
    }

    /// Whether joined parts make a panel of a border piece of the fixed part that has a point of a surface.
    #[inline(never)]
    pub(crate) fn fixed_piece_reflects_at(&self, surface: u32, point: DVec3) -> bool {
        let fixed = self.instances.fixed.as_ref();
        fixed.is_some_and(|fixed| fixed.is_in_raised_piece(surface, point))
    }

    /// Whether joined parts make a panel of any border piece of the fixed part's surface.
    #[inline(never)]
    pub(crate) fn has_raised_piece(&self, surface: u32) -> bool {
        let fixed = self.instances.fixed.as_ref();
        fixed.is_some_and(|fixed| fixed.raised_surfaces().any(|own| own == surface))
    }

    /// Whether joined parts make a panel of the border piece of a triangle of the fixed part.
    #[inline(never)]
    pub(crate) fn is_of_fixed_piece(&self, triangle: u32) -> bool {
        let fixed = self.instances.fixed.as_ref();
        fixed.is_some_and(|fixed| fixed.is_of_raised_piece(triangle))
    }
}
