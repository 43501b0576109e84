//! Bounding volume hierarchy over triangles: closest hit and any hit.
//!
//! The one interface between rays and the rest: whatever tree and instruction set stands behind it, the answers are
//! those of [`super::triangle`] on every triangle.

mod build;
mod traverse;

use glam::Vec3;

/// Group that no triangle has: fills the places of an ignore list that are not needed.
pub const NO_GROUP: u32 = u32::MAX;

/// Deepest tree that traversal accepts; [`Bvh::build`] keeps to it.
const MAX_DEPTH: usize = 64;

/// A tree over triangles. Immutable; queries take `&self` and neither allocate nor block.
#[derive(Debug, Clone, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
    leaves: Vec<LeafTriangle>,
}

/// A box with two children side by side, or a run of triangles.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
struct Node {
    min: Vec3,
    /// First child, or first triangle of a leaf.
    first: u32,
    max: Vec3,
    /// Triangles of a leaf; 0 in an inner node.
    count: u32,
}

/// A triangle as a leaf holds it, so that a test touches one cache line.
#[derive(Debug, Clone, Copy)]
struct LeafTriangle {
    corners: [Vec3; 3],
    triangle: u32,
    group: u32,
}

impl Bvh {
    /// Builds a tree over finite triangles. `groups` has one number a triangle, which any-hit queries can ignore.
    ///
    /// Control side; allocates. Triangles without a finite extent are left out, since nothing can hit them.
    ///
    /// # Panics
    /// If a triangle names a vertex beyond `vertices`, or `groups` is shorter than `triangles`.
    pub fn build(vertices: &[Vec3], triangles: &[[u32; 3]], groups: &[u32]) -> Self {
        build::build(vertices, triangles, groups)
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.leaves.len()
    }

    /// Memory that the tree occupies, in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + self.leaves.capacity() * size_of::<LeafTriangle>()
    }
}
