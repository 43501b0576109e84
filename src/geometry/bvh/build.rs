//! Building the tree: obvhs's PLOC with reinsertion, flattened into our own nodes.
//!
//! Control side. Should obvhs return a tree deeper than traversal's stack (many identical or collinear triangles do
//! that), a median split takes its place: worse, but never deeper than the logarithm of the count.

use std::time::Duration;

use glam::Vec3;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::triangle::Triangle;
use obvhs::{BvhBuildParams, aabb::Aabb};

use super::{Bvh, LeafTriangle, MAX_DEPTH, Node};

/// Triangles in a leaf at most.
const MAX_LEAF_TRIANGLES: usize = 4;

pub(super) fn build(vertices: &[Vec3], triangles: &[[u32; 3]], groups: &[u32]) -> Bvh {
    let leaves: Vec<LeafTriangle> = triangles
        .iter()
        .zip(groups)
        .enumerate()
        .map(|(i, (corners, &group))| LeafTriangle {
            corners: corners.map(|v| vertices[v as usize]),
            triangle: i as u32,
            group,
        })
        .filter(|leaf| leaf.corners.iter().all(|c| c.is_finite()))
        .collect();
    if leaves.is_empty() {
        return Bvh::default();
    }
    let tree = obvhs_tree(&leaves);
    let mut bvh = Bvh {
        nodes: Vec::with_capacity(tree.nodes.len() + 1),
        leaves: Vec::with_capacity(leaves.len()),
    };
    if depth(&tree) <= MAX_DEPTH {
        flatten(&tree, &leaves, &mut bvh);
    } else {
        let mut order: Vec<u32> = (0..leaves.len() as u32).collect();
        bvh.nodes.push(node_over(&leaves, &order, 0));
        split_at_median(&leaves, &mut order, 0, &mut bvh);
    }
    bvh.nodes.shrink_to_fit();
    bvh
}

fn obvhs_tree(leaves: &[LeafTriangle]) -> Bvh2 {
    let triangles: Vec<Triangle> = leaves
        .iter()
        .map(|leaf| Triangle {
            v0: leaf.corners[0].into(),
            v1: leaf.corners[1].into(),
            v2: leaf.corners[2].into(),
        })
        .collect();
    let parameters = BvhBuildParams {
        pre_split: false,
        max_prims_per_leaf: MAX_LEAF_TRIANGLES as u32,
        ..BvhBuildParams::medium_build()
    };
    build_bvh2_from_tris(&triangles, parameters, &mut Duration::default())
}

fn depth(tree: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut open = vec![(0usize, 1usize)];
    while let Some((index, depth)) = open.pop() {
        deepest = deepest.max(depth);
        let node = &tree.nodes[index];
        if node.prim_count == 0 {
            open.push((node.first_index as usize, depth + 1));
            open.push((node.first_index as usize + 1, depth + 1));
        }
    }
    deepest
}

/// Copies an obvhs tree in depth-first order, so that near nodes are near in memory.
fn flatten(tree: &Bvh2, leaves: &[LeafTriangle], bvh: &mut Bvh) {
    let bounds = |aabb: &Aabb| (Vec3::from(aabb.min), Vec3::from(aabb.max));
    let place = |index: usize, bvh: &mut Bvh| {
        let node = &tree.nodes[index];
        let (min, max) = bounds(&node.aabb);
        let first = bvh.leaves.len() as u32;
        for k in 0..node.prim_count {
            let primitive = tree.primitive_indices[(node.first_index + k) as usize];
            bvh.leaves.push(leaves[primitive as usize]);
        }
        Node {
            min,
            first,
            max,
            count: node.prim_count,
        }
    };
    let root = place(0, bvh);
    bvh.nodes.push(root);
    let mut open = vec![(0usize, 0usize)];
    while let Some((from, to)) = open.pop() {
        let source = &tree.nodes[from];
        if source.prim_count > 0 {
            continue;
        }
        let child = source.first_index as usize;
        let first = bvh.nodes.len();
        bvh.nodes[to].first = first as u32;
        for side in 0..2 {
            let node = place(child + side, bvh);
            bvh.nodes.push(node);
        }
        open.push((child + 1, first + 1));
        open.push((child, first));
    }
}

fn node_over(leaves: &[LeafTriangle], order: &[u32], first: u32) -> Node {
    let mut min = Vec3::INFINITY;
    let mut max = Vec3::NEG_INFINITY;
    for &i in order {
        for corner in leaves[i as usize].corners {
            min = min.min(corner);
            max = max.max(corner);
        }
    }
    Node {
        min,
        first,
        max,
        count: order.len() as u32,
    }
}

/// Splits `node` over `order` until leaves are small. Halving bounds the recursion by 32.
fn split_at_median(leaves: &[LeafTriangle], order: &mut [u32], node: usize, bvh: &mut Bvh) {
    if order.len() <= MAX_LEAF_TRIANGLES {
        bvh.nodes[node].first = bvh.leaves.len() as u32;
        bvh.leaves.extend(order.iter().map(|&i| leaves[i as usize]));
        return;
    }
    let size = bvh.nodes[node].max - bvh.nodes[node].min;
    let axis = size.max_position();
    let centre = |i: u32| {
        leaves[i as usize]
            .corners
            .iter()
            .map(|c| c[axis])
            .sum::<f32>()
    };
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |&a, &b| {
        centre(a).total_cmp(&centre(b)).then(a.cmp(&b))
    });
    let (low, high) = order.split_at_mut(middle);
    let first = bvh.nodes.len();
    bvh.nodes.push(node_over(leaves, low, 0));
    bvh.nodes.push(node_over(leaves, high, 0));
    bvh.nodes[node].first = first as u32;
    bvh.nodes[node].count = 0;
    split_at_median(leaves, low, first, bvh);
    split_at_median(leaves, high, first + 1, bvh);
}
