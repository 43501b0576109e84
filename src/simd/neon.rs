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
    Child, Corners, Entered, FAR_WIDENING, Met, NEAR_NARROWING, Near, Planes, RawRay, Row,
    SMALLEST_COMPONENT, TriangleRay,
};

/// Calls a safe function that carries the feature `neon`, which every aarch64 has.
macro_rules! enter_neon {
    ($function:ident $(::<$octant:literal>)? ($($argument:expr),*)) => {
        // SAFETY: the function is safe but for its feature, and NEON is part of aarch64 as Rust targets it.
        unsafe { $function $(::<$octant>)? ($($argument),*) }
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
    pub(crate) fn of<const CALLER: u8>(ray: RawRay<'_>, near: Near) -> Option<Self> {
        let [ox, oy, oz] = *ray.origin;
        let [dx, dy, dz] = *ray.direction;
        let origin = load4(&[ox, oy, oz, 0.0]);
        let direction = load4(&[dx, dy, dz, 0.0]);
        let size = vabsq_f32(direction);
        let (farthest, largest) = (vmaxvq_f32(vabsq_f32(origin)), vmaxvq_f32(size));
        // Of lanes with a number that is none the greatest is none, and none is near.
        let is_near = farthest <= near.reach && (Near::SHORTEST..=Near::LONGEST).contains(&largest);
        if !is_near {
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

/// Which planes of boxes a ray meets first, in whatever way it is known.
pub(crate) trait Sides: Copy {
    /// The row of those of an axis.
    fn near(self, axis: usize) -> Row;
}

/// Known while running.
#[derive(Clone, Copy)]
pub(crate) struct Rows([Row; 3]);

impl Rows {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8>(ray: &Ready) -> Self {
        Self(Row::near(Ready::lanes(ray.inverse)))
    }
}

impl Sides for Rows {
    #[inline(always)]
    fn near(self, axis: usize) -> Row {
        self.0[axis]
    }
}

/// Known while compiling: a bit for each axis along which rays run downwards. Two rows come by one load then.
#[derive(Clone, Copy)]
pub(crate) struct Octant<const DOWN: u8>;

impl<const DOWN: u8> Sides for Octant<DOWN> {
    #[inline(always)]
    fn near(self, axis: usize) -> Row {
        let sign = |axis: u8| if DOWN >> axis & 1 == 1 { -1.0 } else { 1.0 };
        Row::near([sign(0), sign(1), sign(2)])[axis]
    }
}

/// A ray against four boxes at once, fused.
#[derive(Clone, Copy)]
pub(crate) struct Slabs4<S> {
    sides: S,
    scale: [float32x4_t; 3],
    offset: [float32x4_t; 3],
}

impl<S: Sides> Slabs4<S> {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8>(ray: &Ready, sides: S) -> Self {
        let offset = vnegq_f32(vmulq_f32(ray.origin, ray.inverse));
        let splat = |v: float32x4_t| {
            [
                vdupq_laneq_f32::<0>(v),
                vdupq_laneq_f32::<1>(v),
                vdupq_laneq_f32::<2>(v),
            ]
        };
        Self {
            sides,
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
        let near = |axis: usize| at(axis, self.sides.near(axis));
        let far = |axis: usize| at(axis, self.sides.near(axis).opposite());
        // The greater of two zeros is +0 here, so no entry is −0.
        let nearest = vmaxq_f32(vmaxq_f32(near(0), near(1)), near(2));
        let entry = vmaxq_f32(nearest, vdupq_n_f32(0.0));
        let exit = vminq_f32(
            vminq_f32(far(0), far(1)),
            vminq_f32(far(2), vdupq_n_f32(t_max)),
        );
        (entry, vcleq_f32(entry, exit))
    }

    /// Which boxes the ray enters, and where.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<4>,
        t_max: f32,
    ) -> (Summed, Spans4) {
        let (entry, entered) = self.spans(planes, t_max);
        let each = |lane: u64| 1 | lane << 30;
        let each = vcombine_u32(
            vcreate_u32(each(0) | each(1) << 32),
            vcreate_u32(each(2) | each(3) << 32),
        );
        let sum = vaddvq_u32(vandq_u32(entered, each));
        (Summed(sum), Spans4 { entry, entered })
    }

    /// Which boxes the ray enters, a bit each.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn entered<const CALLER: u8>(&self, planes: &Planes<4>, t_max: f32) -> u32 {
        bits(self.spans(planes, t_max).1)
    }
}

/// Which boxes a ray enters, as one sum over lanes: a one each, and of a single box its lane in the highest bits.
#[derive(Clone, Copy)]
pub(crate) struct Summed(u32);

impl Entered for Summed {
    #[inline(always)]
    fn is_none(self) -> bool {
        self.0 == 0
    }

    #[inline(always)]
    fn only(self) -> Option<usize> {
        (self.0 & 6 == 0).then_some((self.0 >> 30) as usize)
    }

    #[inline(always)]
    fn is_pair(self) -> bool {
        self.count() == 2
    }

    #[inline(always)]
    fn count(self) -> usize {
        (self.0 & 7) as usize
    }
}

/// Where a ray enters four boxes, and all bits of those it does enter.
#[derive(Clone, Copy)]
pub(crate) struct Spans4 {
    entry: float32x4_t,
    entered: uint32x4_t,
}

/// Keys: where each box is entered, its lane in the lowest two bits.
#[inline]
#[target_feature(enable = "neon")]
fn keys4(spans: Spans4) -> uint32x4_t {
    let lanes = vcombine_u32(vcreate_u32(1 << 32), vcreate_u32(2 | 3 << 32));
    let rounded = vbicq_u32(vreinterpretq_u32_f32(spans.entry), vdupq_n_u32(3));
    vorrq_u32(rounded, lanes)
}

/// The box of a key.
#[inline(always)]
fn child(key: u32) -> Child {
    Child {
        lane: key as usize % 4,
        entry: key,
    }
}

/// The two boxes that a ray enters, the nearer first.
#[inline]
#[target_feature(enable = "neon")]
pub(crate) fn pair4<const CALLER: u8>(spans: Spans4) -> [Child; 2] {
    let keys = keys4(spans);
    [
        child(vminvq_u32(vornq_u32(keys, spans.entered))),
        child(vmaxvq_u32(vandq_u32(keys, spans.entered))),
    ]
}

/// Keys of four boxes, the greatest number for those that are not entered.
#[inline]
#[target_feature(enable = "neon")]
pub(crate) fn sort4<const CALLER: u8>(spans: Spans4) -> uint32x4_t {
    vornq_u32(keys4(spans), spans.entered)
}

/// The nearest of four boxes, and the keys of the others.
#[inline]
#[target_feature(enable = "neon")]
pub(crate) fn take4<const CALLER: u8>(keys: uint32x4_t) -> (Child, uint32x4_t) {
    let least = vminvq_u32(keys);
    let gone = vceqq_u32(keys, vdupq_n_u32(least));
    (child(least), vorrq_u32(keys, gone))
}

/// Axes in an order in which a ray's longest is the last.
struct Turn {
    /// Which bytes of three lanes make them so.
    bytes: [u8; 16],
    /// Where the axes' rows of four begin, in bytes.
    rows: [usize; 3],
}

impl Turn {
    const fn of(axes: [usize; 3]) -> Self {
        let mut bytes = [0; 16];
        let mut i = 0;
        while i < 12 {
            bytes[i] = (4 * axes[i / 4] + i % 4) as u8;
            i += 1;
        }
        let [x, y, z] = axes;
        let rows = [16 * x, 16 * y, 16 * z];
        Self { bytes, rows }
    }
}

/// By the longest axis, as [`super::tracing::Axes`] has them, and once more for what is none, so that two bits are a place.
static TURNS: [Turn; 4] = [
    Turn::of([1, 2, 0]),
    Turn::of([2, 0, 1]),
    Turn::of([0, 1, 2]),
    Turn::of([0, 1, 2]),
];

/// The lanes of a value by bytes.
#[inline]
#[target_feature(enable = "neon")]
fn turned(values: float32x4_t, bytes: uint8x16_t) -> float32x4_t {
    vreinterpretq_f32_u8(vqtbl1q_u8(vreinterpretq_u8_f32(values), bytes))
}

/// A ray against four triangles at once, axes turned.
#[derive(Clone, Copy)]
pub(crate) struct Shear4<'a> {
    ray: RawRay<'a>,
    turn: &'static Turn,
    origin: [float32x4_t; 3],
    inverse: float32x4_t,
    /// Along x and y, in two lanes.
    shear: float32x4_t,
}

impl<'a> Shear4<'a> {
    /// Of a ray, raw and ready.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8>(ray: RawRay<'a>, ready: &Ready) -> Self {
        let turn = &TURNS[ready.longest % 4];
        // SAFETY: sixteen bytes; the load needs no alignment.
        let bytes = unsafe { vld1q_u8(turn.bytes.as_ptr()) };
        let inverse = turned(ready.inverse, bytes);
        let origin = turned(ready.origin, bytes);
        Self {
            ray,
            turn,
            origin: [
                vdupq_laneq_f32::<0>(origin),
                vdupq_laneq_f32::<1>(origin),
                vdupq_laneq_f32::<2>(origin),
            ],
            inverse,
            shear: vmulq_laneq_f32::<2>(turned(ready.direction, bytes), inverse),
        }
    }

    /// A coordinate of a corner, by the axis that stands for it.
    #[inline]
    #[target_feature(enable = "neon")]
    fn along(&self, corner: &[[f32; 4]; 3], k: usize) -> float32x4_t {
        // SAFETY: a turn's rows begin where a corner's three do.
        let row = unsafe { corner.as_ptr().byte_add(self.turn.rows[k]) };
        // SAFETY: a row is four f32; the load needs no more alignment than theirs.
        unsafe { vld1q_f32(row.cast::<f32>()) }
    }

    /// As [`TriangleRay::meet_four`], to the bit.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn meet<const CALLER: u8>(
        &self,
        corners: &Corners,
        before: f32,
        at: &mut [f32; 4],
    ) -> Met<16> {
        let sheared = |corner: &[[f32; 4]; 3]| {
            let z = vsubq_f32(self.along(corner, 2), self.origin[2]);
            let x = vsubq_f32(self.along(corner, 0), self.origin[0]);
            let y = vsubq_f32(self.along(corner, 1), self.origin[1]);
            let x = vsubq_f32(x, vmulq_laneq_f32::<0>(z, self.shear));
            let y = vsubq_f32(y, vmulq_laneq_f32::<1>(z, self.shear));
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
        if !any(inside) {
            return Met(0);
        }
        let within = vorrq_u32(vcgtzq_f32(least), vcltzq_f32(most));
        if any(vbicq_u32(inside, within)) {
            let RawRay {
                origin,
                direction,
                t_min,
                margin,
            } = self.ray;
            let limits = [t_min, margin];
            return Self::meet_again(
                origin,
                direction,
                limits,
                corners,
                before,
                at,
                bits16(inside),
            );
        }
        let determinant = vaddq_f32(vaddq_f32(u, v), w);
        let depth = vaddq_f32(
            vaddq_f32(vmulq_f32(u, az), vmulq_f32(v, bz)),
            vmulq_f32(w, cz),
        );
        let t = vdivq_f32(vmulq_laneq_f32::<2>(depth, self.inverse), determinant);
        let in_time = vandq_u32(
            vcgtq_f32(t, vdupq_n_f32(self.ray.t_min)),
            vcltq_f32(t, vdupq_n_f32(before)),
        );
        let met = vandq_u32(within, in_time);
        if !any(met) {
            return Met(0);
        }
        let (near, far) = self.spans(corners);
        let t = vmaxq_f32(near, t);
        let in_box = vandq_u32(vcleq_f32(near, far), vcgezq_f32(far));
        let in_time = vcltq_f32(t, vdupq_n_f32(before));
        store4(at, t);
        bits16(vandq_u32(met, vandq_u32(in_box, in_time)))
    }

    /// Where the ray is in each triangle's own box.
    #[inline]
    #[target_feature(enable = "neon")]
    fn spans(&self, corners: &Corners) -> (float32x4_t, float32x4_t) {
        let [a, b, c] = corners;
        let margin = vdupq_n_f32(self.ray.margin);
        let parameters = |k: usize| {
            let (a, b, c) = (self.along(a, k), self.along(b, k), self.along(c, k));
            let lower = vsubq_f32(vminq_f32(vminq_f32(a, b), c), margin);
            let upper = vaddq_f32(vmaxq_f32(vmaxq_f32(a, b), c), margin);
            (
                vsubq_f32(lower, self.origin[k]),
                vsubq_f32(upper, self.origin[k]),
            )
        };
        let ((lx, ux), (ly, uy), (lz, uz)) = (parameters(0), parameters(1), parameters(2));
        let (ax, bx) = (
            vmulq_laneq_f32::<0>(lx, self.inverse),
            vmulq_laneq_f32::<0>(ux, self.inverse),
        );
        let (ay, by) = (
            vmulq_laneq_f32::<1>(ly, self.inverse),
            vmulq_laneq_f32::<1>(uy, self.inverse),
        );
        let (az, bz) = (
            vmulq_laneq_f32::<2>(lz, self.inverse),
            vmulq_laneq_f32::<2>(uz, self.inverse),
        );
        let near = vmaxq_f32(
            vmaxq_f32(vminq_f32(ax, bx), vminq_f32(ay, by)),
            vminq_f32(az, bz),
        );
        let far = vminq_f32(
            vminq_f32(vmaxq_f32(ax, bx), vmaxq_f32(ay, by)),
            vmaxq_f32(az, bz),
        );
        (
            vmulq_n_f32(near, NEAR_NARROWING),
            vmulq_n_f32(far, FAR_WIDENING),
        )
    }

    /// For blocks of which an edge function is zero: the specification itself. Takes parts, so that none of the ray's need
    /// stand in memory for it.
    #[cold]
    #[inline(never)]
    fn meet_again(
        origin: &[f32; 3],
        direction: &[f32; 3],
        [t_min, margin]: [f32; 2],
        corners: &Corners,
        before: f32,
        at: &mut [f32; 4],
        lanes: Met<16>,
    ) -> Met<16> {
        let ray = RawRay {
            origin,
            direction,
            t_min,
            margin,
        };
        TriangleRay::of(ray).meet_again(corners, before, at, lanes)
    }
}
