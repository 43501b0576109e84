//! Walking a wide tree with one ray: one loop for the closest hit, one for any, whatever the lanes are made of.
//!
//! Any thread; neither allocates nor blocks. The lanes say which children of a node a ray enters and in which order (it
//! may be too many, never too few), and which triangles of a block it meets and where, to the bit as the specification
//! has it, so that answers do not depend on the tree or the lanes.

use super::node::{Block, LEAF, NO_TRIANGLE, Node};
use super::{NO_GROUP, Query};
use crate::geometry::ray::Hit;
use crate::simd::stack::Stack;
use crate::simd::tracing::KeyOrder;

/// Nodes that a walk can remember. The builder keeps to it; a walk that met a deeper tree would lose hits, not memory.
pub(super) const STACK: usize = 96;

/// Children of a node that a ray has still to go to.
#[derive(Clone, Copy)]
struct Waiting<K> {
    /// Keys of all but the nearest.
    keys: K,
    nearest: u32,
    node: u32,
}

/// The first triangle a ray meets; of two at the same parameter the one with the lower index.
///
/// `enter` gives a key for every child, `take` the least of keys and the others. `meet` gives the triangles of a block
/// that the ray meets before a parameter, a bit each, and where.
#[inline(always)]
pub(super) fn closest<const W: usize, K: Copy, O: KeyOrder>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    order: O,
    enter: impl Fn(&Node<W>, f32) -> K,
    take: impl Fn(K) -> (u32, K),
    meet: impl Fn(&Block, f32, &mut [f32; 4]) -> u32,
) -> Option<Hit> {
    let mut best = NOTHING;
    let mut t_max = query.ray.t_max;
    let mut bound = order.bound(t_max);
    let mut stack = Stack::<Waiting<K>, STACK>::new();
    let mut at = [0.0; 4];
    let mut link = 0;
    loop {
        if link & LEAF == 0 {
            let node = nodes.get(link as usize)?;
            let (nearest, keys) = take(enter(node, t_max));
            if !order.is_beyond(nearest, bound) {
                let (second, keys) = take(keys);
                let waiting = Waiting {
                    keys,
                    nearest: second,
                    node: link,
                };
                let counts = !order.is_beyond(second, bound);
                if counts || !O::BRANCHES {
                    stack.push_if(waiting, counts);
                }
                link = node.links[order.lane(nearest)];
                continue;
            }
        } else {
            let block = query.blocks.get((link ^ LEAF) as usize)?;
            // The next number, so that a triangle at the same parameter is found as well.
            let mut met = meet(block, t_max, &mut at);
            while met != 0 {
                let lane = met.trailing_zeros() as usize % 4;
                met &= met - 1;
                let (triangle, group) = (block.triangles[lane], block.groups[lane]);
                let t = at[lane];
                if query.counts(group) && (t < best.t || t == best.t && triangle < best.triangle) {
                    best = Hit { t, triangle, group };
                    // An equal parameter still counts: the triangle there may have the lower index.
                    t_max = t.next_up();
                    bound = order.bound(t);
                }
            }
        }
        loop {
            let Some(waiting) = stack.pop() else {
                return (best.triangle != NO_TRIANGLE).then_some(best);
            };
            if !order.is_beyond(waiting.nearest, bound) {
                let (next, keys) = take(waiting.keys);
                let rest = Waiting {
                    keys,
                    nearest: next,
                    node: waiting.node,
                };
                let counts = !order.is_beyond(next, bound);
                if counts || !O::BRANCHES {
                    stack.push_if(rest, counts);
                }
                link = nodes.get(waiting.node as usize)?.links[order.lane(waiting.nearest)];
                break;
            }
        }
    }
}

/// Before a ray has met anything.
const NOTHING: Hit = Hit {
    t: f32::INFINITY,
    triangle: NO_TRIANGLE,
    group: NO_GROUP,
};

/// Whether a ray meets any triangle at all. `enter` says which children it enters, a bit each.
#[inline(always)]
pub(super) fn any<const W: usize>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    enter: impl Fn(&Node<W>, f32) -> u32,
    meet: impl Fn(&Block, f32, &mut [f32; 4]) -> u32,
) -> bool {
    let t_max = query.ray.t_max;
    let mut stack = Stack::<(u32, u32), STACK>::new();
    let mut at = [0.0; 4];
    let mut link = 0;
    loop {
        if link & LEAF == 0 {
            let Some(node) = nodes.get(link as usize) else {
                return false;
            };
            let entered = enter(node, t_max);
            if entered != 0 {
                let rest = entered & (entered - 1);
                stack.push_if((link, rest), rest != 0);
                link = node.links[entered.trailing_zeros() as usize % W];
                continue;
            }
        } else {
            let Some(block) = query.blocks.get((link ^ LEAF) as usize) else {
                return false;
            };
            let mut met = meet(block, t_max, &mut at);
            while met != 0 {
                let lane = met.trailing_zeros() as usize % 4;
                met &= met - 1;
                if query.counts(block.groups[lane]) {
                    return true;
                }
            }
        }
        let Some((above, waiting)) = stack.pop() else {
            return false;
        };
        let rest = waiting & waiting.wrapping_sub(1);
        stack.push_if((above, rest), rest != 0);
        let Some(node) = nodes.get(above as usize) else {
            return false;
        };
        link = node.links[waiting.trailing_zeros() as usize % W];
    }
}
