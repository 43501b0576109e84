//! Walking a wide tree with one ray: one loop for the closest hit, one for any, whatever the lanes are made of.
//!
//! Any thread; neither allocates nor blocks. The lanes say which children of a node a ray enters and in which order (it
//! may be too many, never too few), and which triangles of a block it meets and where, to the bit as the specification
//! has it, so that answers do not depend on the tree or the lanes.

use super::Query;
use super::node::{Block, NO_TRIANGLE, Node};
use crate::geometry::ray::Hit;
use crate::simd::stack::{Pile, Places, Stack, Waiting};
use crate::simd::tracing::{Child, Entered};

/// Children that a walk can remember. The builder keeps to it; a walk that met a deeper tree would lose hits, not memory.
pub(super) const STACK: usize = 256;

/// What a ray has met first so far.
#[derive(Clone, Copy)]
struct Best {
    /// The bits of the parameter.
    t: u32,
    triangle: u32,
    group: u32,
}

impl Best {
    /// Before it has met anything.
    const NOTHING: Self = Self {
        t: f32::INFINITY.to_bits(),
        triangle: NO_TRIANGLE,
        group: super::NO_GROUP,
    };
}

/// What a ray meets first, small enough to come back in registers: a copy of a [`Hit`] in memory would wait for each part
/// to be written.
#[derive(Clone, Copy)]
pub(super) struct Nearest {
    /// The bits of the parameter, and the triangle above them.
    at: u64,
    group: u32,
}

impl Nearest {
    /// Of a ray that meets nothing.
    #[inline(always)]
    pub(super) fn none() -> Self {
        Self::of(Best::NOTHING)
    }

    #[inline(always)]
    fn of(best: Best) -> Self {
        Self {
            at: u64::from(best.triangle) << 32 | u64::from(best.t),
            group: best.group,
        }
    }

    /// Of a hit, or of none.
    #[cfg(feature = "testing")]
    pub(super) fn of_hit(hit: Option<Hit>) -> Self {
        hit.map_or_else(Self::none, |hit| {
            Self::of(Best {
                t: hit.t.to_bits(),
                triangle: hit.triangle,
                group: hit.group,
            })
        })
    }

    /// As a hit, if it is one.
    #[inline(always)]
    pub(super) fn hit(self) -> Option<Hit> {
        let triangle = (self.at >> 32) as u32;
        (triangle != NO_TRIANGLE).then_some(Hit {
            t: f32::from_bits(self.at as u32),
            triangle,
            group: self.group,
        })
    }
}

/// The first triangle a ray meets; of two at the same parameter the one with the lower index.
///
/// `limit` makes a parameter ready for lanes, and says what no entry before it is beyond. `enter` says which children a ray
/// enters before a limit and where. Of most nodes it is one, which takes no order; `pair` orders two, the nearer first; of
/// more `sort` makes keys, from which `take` takes the nearest. `meet` gives the lanes of a block's triangles that the ray
/// meets before a limit, and where; where it cannot tell, nothing comes back. `number` reads a link.
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "a function for each step of the walk that an instruction set has its own way of"
)]
pub(super) fn closest<
    const W: usize,
    L: Copy,
    E: Entered,
    S: Copy,
    K: Copy,
    M: Iterator<Item = usize>,
>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    number: impl Fn(u32) -> u32,
    limit: impl Fn(f32) -> (L, u32),
    enter: impl Fn(&Node<W>, L) -> (E, S),
    pair: impl Fn(E, S) -> [Child; 2],
    sort: impl Fn(E, S) -> K,
    take: impl Fn(K) -> (Child, K),
    meet: impl Fn(&Block, L, &mut [f32; 4]) -> Option<M>,
) -> Option<Nearest> {
    let mut best = Best::NOTHING;
    let (mut before, mut bound) = limit(query.ray.t_max);
    let mut places = Places::<Waiting, { STACK + 1 }>::new();
    let mut pile = Pile::over(&mut places);
    let mut at = [0.0; 4];
    let mut link = 0;
    loop {
        let place = number(link) as usize;
        if let Some(node) = nodes.get(place) {
            let (entered, spans) = enter(node, before);
            if !entered.is_none() {
                let link_of = |child: Child| node.links[child.lane % W];
                link = if let Some(only) = entered.only(&node.links) {
                    only
                } else if entered.is_pair() {
                    let [nearer, other] = pair(entered, spans);
                    let nearest = link_of(nearer);
                    let waiting = Waiting {
                        entry: other.entry,
                        link: entered.other(&node.links, nearest, other),
                    };
                    pile.push(waiting);
                    nearest
                } else {
                    let (nearest, mut keys) = take(sort(entered, spans));
                    pile.push_downwards(entered.count() - 1, || {
                        let (child, rest) = take(keys);
                        keys = rest;
                        Waiting {
                            entry: child.entry,
                            link: link_of(child),
                        }
                    });
                    link_of(nearest)
                };
                continue;
            }
        } else {
            let block = query.blocks.get(place - nodes.len())?;
            for lane in meet(block, before, &mut at)? {
                let (triangle, group) = (block.triangles[lane], block.groups[lane]);
                // What is met is positive and finite, so its bits order as it does.
                let t = at[lane].to_bits();
                let is_first = t < best.t || t == best.t && triangle < best.triangle;
                if query.counts(group) && is_first {
                    best = Best { t, triangle, group };
                    // The next number, since at an equal parameter the triangle may have the lower index.
                    (before, bound) = limit(f32::from_bits(t + 1));
                }
            }
        }
        let Some(waiting) = pile.pop_up_to(bound) else {
            return Some(Nearest::of(best));
        };
        link = waiting.link;
    }
}

/// A triangle that a ray meets, the first that is come upon. `enter` says which children it enters, a bit each; it goes to
/// the lowest first. `meet` and `number` as in [`closest`].
#[inline(always)]
pub(super) fn any<const W: usize, M: Iterator<Item = usize>>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    number: impl Fn(u32) -> u32,
    enter: impl Fn(&Node<W>) -> u32,
    meet: impl Fn(&Block, &mut [f32; 4]) -> Option<M>,
) -> Option<Option<u32>> {
    let mut places = Places::<(u32, u32), STACK>::new();
    let mut stack = Stack::over(&mut places);
    let mut at = [0.0; 4];
    let mut link = 0;
    loop {
        let place = number(link) as usize;
        if let Some(node) = nodes.get(place) {
            let entered = enter(node);
            if entered != 0 {
                let rest = entered & (entered - 1);
                stack.push_if((link, rest), rest != 0);
                link = node.links[entered.trailing_zeros() as usize % W];
                continue;
            }
        } else {
            let block = query.blocks.get(place - nodes.len())?;
            for lane in meet(block, &mut at)? {
                if query.counts(block.groups[lane]) {
                    return Some(Some(block.triangles[lane]));
                }
            }
        }
        let Some((above, waiting)) = stack.pop() else {
            return Some(None);
        };
        let rest = waiting & waiting.wrapping_sub(1);
        stack.push_if((above, rest), rest != 0);
        let node = nodes.get(number(above) as usize)?;
        link = node.links[waiting.trailing_zeros() as usize % W];
    }
}
