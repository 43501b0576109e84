//! Traversal on x86-64 with AVX2 and FMA.
//!
//! The functions have the target features: the kernels and the loop inline into one. [`enter_avx2`] calls them.

use super::node::Node;
use super::traverse::{self, PackedHit};
use super::{Bvh, traverse_scalar};
use crate::geometry::intersect::Child;
use crate::geometry::intersect::x86::{
    RayVectors, ShearRay4, SlabRay8, nearer_first, pop_nearest, sort_keys,
};
use crate::geometry::ray::Ray;
use crate::simd::x86::{Avx2, enter_avx2};

// Callers of kernels.
const CLOSEST: u8 = 0;
const ANY: u8 = 1;

#[inline]
pub(super) fn closest(
    avx2: Avx2,
    nodes: &[Node<8>],
    bvh: &Bvh,
    ray: &Ray,
    ignored: [u32; 2],
) -> PackedHit {
    enter_avx2!(avx2 => avx2_closest(nodes, bvh, ray, ignored))
}

#[inline]
pub(super) fn any(
    avx2: Avx2,
    nodes: &[Node<8>],
    bvh: &Bvh,
    ray: &Ray,
    ignored: [u32; 2],
) -> Option<u32> {
    enter_avx2!(avx2 => avx2_any(nodes, bvh, ray, ignored))
}

#[target_feature(enable = "avx2,fma")]
#[inline(never)]
fn avx2_closest(nodes: &[Node<8>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> PackedHit {
    let query = bvh.query(ray, ignored);
    let Some(raw) = query.raw() else {
        return PackedHit::none();
    };
    let Some(vectors) = RayVectors::new::<CLOSEST>(raw, query.range) else {
        return traverse_scalar::closest(nodes, &bvh.query(ray, ignored), |link| link);
    };
    let slabs = SlabRay8::new::<CLOSEST>(&vectors);
    let shear = ShearRay4::new::<CLOSEST>(raw, &vectors);
    traverse::closest(
        nodes,
        &query,
        |link| link,
        |t_max| (t_max, Child::bound(t_max)),
        |node, t_max| slabs.enter::<CLOSEST>(&node.planes, t_max),
        |entered, spans| nearer_first::<CLOSEST>(entered, spans),
        |_, spans| sort_keys::<CLOSEST>(spans),
        |keys| pop_nearest::<CLOSEST>(keys),
        |block, t_max, at| Some(shear.intersect::<CLOSEST>(&block.corners, t_max, at)),
    )
    .unwrap_or_else(PackedHit::none)
}

#[target_feature(enable = "avx2,fma")]
#[inline(never)]
fn avx2_any(nodes: &[Node<8>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    let query = bvh.query(ray, ignored);
    let raw = query.raw()?;
    let Some(vectors) = RayVectors::new::<ANY>(raw, query.range) else {
        return traverse_scalar::any(nodes, &bvh.query(ray, ignored), |link| link);
    };
    let slabs = SlabRay8::new::<ANY>(&vectors);
    let shear = ShearRay4::new::<ANY>(raw, &vectors);
    let t_max = query.ray.t_max;
    traverse::any(
        nodes,
        &query,
        |link| link,
        |node| slabs.entered::<ANY>(&node.planes, t_max),
        |block, at| Some(shear.intersect::<ANY>(&block.corners, t_max, at)),
    )
    .flatten()
}
