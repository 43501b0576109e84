//! Nodes of `W` children and blocks of four triangles, laid out for lanes.

use glam::Vec3;

use super::bounds::Bounds;
use crate::simd::tracing::{Corners, Planes};

/// A triangle number that is none: fills a block's unused lanes.
pub(super) const NO_TRIANGLE: u32 = u32::MAX;

/// What nodes' boxes stand off what they hold, as a share of the scene's largest coordinate E: 2⁻¹⁷, or 128 ε of half
/// units in the last place.
///
/// The specification of boxes crosses a plane p at (p − o) / d to within 13 ε of it. Lanes on x86-64 multiply before they
/// subtract, which adds ε (|p| + |o| + |p − o|) / |d|: with |p| <= E and |o| <= 4 E ([`REACH`]) no more than
/// (13 · 5 + 1 + 4 + 5) ε E / |d| in all. NEON's measure along the longest
/// axis, where that is r times as much, r = |longest d / d| >= 1: off by 2 ε r |p − o| from the scale, ε (2 r |o| + |o'|) from
/// the offset, o' the start along the longest axis, ε r |p| from the product where it is not fused, and
/// ε (|o'| + r |p − o|) from the sum. With |p| <= E and |o| <= 4 E ([`REACH`]) all are no more than
/// (13 · 5 + 10 + 12 + 1 + 9) ε E r. What is left of the 128, 31 ε E, is more than a limit or the distance of an entry may be
/// off by, 2 ε of at most 5 E and ε of at most 9 E. So no box is missed that the specification enters.
pub(super) const SLACK: f32 = 1.0 / (1u32 << 17) as f32;

/// How far out rays may start for [`SLACK`], in largest coordinates.
pub(super) const REACH: f32 = 4.0;

/// Largest coordinate in metres that a smaller scene's slack and reach are made for, if that is at most so many times its own:
/// a part that moves is asked by rays from far outside of it. Slack for a larger coordinate is slack enough.
pub(super) const LEAST_EXTENT_M: f32 = 32.0;
pub(super) const MOST_TIMES_EXTENT: f32 = 64.0;

/// Up to `W` children. Unused lanes have boxes that nothing enters.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Node<const W: usize> {
    pub(super) planes: Planes<W>,
    /// Numbers of nodes; beyond the last node those of blocks begin. An instruction set may write them in a way of its own.
    pub(super) links: [u32; W],
}

impl<const W: usize> Node<W> {
    pub(super) const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; W],
            [f32::NEG_INFINITY; W],
            [f32::INFINITY; W],
            [f32::NEG_INFINITY; W],
            [f32::INFINITY; W],
            [f32::NEG_INFINITY; W],
        ],
        links: [0; W],
    };

    pub(super) fn set(&mut self, lane: usize, bounds: &Bounds, slack: f32, link: u32) {
        for axis in 0..3 {
            self.planes[2 * axis][lane] = bounds.min[axis] - slack;
            self.planes[2 * axis + 1][lane] = bounds.max[axis] + slack;
        }
        self.links[lane] = link;
    }
}

/// Up to four triangles. Unused lanes have corners that are no numbers, which nothing meets.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Block {
    pub(super) corners: Corners,
    pub(super) triangles: [u32; 4],
    pub(super) groups: [u32; 4],
}

impl Block {
    pub(super) const EMPTY: Self = Self {
        corners: [[[f32::NAN; 4]; 3]; 3],
        triangles: [NO_TRIANGLE; 4],
        groups: [super::NO_GROUP; 4],
    };

    pub(super) fn set(&mut self, lane: usize, corners: &[Vec3; 3], triangle: u32, group: u32) {
        for (row, corner) in self.corners.iter_mut().zip(corners) {
            for (axis, values) in row.iter_mut().enumerate() {
                values[lane] = corner[axis];
            }
        }
        self.triangles[lane] = triangle;
        self.groups[lane] = group;
    }

    /// Corners of the triangle in a lane.
    #[inline(always)]
    pub(super) fn corners_of(&self, lane: usize) -> [Vec3; 3] {
        let [a, b, c] = &self.corners;
        [
            Vec3::new(a[0][lane], a[1][lane], a[2][lane]),
            Vec3::new(b[0][lane], b[1][lane], b[2][lane]),
            Vec3::new(c[0][lane], c[1][lane], c[2][lane]),
        ]
    }
}
