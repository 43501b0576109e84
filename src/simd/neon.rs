//! Kernels of ray tracing for aarch64: four lanes of NEON, which every aarch64 has.
//!
//! `unsafe` for two reasons: loads take pointers, and a function that carries a target feature must be entered from
//! one that does not ([`enter_neon`]). Specification: [`super::tracing`]. Triangles give its bits; boxes may be entered
//! where it does not enter them, never the other way round. Kernels are generic over a number for their caller, so that
//! each has one caller and becomes part of it; of a shared one the compiler makes a call.

mod boxes;
mod course;
mod lanes;
mod prefetch;
mod triangles;

pub(crate) use boxes::{Limit, Slabs4, summand, summand_number, take4};
pub(crate) use course::Course;
pub(crate) use lanes::TwoQuads;
pub(crate) use prefetch::prefetch;
pub(crate) use triangles::Shear4;

use core::arch::aarch64::*;

use super::tracing::{Near, RawRay, SMALLEST_COMPONENT};

/// Calls a safe function that carries the feature `neon`, which every aarch64 has.
macro_rules! enter_neon {
    ($function:ident($($argument:expr),*)) => {
        // SAFETY: the function is safe but for its feature, and NEON is part of aarch64 as Rust targets it.
        unsafe { $function($($argument),*) }
    };
}

pub(crate) use enter_neon;

/// Three lanes, the fourth zero.
#[inline]
#[target_feature(enable = "neon")]
fn load3(lanes: &[f32; 3]) -> float32x4_t {
    // SAFETY: a reference to three f32, of which these are two; the load needs no more alignment than theirs.
    let two = unsafe { vld1_f32(lanes.as_ptr()) };
    let two = vcombine_f32(two, vcreate_f32(0));
    // SAFETY: the third of them; the load needs no more alignment than its.
    unsafe { vld1q_lane_f32::<2>(&raw const lanes[2], two) }
}

/// A ray in the first three lanes.
#[derive(Clone, Copy)]
pub(crate) struct Ready {
    origin: float32x4_t,
    direction: float32x4_t,
    inverse: float32x4_t,
}

impl Ready {
    /// Of a ray that is near.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8, const COURSE: u8>(
        ray: RawRay<'_>,
        near: Near,
    ) -> Option<Self> {
        let origin = load3(ray.origin);
        let direction = load3(ray.direction);
        let size = vabsq_f32(direction);
        let farthest = vmaxvq_f32(vabsq_f32(origin));
        let [_, _, z] = Course::axes(COURSE);
        // A number that is none is longer than all.
        let largest = get(size, z);
        // Of lanes with a number that is none the greatest is none, and none is near.
        let is_near = farthest <= near.reach && (Near::SHORTEST..=Near::LONGEST).contains(&largest);
        if !is_near {
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

/// A lane in all lanes, which operations take as it is.
#[inline]
#[target_feature(enable = "neon")]
fn splat(values: float32x4_t, lane: usize) -> float32x4_t {
    match lane {
        0 => vdupq_laneq_f32::<0>(values),
        1 => vdupq_laneq_f32::<1>(values),
        _ => vdupq_laneq_f32::<2>(values),
    }
}

/// A lane as a number.
#[inline]
#[target_feature(enable = "neon")]
fn get(values: float32x4_t, lane: usize) -> f32 {
    match lane {
        0 => vgetq_lane_f32::<0>(values),
        1 => vgetq_lane_f32::<1>(values),
        _ => vgetq_lane_f32::<2>(values),
    }
}
