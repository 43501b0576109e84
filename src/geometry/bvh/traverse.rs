//! Traversal of a wide tree by one ray: a loop for the closest hit and one for any hit, generic over the kernels.
//!
//! Any thread; neither allocates nor blocks. Kernels report the children that a ray enters (perhaps too many, never too
//! few) and the exact hits with the triangles of a block. So answers depend neither on the tree nor on the kernels.

use super::Query;
use super::node::{Block, NO_TRIANGLE, Node};
use crate::geometry::intersect::{Child, EnteredChildren};
use crate::geometry::ray::Hit;
use crate::geometry::stack::{PendingChild, SentinelStack, Stack, StackStorage};

/// Capacity of the traversal stack. The builder respects it; a deeper tree would lose hits, without memory errors.
pub(super) const STACK: usize = 256;

/// The closest hit so far.
#[derive(Clone, Copy)]
struct Closest {
    /// The bits of the parameter.
    t: u32,
    triangle: u32,
    group: u32,
}

impl Closest {
    const NONE: Self = Self {
        t: f32::INFINITY.to_bits(),
        triangle: NO_TRIANGLE,
        group: super::NO_GROUP,
    };
}

/// A [`Hit`] or none in two registers: returned in memory, it would be read before its parts are written.
#[derive(Clone, Copy)]
pub(super) struct PackedHit {
    /// The bits of the parameter; the triangle in the upper half.
    t_and_triangle: u64,
    group: u32,
}

impl PackedHit {
    /// No hit.
    #[inline(always)]
    pub(super) fn none() -> Self {
        Self::new(Closest::NONE)
    }

    #[inline(always)]
    fn new(best: Closest) -> Self {
        Self {
            t_and_triangle: u64::from(best.triangle) << 32 | u64::from(best.t),
            group: best.group,
        }
    }

    /// The hit, if any.
    #[inline(always)]
    pub(super) fn hit(self) -> Option<Hit> {
        let triangle = (self.t_and_triangle >> 32) as u32;
        (triangle != NO_TRIANGLE).then_some(Hit {
            t: f32::from_bits(self.t_and_triangle as u32),
            triangle,
            group: self.group,
        })
    }
}

/// The closest hit; of equal parameters the triangle with the lowest index. None if `intersect` cannot decide.
///
/// `limit` converts a parameter into the kernels' form and an upper bound of the distance keys before it. `enter` finds the
/// children that a ray enters before a limit, mostly one; `nearer_first` orders two; for more, `sort_keys` makes keys, from
/// which `pop_nearest` removes the nearest. `intersect` finds the hits with a block before a limit. `index` decodes a link.
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "one function for each step that depends on the instruction set"
)]
pub(super) fn closest<
    const W: usize,
    L: Copy,
    E: EnteredChildren,
    S: Copy,
    K: Copy,
    M: Iterator<Item = usize>,
>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    index: impl Fn(u32) -> u32,
    limit: impl Fn(f32) -> (L, u32),
    enter: impl Fn(&Node<W>, L) -> (E, S),
    nearer_first: impl Fn(E, S) -> [Child; 2],
    sort_keys: impl Fn(E, S) -> K,
    pop_nearest: impl Fn(K) -> (Child, K),
    intersect: impl Fn(&Block, L, &mut [f32; 4]) -> Option<M>,
) -> Option<PackedHit> {
    let mut best = Closest::NONE;
    let (mut t_max, mut bound) = limit(query.ray.t_max);
    let mut storage = StackStorage::<PendingChild, { STACK + 1 }>::new();
    let mut stack = SentinelStack::new(&mut storage);
    let mut at = [0.0; 4];
    let mut link = 0;
    loop {
        let target = index(link) as usize;
        if let Some(node) = nodes.get(target) {
            let (entered, spans) = enter(node, t_max);
            if !entered.is_none() {
                let link_of = |child: Child| node.links[child.lane % W];
                link = if let Some(only) = entered.only(&node.links) {
                    only
                } else if entered.is_pair() {
                    let [nearer, other] = nearer_first(entered, spans);
                    let nearest = link_of(nearer);
                    stack.push(PendingChild {
                        entry: other.entry,
                        link: entered.other(&node.links, nearest, other),
                    });
                    nearest
                } else {
                    let (nearest, mut keys) = pop_nearest(sort_keys(entered, spans));
                    stack.push_ordered(entered.count() - 1, || {
                        let (child, rest) = pop_nearest(keys);
                        keys = rest;
                        PendingChild {
                            entry: child.entry,
                            link: link_of(child),
                        }
                    });
                    link_of(nearest)
                };
                continue;
            }
        } else {
            let block = query.blocks.get(target - nodes.len())?;
            for lane in intersect(block, t_max, &mut at)? {
                let (triangle, group) = (block.triangles[lane], block.groups[lane]);
                // Parameters of hits are positive and finite: their bits have the same order.
                let t = at[lane].to_bits();
                let is_first = t < best.t || t == best.t && triangle < best.triangle;
                if query.counts(group) && is_first {
                    best = Closest { t, triangle, group };
                    // The next float: a triangle of a lower index may have an equal parameter.
                    (t_max, bound) = limit(f32::from_bits(t + 1));
                }
            }
        }
        let Some(pending) = stack.pop_within(bound) else {
            return Some(PackedHit::new(best));
        };
        link = pending.link;
    }
}

/// The first triangle found that a ray hits. None if `intersect` cannot decide. `enter` gives the children that the ray
/// enters, one bit a lane; the lowest is visited first. The rest as in [`closest`].
#[inline(always)]
pub(super) fn any<const W: usize, M: Iterator<Item = usize>>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    index: impl Fn(u32) -> u32,
    enter: impl Fn(&Node<W>) -> u32,
    intersect: impl Fn(&Block, &mut [f32; 4]) -> Option<M>,
) -> Option<Option<u32>> {
    let mut storage = StackStorage::<(u32, u32), STACK>::new();
    let mut stack = Stack::new(&mut storage);
    let mut at = [0.0; 4];
    let mut link = 0;
    loop {
        let target = index(link) as usize;
        if let Some(node) = nodes.get(target) {
            let entered = enter(node);
            if entered != 0 {
                let rest = entered & (entered - 1);
                stack.push_if((link, rest), rest != 0);
                link = node.links[entered.trailing_zeros() as usize % W];
                continue;
            }
        } else {
            let block = query.blocks.get(target - nodes.len())?;
            for lane in intersect(block, &mut at)? {
                if query.counts(block.groups[lane]) {
                    return Some(Some(block.triangles[lane]));
                }
            }
        }
        let Some((parent, pending)) = stack.pop() else {
            return Some(None);
        };
        let rest = pending & pending.wrapping_sub(1);
        stack.push_if((parent, rest), rest != 0);
        let node = nodes.get(index(parent) as usize)?;
        link = node.links[pending.trailing_zeros() as usize % W];
    }
}
