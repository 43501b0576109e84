//! A ray against four triangles. `unsafe` for loads and stores.

use core::arch::aarch64::*;

use super::{Course, Limit, Ready, splat};
use crate::simd::stack::forgotten;
use crate::simd::tracing::{Corners, FAR_WIDENING, Met, NEAR_NARROWING, RawRay};

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

/// The lanes whose bits are all set, a bit each in every sixteenth place.
#[inline]
#[target_feature(enable = "neon")]
fn bits16(lanes: uint32x4_t) -> Met<16> {
    let narrow = vreinterpret_u64_u16(vmovn_u32(lanes));
    Met(vget_lane_u64::<0>(narrow) & 0x0001_0001_0001_0001)
}

/// Whether any lane's bits are all set.
#[inline]
#[target_feature(enable = "neon")]
fn any(lanes: uint32x4_t) -> bool {
    vget_lane_u64::<0>(vreinterpret_u64_u16(vmovn_u32(lanes))) != 0
}

/// The same corners, which are loaded again: of those kept a ray would have to save registers.
#[inline(always)]
fn load_again(corners: &Corners) -> &Corners {
    let pointer = forgotten((&raw const *corners).cast_mut());
    // SAFETY: the pointer of a reference that lives as long.
    unsafe { &*pointer }
}

/// A ray against four triangles at once, axes turned.
#[derive(Clone, Copy)]
pub(crate) struct Shear4<const COURSE: u8> {
    origin: [float32x4_t; 3],
    inverse: float32x4_t,
    shear: float32x4_t,
    t_min: float32x4_t,
    margin: float32x4_t,
}

impl<const COURSE: u8> Shear4<COURSE> {
    /// Of a ray, raw and ready.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8>(ray: RawRay<'_>, ready: &Ready) -> Self {
        let [x, y, z] = Course::axes(COURSE);
        Self {
            origin: [
                splat(ready.origin, x),
                splat(ready.origin, y),
                splat(ready.origin, z),
            ],
            inverse: ready.inverse,
            shear: vmulq_f32(ready.direction, splat(ready.inverse, z)),
            t_min: vdupq_n_f32(ray.t_min),
            margin: vdupq_n_f32(ray.margin),
        }
    }

    /// A coordinate of a corner, by the axis that stands for it.
    #[inline]
    #[target_feature(enable = "neon")]
    fn along(corner: &[[f32; 4]; 3], k: usize) -> float32x4_t {
        load4(&corner[Course::axes(COURSE)[k]])
    }

    /// As [`TriangleRay::meet_four`], to the bit; nothing of a block of which an edge function is zero.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn meet<const CALLER: u8>(
        &self,
        corners: &Corners,
        limit: Limit,
        at: &mut [f32; 4],
    ) -> Option<Met<16>> {
        let [kx, ky, kz] = Course::axes(COURSE);
        let before = limit.t_max;
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
        // Of two signs the product is negative. Nothing, or less than there are numbers for, may be an edge. Written so that
        // numbers that are none are outside.
        let signs = vmulq_f32(least, most);
        let inside = vcgezq_f32(signs);
        if !any(inside) {
            return Some(Met(0));
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
        let in_time = vandq_u32(vcgtq_f32(t, self.t_min), vcltq_f32(t, before));
        let met = vandq_u32(within, in_time);
        if !any(met) {
            return Some(Met(0));
        }
        let (near, far) = self.spans(load_again(corners));
        let t = vmaxq_f32(near, t);
        let in_box = vandq_u32(vcleq_f32(near, far), vcgezq_f32(far));
        let in_time = vcltq_f32(t, before);
        store4(at, t);
        Some(bits16(vandq_u32(met, vandq_u32(in_box, in_time))))
    }

    /// Where the ray is in each triangle's own box.
    #[inline]
    #[target_feature(enable = "neon")]
    fn spans(&self, corners: &Corners) -> (float32x4_t, float32x4_t) {
        let [a, b, c] = corners;
        let margin = self.margin;
        let parameters = |k: usize| {
            let (a, b, c) = (Self::along(a, k), Self::along(b, k), Self::along(c, k));
            let lower = vsubq_f32(vminq_f32(vminq_f32(a, b), c), margin);
            let upper = vaddq_f32(vmaxq_f32(vmaxq_f32(a, b), c), margin);
            (
                vsubq_f32(lower, self.origin[k]),
                vsubq_f32(upper, self.origin[k]),
            )
        };
        // Where a side is known to come first its parameter is the lesser, since rounding keeps order.
        let span = |k: usize| {
            let axis = Course::axes(COURSE)[k];
            let (lower, upper) = parameters(k);
            let inverse = splat(self.inverse, axis);
            let (lower, upper) = (vmulq_f32(lower, inverse), vmulq_f32(upper, inverse));
            let down = match k {
                2 => Some(Course::runs_down(COURSE)),
                _ => Course::side(COURSE, axis),
            };
            match down {
                Some(false) => (lower, upper),
                Some(true) => (upper, lower),
                None => (vminq_f32(lower, upper), vmaxq_f32(lower, upper)),
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
