//! A tree over moving boxes, rebuilt after every move.
//!
//! Nodes have eight children. Building takes n log n steps and does not allocate within the reserved size; traversal neither
//! allocates nor blocks. Own. The result is independent of the tree's shape, except for rays that graze a box within
//! rounding.

use glam::Vec3;

use super::aabb::Aabb;
use super::bvh::node::Node;
use super::intersect::{LaneMask, SlabRay};
#[cfg(target_arch = "x86_64")]
use super::intersect::{
    RawRay, RayRange,
    x86::{RayVectors, SlabRay8},
};
use super::ray::Ray;
use super::stack::{Stack, StackStorage};
#[cfg(target_arch = "x86_64")]
use crate::simd::x86::{Avx2, enter_avx2};

/// Children of a node.
const WIDTH: usize = 8;

/// Marks a link to a box.
const LEAF: u32 = 1 << 31;

/// Capacity of the traversal stack: 2³¹ boxes are eleven levels deep, and each level leaves seven nodes.
const STACK: usize = 80;

/// Smallest size of a direction component for boxes: keeps products with infinite planes from being NaN.
const SMALLEST_COMPONENT: f32 = 1e-30;

/// Largest coordinate of an origin for AVX2, which multiplies before it subtracts, in metres. For an origin o and a plane p
/// its error is 2⁻²⁴ (3 |o| + 2 |p|), 2.3e-5 m from o, besides the rounding of p itself.
#[cfg(target_arch = "x86_64")]
const REACH_M: f32 = 128.0;

/// Index of the caller of kernels ([`super::intersect::x86`]).
#[cfg(target_arch = "x86_64")]
const AABB_TREE: u8 = 2;

/// A ray against boxes, with plain rounding: callers enlarge boxes by what matters to them, at least 5e-5 m.
fn slabs(ray: &Ray) -> SlabRay {
    let d = ray.direction;
    let size = d.abs().max(Vec3::splat(SMALLEST_COMPONENT));
    SlabRay {
        origin: ray.origin.to_array(),
        inverse: (Vec3::ONE / size.copysign(d)).to_array(),
    }
}

/// The boxes of a node that the ray enters between 0 and `t_max`, one bit each.
#[inline(always)]
fn entered(slabs: &SlabRay, node: &Node<WIDTH>, t_max: f32) -> u32 {
    let [near, far] = slabs.spans(&node.planes, 0.0, t_max);
    LaneMask::of_spans(&near, &far).0
}

/// A tree over axis-aligned boxes.
///
/// ```
/// use foresound::geometry::{Aabb, AabbTree, Ray};
/// use glam::Vec3;
///
/// let unit = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
/// let mut tree = AabbTree::default();
/// tree.build(&[unit]);
/// assert!(tree.is_entered(&Ray::new(Vec3::splat(0.5) + 3.0 * Vec3::Z, -Vec3::Z)));
/// ```
#[derive(Debug, Clone, Default)]
pub struct AabbTree {
    nodes: Vec<Node<WIDTH>>,
    /// Indices of the boxes, during construction.
    order: Vec<u32>,
}

impl AabbTree {
    /// Reserves memory for `count` boxes: [`Self::build`] then does not allocate.
    pub fn reserve(&mut self, count: usize) {
        self.order.reserve(count.saturating_sub(self.order.len()));
        // Every node but a single root has at least two boxes below it.
        self.nodes
            .reserve((count + 1).saturating_sub(self.nodes.len()));
    }

    /// Rebuilds the tree over boxes; empty ones are left out. Allocates only beyond the reserved size.
    pub fn build(&mut self, boxes: &[Aabb]) {
        self.nodes.clear();
        self.order.clear();
        let occupied = (0..boxes.len() as u32).filter(|&n| !boxes[n as usize].is_empty());
        self.order.extend(occupied);
        if !self.order.is_empty() {
            self.node(boxes, 0, self.order.len());
        }
    }

