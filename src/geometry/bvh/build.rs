//! Construction: valid triangles, a binary tree, a wide tree.
//!
//! Control side; allocates; deterministic. If the best tree needs more than the traversal stack, a balanced tree replaces it:
//! slower, but of logarithmic depth.

use glam::Vec3;
use obvhs::bvh2::Bvh2;

use super::collapse::{Choice, Collapsed, collapse};
use super::node::{Block, LEAST_EXTENT_M, MOST_TIMES_EXTENT, Node, REACH, SLACK};
use super::split::{balanced_tree, binary_tree, crossed};
use super::traverse::STACK;
use super::{Bvh, InstructionSet, Nodes};
use crate::geometry::aabb::Aabb;
use crate::geometry::triangle::box_margin;

/// Largest coordinate of a triangle: 2⁴⁰. Areas and the arithmetic of boxes stay finite in `f32`.
const FARTHEST: f32 = (1u64 << 40) as f32;

/// Scenes up to this size use the scalar reference, since kernels would underflow: 2⁻⁴⁰.
const SMALLEST: f32 = 1.0 / FARTHEST;

/// A triangle of the tree.
#[derive(Clone, Copy)]
pub(super) struct Item {
    corners: [Vec3; 3],
    triangle: u32,
    group: u32,
}

pub(super) fn build(
    vertices: &[Vec3],
    triangles: &[[u32; 3]],
    groups: &[u32],
    set: InstructionSet,
) -> Bvh {
    build_over(items_of(vertices, triangles, groups), set)
}

/// The triangles of a mesh that a tree takes.
pub(super) fn items_of(vertices: &[Vec3], triangles: &[[u32; 3]], groups: &[u32]) -> Vec<Item> {
    let is_near = |corner: &Vec3| corner.abs().max_element() <= FARTHEST && corner.is_finite();
    triangles
        .iter()
        .zip(groups)
        .zip(0u32..)
        .map(|((corners, &group), triangle)| Item {
            corners: corners.map(|v| vertices[v as usize]),
            triangle,
            group,
        })
        .filter(|item| item.corners.iter().all(is_near))
        .collect()
}

/// Builds another tree over the triangles of a tree.
pub(super) fn rebuild(bvh: &Bvh, set: InstructionSet) -> Bvh {
    let mut items: Vec<Item> = bvh
        .triangles()
        .map(|(corners, triangle, group)| Item {
            corners,
            triangle,
            group,
        })
        .collect();
    items.sort_by_key(|item| item.triangle);
    build_over(items, set)
}

fn build_over(items: Vec<Item>, set: InstructionSet) -> Bvh {
    if items.is_empty() {
        return Bvh::default();
    }
    let measures = Measures::of(&items);
    let boxes = measures.boxes(&items);
    let tree = binary_tree(&boxes);
    let (nodes, leaves) = match set {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 if let Some(avx2) = crate::simd::x86::Avx2::detect() => {
            let (nodes, leaves) = wide::<8>(&tree, &boxes, measures.slack());
            (Nodes::Avx2(nodes, avx2), leaves)
        }
        #[cfg(target_arch = "aarch64")]
        InstructionSet::Neon => {
            let (nodes, leaves) = wide::<4>(&tree, &boxes, measures.slack());
            (Nodes::neon(nodes), leaves)
        }
        _ => {
            let (nodes, leaves) = wide::<4>(&tree, &boxes, measures.slack());
            (Nodes::Scalar(nodes), leaves)
        }
    };
    let blocks = leaf_blocks(&items, leaves.iter().map(Vec::as_slice));
    measures.tree(nodes, blocks, items.len(), crossed(&tree))
}

impl Nodes {
    /// Nodes of the NEON kernels, which encode links.
    #[cfg(target_arch = "aarch64")]
    pub(super) fn neon(mut nodes: Vec<Node<4>>) -> Self {
        for link in nodes.iter_mut().flat_map(|node| &mut node.links) {
            *link = crate::geometry::intersect::neon::encode_link(*link);
        }
        Self::Neon(nodes)
    }
}

/// Margins of a tree by the coordinates of its triangles.
pub(super) struct Measures {
    /// Largest coordinate.
    extent: f32,
    margin: f32,
    reached: f32,
}

impl Measures {
    pub(super) fn of(items: &[Item]) -> Self {
        let extent = items
            .iter()
            .flat_map(|item| item.corners)
            .fold(0.0, |most: f32, corner| {
                most.max(corner.abs().max_element())
            });
        Self {
            extent,
            margin: box_margin(extent),
            reached: extent.max(LEAST_EXTENT_M.min(extent * MOST_TIMES_EXTENT)),
        }
    }

    /// The box of a triangle: that of the intersection test, to the bit.
    pub(super) fn bounds(&self, item: &Item) -> Aabb {
        Aabb::of_triangle(item.corners, self.margin)
    }

    pub(super) fn boxes(&self, items: &[Item]) -> Vec<Aabb> {
        items.iter().map(|item| self.bounds(item)).collect()
    }

    /// Margin of a node's boxes.
    pub(super) fn slack(&self) -> f32 {
        self.reached * SLACK
    }

    /// A tree of nodes and blocks.
    pub(super) fn tree(
        &self,
        nodes: Nodes,
        blocks: Vec<Block>,
        triangle_count: usize,
        crossed_boxes: f64,
    ) -> Bvh {
        Bvh {
            nodes,
            blocks,
            triangle_count,
            margin: self.margin,
            reach: if self.extent > SMALLEST {
                f64::from(self.reached * REACH)
            } else {
                f64::NAN
            },
            crossed_boxes,
        }
    }
}

/// The blocks of leaves, each a list of items.
pub(super) fn leaf_blocks<'a>(
    items: &[Item],
    leaves: impl Iterator<Item = &'a [u32]>,
) -> Vec<Block> {
    let block = |leaf: &[u32]| {
        let mut block = Block::EMPTY;
        for (lane, &i) in leaf.iter().enumerate() {
            let item = &items[i as usize];
            block.set(lane, &item.corners, item.triangle, item.group);
        }
        block
    };
    leaves.map(block).collect()
}

/// Nodes and leaves of a binary tree as a wide one.
pub(super) fn wide<const W: usize>(
    tree: &Bvh2,
    boxes: &[Aabb],
    slack: f32,
) -> (Vec<Node<W>>, Vec<Vec<u32>>) {
    let mut wide: Collapsed<W> = collapse(tree, Choice::Cheapest, slack);
    if wide.stack > STACK {
        wide = collapse(&balanced_tree(boxes), Choice::Shallowest, slack);
    }
    wide.nodes.shrink_to_fit();
    (wide.nodes, wide.leaves)
}
