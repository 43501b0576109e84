//! Kernels of ray tracing for aarch64: four lanes of NEON, which every aarch64 has.
//!
//! `unsafe` for two reasons: loads take pointers, and a function that carries a target feature must be entered from
//! one that does not ([`enter_neon`]). Specification: [`super::tracing`]. Triangles give its bits; boxes may be entered
//! where it does not enter them, never the other way round. Kernels are generic over a number for their caller, so that
//! each has one caller and becomes part of it; of a shared one the compiler makes a call.

mod lanes;
mod prefetch;

pub(crate) use lanes::TwoQuads;
pub(crate) use prefetch::prefetch;

use core::arch::aarch64::*;

use super::tracing::{
    Axes, Corners, FAR_WIDENING, NEAR_NARROWING, Near, Planes, RawRay, Row, SMALLEST_COMPONENT,
    TriangleRay,
};

/// Calls a safe function that carries the feature `neon`, which every aarch64 has.
macro_rules! enter_neon {
    ($function:ident($($argument:expr),*)) => {
        // SAFETY: the function is safe but for its feature, and NEON is part of aarch64 as Rust targets it.
        unsafe { $function($($argument),*) }
    };
}

pub(crate) use enter_neon;

#[inline]
#[target_feature(enable = "neon")]
fn load4(lanes: &[f32; 4]) -> float32x4_t {
    // SAFETY: a reference to four f32; the load needs no more alignment than theirs.
    unsafe { vld1q_f32(lanes.as_ptr()) }
}

#[inline]
#[target_feature(enable = "neon")]
fn store4(lanes: &mut [f32; 4], values: float32x4_t) {
    // SAFETY: a unique reference to four f32; the store needs no more alignment than theirs.
    unsafe { vst1q_f32(lanes.as_mut_ptr(), values) }
}

/// The lanes whose bits are all set, a bit each.
#[inline]
#[target_feature(enable = "neon")]
fn bits(lanes: uint32x4_t) -> u32 {
    let weights = vcombine_u32(vcreate_u32(1 | 2 << 32), vcreate_u32(4 | 8 << 32));
    vaddvq_u32(vandq_u32(lanes, weights))
}

/// A row of planes.
#[inline]
#[target_feature(enable = "neon")]
fn row4(planes: &Planes<4>, row: Row) -> float32x4_t {
    // SAFETY: a row is one of six of four f32; the load needs no more alignment than theirs.
    let row = unsafe { planes.as_ptr().add(row.number()) };
    // SAFETY: a row is four f32; the load needs no alignment.
    unsafe { vld1q_f32(row.cast::<f32>()) }
}

/// A ray in the first three lanes: where it starts and one over its direction.
#[derive(Clone, Copy)]
pub(crate) struct Ready {
    origin: float32x4_t,
    direction: float32x4_t,
    inverse: float32x4_t,
    /// Axis of the largest component of the direction, the first of equals.
    longest: usize,
}

impl Ready {
    /// Of a ray that is near.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8>(ray: &RawRay, near: Near) -> Option<Self> {
        let [ox, oy, oz] = ray.origin;
        let [dx, dy, dz] = ray.direction;
        let origin = load4(&[ox, oy, oz, 0.0]);
        let direction = load4(&[dx, dy, dz, 0.0]);
        // Numbers that are none are not near.
        let is_near = vandq_u32(
            vcaleq_f32(origin, vdupq_n_f32(near.reach)),
            vcaleq_f32(direction, vdupq_n_f32(Near::LONGEST)),
        );
        let size = vabsq_f32(direction);
        let largest = vmaxvq_f32(size);
        if vminvq_u32(is_near) == 0 || largest < Near::SHORTEST {
            return None;
        }
        let smallest = vdupq_n_f32(largest * SMALLEST_COMPONENT);
        let sign = vdupq_n_u32(1 << 31);
        let bounded = vbslq_f32(sign, direction, vmaxq_f32(size, smallest));
        let is_longest = vmovn_u32(vceqq_f32(size, vdupq_n_f32(largest)));
        let is_longest = vget_lane_u64::<0>(vreinterpret_u64_u16(is_longest));
        Some(Self {
            origin,
            direction,
            inverse: vdivq_f32(vdupq_n_f32(1.0), bounded),
            longest: is_longest.trailing_zeros() as usize / 16,
        })
    }

    /// Lanes as numbers.
    #[inline]
    #[target_feature(enable = "neon")]
    fn lanes(values: float32x4_t) -> [f32; 3] {
        [
            vgetq_lane_f32::<0>(values),
            vgetq_lane_f32::<1>(values),
            vgetq_lane_f32::<2>(values),
        ]
    }
}