    /// Adds the node over a range of the order and all nodes below it; returns its box.
    fn node(&mut self, boxes: &[Aabb], first: usize, end: usize) -> Aabb {
        let this = self.nodes.len();
        self.nodes.push(Node::EMPTY);
        let mut ends = [first; WIDTH + 1];
        ends[1] = end;
        let mut groups = 1;
        while groups < WIDTH {
            let split: [usize; WIDTH + 1] = std::array::from_fn(|i| {
                let (a, b) = (ends[(i / 2).min(groups)], ends[(i / 2 + 1).min(groups)]);
                if i % 2 == 0 {
                    a
                } else {
                    a + (b - a).div_ceil(2)
                }
            });
            for group in 0..groups {
                let (from, middle, to) = (ends[group], split[2 * group + 1], ends[group + 1]);
                if middle > from && middle < to {
                    self.halve(boxes, from, middle, to);
                }
            }
            groups *= 2;
            ends = split;
            ends[groups] = end;
        }
        let mut all = Aabb::EMPTY;
        for lane in 0..WIDTH {
            let (from, to) = (ends[lane], ends[lane + 1]);
            let (bounds, link) = match to - from {
                0 => continue,
                1 => {
                    let index = self.order[from];
                    (boxes[index as usize], index | LEAF)
                }
                _ => {
                    let link = self.nodes.len() as u32;
                    (self.node(boxes, from, to), link)
                }
            };
            self.nodes[this].set(lane, &bounds, 0.0, link);
            all = all.union(&bounds);
        }
        all
    }

    /// Partitions a range of the order at its middle, along the axis of the largest spread of centres.
    fn halve(&mut self, boxes: &[Aabb], first: usize, middle: usize, end: usize) {
        let centre = |&n: &u32| boxes[n as usize].min + boxes[n as usize].max;
        let part = &mut self.order[first..end];
        let points = part.iter().map(centre);
        let spread = points.fold(Aabb::EMPTY, |all, point| all.with_point(point));
        let axis = spread.size().max_position();
        part.select_nth_unstable_by(middle - first, |a, b| {
            centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(b))
        });
    }

    /// Calls `visit` with the index of every box that a ray enters before a parameter: `ray.t_max` first, then the last
    /// result of `visit`; a negative one ends the traversal. The order is unspecified. For an invalid ray any box may be
    /// visited; for boxes that a ray only grazes, instruction sets differ.
    #[inline]
    pub fn traverse(&self, ray: &Ray, visit: impl FnMut(u32, f32) -> f32) {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = Avx2::detect() {
            return enter_avx2!(avx2 => traverse_avx2(self, ray, visit));
        }
        self.traverse_scalar(ray, visit);
    }

    /// Whether a ray enters any box before `ray.t_max`, the same on every machine.
    pub fn is_entered(&self, ray: &Ray) -> bool {
        let mut is_entered = false;
        self.traverse_scalar(ray, |_, _| {
            is_entered = true;
            -1.0
        });
        is_entered
    }

    #[inline(always)]
    fn traverse_scalar(&self, ray: &Ray, visit: impl FnMut(u32, f32) -> f32) {
        let slabs = slabs(ray);
        self.traverse_nodes(ray.t_max, |node, t_max| entered(&slabs, node, t_max), visit);
    }

    /// `enter` gives the boxes of a node that the ray enters before a parameter, one bit each.
    #[inline(always)]
    fn traverse_nodes(
        &self,
        mut t_max: f32,
        enter: impl Fn(&Node<WIDTH>, f32) -> u32,
        mut visit: impl FnMut(u32, f32) -> f32,
    ) {
        let mut storage = StackStorage::<u32, STACK>::new();
        let mut stack = Stack::new(&mut storage);
        let mut at = 0;
        while let Some(node) = self.nodes.get(at as usize) {
            let mut entered = enter(node, t_max);
            while entered != 0 {
                let link = node.links[entered.trailing_zeros() as usize % WIDTH];
                entered &= entered - 1;
                if link & LEAF != 0 {
                    t_max = visit(link ^ LEAF, t_max);
                    if t_max < 0.0 {
                        return;
                    }
                } else {
                    stack.push_if(link, true);
                }
            }
            let Some(next) = stack.pop() else {
                return;
            };
            at = next;
        }
    }

    /// Memory of the tree, in bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.order.as_slice())
    }
}

