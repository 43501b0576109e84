//! The walk on aarch64: four lanes of NEON.
//!
//! The functions here carry the feature, so the kernels and the loop become one piece of code; the way in is
//! [`crate::simd::neon`]'s. There is a walk for each course of rays, so that places
//! in memory are known in it: for closest hits of full courses, which makes two rows of planes one load.

use super::node::Node;
use super::walk::{self, Nearest};
use super::{Bvh, portable};
use crate::geometry::ray::Ray;
use crate::simd::neon::{Course, Ready, Shear4, Slabs4, enter_neon, summand_number, take4};

pub(super) fn closest(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Nearest {
    enter_neon!(neon_closest(nodes, bvh, ray, ignored))
}

pub(super) fn any(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    enter_neon!(neon_any(nodes, bvh, ray, ignored))
}

#[target_feature(enable = "neon")]
fn neon_closest(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Nearest {
    type Walk = fn(&[Node<4>], &Bvh, &Ray, [u32; 2]) -> Nearest;
    // A choice of constants is one look into a table; where all of five bits have a place in it, without a comparison.
    let walk: Walk = match Course::of(ray.direction.as_ref()) % 32 {
        0 => closest_along::<0>,
        1 => closest_along::<1>,
        2 => closest_along::<2>,
        3 => closest_along::<3>,
        4 => closest_along::<4>,
        5 => closest_along::<5>,
        6 => closest_along::<6>,
        7 => closest_along::<7>,
        8 => closest_along::<8>,
        9 => closest_along::<9>,
        10 => closest_along::<10>,
        11 => closest_along::<11>,
        12 => closest_along::<12>,
        13 => closest_along::<13>,
        14 => closest_along::<14>,
        15 => closest_along::<15>,
        16 | 24 => closest_along::<16>,
        17 | 25 => closest_along::<17>,
        18 | 26 => closest_along::<18>,
        19 | 27 => closest_along::<19>,
        20 | 28 => closest_along::<20>,
        21 | 29 => closest_along::<21>,
        22 | 30 => closest_along::<22>,
        23 | 31 => closest_along::<23>,
        _ => closest_along::<0>,
    };
    walk(nodes, bvh, ray, ignored)
}

#[target_feature(enable = "neon")]
fn neon_any(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    type Walk = fn(&[Node<4>], &Bvh, &Ray, [u32; 2]) -> Option<u32>;
    let walk: Walk = match Course::short(ray.direction.as_ref()) {
        24 => any_along::<24>,
        25 => any_along::<25>,
        26 => any_along::<26>,
        27 => any_along::<27>,
        28 => any_along::<28>,
        _ => any_along::<29>,
    };
    walk(nodes, bvh, ray, ignored)
}

/// Callers of kernels, which are compiled for each of them and each course.
const CLOSEST: u8 = 0;
const ANY: u8 = 1;

#[target_feature(enable = "neon")]
#[inline(never)]
fn closest_along<const COURSE: u8>(
    nodes: &[Node<4>],
    bvh: &Bvh,
    ray: &Ray,
    ignored: [u32; 2],
) -> Nearest {
    let query = bvh.query(ray, ignored);
    let nearest = query.raw().and_then(|raw| {
        let ready = Ready::of::<CLOSEST, COURSE>(raw, query.near)?;
        let slabs = Slabs4::<COURSE>::of::<CLOSEST>(&ready);
        let shear = Shear4::<COURSE>::of::<CLOSEST>(raw, &ready);
        walk::closest(
            nodes,
            &query,
            summand_number,
            |t_max| slabs.limit::<CLOSEST>(t_max),
            |node, limit| slabs.enter::<CLOSEST>(&node.planes, &node.links, limit),
            |_, spans| slabs.pair::<CLOSEST>(spans),
            |_, spans| slabs.sort::<CLOSEST>(spans),
            |keys| take4::<CLOSEST, COURSE>(keys),
            |block, limit, at| shear.meet::<CLOSEST>(&block.corners, limit, at),
        )
    });
    match nearest {
        Some(nearest) => nearest,
        None => closest_exactly(nodes, bvh, ray, ignored),
    }
}

#[target_feature(enable = "neon")]
#[inline(never)]
fn any_along<const COURSE: u8>(
    nodes: &[Node<4>],
    bvh: &Bvh,
    ray: &Ray,
    ignored: [u32; 2],
) -> Option<u32> {
    let query = bvh.query(ray, ignored);
    let found = query.raw().and_then(|raw| {
        let ready = Ready::of::<ANY, COURSE>(raw, query.near)?;
        let slabs = Slabs4::<COURSE>::of::<ANY>(&ready);
        let shear = Shear4::<COURSE>::of::<ANY>(raw, &ready);
        let (limit, _) = slabs.limit::<ANY>(query.ray.t_max);
        walk::any(
            nodes,
            &query,
            summand_number,
            |node| slabs.entered::<ANY>(&node.planes, limit),
            |block, at| shear.meet::<ANY>(&block.corners, limit, at),
        )
    });
    match found {
        Some(found) => found,
        None => any_exactly(nodes, bvh, ray, ignored),
    }
}

/// By the specification: for rays too far out for lanes or without an interval, and those that run through an edge to the
/// last bit. Apart from the walks, so that nothing of theirs has to outlive a call.
#[cold]
#[inline(never)]
fn closest_exactly(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Nearest {
    portable::closest(nodes, &bvh.query(ray, ignored), summand_number)
}

/// The same for any hit.
#[cold]
#[inline(never)]
fn any_exactly(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    portable::any(nodes, &bvh.query(ray, ignored), summand_number)
}
