//! Traversal on aarch64 with NEON.
//!
//! The functions have the target feature: the kernels and the loop inline into one. [`enter_neon`] calls them. Each is
//! compiled for every [`DirectionClass`].

use super::node::Node;
use super::traverse::{self, PackedHit};
use super::{Bvh, traverse_scalar};
use crate::geometry::intersect::neon::{
    DirectionClass, RayVectors, ShearRay4, SlabRay4, enter_neon, link_index, pop_nearest,
};
use crate::geometry::ray::Ray;

// Callers of kernels.
const CLOSEST: u8 = 0;
const ANY: u8 = 1;

pub(super) fn closest(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> PackedHit {
    enter_neon!(neon_closest(nodes, bvh, ray, ignored))
}

pub(super) fn any(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    enter_neon!(neon_any(nodes, bvh, ray, ignored))
}

/// The instance of a function for the class of a ray's direction. A match of constants compiles to one table lookup.
macro_rules! of_class {
    ($function:ident, $ray:expr) => {
        match DirectionClass::of($ray.direction.as_ref()) {
            0 => $function::<0>,
            1 => $function::<1>,
            2 => $function::<2>,
            3 => $function::<3>,
            4 => $function::<4>,
            _ => $function::<5>,
        }
    };
}

#[target_feature(enable = "neon")]
fn neon_closest(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> PackedHit {
    type Traversal = fn(&[Node<4>], &Bvh, &Ray, [u32; 2]) -> PackedHit;
    let traversal: Traversal = of_class!(closest_of_class, ray);
    traversal(nodes, bvh, ray, ignored)
}

#[target_feature(enable = "neon")]
fn neon_any(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    type Traversal = fn(&[Node<4>], &Bvh, &Ray, [u32; 2]) -> Option<u32>;
    let traversal: Traversal = of_class!(any_of_class, ray);
    traversal(nodes, bvh, ray, ignored)
}

#[target_feature(enable = "neon")]
#[inline(never)]
fn closest_of_class<const CLASS: u8>(
    nodes: &[Node<4>],
    bvh: &Bvh,
    ray: &Ray,
    ignored: [u32; 2],
) -> PackedHit {
    let query = bvh.query(ray, ignored);
    let hit = query.raw().and_then(|raw| {
        let vectors = RayVectors::new::<CLOSEST, CLASS>(raw, query.range)?;
        let slabs = SlabRay4::<CLASS>::new::<CLOSEST>(&vectors);
        let shear = ShearRay4::<CLASS>::new::<CLOSEST>(raw, &vectors);
        traverse::closest(
            nodes,
            &query,
            link_index,
            |t_max| slabs.limit::<CLOSEST>(t_max),
            |node, limit| slabs.enter::<CLOSEST>(&node.planes, &node.links, limit),
            |_, spans| slabs.nearer_first::<CLOSEST>(spans),
            |_, spans| slabs.sort_keys::<CLOSEST>(spans),
            |keys| pop_nearest::<CLOSEST, CLASS>(keys),
            |block, limit, at| shear.intersect::<CLOSEST>(&block.corners, limit, at),
        )
    });
    match hit {
        Some(hit) => hit,
        None => closest_exact(nodes, bvh, ray, ignored),
    }
}

#[target_feature(enable = "neon")]
#[inline(never)]
fn any_of_class<const CLASS: u8>(
    nodes: &[Node<4>],
    bvh: &Bvh,
    ray: &Ray,
    ignored: [u32; 2],
) -> Option<u32> {
    let query = bvh.query(ray, ignored);
    let found = query.raw().and_then(|raw| {
        let vectors = RayVectors::new::<ANY, CLASS>(raw, query.range)?;
        let slabs = SlabRay4::<CLASS>::new::<ANY>(&vectors);
        let shear = ShearRay4::<CLASS>::new::<ANY>(raw, &vectors);
        let (limit, _) = slabs.limit::<ANY>(query.ray.t_max);
        traverse::any(
            nodes,
            &query,
            link_index,
            |node| slabs.entered::<ANY>(&node.planes, limit),
            |block, at| shear.intersect::<ANY>(&block.corners, limit, at),
        )
    });
    match found {
        Some(found) => found,
        None => any_exact(nodes, bvh, ray, ignored),
    }
}

/// The scalar reference: for rays out of range or without an interval, and those that hit an edge to the last bit. A
/// separate function: the traversal above has no value to save across a call.
#[cold]
#[inline(never)]
fn closest_exact(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> PackedHit {
    traverse_scalar::closest(nodes, &bvh.query(ray, ignored), link_index)
}

/// [`closest_exact`] for any hit.
#[cold]
#[inline(never)]
fn any_exact(nodes: &[Node<4>], bvh: &Bvh, ray: &Ray, ignored: [u32; 2]) -> Option<u32> {
    traverse_scalar::any(nodes, &bvh.query(ray, ignored), link_index)
}
