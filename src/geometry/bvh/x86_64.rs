//! The walk on x86-64: four lanes of SSE2, or eight of AVX2 for boxes and four for triangles.
//!
//! The functions here carry the features, so the kernels and the loop become one piece of code; the way in is
//! [`crate::simd::x86`]'s.

use super::node::Node;
use super::walk::{self, Nearest};
use super::{Bvh, Query, portable};
use crate::geometry::ray::Ray;
use crate::simd::tracing::RawRay;
use crate::simd::x86::{Avx2, Ready, Shear4, Slabs4, Slabs8, enter_avx2, enter_sse2, take4, take8};

// Callers of kernels, which are compiled for each of them: two a walk, since rays run up or down along their longest axis.
const SSE2_CLOSEST: u8 = 0;
const SSE2_CLOSEST_DOWN: u8 = 1;
const SSE2_ANY: u8 = 2;
const SSE2_ANY_DOWN: u8 = 3;
const AVX2_CLOSEST: u8 = 4;
const AVX2_CLOSEST_DOWN: u8 = 5;
const AVX2_ANY: u8 = 6;
const AVX2_ANY_DOWN: u8 = 7;

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
    if ready.runs_down() {
        sse2_closest_along::<SSE2_CLOSEST_DOWN, true>(nodes, &query, raw, &ready)
    } else {
        sse2_closest_along::<SSE2_CLOSEST, false>(nodes, &query, raw, &ready)
    }
}

#[target_feature(enable = "sse2")]
#[inline]
fn sse2_closest_along<const CALLER: u8, const DOWN: bool>(
    nodes: &[Node<4>],
    query: &Query<'_>,
    raw: RawRay<'_>,
    ready: &Ready,
) -> Nearest {
    let slabs = Slabs4::<DOWN>::of::<CALLER>(ready);
    let shear = Shear4::of::<CALLER>(raw, ready);
    walk::closest(
        nodes,
        query,
        |link| link,
        |t_max| slabs.limit::<CALLER>(t_max),
        |node, limit| slabs.enter::<CALLER>(&node.planes, limit),
        |entered, spans| slabs.pair::<CALLER>(entered, spans),
        |_, spans| slabs.sort::<CALLER>(spans),
        |keys| take4::<CALLER>(keys),
        |block, limit, at| shear.meet::<CALLER, _>(&block.corners, limit, at),
    )
}

#[target_feature(enable = "sse2")]
#[inline(never)]
fn sse2_any(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    let query = bvh.query(ray, ignored);
    let raw = query.raw()?;
    let Some(ready) = Ready::of::<SSE2_ANY>(raw, query.near) else {
        return portable::any(nodes, &bvh.query(ray, ignored), |link| link);
    };
    if ready.runs_down() {
        sse2_any_along::<SSE2_ANY_DOWN, true>(nodes, &query, raw, &ready)
    } else {
        sse2_any_along::<SSE2_ANY, false>(nodes, &query, raw, &ready)
    }
}

#[target_feature(enable = "sse2")]
#[inline]
fn sse2_any_along<const CALLER: u8, const DOWN: bool>(
    nodes: &[Node<4>],
    query: &Query<'_>,
    raw: RawRay<'_>,
    ready: &Ready,
) -> Option<u32> {
    let slabs = Slabs4::<DOWN>::of::<CALLER>(ready);
    let shear = Shear4::of::<CALLER>(raw, ready);
    let (limit, _) = slabs.limit::<CALLER>(query.ray.t_max);
    walk::any(
        nodes,
        query,
        |link| link,
        |node| slabs.entered::<CALLER>(&node.planes, limit),
        |block, at| shear.meet::<CALLER, _>(&block.corners, limit, at),
    )
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
    if ready.runs_down() {
        avx2_closest_along::<AVX2_CLOSEST_DOWN, true>(nodes, &query, raw, &ready)
    } else {
        avx2_closest_along::<AVX2_CLOSEST, false>(nodes, &query, raw, &ready)
    }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn avx2_closest_along<const CALLER: u8, const DOWN: bool>(
    nodes: &[Node<8>],
    query: &Query<'_>,
    raw: RawRay<'_>,
    ready: &Ready,
) -> Nearest {
    let slabs = Slabs8::<DOWN>::of::<CALLER>(ready);
    let shear = Shear4::of::<CALLER>(raw, ready);
    walk::closest(
        nodes,
        query,
        |link| link,
        |t_max| slabs.limit::<CALLER>(t_max),
        |node, limit| slabs.enter::<CALLER>(&node.planes, limit),
        |entered, spans| slabs.pair::<CALLER>(entered, spans),
        |_, spans| slabs.sort::<CALLER>(spans),
        |keys| take8::<CALLER>(keys),
        |block, limit, at| shear.meet::<CALLER, _>(&block.corners, limit, at),
    )
}

#[target_feature(enable = "avx2,fma")]
#[inline(never)]
fn avx2_any(nodes: &[Node<8>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    let query = bvh.query(ray, ignored);
    let raw = query.raw()?;
    let Some(ready) = Ready::of::<AVX2_ANY>(raw, query.near) else {
        return portable::any(nodes, &bvh.query(ray, ignored), |link| link);
    };
    if ready.runs_down() {
        avx2_any_along::<AVX2_ANY_DOWN, true>(nodes, &query, raw, &ready)
    } else {
        avx2_any_along::<AVX2_ANY, false>(nodes, &query, raw, &ready)
    }
}

#[target_feature(enable = "avx2,fma")]
#[inline]
fn avx2_any_along<const CALLER: u8, const DOWN: bool>(
    nodes: &[Node<8>],
    query: &Query<'_>,
    raw: RawRay<'_>,
    ready: &Ready,
) -> Option<u32> {
    let slabs = Slabs8::<DOWN>::of::<CALLER>(ready);
    let shear = Shear4::of::<CALLER>(raw, ready);
    let (limit, _) = slabs.limit::<CALLER>(query.ray.t_max);
    walk::any(
        nodes,
        query,
        |link| link,
        |node| slabs.entered::<CALLER>(&node.planes, limit),
        |block, at| shear.meet::<CALLER, _>(&block.corners, limit, at),
    )
}
