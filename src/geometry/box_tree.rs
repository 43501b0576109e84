//! A tree over boxes that move: built anew whenever they do.
//!
//! Eight boxes a node, told apart in lanes. Building takes n log n steps and, once there was room for as many boxes,
//! allocates nothing; walking neither allocates nor blocks. Own; what it finds does not depend on its shape, but for
//! rays that graze a box within rounding.

use glam::Vec3;

use super::ray::Ray;
use crate::simd::stack::{Places, Stack};
use crate::simd::tracing::Planes;
#[cfg(target_arch = "x86_64")]
use crate::simd::{
    tracing::{Near, RawRay},
    x86::{Avx2, Ready, Slabs8, enter_avx2},
};

/// Children of a node.
const WIDTH: usize = 8;

/// Bit of a link to a box.
const LEAF: u32 = 1 << 31;

/// Nodes that a walk can have before it: 2³¹ boxes are eleven levels deep, and each leaves seven behind.
const STACK: usize = 80;

/// Smallest component that a direction has for boxes, so that no plane is crossed at a number that is none.
const SMALLEST_COMPONENT: f32 = 1e-30;

/// How far from the origin a ray may start for lanes that multiply before they subtract, in metres. They miss a plane by
/// 2⁻²⁴ (3 |o| + 2 |p|) there, 2.3e-5 m for the start o, beside what the plane p itself is rounded by.
#[cfg(target_arch = "x86_64")]
const REACH_M: f32 = 128.0;

/// Caller of kernels, which are compiled for each of them.
#[cfg(target_arch = "x86_64")]
const BOX_TREE: u8 = 4;

/// A ray against boxes: planes are crossed at `(plane − origin) · inverse`. Plain rounding: whoever gives boxes makes
/// them as much larger as it matters, and by 5e-5 m at least.
struct Slabs {
    origin: Vec3,
    inverse: Vec3,
}

impl Slabs {
    #[inline(always)]
    fn of(ray: &Ray) -> Self {
        let d = ray.direction;
        let size = d.abs().max(Vec3::splat(SMALLEST_COMPONENT));
        Self {
            origin: ray.origin,
            inverse: Vec3::ONE / size.copysign(d),
        }
    }

    /// Whether the ray is in a box somewhere between 0 and `t_max`.
    #[inline(always)]
    fn enters(&self, bounds: &Bounds, t_max: f32) -> bool {
        let a = (bounds.low - self.origin) * self.inverse;
        let b = (bounds.high - self.origin) * self.inverse;
        let near = a.min(b).max_element().max(0.0);
        let far = a.max(b).min_element().min(t_max);
        near <= far
    }
}

#[derive(Debug, Clone)]
struct Node {
    planes: Planes<WIDTH>,
    links: [u32; WIDTH],
}

impl Node {
    const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        links: [LEAF; WIDTH],
    };

    fn set(&mut self, lane: usize, bounds: &Bounds, link: u32) {
        for axis in 0..3 {
            self.planes[2 * axis][lane] = bounds.low[axis];
            self.planes[2 * axis + 1][lane] = bounds.high[axis];
        }
        self.links[lane] = link;
    }

    /// Which boxes the ray enters before `t_max`, a bit each. Written so that lanes are computed side by side.
    #[inline(always)]
    fn entered(&self, ray: &Slabs, t_max: f32) -> u32 {
        let mut near = [0.0f32; WIDTH];
        let mut far = [t_max; WIDTH];
        for axis in 0..3 {
            let down = usize::from(ray.inverse[axis].is_sign_negative());
            let first = &self.planes[2 * axis + down];
            let last = &self.planes[2 * axis + 1 - down];
            let (origin, inverse) = (ray.origin[axis], ray.inverse[axis]);
            for lane in 0..WIDTH {
                let a = (first[lane] - origin) * inverse;
                let b = (last[lane] - origin) * inverse;
                near[lane] = if a > near[lane] { a } else { near[lane] };
                far[lane] = if b < far[lane] { b } else { far[lane] };
            }
        }
        let mut entered = [0u32; WIDTH];
        for lane in 0..WIDTH {
            entered[lane] = u32::from(near[lane] <= far[lane]) << lane;
        }
        entered.iter().fold(0, |all, bit| all | bit)
    }
}

/// A box: least and greatest coordinates. One whose least are above its greatest is met by nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least coordinates.
    pub low: Vec3,
    /// Greatest coordinates.
    pub high: Vec3,
}

impl Default for Bounds {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Bounds {
    /// What holds nothing.
    pub const EMPTY: Self = Self {
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
    };

