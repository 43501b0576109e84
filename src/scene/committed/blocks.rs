//! Boxes of neighbouring triangles: where a few places of a scene are searched, without rays.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::geometry::Aabb;

/// Triangles that have bounds together: neighbours in a file are often neighbours in space.
const BLOCK: usize = 32;

/// Bounds of every [`BLOCK`] triangles of a mesh, made at commit and when a scene is loaded: a part that joins a scene of a million
/// triangles has no time to look at all of them.
#[derive(Debug, Clone)]
pub(super) struct TriangleBlocks {
    bounds: Arc<[Aabb]>,
    triangles: usize,
}

impl TriangleBlocks {
    pub(super) fn build(vertices: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let of_block = |block: &[[u32; 3]]| {
            let corners = block.iter().flatten();
            corners.fold(Aabb::EMPTY, |bounds, &vertex| {
                bounds.with_point(vertices[vertex as usize])
            })
        };
        Self {
            bounds: triangles.chunks(BLOCK).map(of_block).collect(),
            triangles: triangles.len(),
        }
    }

    /// Bounds of all triangles.
    pub(super) fn all(&self) -> Aabb {
        let all = self.bounds.iter();
        all.fold(Aabb::EMPTY, |bounds, block| bounds.union(block))
    }

    /// Blocks that meet a box.
    pub(super) fn near(&self, low: DVec3, high: DVec3) -> Vec<usize> {
        let blocks = 0..self.bounds.len();
        blocks
            .filter(|&block| self.is_near(block, low, high))
            .collect()
    }

    fn is_near(&self, block: usize, low: DVec3, high: DVec3) -> bool {
        let bounds = &self.bounds[block];
        bounds.min.as_dvec3().cmple(high).all() && bounds.max.as_dvec3().cmpge(low).all()
    }

    /// Triangles of some blocks in a box, and others beside them.
    pub(super) fn triangles_near<'a>(
        &'a self,
        blocks: &'a [usize],
        low: DVec3,
        high: DVec3,
    ) -> impl Iterator<Item = u32> + 'a {
        let blocks = blocks.iter().copied();
        let near = blocks.filter(move |&block| self.is_near(block, low, high));
        near.flat_map(|block| {
            let first = block * BLOCK;
            first as u32..(first + BLOCK).min(self.triangles) as u32
        })
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.bounds)
    }
}
