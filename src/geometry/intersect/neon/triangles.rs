//! A ray against four triangles. `unsafe` for loads and stores.

use core::arch::aarch64::*;

use super::{DirectionClass, RayLimit, RayVectors, splat};
use crate::geometry::intersect::{Corners, FAR_WIDENING, HitLanes, NEAR_NARROWING, RawRay};
use crate::geometry::stack::opaque_pointer;

#[inline]
#[target_feature(enable = "neon")]
fn load4(lanes: &[f32; 4]) -> float32x4_t {
    // SAFETY: a reference to four f32; the load needs only their alignment.
    unsafe { vld1q_f32(lanes.as_ptr()) }
}

#[inline]
#[target_feature(enable = "neon")]
fn store4(lanes: &mut [f32; 4], values: float32x4_t) {
    // SAFETY: a unique reference to four f32; the store needs only their alignment.
    unsafe { vst1q_f32(lanes.as_mut_ptr(), values) }
}

/// The lanes with all bits set, one bit every 16 bits.
#[inline]
#[target_feature(enable = "neon")]
fn bits16(lanes: uint32x4_t) -> HitLanes<16> {
    let narrow = vreinterpret_u64_u16(vmovn_u32(lanes));
    HitLanes(vget_lane_u64::<0>(narrow) & 0x0001_0001_0001_0001)
}

/// Whether any lane has all bits set.
#[inline]
#[target_feature(enable = "neon")]
fn any(lanes: uint32x4_t) -> bool {
    vget_lane_u64::<0>(vreinterpret_u64_u16(vmovn_u32(lanes))) != 0
}

/// The same corners, to be loaded again: keeping them would use registers that a ray has to save.
#[inline(always)]
fn reload(corners: &Corners) -> &Corners {
    let pointer = opaque_pointer((&raw const *corners).cast_mut());
    // SAFETY: the pointer of a reference with the same lifetime.
    unsafe { &*pointer }
}

/// A ray against four triangles, with permuted axes.
#[derive(Clone, Copy)]
pub(crate) struct ShearRay4<const CLASS: u8> {
    origin: [float32x4_t; 3],
    inverse: float32x4_t,
    shear: float32x4_t,
    t_min: float32x4_t,
    margin: float32x4_t,
}

impl<const CLASS: u8> ShearRay4<CLASS> {
    /// Precomputes the terms of a ray.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn new<const CALLER: u8>(ray: RawRay<'_>, vectors: &RayVectors) -> Self {
        let [x, y, z] = DirectionClass::axes(CLASS);
        Self {
            origin: [
                splat(vectors.origin, x),
                splat(vectors.origin, y),
                splat(vectors.origin, z),
            ],
            inverse: vectors.inverse,
            shear: vmulq_f32(vectors.direction, splat(vectors.inverse, z)),
            t_min: vdupq_n_f32(ray.t_min),
            margin: vdupq_n_f32(ray.margin),
        }
    }

    /// Coordinates of a corner along a permuted axis.
    #[inline]
    #[target_feature(enable = "neon")]
    fn along(corner: &[[f32; 4]; 3], k: usize) -> float32x4_t {
        load4(&corner[DirectionClass::axes(CLASS)[k]])
    }

    /// [`ScalarRay::intersect_four`](crate::geometry::intersect::ScalarRay::intersect_four), to the bit; none for a block with
    /// an edge function of zero.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn intersect<const CALLER: u8>(
        &self,
        corners: &Corners,
        limit: RayLimit,
        at: &mut [f32; 4],
    ) -> Option<HitLanes<16>> {
        let [kx, ky, kz] = DirectionClass::axes(CLASS);
        let t_max = limit.t_max;
        let sheared = |corner: &[[f32; 4]; 3]| {
            let z = vsubq_f32(Self::along(corner, 2), self.origin[2]);
            let x = vsubq_f32(Self::along(corner, 0), self.origin[0]);
            let y = vsubq_f32(Self::along(corner, 1), self.origin[1]);
            let x = vsubq_f32(x, vmulq_f32(z, splat(self.shear, kx)));
            let y = vsubq_f32(y, vmulq_f32(z, splat(self.shear, ky)));
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
        // The product of different signs is negative. A product of zero, or one that underflows, may be an edge. False for a
        // NaN.
        let signs = vmulq_f32(least, most);
        let inside = vcgezq_f32(signs);
        if !any(inside) {
            return Some(HitLanes(0));
        }
        let within = vcgtzq_f32(signs);
        if any(vbicq_u32(inside, within)) {
            return None;
        }
        let determinant = vaddq_f32(vaddq_f32(u, v), w);
        let depth = vaddq_f32(
            vaddq_f32(vmulq_f32(u, az), vmulq_f32(v, bz)),
            vmulq_f32(w, cz),
        );
        let t = vdivq_f32(vmulq_f32(depth, splat(self.inverse, kz)), determinant);
        let in_range = vandq_u32(vcgtq_f32(t, self.t_min), vcltq_f32(t, t_max));
        let hits = vandq_u32(within, in_range);
        if !any(hits) {
            return Some(HitLanes(0));
        }
        let (near, far) = self.spans(reload(corners));
        let t = vmaxq_f32(near, t);
        let in_box = vandq_u32(vcleq_f32(near, far), vcgezq_f32(far));
        let in_range = vcltq_f32(t, t_max);
        store4(at, t);
        Some(bits16(vandq_u32(hits, vandq_u32(in_box, in_range))))
    }

    /// Parameters at which the ray enters and leaves the box of each triangle.
    #[inline]
    #[target_feature(enable = "neon")]
    fn spans(&self, corners: &Corners) -> (float32x4_t, float32x4_t) {
        let [a, b, c] = corners;
        let margin = self.margin;
        let distances = |k: usize| {
            let (a, b, c) = (Self::along(a, k), Self::along(b, k), Self::along(c, k));
            let lower = vsubq_f32(vminq_f32(vminq_f32(a, b), c), margin);
            let upper = vaddq_f32(vmaxq_f32(vmaxq_f32(a, b), c), margin);
            (
                vsubq_f32(lower, self.origin[k]),
                vsubq_f32(upper, self.origin[k]),
            )
        };
        // Along the longest axis the order of the planes is known; rounding keeps it.
        let span = |k: usize| {
            let (lower, upper) = distances(k);
            let inverse = splat(self.inverse, DirectionClass::axes(CLASS)[k]);
            let (lower, upper) = (vmulq_f32(lower, inverse), vmulq_f32(upper, inverse));
            match (k, DirectionClass::descends(CLASS)) {
                (2, false) => (lower, upper),
                (2, true) => (upper, lower),
                _ => (vminq_f32(lower, upper), vmaxq_f32(lower, upper)),
            }
        };
        let ((nx, fx), (ny, fy), (nz, fz)) = (span(0), span(1), span(2));
        let near = vmaxq_f32(vmaxq_f32(nx, ny), nz);
        let far = vminq_f32(vminq_f32(fx, fy), fz);
        (
            vmulq_n_f32(near, NEAR_NARROWING),
            vmulq_n_f32(far, FAR_WIDENING),
        )
    }
}
