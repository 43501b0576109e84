//! Walking a wide tree with one ray: one loop for the closest hit, one for any, whatever the lanes are made of.
//!
//! Any thread; neither allocates nor blocks. `enter` says which children of a node a ray enters and where (it may say
//! too many, never too few), `meet` which triangles of a block it meets and where. A hit counts only as the
//! specification confirms it ([`PreparedRay::confirm`]), so that answers do not depend on the tree or the lanes.

use super::Query;
use super::node::{Block, LEAF, Node};
use crate::geometry::ray::Hit;

/// Entries that a walk can remember. The builder keeps to it; a walk that met a deeper tree would lose hits, not memory.
pub(super) const STACK: usize = 96;

/// A place to go to: where the ray enters in the high half, what is there in the low half. Entries are never negative,
/// so their bits order as they do.
#[inline(always)]
fn place(entry: f32, link: u32) -> u64 {
    u64::from(entry.to_bits()) << 32 | u64::from(link)
}

#[inline(always)]
fn link_of(place: u64) -> u32 {
    place as u32
}

#[inline(always)]
fn entry_of(place: u64) -> f32 {
    f32::from_bits((place >> 32) as u32)
}

struct Stack {
    places: [u64; STACK],
    height: usize,
}

impl Stack {
    #[inline(always)]
    fn new() -> Self {
        Self {
            places: [0; STACK],
            height: 0,
        }
    }

    #[inline(always)]
    fn push(&mut self, place: u64) {
        if let Some(slot) = self.places.get_mut(self.height) {
            *slot = place;
            self.height += 1;
        }
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<u64> {
        self.height = self.height.checked_sub(1)?;
        self.places.get(self.height).copied()
    }

    /// Orders what was pushed since `from`, the nearest last.
    #[inline(always)]
    fn sort(&mut self, from: usize) {
        let Some(places) = self.places.get_mut(from..self.height) else {
            return;
        };
        for i in 1..places.len() {
            let moving = places[i];
            let mut at = i;
            while at > 0 && places[at - 1] < moving {
                places[at] = places[at - 1];
                at -= 1;
            }
            places[at] = moving;
        }
    }
}

/// The first triangle a ray meets; of two at the same parameter the one with the lower index.
#[inline(always)]
pub(super) fn closest<const W: usize>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    enter: impl Fn(&Node<W>, f32, &mut [f32; W]) -> u32,
    meet: impl Fn(&Block, f32, &mut [f32; 4]) -> u32,
) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    let mut t_max = query.ray.t_max;
    let mut stack = Stack::new();
    let mut entries = [0.0; W];
    let mut at = [0.0; 4];
    let mut link = 0;
    loop {
        if link & LEAF == 0 {
            let node = nodes.get(link as usize)?;
            let entered = enter(node, t_max, &mut entries);
            let child = |lanes: u32| {
                let lane = lanes.trailing_zeros() as usize % W;
                place(entries[lane], node.links[lane])
            };
            if entered != 0 {
                let first = child(entered);
                let others = entered & (entered - 1);
                if others == 0 {
                    link = link_of(first);
                    continue;
                }
                let second = child(others);
                let mut others = others & (others - 1);
                if others == 0 {
                    stack.push(first.max(second));
                    link = link_of(first.min(second));
                    continue;
                }
                let bottom = stack.height;
                stack.push(first);
                stack.push(second);
                while others != 0 {
                    stack.push(child(others));
                    others &= others - 1;
                }
                stack.sort(bottom);
            }
        } else {
            let block = query.blocks.get((link ^ LEAF) as usize)?;
            let mut met = meet(block, t_max, &mut at);
            while met != 0 {
                let lane = met.trailing_zeros() as usize % 4;
                met &= met - 1;
                if let Some(hit) = query.confirm(block, lane, at[lane])
                    && best.is_none_or(|b| (hit.t, hit.triangle) < (b.t, b.triangle))
                {
                    t_max = hit.t;
                    best = Some(hit);
                }
            }
        }
        loop {
            let Some(next) = stack.pop() else {
                return best;
            };
            // An equal parameter still counts: the triangle there may have the lower index.
            if entry_of(next) <= t_max {
                link = link_of(next);
                break;
            }
        }
    }
}

/// Whether a ray meets any triangle at all.
#[inline(always)]
pub(super) fn any<const W: usize>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    enter: impl Fn(&Node<W>, f32, &mut [f32; W]) -> u32,
    meet: impl Fn(&Block, f32, &mut [f32; 4]) -> u32,
) -> bool {
    let t_max = query.ray.t_max;
    let mut stack = Stack::new();
    let mut entries = [0.0; W];
    let mut at = [0.0; 4];
    let mut link = 0;
    loop {
        if link & LEAF == 0 {
            let Some(node) = nodes.get(link as usize) else {
                return false;
            };
            let mut entered = enter(node, t_max, &mut entries);
            if entered != 0 {
                let child = |lanes: u32| node.links[lanes.trailing_zeros() as usize % W];
                link = child(entered);
                entered &= entered - 1;
                while entered != 0 {
                    stack.push(u64::from(link));
                    link = child(entered);
                    entered &= entered - 1;
                }
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
                if query.confirm(block, lane, at[lane]).is_some() {
                    return true;
                }
            }
        }
        let Some(next) = stack.pop() else {
            return false;
        };
        link = link_of(next);
    }
}
