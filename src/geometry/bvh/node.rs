//! Memory layout: nodes of `W` children, blocks of four triangles.

use glam::Vec3;

use crate::geometry::aabb::Aabb;
use crate::geometry::intersect::{Corners, Planes};

/// Triangle index of unused lanes.
pub(super) const NO_TRIANGLE: u32 = u32::MAX;

/// Margin of the boxes of nodes around their contents, as a fraction of the scene's largest coordinate E: 2⁻¹⁷ = 128 ε, ε
/// half a unit in the last place.
///
/// The scalar reference crosses a plane p at (p − o) / d with an error of 13 ε of that. AVX2 multiplies before it subtracts,
/// which adds ε (|p| + |o| + |p − o|) / |d|: with |p| <= E and |o| <= 4 E ([`REACH`]) at most (13 · 5 + 1 + 4 + 5) ε E / |d|
/// in all. NEON measures along the longest axis, where errors are r = |longest d / d| >= 1 times larger: 2 ε r |p − o| from
/// the scale, ε (2 r |o| + |o'|) from the offset, o' the origin on the longest axis, and ε (|o'| + r |p − o|) from the sum.
/// With the same bounds all are at most (13 · 5 + 10 + 12 + 1 + 9) ε E r. The rest of the 128, 31 ε E, exceeds the errors of
/// the limit, 2 ε of at most 5 E, and of the entry distance, ε of at most 9 E. So kernels enter every box that the reference
/// enters.
pub(super) const SLACK: f32 = 1.0 / (1u32 << 17) as f32;

/// Largest coordinate of an origin for which [`SLACK`] suffices, in units of the scene's largest coordinate.
pub(super) const REACH: f32 = 4.0;

/// Slack and reach are computed for a coordinate of at least this, in metres, but at most [`MOST_TIMES_EXTENT`] times the
/// scene's own: rays start far outside of a small moving part. Slack for a larger coordinate suffices for a smaller one.
pub(super) const LEAST_EXTENT_M: f32 = 32.0;
/// See [`LEAST_EXTENT_M`].
pub(super) const MOST_TIMES_EXTENT: f32 = 64.0;

/// A node of at most `W` children. Unused lanes have empty boxes.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(in crate::geometry) struct Node<const W: usize> {
    pub(in crate::geometry) planes: Planes<W>,
    /// Links to children. In a [`Bvh`](super::Bvh): indices of nodes, followed by those of blocks; an instruction set may
    /// encode them.
    pub(in crate::geometry) links: [u32; W],
}

impl<const W: usize> Node<W> {
    pub(in crate::geometry) const EMPTY: Self = Self {
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

    /// Sets a child; its box is `slack` larger on every side.
    pub(in crate::geometry) fn set(&mut self, lane: usize, bounds: &Aabb, slack: f32, link: u32) {
        for axis in 0..3 {
            self.planes[2 * axis][lane] = bounds.min[axis] - slack;
            self.planes[2 * axis + 1][lane] = bounds.max[axis] + slack;
        }
        self.links[lane] = link;
    }
}

/// A block of at most four triangles. The corners of unused lanes are NaN, which no ray hits.
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

    /// Corners of the triangle of a lane.
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
