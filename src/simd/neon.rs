//! Kernels of ray tracing for aarch64: four lanes of NEON, which every aarch64 has.
//!
//! `unsafe` for two reasons: loads take pointers, and a function that carries a target feature must be entered from
//! one that does not ([`enter_neon`]). Specification: [`super::tracing`]. Triangles give its bits; boxes may be entered
//! where it does not enter them, never the other way round. Kernels are generic over a number for their caller, so that
//! each has one caller and becomes part of it; of a shared one the compiler makes a call.

mod lanes;

pub(crate) use lanes::TwoQuads;

use core::arch::aarch64::*;

use super::tracing::{Corners, Planes, ShearRay, SlabRay};

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

/// A ray against four boxes at once, fused ([`FUSED_SLACK`](super::tracing::FUSED_SLACK)).
#[derive(Clone, Copy)]
pub(crate) struct Slabs4<'a> {
    ray: &'a SlabRay,
    near_scale: [float32x4_t; 3],
    near_offset: [float32x4_t; 3],
    far_scale: [float32x4_t; 3],
    far_offset: [float32x4_t; 3],
}

impl<'a> Slabs4<'a> {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8>(ray: &'a SlabRay) -> Self {
        let fused = ray.fused();
        let splat = |v: [f32; 3]| [vdupq_n_f32(v[0]), vdupq_n_f32(v[1]), vdupq_n_f32(v[2])];
        Self {
            ray,
            near_scale: splat(fused.near_scale),
            near_offset: splat(fused.near_offset),
            far_scale: splat(fused.far_scale),
            far_offset: splat(fused.far_offset),
        }
    }

    /// As [`SlabRay::enter`], but for boxes that the ray misses by a rounding, which it may enter here.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<4>,
        t_max: f32,
        entries: &mut [f32; 4],
    ) -> u32 {
        let near = |axis: usize| {
            let plane = load4(&planes[self.ray.near_row(axis)]);
            vfmaq_f32(self.near_offset[axis], plane, self.near_scale[axis])
        };
        let far = |axis: usize| {
            let plane = load4(&planes[self.ray.far_row(axis)]);
            vfmaq_f32(self.far_offset[axis], plane, self.far_scale[axis])
        };
        // The greater of two zeros is +0 here, so no entry is −0.
        let nearest = vmaxq_f32(vmaxq_f32(near(0), near(1)), near(2));
        let entry = vmaxq_f32(nearest, vdupq_n_f32(0.0));
        let exit = vminq_f32(
            vminq_f32(far(0), far(1)),
            vminq_f32(far(2), vdupq_n_f32(t_max)),
        );
        store4(entries, entry);
        bits(vcleq_f32(entry, exit))
    }
}

/// A ray against four triangles at once.
#[derive(Clone, Copy)]
pub(crate) struct Shear4<'a> {
    ray: &'a ShearRay,
    /// Axes again, known to be three.
    axis: [usize; 3],
    origin: [float32x4_t; 3],
    shear: [float32x4_t; 3],
    t_min: float32x4_t,
}

impl<'a> Shear4<'a> {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8>(ray: &'a ShearRay) -> Self {
        let [x, y, z] = ray.axis;
        let axis = [x.min(2), y.min(2), z.min(2)];
        let origin = [
            ray.origin[axis[0]],
            ray.origin[axis[1]],
            ray.origin[axis[2]],
        ];
        let splat = |v: [f32; 3]| [vdupq_n_f32(v[0]), vdupq_n_f32(v[1]), vdupq_n_f32(v[2])];
        Self {
            ray,
            axis,
            origin: splat(origin),
            shear: splat(ray.shear),
            t_min: vdupq_n_f32(ray.t_min),
        }
    }

    /// As [`ShearRay::meet_four`], to the bit.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn meet<const CALLER: u8>(
        &self,
        corners: &Corners,
        t_max: f32,
        at: &mut [f32; 4],
    ) -> u32 {
        let [kx, ky, kz] = self.axis;
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
        let outside = vandq_u32(vcltzq_f32(least), vcgtzq_f32(most));
        if vminvq_u32(outside) == u32::MAX {
            return 0;
        }
        let on_edge = vorrq_u32(vceqzq_f32(u), vorrq_u32(vceqzq_f32(v), vceqzq_f32(w)));
        let again = bits(vbicq_u32(on_edge, outside));
        let determinant = vaddq_f32(vaddq_f32(u, v), w);
        let depth = vaddq_f32(
            vaddq_f32(
                vmulq_f32(u, vmulq_f32(sz, az)),
                vmulq_f32(v, vmulq_f32(sz, bz)),
            ),
            vmulq_f32(w, vmulq_f32(sz, cz)),
        );
        let t = vdivq_f32(depth, determinant);
        let within = vandq_u32(vcgtq_f32(t, self.t_min), vcleq_f32(t, vdupq_n_f32(t_max)));
        let inside = vbicq_u32(within, outside);
        let met = bits(vbicq_u32(inside, vceqzq_f32(determinant)));
        store4(at, t);
        if again == 0 {
            return met;
        }
        self.ray.meet_again(corners, t_max, at, met, again)
    }
}
