//! The binary tree: binned splits by the surface area heuristic, then reinsertion.
//!
//! Control side; deterministic. Splits: \[WALD07\], adapted: down to one triangle per leaf, since the collapse forms the
//! leaves. Reinsertion: that of obvhs, after \[MEISTER22\].

use std::collections::VecDeque;

use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;

use crate::geometry::aabb::Aabb;

/// Bins per axis.
const BINS: usize = 32;

/// Smallest stack of the reinsertion of obvhs, which needs one entry more than the tree has levels.
const REINSERTION_STACK: usize = 190;

/// Passes of reinsertion: pass `n` treats the largest 1 / (2 n + 1) of all nodes (the sequence of obvhs).
const REINSERTION_PASSES: u16 = 16;

/// Largest estimated number of overlapping pairs of boxes for reinsertion; beyond it the tree stays as it was split.
/// Reinsertion visits for each node the nodes that its box overlaps. Where most overlap, the work is quadratic (measured:
/// 3.5 ns per pair, 12 s for sixty thousand triangles with a common corner). Two million triangles of a scene like the
/// procedural ones, where a box overlaps two dozen others, have a quarter of this.
const MOST_OVERLAPS: f64 = 4e8;

/// A binary tree over at least one box, one per leaf; `first_index` of a leaf is the index of its box.
pub(super) fn binary_tree(boxes: &[Aabb]) -> Bvh2 {
    let mut tree = split(boxes);
    if overlaps(&tree) > MOST_OVERLAPS {
        return tree;
    }
    for pass in 0..REINSERTION_PASSES {
        if depth(&tree) >= REINSERTION_STACK {
            break;
        }
        let ratio = 1.0 / f32::from(2 * pass + 1);
        ReinsertionOptimizer::default().run(&mut tree, 1.0, Some(vec![ratio]));
    }
    tree
}

/// A tree split at medians: slower to traverse, of logarithmic depth.
pub(super) fn balanced_tree(boxes: &[Aabb]) -> Bvh2 {
    grow(boxes, |boxes, items| {
        let axis = centres(boxes, items).size().max_position();
        let middle = items.len() / 2;
        let centre = |i: u32| boxes[i as usize].centre()[axis];
        items.select_nth_unstable_by(middle, |&a, &b| {
            centre(a).total_cmp(&centre(b)).then(a.cmp(&b))
        });
        middle
    })
}

fn split(boxes: &[Aabb]) -> Bvh2 {
    grow(boxes, |boxes, items| {
        best_split(boxes, items).unwrap_or(items.len() / 2)
    })
}

/// Grows a tree breadth first: large nodes come first, which improves reinsertion. `cut` orders the items of a node and
/// returns the number on the left, at least one and not all.
fn grow(boxes: &[Aabb], cut: impl Fn(&[Aabb], &mut [u32]) -> usize) -> Bvh2 {
    let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = Vec::with_capacity(2 * boxes.len());
    nodes.push(Bvh2Node::default());
    let mut open = VecDeque::from([(0usize, 0..items.len())]);
    while let Some((node, range)) = open.pop_front() {
        let bounds = bounds_of(boxes, &items[range.clone()]);
        let aabb = obvhs::aabb::Aabb::new(bounds.min.into(), bounds.max.into());
        if range.len() == 1 {
            nodes[node] = Bvh2Node::new(aabb, 1, items[range.start]);
            continue;
        }
        let middle = range.start + cut(boxes, &mut items[range.clone()]);
        let first = nodes.len();
        nodes[node] = Bvh2Node::new(aabb, 0, first as u32);
        nodes.extend([Bvh2Node::default(); 2]);
        open.push_back((first, range.start..middle));
        open.push_back((first + 1, middle..range.end));
    }
    Bvh2 {
        nodes,
        primitive_indices: (0..boxes.len() as u32).collect(),
        children_are_ordered_after_parents: true,
        ..Bvh2::default()
    }
}

fn bounds_of(boxes: &[Aabb], items: &[u32]) -> Aabb {
    items
        .iter()
        .fold(Aabb::EMPTY, |sum, &i| sum.union(&boxes[i as usize]))
}

fn centres(boxes: &[Aabb], items: &[u32]) -> Aabb {
    items.iter().fold(Aabb::EMPTY, |sum, &i| {
        sum.with_point(boxes[i as usize].centre())
    })
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: usize,
}

