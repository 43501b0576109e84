//! The binary tree: binned splits by the surface area heuristic, then reinsertion.
//!
//! Control side; deterministic. Splits: \[WALD07\], adapted: down to one triangle a leaf, since the collapse that follows
//! decides what a leaf is. Reinsertion: obvhs's, after \[MEISTER22\].

use std::collections::VecDeque;

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;

use super::bounds::Bounds;

/// Bins an axis.
const BINS: usize = 32;

/// obvhs's reinsertion keeps a stack of at least this many entries, and needs one more than the tree is deep.
const REINSERTION_STACK: usize = 190;

/// Passes of reinsertion: pass `n` looks at the largest 1 / (2 n + 1) of all nodes (obvhs's own sequence).
const REINSERTION_PASSES: u16 = 16;

/// Reinsertion looks for a better place for each node among those that its box meets. Where boxes pile up those are nearly
/// all, and its work is the square of their count (measured: 3.5 ns a meeting, so 12 s for sixty thousand triangles that
/// share a corner). Beyond so many meetings the tree stays as it was split; two million triangles of a scene like the
/// procedural ones, whose boxes meet two dozen others, have a quarter of that.
const MOST_MEETINGS: f64 = 4e8;

/// A binary tree over boxes, one a leaf, every leaf's `first_index` the number of its box. At least one box.
pub(super) fn binary_tree(boxes: &[Bounds]) -> Bvh2 {
    let mut tree = split(boxes);
    if meetings(&tree) > MOST_MEETINGS {
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

/// Halves at the median instead: worse, but never deeper than the logarithm of the count.
pub(super) fn balanced_tree(boxes: &[Bounds]) -> Bvh2 {
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

fn split(boxes: &[Bounds]) -> Bvh2 {
    grow(boxes, |boxes, items| {
        best_split(boxes, items).unwrap_or(items.len() / 2)
    })
}

/// Grows a tree breadth first, so that large nodes come first, as reinsertion likes them. `cut` orders the items of a
/// node and says how many go left, at least one and not all.
fn grow(boxes: &[Bounds], cut: impl Fn(&[Bounds], &mut [u32]) -> usize) -> Bvh2 {
    let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = Vec::with_capacity(2 * boxes.len());
    nodes.push(Bvh2Node::default());
    let mut open = VecDeque::from([(0usize, 0..items.len())]);
    while let Some((node, range)) = open.pop_front() {
        let bounds = bounds_of(boxes, &items[range.clone()]);
        let aabb = Aabb::new(bounds.min.into(), bounds.max.into());
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

fn bounds_of(boxes: &[Bounds], items: &[u32]) -> Bounds {
    items
        .iter()
        .fold(Bounds::EMPTY, |sum, &i| sum.union(&boxes[i as usize]))
}

fn centres(boxes: &[Bounds], items: &[u32]) -> Bounds {
    items.iter().fold(Bounds::EMPTY, |sum, &i| {
        sum.with_point(boxes[i as usize].centre())
    })
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: usize,
}

const EMPTY_BIN: Bin = Bin {
    bounds: Bounds::EMPTY,
    count: 0,
};

/// Splits where area times count is least; nothing if all centres are one.
fn best_split(boxes: &[Bounds], items: &mut [u32]) -> Option<usize> {
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
    // Stable, so that the tree depends on nothing but the boxes.
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

fn bin_of(bounds: &Bounds, centres: &Bounds, axis: usize) -> usize {
    let share = (bounds.centre()[axis] - centres.min[axis]) / centres.size()[axis];
    ((share * BINS as f32) as usize).min(BINS - 1)
}

/// How many nodes meet the box of one, about, summed over all: as many as a line through the whole would meet, each.
fn meetings(tree: &Bvh2) -> f64 {
    let area = |node: &Bvh2Node| f64::from(node.aabb().half_area());
    let whole = area(&tree.nodes[0]).max(f64::MIN_POSITIVE);
    let met: f64 = tree.nodes.iter().map(area).sum();
    tree.nodes.len() as f64 * (met / whole)
}

/// Levels of a binary tree.
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
    fn piles_stay_as_split_and_scenes_are_improved() {
        // A fan: every box has one corner in common with all others.
        let fan: Vec<Bounds> = (0..24_000u16)
            .map(|n| Bounds {
                min: Vec3::ZERO,
                max: Vec3::new(f32::from(n % 100), 0.0, f32::from(n / 100)),
            })
            .collect();
        assert!(meetings(&split(&fan)) > MOST_MEETINGS);
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
            let boxes: Vec<Bounds> = mesh
                .triangles
                .iter()
                .map(|triangle| {
                    let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
                    Bounds {
                        min: a.min(b).min(c),
                        max: a.max(b).max(c),
                    }
                })
                .collect();
            let meetings = meetings(&split(&boxes)) / boxes.len() as f64;
            assert!(
                meetings < MOST_MEETINGS / 2e6,
                "{name}: {meetings} a triangle"
            );
        }
    }
}