    /// What holds both.
    pub fn with(&self, other: &Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// Whether it holds nothing.
    pub fn is_empty(&self) -> bool {
        !self.low.cmple(self.high).all()
    }
}

/// The tree.
#[derive(Debug, Clone, Default)]
pub struct BoxTree {
    /// What holds all boxes.
    whole: Bounds,
    nodes: Vec<Node>,
    /// Numbers of the boxes, while it is being built.
    order: Vec<u32>,
}

impl BoxTree {
    /// Makes room for `count` boxes, so that [`Self::build`] need not.
    pub fn reserve(&mut self, count: usize) {
        self.order.reserve(count.saturating_sub(self.order.len()));
        // Every node but the only one has two boxes below it at least.
        self.nodes
            .reserve((count + 1).saturating_sub(self.nodes.len()));
    }

    /// A tree over these boxes, which are numbered as they come; empty ones are left out.
    pub fn build(&mut self, boxes: &[Bounds]) {
        self.nodes.clear();
        self.order.clear();
        let there = (0..boxes.len() as u32).filter(|&n| !boxes[n as usize].is_empty());
        self.order.extend(there);
        self.whole = match self.order.len() {
            0 => Bounds::EMPTY,
            count => self.node(boxes, 0, count),
        };
    }

    /// Adds the node over a part of the order and all below it; gives its bounds.
    fn node(&mut self, boxes: &[Bounds], first: usize, end: usize) -> Bounds {
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
        let mut whole = Bounds::EMPTY;
        for lane in 0..WIDTH {
            let (from, to) = (ends[lane], ends[lane + 1]);
            let (bounds, link) = match to - from {
                0 => continue,
                1 => {
                    let number = self.order[from];
                    (boxes[number as usize], number | LEAF)
                }
                _ => {
                    let link = self.nodes.len() as u32;
                    (self.node(boxes, from, to), link)
                }
            };
            self.nodes[this].set(lane, &bounds, link);
            whole = whole.with(&bounds);
        }
        whole
    }

    /// Puts the boxes of a part of the order on two sides of its middle, along the axis on which they spread most.
    fn halve(&mut self, boxes: &[Bounds], first: usize, middle: usize, end: usize) {
        let centre = |&n: &u32| boxes[n as usize].low + boxes[n as usize].high;
        let part = &mut self.order[first..end];
        let spread = part.iter().map(centre).fold(Bounds::EMPTY, |all, at| {
            all.with(&Bounds { low: at, high: at })
        });
        let axis = (spread.high - spread.low).max_position();
        part.select_nth_unstable_by(middle - first, |a, b| {
            centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(b))
        });
    }

    /// Calls `visit` with the number of every box that a ray enters before a parameter, `ray.t_max` at first, then what
    /// `visit` has given last: below 0 ends the walk. In no order that means anything. Of a ray that is none any box
    /// may be met, and of boxes that a ray only grazes machines meet others.
    #[inline]
    pub fn walk(&self, ray: &Ray, visit: impl FnMut(u32, f32) -> f32) {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = Avx2::detect() {
            return enter_avx2!(avx2 => walk_avx2(self, ray, visit));
        }
        self.walk_plainly(ray, visit);
    }

    /// Whether a ray enters any box up to `ray.t_max`, the same on every machine.
    pub fn is_entered(&self, ray: &Ray) -> bool {
        let mut is_entered = false;
        self.walk_plainly(ray, |_, _| {
            is_entered = true;
            -1.0
        });
        is_entered
    }

    #[inline(always)]
    fn walk_plainly(&self, ray: &Ray, visit: impl FnMut(u32, f32) -> f32) {
        let slabs = Slabs::of(ray);
        if slabs.enters(&self.whole, ray.t_max) {
            self.walk_nodes(ray.t_max, |node, t_max| node.entered(&slabs, t_max), visit);
        }
    }

