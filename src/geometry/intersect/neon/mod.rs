//! aarch64: one ray against four boxes and four triangles with NEON.
//!
//! `unsafe` because loads and stores take pointers, and to call a function with target features from one without
//! ([`enter_neon`]). Every function is generic over `CALLER`, an index of its caller, and over the [`DirectionClass`] of its
//! ray: a function with target features inlines reliably only if it has a single caller.

mod boxes;
mod direction_class;
mod triangles;

pub(crate) use boxes::{RayLimit, SlabRay4, encode_link, link_index, pop_nearest};
pub(crate) use direction_class::DirectionClass;
pub(crate) use triangles::ShearRay4;

use core::arch::aarch64::*;

use super::{RawRay, RayRange, SMALLEST_COMPONENT};

/// Calls a safe function with the target feature `neon`, which every aarch64 has.
macro_rules! enter_neon {
    ($function:ident($($argument:expr),*)) => {
        // SAFETY: the function is safe but for its feature, and NEON is part of aarch64 as Rust targets it.
        unsafe { $function($($argument),*) }
    };
}

pub(crate) use enter_neon;

/// Loads three lanes; the fourth is zero.
#[inline]
#[target_feature(enable = "neon")]
fn load3(lanes: &[f32; 3]) -> float32x4_t {
    // SAFETY: a reference to three f32, of which these are two; the load needs only their alignment.
    let two = unsafe { vld1_f32(lanes.as_ptr()) };
    let two = vcombine_f32(two, vcreate_f32(0));
    // SAFETY: the third f32; the load needs only its alignment.
    unsafe { vld1q_lane_f32::<2>(&raw const lanes[2], two) }
}

/// A ray in the first three lanes of registers.
#[derive(Clone, Copy)]
pub(crate) struct RayVectors {
    origin: float32x4_t,
    direction: float32x4_t,
    /// Reciprocal of the direction.
    inverse: float32x4_t,
}

impl RayVectors {
    /// Loads a ray; none if it is out of range.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn new<const CALLER: u8, const CLASS: u8>(
        ray: RawRay<'_>,
        range: RayRange,
    ) -> Option<Self> {
        let origin = load3(ray.origin);
        let direction = load3(ray.direction);
        let size = vabsq_f32(direction);
        let farthest = vmaxvq_f32(vabsq_f32(origin));
        let [_, _, z] = DirectionClass::axes(CLASS);
        // A NaN counts as the longest component.
        let largest = get(size, z);
        // The maximum of lanes with a NaN is a NaN, which is out of range.
        let in_range =
            farthest <= range.reach && (RayRange::SHORTEST..=RayRange::LONGEST).contains(&largest);
        if !in_range {
            return None;
        }
        let smallest = vmulq_n_f32(vdupq_n_f32(SMALLEST_COMPONENT), largest);
        let sign = vdupq_n_u32(1 << 31);
        let bounded = vbslq_f32(sign, direction, vmaxq_f32(size, smallest));
        Some(Self {
            origin,
            direction,
            inverse: vdivq_f32(vdupq_n_f32(1.0), bounded),
        })
    }
}

/// Broadcasts a lane; operations take it as an operand.
#[inline]
#[target_feature(enable = "neon")]
fn splat(values: float32x4_t, lane: usize) -> float32x4_t {
    match lane {
        0 => vdupq_laneq_f32::<0>(values),
        1 => vdupq_laneq_f32::<1>(values),
        _ => vdupq_laneq_f32::<2>(values),
    }
}

/// The value of a lane.
#[inline]
#[target_feature(enable = "neon")]
fn get(values: float32x4_t, lane: usize) -> f32 {
    match lane {
        0 => vgetq_lane_f32::<0>(values),
        1 => vgetq_lane_f32::<1>(values),
        _ => vgetq_lane_f32::<2>(values),
    }
}