/// A ray against four boxes at once, fused.
#[derive(Clone, Copy)]
pub(crate) struct Slabs4 {
    near: [Row; 3],
    scale: [float32x4_t; 3],
    offset: [float32x4_t; 3],
}

impl Slabs4 {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8>(ray: &Ready) -> Self {
        let offset = vnegq_f32(vmulq_f32(ray.origin, ray.inverse));
        let splat = |v: float32x4_t| {
            [
                vdupq_laneq_f32::<0>(v),
                vdupq_laneq_f32::<1>(v),
                vdupq_laneq_f32::<2>(v),
            ]
        };
        Self {
            near: Row::near(Ready::lanes(ray.inverse)),
            scale: splat(ray.inverse),
            offset: splat(offset),
        }
    }

    /// Where the ray enters each box, and which boxes it does enter.
    #[inline]
    #[target_feature(enable = "neon")]
    fn spans(&self, planes: &Planes<4>, t_max: f32) -> (float32x4_t, uint32x4_t) {
        let at = |axis: usize, row: Row| {
            vfmaq_f32(self.offset[axis], row4(planes, row), self.scale[axis])
        };
        let near = |axis: usize| at(axis, self.near[axis]);
        let far = |axis: usize| at(axis, self.near[axis].opposite());
        // The greater of two zeros is +0 here, so no entry is −0.
        let nearest = vmaxq_f32(vmaxq_f32(near(0), near(1)), near(2));
        let entry = vmaxq_f32(nearest, vdupq_n_f32(0.0));
        let exit = vminq_f32(
            vminq_f32(far(0), far(1)),
            vminq_f32(far(2), vdupq_n_f32(t_max)),
        );
        (entry, vcgtq_f32(entry, exit))
    }

    /// A key for every box ([`LaneInLowBits`](super::tracing::LaneInLowBits)).
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn enter<const CALLER: u8>(&self, planes: &Planes<4>, t_max: f32) -> uint32x4_t {
        let (entry, missed) = self.spans(planes, t_max);
        let lanes = vcombine_u32(vcreate_u32(1 << 32), vcreate_u32(2 | 3 << 32));
        let keys = vbslq_u32(vdupq_n_u32(3), lanes, vreinterpretq_u32_f32(entry));
        vorrq_u32(keys, missed)
    }

    /// Which boxes the ray enters, a bit each.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn entered<const CALLER: u8>(&self, planes: &Planes<4>, t_max: f32) -> u32 {
        bits(vmvnq_u32(self.spans(planes, t_max).1))
    }
}

/// The least of four keys, and the others.
#[inline]
#[target_feature(enable = "neon")]
pub(crate) fn take4<const CALLER: u8>(keys: uint32x4_t) -> (u32, uint32x4_t) {
    let least = vminvq_u32(keys);
    let gone = vceqq_u32(keys, vdupq_n_u32(least));
    (least, vorrq_u32(keys, gone))
}

/// A ray against four triangles at once.
#[derive(Clone, Copy)]
pub(crate) struct Shear4<'a> {
    ray: &'a RawRay,
    ready: Ready,
    axes: [usize; 3],
    /// Permuted.
    origin: [float32x4_t; 3],
    shear: [float32x4_t; 3],
}

