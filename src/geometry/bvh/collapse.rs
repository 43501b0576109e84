//! Collapse of a binary tree into a wide one of minimal expected cost per ray.
//!
//! Control side; deterministic. Source: \[YLITIE17\], adapted: dynamic programming over the surface area heuristic in `f64`;
//! a leaf is one block of four triangles.

use obvhs::bvh2::Bvh2;

use super::node::Node;
use crate::geometry::aabb::Aabb;

/// Largest number of triangles in a leaf: the lanes of a block.
pub(super) const LEAF_TRIANGLES: u32 = 4;

/// Cost of a block of triangles relative to a visit of a node. From 1 to 2.5, instructions per ray in the hall change by
/// less than 1 %.
const BLOCK_COST: f64 = 1.0;

/// Marks a link to a leaf while nodes are still being added.
const LEAF: u32 = 1 << 31;

/// A wide tree: nodes in depth-first order, leaves as lists of triangles.
pub(super) struct Collapsed<const W: usize> {
    pub(super) nodes: Vec<Node<W>>,
    pub(super) leaves: Vec<Vec<u32>>,
    /// Stack entries that a traversal may need.
    pub(super) stack: usize,
}

/// The aim of a collapse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Choice {
    /// Minimal expected cost.
    Cheapest,
    /// As many levels of the binary tree per node as possible: minimal depth.
    Shallowest,
}

/// Costs of a subtree as at most 1, 2, … `W` children of one node, and the decisions that reach them.
#[derive(Clone, Copy)]
struct Choices<const W: usize> {
    cost: [f64; W],
    /// Children of the left side; 0 where fewer children cost no more. For one child: 0 for a leaf, 1 for a node.
    left: [u8; W],
    /// [`Self::left`] for the children of the subtree's own node.
    own_left: u8,
    count: u32,
}

pub(super) fn collapse<const W: usize>(tree: &Bvh2, choice: Choice, slack: f32) -> Collapsed<W> {
    let choices = choose::<W>(tree, choice);
    let mut wide = Collapsed {
        nodes: vec![Node::EMPTY],
        leaves: Vec::new(),
        stack: 0,
    };
    // The root is always a node.
    let mut open = vec![(0usize, 0usize, 0usize)];
    let mut children = Vec::with_capacity(W);
    while let Some((from, to, above)) = open.pop() {
        children.clear();
        children_of(tree, &choices, from, &mut children);
        // Traversal for any hit visits the first lane first: small boxes are dense, a hit in them is likely.
        children.sort_by(|&a, &b| half_area(tree, a).total_cmp(&half_area(tree, b)));
        let pending = above + children.len() - 1;
        // Traversal for any hit pushes an entry at every node.
        wide.stack = wide.stack.max(pending.max(above + 1));
        for (lane, &child) in children.iter().enumerate() {
            let bounds = bounds_of(tree, child);
            let link = if choices[child].left[0] == 0 {
                wide.leaves.push(triangles_below(tree, child));
                LEAF | (wide.leaves.len() - 1) as u32
            } else {
                wide.nodes.push(Node::EMPTY);
                open.push((child, wide.nodes.len() - 1, pending));
                (wide.nodes.len() - 1) as u32
            };
            wide.nodes[to].set(lane, &bounds, slack, link);
        }
    }
    let count = wide.nodes.len() as u32;
    for link in wide.nodes.iter_mut().flat_map(|node| &mut node.links) {
        if *link & LEAF != 0 {
            *link = (*link ^ LEAF) + count;
        }
    }
    wide
}

fn bounds_of(tree: &Bvh2, node: usize) -> Aabb {
    let aabb = tree.nodes[node].aabb();
    Aabb {
        min: aabb.min.into(),
        max: aabb.max.into(),
    }
}

fn half_area(tree: &Bvh2, node: usize) -> f64 {
    bounds_of(tree, node).half_area()
}

