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

#[derive(Clone, Copy)]
struct Item {
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
    let is_near = |corner: &Vec3| corner.abs().max_element() <= FARTHEST && corner.is_finite();
    let items = triangles
        .iter()
        .zip(groups)
        .zip(0u32..)
        .map(|((corners, &group), triangle)| Item {
            corners: corners.map(|v| vertices[v as usize]),
            triangle,
            group,
        })
        .filter(|item| item.corners.iter().all(is_near))
        .collect();
    build_over(items, set)
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
    let extent = items
        .iter()
        .flat_map(|item| item.corners)
        .fold(0.0, |most: f32, corner| {
            most.max(corner.abs().max_element())
        });
    let margin = box_margin(extent);
    let reached = extent.max(LEAST_EXTENT_M.min(extent * MOST_TIMES_EXTENT));
    let boxes: Vec<Aabb> = items
        .iter()
        // The boxes of the intersection test, to the bit.
        .map(|item| Aabb::of_triangle(item.corners, margin))
        .collect();
    let tree = binary_tree(&boxes);
    let (nodes, leaves) = match set {
        #[cfg(target_arch = "x86_64")]
        InstructionSet::Avx2 if let Some(avx2) = crate::simd::x86::Avx2::detect() => {
            let (nodes, leaves) = wide::<8>(&tree, &boxes, reached * SLACK);
            (Nodes::Avx2(nodes, avx2), leaves)
        }
        #[cfg(target_arch = "aarch64")]
        InstructionSet::Neon => {
            let (mut nodes, leaves) = wide::<4>(&tree, &boxes, reached * SLACK);
            for link in nodes.iter_mut().flat_map(|node| &mut node.links) {
                *link = crate::geometry::intersect::neon::encode_link(*link);
            }
            (Nodes::Neon(nodes), leaves)
        }
        _ => {
            let (nodes, leaves) = wide::<4>(&tree, &boxes, reached * SLACK);
            (Nodes::Scalar(nodes), leaves)
        }
    };
    let block = |leaf: &Vec<u32>| {
        let mut block = Block::EMPTY;
        for (lane, &i) in leaf.iter().enumerate() {
            let item = &items[i as usize];
            block.set(lane, &item.corners, item.triangle, item.group);
        }
        block
    };
    Bvh {
        nodes,
        blocks: leaves.iter().map(block).collect(),
        triangle_count: items.len(),
        margin,
        reach: if extent > SMALLEST {
            f64::from(reached * REACH)
        } else {
            f64::NAN
        },
        crossed_boxes: crossed(&tree),
    }
}

fn wide<const W: usize>(tree: &Bvh2, boxes: &[Aabb], slack: f32) -> (Vec<Node<W>>, Vec<Vec<u32>>) {
    let mut wide: Collapsed<W> = collapse(tree, Choice::Cheapest, slack);
    if wide.stack > STACK {
        wide = collapse(&balanced_tree(boxes), Choice::Shallowest, slack);
    }
    wide.nodes.shrink_to_fit();
    (wide.nodes, wide.leaves)
}
