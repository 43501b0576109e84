//! The walk without lanes: the specification that every instruction set is tested against, and the way of rays too far
//! out for the lanes' arithmetic. `number` reads a link.

use super::Query;
use super::node::Node;
use super::walk::{self, Nearest};
use crate::geometry::triangle::PreparedRay;
use crate::simd::tracing::Child;

#[cold]
pub(super) fn closest<const W: usize>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    number: impl Fn(u32) -> u32,
) -> Nearest {
    let Some(PreparedRay { ray, .. }) = PreparedRay::of(query.ray, query.margin) else {
        return Nearest::none();
    };
    walk::closest(
        nodes,
        query,
        number,
        |t_max| (t_max, Child::bound(t_max)),
        |node, t_max| ray.slabs.enter(&node.planes, t_max),
        |entered, entries| entered.pair(&entries),
        |entered, entries| {
            std::array::from_fn(|lane| match entered.0 >> lane & 1 {
                1 => entries[lane],
                _ => u32::MAX,
            })
        },
        |mut keys: [u32; W]| {
            let mut lane = 0;
            for other in 1..W {
                if keys[other] < keys[lane] {
                    lane = other;
                }
            }
            let entry = std::mem::replace(&mut keys[lane], u32::MAX);
            (Child { lane, entry }, keys)
        },
        |block, t_max, at| Some(ray.meet_four::<1>(&block.corners, t_max, at)),
    )
    .unwrap_or_else(Nearest::none)
}

#[cold]
pub(super) fn any<const W: usize>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    number: impl Fn(u32) -> u32,
) -> Option<u32> {
    let PreparedRay { ray, t_max } = PreparedRay::of(query.ray, query.margin)?;
    walk::any(
        nodes,
        query,
        number,
        |node| ray.slabs.enter(&node.planes, t_max).0.0,
        |block, at| Some(ray.meet_four::<1>(&block.corners, t_max, at)),
    )
    .flatten()
}
