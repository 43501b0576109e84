//! Traversal by the scalar reference: on machines without vector kernels, and for rays out of the kernels' range.
//! `index` decodes a link.

use super::Query;
use super::node::Node;
use super::traverse::{self, PackedHit};
use crate::geometry::intersect::Child;
use crate::geometry::triangle::PreparedRay;

#[cold]
pub(super) fn closest<const W: usize>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    index: impl Fn(u32) -> u32,
) -> PackedHit {
    let Some(PreparedRay { ray, .. }) = PreparedRay::new(query.ray, query.margin) else {
        return PackedHit::none();
    };
    traverse::closest(
        nodes,
        query,
        index,
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
        |block, t_max, at| Some(ray.intersect_four::<1>(&block.corners, t_max, at)),
    )
    .unwrap_or_else(PackedHit::none)
}

#[cold]
pub(super) fn any<const W: usize>(
    nodes: &[Node<W>],
    query: &Query<'_>,
    index: impl Fn(u32) -> u32,
) -> Option<u32> {
    let PreparedRay { ray, t_max } = PreparedRay::new(query.ray, query.margin)?;
    traverse::any(
        nodes,
        query,
        index,
        |node| ray.slabs.enter(&node.planes, t_max).0.0,
        |block, at| Some(ray.intersect_four::<1>(&block.corners, t_max, at)),
    )
    .flatten()
}