    /// `enter` says which boxes of a node the ray enters before a parameter, a bit each.
    #[inline(always)]
    fn walk_nodes(
        &self,
        mut t_max: f32,
        enter: impl Fn(&Node, f32) -> u32,
        mut visit: impl FnMut(u32, f32) -> f32,
    ) {
        let mut places = Places::<u32, STACK>::new();
        let mut stack = Stack::over(&mut places);
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

    /// Memory that the tree occupies, in bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.order.as_slice())
    }
}

/// Eight boxes to a register, for rays that do not start too far out.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
#[inline]
fn walk_avx2(tree: &BoxTree, ray: &Ray, visit: impl FnMut(u32, f32) -> f32) {
    let raw = RawRay {
        origin: ray.origin.as_ref(),
        direction: ray.direction.as_ref(),
        t_min: 0.0,
        margin: 0.0,
    };
    let Some(ready) = Ready::of::<BOX_TREE>(raw, Near { reach: REACH_M }) else {
        return tree.walk_plainly(ray, visit);
    };
    let slabs = Slabs8::of::<BOX_TREE>(&ready);
    tree.walk_nodes(
        ray.t_max,
        |node, t_max| slabs.entered::<BOX_TREE>(&node.planes, t_max),
        visit,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number from 0 to below 1 from a counter.
    fn draw(seed: &mut u64) -> f32 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (*seed >> 40) as f32 / (1u64 << 24) as f32
    }

    #[test]
    fn a_walk_meets_every_box_that_the_ray_enters() {
        let mut seed = 7;
        let mut tree = BoxTree::default();
        for count in [0, 1, 2, 7, 8, 9, 17, 64, 65, 300] {
            let mut point = || Vec3::from_array([(); 3].map(|()| 20.0 * draw(&mut seed)));
            let boxes: Vec<Bounds> = (0..count)
                .map(|n| {
                    let low = point();
                    let high = low + 0.1 * point();
                    // Every fifth is empty.
                    if n % 5 == 4 {
                        Bounds::EMPTY
                    } else {
                        Bounds { low, high }
                    }
                })
                .collect();
            tree.build(&boxes);
            for _ in 0..100 {
                let ray = Ray::between(point(), point());
                let mut met = vec![false; boxes.len()];
                tree.walk(&ray, |number, t_max| {
                    assert!(!met[number as usize], "met twice");
                    met[number as usize] = true;
                    t_max
                });
                for (number, bounds) in boxes.iter().enumerate() {
                    let steps = (0..=2000).map(|i| ray.at(i as f32 / 2000.0));
                    let mut inside = steps.filter(|p| *p == p.clamp(bounds.low, bounds.high));
                    let enters = !bounds.is_empty() && inside.next().is_some();
                    assert!(met[number] || !enters, "{count} boxes, box {number}");
                    assert!(!met[number] || !bounds.is_empty());
                }
            }
        }
    }

    #[test]
    fn a_walk_ends_where_it_is_told_to() {
        let one = Bounds {
            low: -Vec3::ONE,
            high: Vec3::ONE,
        };
        let mut tree = BoxTree::default();
        tree.build(&[one; 100]);
        let mut visits = 0;
        tree.walk(&Ray::new(Vec3::Z * 5.0, -Vec3::Z), |_, _| {
            visits += 1;
            -1.0
        });
        assert_eq!(visits, 1);
        tree.walk(&Ray::new(Vec3::Z * 5.0, Vec3::Z), |_, _| {
            unreachable!("behind it")
        });
        assert!(tree.is_entered(&Ray::new(Vec3::Z * 5.0, -Vec3::Z)));
        assert!(!tree.is_entered(&Ray::new(Vec3::Z * 5.0, Vec3::Z)));
    }

    /// Lanes miss no box that plain arithmetic enters, where boxes stand off what is in them.
    #[test]
    fn a_walk_in_lanes_misses_no_box() {
        let mut seed = 11;
        let mut tree = BoxTree::default();
        let mut point =
            |size: f32| size * (Vec3::from_array([(); 3].map(|()| draw(&mut seed))) - 0.5);
        let inner: Vec<Bounds> = (0..200)
            .map(|_| {
                let (low, size) = (point(60.0), point(2.0).abs());
                let high = low + size;
                Bounds { low, high }
            })
            .collect();
        let boxes: Vec<Bounds> = inner
            .iter()
            .map(|inner| Bounds {
                low: inner.low - 1e-4,
                high: inner.high + 1e-4,
            })
            .collect();
        tree.build(&boxes);
        let mut met_in_all = 0;
        for n in 0..2000 {
            // Farther out than lanes are used, too, and along an axis.
            let origin = point(if n % 10 == 0 { 400.0 } else { 200.0 });
            let towards = inner[n % inner.len()];
            let mut goal = 0.5 * (towards.low + towards.high);
            if n % 7 == 0 {
                goal.y = origin.y;
            }
            let ray = Ray::between(origin, goal + (goal - origin));
            let mut met = vec![false; boxes.len()];
            tree.walk(&ray, |number, t_max| {
                met[number as usize] = true;
                t_max
            });
            let slabs = Slabs::of(&ray);
            for (inner, met) in inner.iter().zip(&met) {
                assert!(*met || !slabs.enters(inner, ray.t_max), "ray {n}");
            }
            met_in_all += met.iter().filter(|met| **met).count();
        }
        assert!(met_in_all > 1500, "{met_in_all}");
    }
}
