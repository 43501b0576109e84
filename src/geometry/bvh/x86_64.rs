//! The walk on x86-64: four lanes of SSE2, or eight of AVX2 for boxes and four for triangles.
//!
//! The functions here carry the features, so the kernels and the loop become one piece of code; the way in is
//! [`crate::simd::x86`]'s.

use super::node::Node;
use super::walk::{self, Nearest};
use super::{Bvh, portable};
use crate::geometry::ray::Ray;
use crate::simd::tracing::Child;
use crate::simd::x86::{
    Avx2, Ready, Shear4, Slabs4, Slabs8, enter_avx2, enter_sse2, pair4, pair8, sort4, sort8, take4,
    take8,
};

// Callers of kernels, which are compiled for each of them.
const SSE2_CLOSEST: u8 = 0;
const SSE2_ANY: u8 = 1;
const AVX2_CLOSEST: u8 = 2;
const AVX2_ANY: u8 = 3;

#[inline]
pub(super) fn closest_sse2(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Nearest {
    enter_sse2!(sse2_closest(nodes, bvh, ray, ignored))
}

#[inline]
pub(super) fn any_sse2(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    enter_sse2!(sse2_any(nodes, bvh, ray, ignored))
}

#[inline]
pub(super) fn closest_avx2(
    avx2: Avx2,
    nodes: &[Node<8>],
    bvh: &Bvh,
    ray: &Ray,
    ignored: [u32; 2],
) -> Nearest {
    enter_avx2!(avx2 => avx2_closest(nodes, bvh, ray, ignored))
}

#[inline]
pub(super) fn any_avx2(
    avx2: Avx2,
    nodes: &[Node<8>],
    bvh: &Bvh,
    ray: &Ray,
    ignored: [u32; 2],
) -> Option<u32> {
    enter_avx2!(avx2 => avx2_any(nodes, bvh, ray, ignored))
}

#[target_feature(enable = "sse2")]
#[inline(never)]
fn sse2_closest(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Nearest {
    let query = bvh.query(ray, ignored);
    let Some(raw) = query.raw() else {
        return Nearest::none();
    };
    let Some(ready) = Ready::of::<SSE2_CLOSEST>(raw, query.near) else {
        return portable::closest(nodes, &bvh.query(ray, ignored), |link| link);
    };
    let slabs = Slabs4::of::<SSE2_CLOSEST>(&ready);
    let shear = Shear4::of::<SSE2_CLOSEST>(raw, &ready);
    walk::closest(
        nodes,
        &query,
        |link| link,
        |t_max| (t_max, Child::bound(t_max)),
        |node, t_max| slabs.enter::<SSE2_CLOSEST>(&node.planes, t_max),
        |entered, spans| pair4::<SSE2_CLOSEST>(entered, spans),
        |_, spans| sort4::<SSE2_CLOSEST>(spans),
        |keys| take4::<SSE2_CLOSEST>(keys),
        |block, t_max, at| Some(shear.meet::<SSE2_CLOSEST>(&block.corners, t_max, at)),
    )
    .unwrap_or_else(Nearest::none)
}

#[target_feature(enable = "sse2")]
#[inline(never)]
fn sse2_any(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    let query = bvh.query(ray, ignored);
    let raw = query.raw()?;
    let Some(ready) = Ready::of::<SSE2_ANY>(raw, query.near) else {
        return portable::any(nodes, &bvh.query(ray, ignored), |link| link);
    };
    let slabs = Slabs4::of::<SSE2_ANY>(&ready);
    let shear = Shear4::of::<SSE2_ANY>(raw, &ready);
    let t_max = query.ray.t_max;
    walk::any(
        nodes,
        &query,
        |link| link,
        |node| slabs.entered::<SSE2_ANY>(&node.planes, t_max),
        |block, at| Some(shear.meet::<SSE2_ANY>(&block.corners, t_max, at)),
    )
    .flatten()
}

#[target_feature(enable = "avx2,fma")]
#[inline(never)]
fn avx2_closest(nodes: &[Node<8>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Nearest {
    let query = bvh.query(ray, ignored);
    let Some(raw) = query.raw() else {
        return Nearest::none();
    };
    let Some(ready) = Ready::of::<AVX2_CLOSEST>(raw, query.near) else {
        return portable::closest(nodes, &bvh.query(ray, ignored), |link| link);
    };
    let slabs = Slabs8::of::<AVX2_CLOSEST>(&ready);
    let shear = Shear4::of::<AVX2_CLOSEST>(raw, &ready);
    walk::closest(
        nodes,
        &query,
        |link| link,
        |t_max| (t_max, Child::bound(t_max)),
        |node, t_max| slabs.enter::<AVX2_CLOSEST>(&node.planes, t_max),
        |entered, spans| pair8::<AVX2_CLOSEST>(entered, spans),
        |_, spans| sort8::<AVX2_CLOSEST>(spans),
        |keys| take8::<AVX2_CLOSEST>(keys),
        |block, t_max, at| Some(shear.meet::<AVX2_CLOSEST>(&block.corners, t_max, at)),
    )
    .unwrap_or_else(Nearest::none)
}

#[target_feature(enable = "avx2,fma")]
#[inline(never)]
fn avx2_any(nodes: &[Node<8>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    let query = bvh.query(ray, ignored);
    let raw = query.raw()?;
    let Some(ready) = Ready::of::<AVX2_ANY>(raw, query.near) else {
        return portable::any(nodes, &bvh.query(ray, ignored), |link| link);
    };
    let slabs = Slabs8::of::<AVX2_ANY>(&ready);
    let shear = Shear4::of::<AVX2_ANY>(raw, &ready);
    let t_max = query.ray.t_max;
    walk::any(
        nodes,
        &query,
        |link| link,
        |node| slabs.entered::<AVX2_ANY>(&node.planes, t_max),
        |block, at| Some(shear.meet::<AVX2_ANY>(&block.corners, t_max, at)),
    )
    .flatten()
}
