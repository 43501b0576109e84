//! The walk on aarch64: four lanes of NEON.
//!
//! The functions here carry the feature, so the kernels and the loop become one piece of code; the way in is
//! [`crate::simd::neon`]'s.

use super::node::Node;
use super::walk::{self, Nearest};
use super::{Bvh, portable};
use crate::geometry::ray::Ray;
use crate::simd::neon::{Octant, Ready, Rows, Shear4, Slabs4, enter_neon, pair4, sort4, take4};

/// A caller of kernels, which are compiled for each of them; octants are the others.
const ANY: u8 = 8;

/// A walk for each octant of directions: planes' places are known then, and two come by one load.
pub(super) fn closest(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Nearest {
    enter_neon!(neon_octant(nodes, bvh, ray, ignored))
}

#[target_feature(enable = "neon")]
fn neon_octant(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Nearest {
    type Walk = fn(&[Node<4>], &Bvh, &Ray, [u32; 2]) -> Nearest;
    // A choice of constants is one look into a table.
    let walk: Walk = match ray.direction.is_negative_bitmask() & 7 {
        0 => neon_closest::<0>,
        1 => neon_closest::<1>,
        2 => neon_closest::<2>,
        3 => neon_closest::<3>,
        4 => neon_closest::<4>,
        5 => neon_closest::<5>,
        6 => neon_closest::<6>,
        _ => neon_closest::<7>,
    };
    walk(nodes, bvh, ray, ignored)
}

#[inline]
pub(super) fn any(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    enter_neon!(neon_any(nodes, bvh, ray, ignored))
}

#[target_feature(enable = "neon")]
#[inline(never)]
fn neon_closest<const DOWN: u8>(
    nodes: &[Node<4>],
    bvh: &Bvh,
    ray: &Ray,
    ignored: [u32; 2],
) -> Nearest {
    let query = bvh.query(ray, ignored);
    let Some(raw) = query.raw() else {
        return Nearest::none();
    };
    let Some(ready) = Ready::of::<DOWN>(raw, query.near) else {
        return portable::closest(nodes, &bvh.query(ray, ignored));
    };
    let slabs = Slabs4::of::<DOWN>(&ready, Octant::<DOWN>);
    let shear = Shear4::of::<DOWN>(raw, &ready);
    walk::closest(
        nodes,
        &query,
        |node, t_max| slabs.enter::<DOWN>(&node.planes, t_max),
        |_, spans| pair4::<DOWN>(spans),
        |_, spans| sort4::<DOWN>(spans),
        |keys| take4::<DOWN>(keys),
        |block, t_max, at| shear.meet::<DOWN>(&block.corners, t_max, at),
    )
}

#[target_feature(enable = "neon")]
#[inline(never)]
fn neon_any(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    let query = bvh.query(ray, ignored);
    let raw = query.raw()?;
    let Some(ready) = Ready::of::<ANY>(raw, query.near) else {
        return portable::any(nodes, &bvh.query(ray, ignored));
    };
    let slabs = Slabs4::of::<ANY>(&ready, Rows::of::<ANY>(&ready));
    let shear = Shear4::of::<ANY>(raw, &ready);
    walk::any(
        nodes,
        &query,
        |node, t_max| slabs.entered::<ANY>(&node.planes, t_max),
        |block, t_max, at| shear.meet::<ANY>(&block.corners, t_max, at),
    )
}
