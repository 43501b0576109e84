//! The walk on aarch64: four lanes of NEON.
//!
//! The functions here carry the feature, so the kernels and the loop become one piece of code; the way in is
//! [`crate::simd::neon`]'s.

use super::node::Node;
use super::{Query, portable, walk};
use crate::geometry::ray::Hit;
use crate::simd::neon::{Ready, Shear4, Slabs4, enter_neon, take4};
use crate::simd::tracing::LaneInLowBits;

// Callers of kernels, which are compiled for each of them.
const CLOSEST: u8 = 0;
const ANY: u8 = 1;

pub(super) fn closest(nodes: &[Node<4>], query: &Query<'_>) -> Option<Hit> {
    enter_neon!(neon_closest(nodes, query))
}

pub(super) fn any(nodes: &[Node<4>], query: &Query<'_>) -> bool {
    enter_neon!(neon_any(nodes, query))
}

#[target_feature(enable = "neon")]
fn neon_closest(nodes: &[Node<4>], query: &Query<'_>) -> Option<Hit> {
    let raw = query.raw()?;
    let Some(ready) = Ready::of::<CLOSEST>(&raw, query.near) else {
        return portable::closest(nodes, query);
    };
    let slabs = Slabs4::of::<CLOSEST>(&ready);
    let shear = Shear4::of::<CLOSEST>(&raw, &ready);
    walk::closest(
        nodes,
        query,
        LaneInLowBits::<4>,
        |node, t_max| slabs.enter::<CLOSEST>(&node.planes, t_max),
        |keys| take4::<CLOSEST>(keys),
        |block, t_max, at| shear.meet::<CLOSEST>(&block.corners, t_max, at),
    )
}

#[target_feature(enable = "neon")]
fn neon_any(nodes: &[Node<4>], query: &Query<'_>) -> bool {
    let Some(raw) = query.raw() else {
        return false;
    };
    let Some(ready) = Ready::of::<ANY>(&raw, query.near) else {
        return portable::any(nodes, query);
    };
    let slabs = Slabs4::of::<ANY>(&ready);
    let shear = Shear4::of::<ANY>(&raw, &ready);
    walk::any(
        nodes,
        query,
        |node, t_max| slabs.entered::<ANY>(&node.planes, t_max),
        |block, t_max, at| shear.meet::<ANY>(&block.corners, t_max, at),
    )
}
