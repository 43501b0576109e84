//! The walk without lanes: the specification that every instruction set is tested against, and the way of rays too far
//! out for fused arithmetic.

use super::Query;
use super::node::Node;
use super::walk;
use crate::geometry::ray::Hit;

pub(super) fn closest<const W: usize>(nodes: &[Node<W>], query: &Query<'_>) -> Option<Hit> {
    let ray = &query.ray;
    walk::closest(
        nodes,
        query,
        |node, t_max, entries| ray.slabs.enter(&node.planes, t_max, entries),
        |block, t_max, at| ray.shear.meet_four(&block.corners, t_max, at),
    )
}

pub(super) fn any<const W: usize>(nodes: &[Node<W>], query: &Query<'_>) -> bool {
    let ray = &query.ray;
    walk::any(
        nodes,
        query,
        |node, t_max, entries| ray.slabs.enter(&node.planes, t_max, entries),
        |block, t_max, at| ray.shear.meet_four(&block.corners, t_max, at),
    )
}