/// Traversal with AVX2, for rays from within [`REACH_M`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
#[inline]
fn traverse_avx2(tree: &AabbTree, ray: &Ray, visit: impl FnMut(u32, f32) -> f32) {
    let raw = RawRay {
        origin: ray.origin.as_ref(),
        direction: ray.direction.as_ref(),
        t_min: 0.0,
        margin: 0.0,
    };
    let Some(vectors) = RayVectors::new::<AABB_TREE>(raw, RayRange { reach: REACH_M }) else {
        return tree.traverse_scalar(ray, visit);
    };
    let slabs = SlabRay8::new::<AABB_TREE>(&vectors);
    tree.traverse_nodes(
        ray.t_max,
        |node, t_max| slabs.entered::<AABB_TREE>(&node.planes, t_max),
        visit,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number in [0, 1) from a counter.
    fn draw(seed: &mut u64) -> f32 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (*seed >> 40) as f32 / (1u64 << 24) as f32
    }

    fn enters(slabs: &SlabRay, bounds: &Aabb, t_max: f32) -> bool {
        let mut node = Node::EMPTY;
        node.set(0, bounds, 0.0, 0);
        entered(slabs, &node, t_max) != 0
    }

    #[test]
    fn traversal_visits_every_box_that_the_ray_enters() {
        let mut seed = 7;
        let mut tree = AabbTree::default();
        for count in [0, 1, 2, 7, 8, 9, 17, 64, 65, 300] {
            let mut point = || Vec3::from_array([(); 3].map(|()| 20.0 * draw(&mut seed)));
            let boxes: Vec<Aabb> = (0..count)
                .map(|n| {
                    let low = point();
                    let high = low + 0.1 * point();
                    // Every fifth is empty.
                    if n % 5 == 4 {
                        Aabb::EMPTY
                    } else {
                        Aabb {
                            min: low,
                            max: high,
                        }
                    }
                })
                .collect();
            tree.build(&boxes);
            for _ in 0..100 {
                let ray = Ray::between(point(), point());
                let mut visited = vec![false; boxes.len()];
                tree.traverse(&ray, |number, t_max| {
                    assert!(!visited[number as usize], "visited twice");
                    visited[number as usize] = true;
                    t_max
                });
                for (number, bounds) in boxes.iter().enumerate() {
                    let steps = (0..=2000).map(|i| ray.at(i as f32 / 2000.0));
                    let mut inside = steps.filter(|p| *p == p.clamp(bounds.min, bounds.max));
                    let enters = !bounds.is_empty() && inside.next().is_some();
                    assert!(visited[number] || !enters, "{count} boxes, box {number}");
                    assert!(!visited[number] || !bounds.is_empty());
                }
            }
        }
    }

    #[test]
    fn a_negative_result_ends_the_traversal() {
        let one = Aabb {
            min: -Vec3::ONE,
            max: Vec3::ONE,
        };
        let mut tree = AabbTree::default();
        tree.build(&[one; 100]);
        let mut visits = 0;
        tree.traverse(&Ray::new(Vec3::Z * 5.0, -Vec3::Z), |_, _| {
            visits += 1;
            -1.0
        });
        assert_eq!(visits, 1);
        tree.traverse(&Ray::new(Vec3::Z * 5.0, Vec3::Z), |_, _| {
            unreachable!("behind it")
        });
        assert!(tree.is_entered(&Ray::new(Vec3::Z * 5.0, -Vec3::Z)));
        assert!(!tree.is_entered(&Ray::new(Vec3::Z * 5.0, Vec3::Z)));
    }

    /// Kernels miss no box that scalar arithmetic enters, if boxes are larger than their contents.
    #[test]
    fn kernels_miss_no_box() {
        let mut seed = 11;
        let mut tree = AabbTree::default();
        let mut point =
            |size: f32| size * (Vec3::from_array([(); 3].map(|()| draw(&mut seed))) - 0.5);
        let inner: Vec<Aabb> = (0..200)
            .map(|_| {
                let (low, size) = (point(60.0), point(2.0).abs());
                let high = low + size;
                Aabb {
                    min: low,
                    max: high,
                }
            })
            .collect();
        let boxes: Vec<Aabb> = inner
            .iter()
            .map(|inner| Aabb {
                min: inner.min - 1e-4,
                max: inner.max + 1e-4,
            })
            .collect();
        tree.build(&boxes);
        let mut visits = 0;
        for n in 0..2000 {
            // Also from beyond the range of the kernels, and along an axis.
            let origin = point(if n % 10 == 0 { 400.0 } else { 200.0 });
            let towards = inner[n % inner.len()];
            let mut goal = 0.5 * (towards.min + towards.max);
            if n % 7 == 0 {
                goal.y = origin.y;
            }
            let ray = Ray::between(origin, goal + (goal - origin));
            let mut visited = vec![false; boxes.len()];
            tree.traverse(&ray, |number, t_max| {
                visited[number as usize] = true;
                t_max
            });
            let slabs = slabs(&ray);
            for (inner, visited) in inner.iter().zip(&visited) {
                assert!(*visited || !enters(&slabs, inner, ray.t_max), "ray {n}");
            }
            visits += visited.iter().filter(|visited| **visited).count();
        }
        assert!(visits > 1500, "{visits}");
    }
}
