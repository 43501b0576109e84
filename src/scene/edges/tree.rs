//! A tree of boxes over edges.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::edge::Edge;

/// Most edges in a leaf.
const LEAF: usize = 4;

/// Lists of at most so many edges are sorted, longer ones divided at their median.
const SORTED: usize = 64;

/// Rounding of path lengths in metres; boxes are exact.
const SLACK_M: f64 = 1e-9;

#[derive(Debug, Clone, Copy)]
struct Node {
    min: DVec3,
    max: DVec3,
    /// First edge of a leaf in `order`.
    first: u32,
    /// Edges of a leaf, 0 in an inner node.
    count: u32,
    /// Index of the node after this one's subtree.
    next: u32,
}

/// Boxes in depth-first order, each with the index of the next node if its subtree is skipped.
#[derive(Debug, Clone, Default)]
pub(super) struct EdgeTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl EdgeTree {
    pub(super) fn build(edges: &[Edge]) -> Self {
        let ends = |edge: &Edge| [edge.origin, edge.at(edge.length_m)];
        Self::of_ends(&edges.iter().map(ends).collect::<Vec<_>>())
    }

    /// A tree of lines by their ends.
    pub(super) fn of_ends(ends: &[[DVec3; 2]]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            order: (0..ends.len() as u32).collect(),
        };
        if !ends.is_empty() {
            tree.split(ends, 0, ends.len());
        }
        tree
    }

    fn split(&mut self, edges: &[[DVec3; 2]], first: usize, end: usize) {
        let ends = |e: &u32| edges[*e as usize];
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in self.order[first..end].iter().flat_map(ends) {
            (min, max) = (min.min(point), max.max(point));
        }
        let this = self.nodes.len();
        let leaf = end - first <= LEAF;
        self.nodes.push(Node {
            min,
            max,
            first: first as u32,
            count: if leaf { (end - first) as u32 } else { 0 },
            next: 0,
        });
        if !leaf {
            let axis = (max - min).max_position();
            let middle = (first + end) / 2;
            let centre = |e: &u32| ends(e).iter().map(|p| p[axis]).sum::<f64>();
            let by_centre = |a: &u32, b: &u32| centre(a).total_cmp(&centre(b)).then(a.cmp(b));
            let own = &mut self.order[first..end];
            match own.len() > SORTED {
                true => _ = own.select_nth_unstable_by(middle - first, by_centre),
                false => own.sort_unstable_by(by_centre),
            }
            self.split(edges, first, middle);
            self.split(edges, middle, end);
        }
        self.nodes[this].next = self.nodes.len() as u32;
    }

    /// Bounds of all edges.
    pub(super) fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.nodes.first().map(|root| (root.min, root.max))
    }

    /// Rounding of the sum of two distances to boxes, in metres.
    pub(super) fn slack_m(&self) -> f64 {
        SLACK_M
    }

    /// Calls `enter` with the bounds of boxes and, in leaves, their edges; a subtree is skipped if it returns `false`.
    pub(super) fn walk(&self, mut enter: impl FnMut(DVec3, DVec3, &[u32]) -> bool) {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let first = node.first as usize;
            let leaf = &self.order[first..first + node.count as usize];
            let inside = enter(node.min, node.max, leaf);
            at = if inside { at + 1 } else { node.next as usize };
        }
    }

    /// Calls `enter` with the distances of boxes and, of leaves, their edges, nearest box first, until it returns `false`.
    /// `distance_m` gives a box's distance, not below zero.
    pub(super) fn walk_nearest(
        &self,
        distance_m: impl Fn(DVec3, DVec3) -> f64,
        mut enter: impl FnMut(f64, &[u32]) -> bool,
    ) {
        // Bits of positive numbers sort as the numbers do.
        let rank = |at: u32| {
            let node = &self.nodes[at as usize];
            Reverse((distance_m(node.min, node.max).to_bits(), at))
        };
        let mut pending = BinaryHeap::new();
        if !self.nodes.is_empty() {
            pending.push(rank(0));
        }
        while let Some(Reverse((bits, at))) = pending.pop() {
            let node = &self.nodes[at as usize];
            let first = node.first as usize;
            let leaf = &self.order[first..first + node.count as usize];
            if !enter(f64::from_bits(bits), leaf) {
                return;
            }
            if leaf.is_empty() {
                pending.push(rank(at + 1));
                pending.push(rank(self.nodes[at as usize + 1].next));
            }
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.order.as_slice())
    }
}
