//! The walk without lanes: the specification that every instruction set is tested against, and the way of rays too far
//! out for the lanes' arithmetic.

use super::Query;
use super::node::Node;
use super::walk;
use crate::geometry::ray::Hit;
use crate::geometry::triangle::PreparedRay;
use crate::simd::tracing::LaneInLowBits;

#[cold]
pub(super) fn closest<const W: usize>(nodes: &[Node<W>], query: &Query<'_>) -> Option<Hit> {
    let ray = PreparedRay::of(query.ray, query.margin)?.ray;
    walk::closest(
        nodes,
        query,
        LaneInLowBits::<W>,
        |node, t_max| ray.slabs.enter(&node.planes, t_max),
        |keys| {
            let least = keys.into_iter().fold(u32::MAX, u32::min);
            let without = |key| if key == least { u32::MAX } else { key };
            (least, keys.map(without))
        },
        |block, t_max, at| ray.meet_four(&block.corners, t_max, at),
    )
}

#[cold]
pub(super) fn any<const W: usize>(nodes: &[Node<W>], query: &Query<'_>) -> bool {
    let Some(PreparedRay { ray, .. }) = PreparedRay::of(query.ray, query.margin) else {
        return false;
    };
    walk::any(
        nodes,
        query,
        |node, t_max| {
            let keys = ray.slabs.enter(&node.planes, t_max);
            keys.into_iter()
                .rfold(0, |bits, key| bits << 1 | u32::from(key != u32::MAX))
        },
        |block, t_max, at| ray.meet_four(&block.corners, t_max, at),
    )
}