const EMPTY_BIN: Bin = Bin {
    bounds: Aabb::EMPTY,
    count: 0,
};

/// Splits where area times count is minimal; none if all centres are equal.
fn best_split(boxes: &[Aabb], items: &mut [u32]) -> Option<usize> {
    let centres = centres(boxes, items);
    let size = centres.size();
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in 0..3 {
        if size[axis] <= 0.0 {
            continue;
        }
        let mut bins = [EMPTY_BIN; BINS];
        for &item in items.iter() {
            let bounds = &boxes[item as usize];
            let bin = &mut bins[bin_of(bounds, &centres, axis)];
            bin.bounds = bin.bounds.union(bounds);
            bin.count += 1;
        }
        let mut right_costs = [0.0; BINS];
        let mut right = EMPTY_BIN;
        for i in (1..BINS).rev() {
            right = joined(&right, &bins[i]);
            right_costs[i] = cost(&right);
        }
        let mut left = EMPTY_BIN;
        for i in 1..BINS {
            left = joined(&left, &bins[i - 1]);
            if left.count == 0 || left.count == items.len() {
                continue;
            }
            let total = cost(&left) + right_costs[i];
            if best.is_none_or(|(least, ..)| total < least) {
                best = Some((total, axis, i));
            }
        }
    }
    let (_, axis, cut) = best?;
    let is_left = |item: u32| bin_of(&boxes[item as usize], &centres, axis) < cut;
    // Stable: the tree depends only on the boxes.
    items.sort_by_key(|&item| !is_left(item));
    Some(items.partition_point(|&item| is_left(item)))
}

fn joined(a: &Bin, b: &Bin) -> Bin {
    Bin {
        bounds: a.bounds.union(&b.bounds),
        count: a.count + b.count,
    }
}

fn cost(bin: &Bin) -> f64 {
    bin.bounds.half_area() * bin.count as f64
}

fn bin_of(bounds: &Aabb, centres: &Aabb, axis: usize) -> usize {
    let share = (bounds.centre()[axis] - centres.min[axis]) / centres.size()[axis];
    ((share * BINS as f32) as usize).min(BINS - 1)
}

/// Estimated number of overlapping pairs of nodes: each box overlaps as many as a line through the scene intersects.
fn overlaps(tree: &Bvh2) -> f64 {
    tree.nodes.len() as f64 * crossed(tree)
}

/// Estimated number of boxes that a line through the scene intersects (the surface area heuristic).
pub(super) fn crossed(tree: &Bvh2) -> f64 {
    let area = |node: &Bvh2Node| f64::from(node.aabb().half_area());
    let whole = area(&tree.nodes[0]).max(f64::MIN_POSITIVE);
    let sum: f64 = tree.nodes.iter().map(area).sum();
    sum / whole
}

/// Number of levels.
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

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::procedural;

    #[test]
    fn reinsertion_skips_fans_and_improves_scenes() {
        // A fan: all boxes have a common corner.
        let fan: Vec<Aabb> = (0..24_000u16)
            .map(|n| Aabb {
                min: Vec3::ZERO,
                max: Vec3::new(f32::from(n % 100), 0.0, f32::from(n / 100)),
            })
            .collect();
        assert!(overlaps(&split(&fan)) > MOST_OVERLAPS);
        let tree = binary_tree(&fan);
        assert!(tree.children_are_ordered_after_parents, "was reinserted");
        let mut seen: Vec<u32> = tree
            .nodes
            .iter()
            .filter(|node| node.is_leaf())
            .map(|node| node.first_index)
            .collect();
        seen.sort_unstable();
        assert!(seen.into_iter().eq(0..24_000));
        for name in procedural::NAMES {
            let mesh = procedural::by_name(name).expect("a scene").mesh;
            let boxes: Vec<Aabb> = mesh
                .triangles
                .iter()
                .map(|triangle| {
                    let corners = triangle.map(|v| mesh.vertices[v as usize]);
                    Aabb::of_triangle(corners, 0.0)
                })
                .collect();
            let overlaps = overlaps(&split(&boxes)) / boxes.len() as f64;
            assert!(
                overlaps < MOST_OVERLAPS / 2e6,
                "{name}: {overlaps} per triangle"
            );
        }
    }
}