/// The choices of every node, from the leaves up.
fn choose<const W: usize>(tree: &Bvh2, choice: Choice) -> Vec<Choices<W>> {
    let mut order = Vec::with_capacity(tree.nodes.len());
    let mut open = vec![0usize];
    while let Some(index) = open.pop() {
        order.push(index);
        let node = &tree.nodes[index];
        if node.prim_count == 0 {
            open.extend([node.first_index as usize, node.first_index as usize + 1]);
        }
    }
    let nothing = Choices {
        cost: [f64::INFINITY; W],
        left: [0; W],
        own_left: 0,
        count: 0,
    };
    let mut choices = vec![nothing; tree.nodes.len()];
    for &index in order.iter().rev() {
        let node = &tree.nodes[index];
        let area = half_area(tree, index);
        choices[index] = if node.prim_count > 0 {
            Choices {
                cost: [area * BLOCK_COST; W],
                count: node.prim_count,
                ..nothing
            }
        } else {
            let first = node.first_index as usize;
            let (left, right) = (&choices[first], &choices[first + 1]);
            match choice {
                Choice::Cheapest => inner(area, left, right),
                Choice::Shallowest => by_levels(left, right),
            }
        };
    }
    choices
}

fn inner<const W: usize>(area: f64, left: &Choices<W>, right: &Choices<W>) -> Choices<W> {
    // Cheapest division of `n` children between two sides, at least one each.
    let spread = |n: usize| {
        let mut best = (f64::INFINITY, 0u8);
        for to_left in 1..n {
            let cost = left.cost[to_left - 1] + right.cost[n - to_left - 1];
            if cost < best.0 {
                best = (cost, to_left as u8);
            }
        }
        best
    };
    let count = left.count + right.count;
    let (own_cost, own_left) = spread(W);
    let as_node = area + own_cost;
    let as_leaf = if count <= LEAF_TRIANGLES {
        area * BLOCK_COST
    } else {
        f64::INFINITY
    };
    let mut choice = Choices {
        cost: [as_node.min(as_leaf); W],
        left: [0; W],
        own_left,
        count,
    };
    choice.left[0] = u8::from(as_node < as_leaf);
    for n in 2..=W {
        let (cost, to_left) = spread(n);
        if cost < choice.cost[n - 2] {
            choice.cost[n - 1] = cost;
            choice.left[n - 1] = to_left;
        } else {
            choice.cost[n - 1] = choice.cost[n - 2];
        }
    }
    choice
}

/// Equal division between two sides, down to the size of a leaf.
fn by_levels<const W: usize>(left: &Choices<W>, right: &Choices<W>) -> Choices<W> {
    let count = left.count + right.count;
    let half = |n: usize| match n {
        1 => 1,
        n if n.is_power_of_two() => (n / 2) as u8,
        _ => 0,
    };
    Choices {
        cost: [0.0; W],
        left: std::array::from_fn(|i| {
            if count > LEAF_TRIANGLES {
                half(i + 1)
            } else {
                0
            }
        }),
        own_left: half(W),
        count,
    }
}

/// Binary nodes that become the children of the wide node over `node`.
fn children_of<const W: usize>(
    tree: &Bvh2,
    choices: &[Choices<W>],
    node: usize,
    children: &mut Vec<usize>,
) {
    if tree.nodes[node].prim_count > 0 {
        children.push(node);
        return;
    }
    let first = tree.nodes[node].first_index as usize;
    let to_left = usize::from(choices[node].own_left);
    let mut open = vec![(first + 1, W - to_left), (first, to_left)];
    while let Some((index, budget)) = open.pop() {
        let choice = &choices[index];
        // A choice of 0 means fewer children.
        let spent = (2..=budget).rev().find(|&n| choice.left[n - 1] > 0);
        match spent {
            Some(n) => {
                let first = tree.nodes[index].first_index as usize;
                let to_left = usize::from(choice.left[n - 1]);
                open.push((first + 1, n - to_left));
                open.push((first, to_left));
            }
            None => children.push(index),
        }
    }
}

fn triangles_below(tree: &Bvh2, node: usize) -> Vec<u32> {
    let mut triangles = Vec::with_capacity(LEAF_TRIANGLES as usize);
    let mut open = vec![node];
    while let Some(index) = open.pop() {
        let node = &tree.nodes[index];
        if node.prim_count > 0 {
            triangles.push(node.first_index);
        } else {
            open.extend([node.first_index as usize, node.first_index as usize + 1]);
        }
    }
    triangles.sort_unstable();
    triangles
}