impl<'a> Shear4<'a> {
    /// Of a ray, raw and ready.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8>(ray: &'a RawRay, ready: &Ready) -> Self {
        let [x, y, z] = Axes::ending_at(ready.longest).numbers();
        let axes = [x.min(2), y.min(2), z.min(2)];
        let mut inverse = [0.0; 4];
        store4(&mut inverse, ready.inverse);
        let inverse = inverse[axes[2]];
        let mut stretched = [0.0; 4];
        store4(&mut stretched, vmulq_n_f32(ready.direction, inverse));
        Self {
            ray,
            ready: *ready,
            axes,
            origin: [
                vdupq_n_f32(ray.origin[axes[0]]),
                vdupq_n_f32(ray.origin[axes[1]]),
                vdupq_n_f32(ray.origin[axes[2]]),
            ],
            shear: [
                vdupq_n_f32(stretched[axes[0]]),
                vdupq_n_f32(stretched[axes[1]]),
                vdupq_n_f32(inverse),
            ],
        }
    }

    /// As [`TriangleRay::meet_four`], to the bit.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn meet<const CALLER: u8>(
        &self,
        corners: &Corners,
        before: f32,
        at: &mut [f32; 4],
    ) -> u32 {
        let [kx, ky, kz] = self.axes;
        let [sx, sy, sz] = self.shear;
        let sheared = |corner: &[[f32; 4]; 3]| {
            let z = vsubq_f32(load4(&corner[kz]), self.origin[2]);
            let x = vsubq_f32(load4(&corner[kx]), self.origin[0]);
            let y = vsubq_f32(load4(&corner[ky]), self.origin[1]);
            let x = vsubq_f32(x, vmulq_f32(sx, z));
            let y = vsubq_f32(y, vmulq_f32(sy, z));
            (x, y, z)
        };
        let (ax, ay, az) = sheared(&corners[0]);
        let (bx, by, bz) = sheared(&corners[1]);
        let (cx, cy, cz) = sheared(&corners[2]);
        let u = vsubq_f32(vmulq_f32(cx, by), vmulq_f32(cy, bx));
        let v = vsubq_f32(vmulq_f32(ax, cy), vmulq_f32(ay, cx));
        let w = vsubq_f32(vmulq_f32(bx, ay), vmulq_f32(by, ax));
        let least = vminq_f32(u, vminq_f32(v, w));
        let most = vmaxq_f32(u, vmaxq_f32(v, w));
        // Written so that numbers that are none are outside.
        let inside = vorrq_u32(vcgezq_f32(least), vclezq_f32(most));
        if vmaxvq_u32(inside) == 0 {
            return 0;
        }
        let within = vorrq_u32(vcgtzq_f32(least), vcltzq_f32(most));
        if vmaxvq_u32(vbicq_u32(inside, within)) != 0 {
            return self.meet_again(corners, before, at, bits(inside));
        }
        let determinant = vaddq_f32(vaddq_f32(u, v), w);
        let depth = vaddq_f32(
            vaddq_f32(vmulq_f32(u, az), vmulq_f32(v, bz)),
            vmulq_f32(w, cz),
        );
        let t = vdivq_f32(vmulq_f32(depth, sz), determinant);
        let in_time = vandq_u32(
            vcgtq_f32(t, vdupq_n_f32(self.ray.t_min)),
            vcltq_f32(t, vdupq_n_f32(before)),
        );
        let met = vandq_u32(within, in_time);
        if vmaxvq_u32(met) == 0 {
            return 0;
        }
        let (near, far) = self.spans(corners);
        let t = vmaxq_f32(near, t);
        let in_box = vandq_u32(vcleq_f32(near, far), vcgezq_f32(far));
        let in_time = vcltq_f32(t, vdupq_n_f32(before));
        store4(at, t);
        bits(vandq_u32(met, vandq_u32(in_box, in_time)))
    }

    /// Where the ray is in each triangle's own box.
    #[inline]
    #[target_feature(enable = "neon")]
    fn spans(&self, corners: &Corners) -> (float32x4_t, float32x4_t) {
        let [a, b, c] = corners;
        let margin = vdupq_n_f32(self.ray.margin);
        let inverse = Ready::lanes(self.ready.inverse);
        let span = |axis: usize| {
            let (a, b, c) = (load4(&a[axis]), load4(&b[axis]), load4(&c[axis]));
            let lower = vsubq_f32(vminq_f32(vminq_f32(a, b), c), margin);
            let upper = vaddq_f32(vmaxq_f32(vmaxq_f32(a, b), c), margin);
            let origin = vdupq_n_f32(self.ray.origin[axis]);
            let inverse = vdupq_n_f32(inverse[axis]);
            let first = vmulq_f32(vsubq_f32(lower, origin), inverse);
            let second = vmulq_f32(vsubq_f32(upper, origin), inverse);
            (vminq_f32(first, second), vmaxq_f32(first, second))
        };
        let ((nx, fx), (ny, fy), (nz, fz)) = (span(0), span(1), span(2));
        let near = vmaxq_f32(vmaxq_f32(nx, ny), nz);
        let far = vminq_f32(vminq_f32(fx, fy), fz);
        (
            vmulq_n_f32(near, NEAR_NARROWING),
            vmulq_n_f32(far, FAR_WIDENING),
        )
    }

    /// For blocks of which an edge function is zero: the specification itself.
    #[cold]
    #[inline(never)]
    fn meet_again(&self, corners: &Corners, before: f32, at: &mut [f32; 4], lanes: u32) -> u32 {
        TriangleRay::of(self.ray).meet_again(corners, before, at, lanes)
    }
}
