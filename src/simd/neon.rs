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

use super::stack::forgotten;
use super::tracing::{
    Axes, Child, Corners, Entered, FAR_WIDENING, Met, NEAR_NARROWING, Near, Planes, RawRay, Row,
    SMALLEST_COMPONENT,
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

/// The same corners, which are loaded again: of those kept a ray would have to save registers.
#[inline(always)]
fn load_again(corners: &Corners) -> &Corners {
    let pointer = forgotten((&raw const *corners).cast_mut());
    // SAFETY: the pointer of a reference that lives as long.
    unsafe { &*pointer }
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

/// A ray's course, a number: its longest axis and along which axes it runs downwards; of shortened courses that is known of
/// the longest axis alone. Kernels are compiled for each, so that places in memory are known.
pub(crate) struct Course;

impl Course {
    /// Of a ray; of components as long as each other the first counts. 23 at most.
    #[inline(always)]
    pub(crate) fn of(direction: &[f32; 3]) -> u8 {
        let [x, y, z] = direction.map(f32::to_bits);
        // Signs are shifted in one by one, each by one instruction.
        [z, y, x]
            .iter()
            .fold(Self::longest(direction) as u32, |course, bits| {
                course << 1 | bits >> 31
            }) as u8
    }

    /// The same, shortened: 24 to 29.
    #[inline(always)]
    pub(crate) fn short(direction: &[f32; 3]) -> u8 {
        let longest = Self::longest(direction);
        24 + 2 * longest as u8 + u8::from(direction[longest].is_sign_negative())
    }

    /// Which component is longest. Without their signs the bits of numbers order as they do; one that is none is longer
    /// than all.
    #[inline(always)]
    fn longest(direction: &[f32; 3]) -> usize {
        let [x, y, z] = direction.map(|component| component.to_bits() << 1);
        let (xy, longer) = if x >= y { (0, x) } else { (1, y) };
        if longer >= z { xy } else { 2 }
    }

    /// The axes in turn, the longest the last.
    const fn axes(course: u8) -> [usize; 3] {
        let longest = if course < 24 {
            course / 8
        } else {
            (course - 24) / 2
        };
        match longest {
            0 => [1, 2, 0],
            1 => [2, 0, 1],
            _ => [0, 1, 2],
        }
    }

    /// Whether it runs downwards along its longest axis.
    const fn runs_down(course: u8) -> bool {
        if course < 24 {
            course >> (course / 8) & 1 == 1
        } else {
            course % 2 == 1
        }
    }

    /// Whether it runs downwards along a shorter axis, if that is known.
    const fn side(course: u8, axis: usize) -> Option<bool> {
        if course < 24 {
            Some(course >> axis & 1 == 1)
        } else {
            None
        }
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

/// A parameter, and where it is on a ray's longest axis, in all lanes.
#[derive(Clone, Copy)]
pub(crate) struct Limit {
    t_max: float32x4_t,
    place: float32x4_t,
}

/// A ray against four boxes at once, fused, in coordinates of its longest axis ([`super::tracing::SlabRay`]).
#[derive(Clone, Copy)]
pub(crate) struct Slabs4<const COURSE: u8> {
    /// The rows it crosses first, of the axes in turn.
    near: [Row; 3],
    scale: float32x4_t,
    offset: [float32x4_t; 2],
    start: float32x4_t,
    /// How far it goes while the parameter grows by one.
    pace: float32x4_t,
}

impl<const COURSE: u8> Slabs4<COURSE> {
    /// Of a ray.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn of<const CALLER: u8>(ray: &Ready) -> Self {
        let [x, y, z] = Course::axes(COURSE);
        let pace = splat(ray.direction, z);
        let start = splat(ray.origin, z);
        let scale = vmulq_f32(ray.inverse, pace);
        let offset = vfmsq_f32(start, ray.origin, scale);
        let down = |axis: usize| match Course::side(COURSE, axis) {
            Some(down) => down,
            None => get(ray.inverse, axis).is_sign_negative(),
        };
        let down = [down(x), down(y), Course::runs_down(COURSE)];
        Self {
            near: Axes::ending_at(z).first_rows(down),
            scale,
            offset: [splat(offset, x), splat(offset, y)],
            start,
            pace,
        }
    }

    /// A parameter for lanes, and what no entry before it is beyond.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn limit<const CALLER: u8>(&self, t_max: f32) -> (Limit, u32) {
        let t_max = vdupq_n_f32(t_max);
        let way = vmulq_f32(t_max, self.pace);
        let place = vaddq_f32(self.start, way);
        let bound = Child::bound(vgetq_lane_f32::<0>(vabsq_f32(way)));
        (Limit { t_max, place }, bound)
    }

    /// Where the ray enters each box, and which boxes it does enter.
    #[inline]
    #[target_feature(enable = "neon")]
    fn spans(&self, planes: &Planes<4>, limit: float32x4_t) -> (float32x4_t, uint32x4_t) {
        let [x, y, _] = Course::axes(COURSE);
        let down = Course::runs_down(COURSE);
        let later = |a, b| {
            if down {
                vminq_f32(a, b)
            } else {
                vmaxq_f32(a, b)
            }
        };
        let sooner = |a, b| {
            if down {
                vmaxq_f32(a, b)
            } else {
                vminq_f32(a, b)
            }
        };
        let at_x = |row: Row| vfmaq_f32(self.offset[0], row4(planes, row), splat(self.scale, x));
        let at_y = |row: Row| vfmaq_f32(self.offset[1], row4(planes, row), splat(self.scale, y));
        let [near_x, near_y, near_z] = self.near;
        let entry = later(
            later(at_x(near_x), at_y(near_y)),
            later(row4(planes, near_z), self.start),
        );
        let exit = sooner(
            sooner(at_x(near_x.opposite()), at_y(near_y.opposite())),
            sooner(row4(planes, near_z.opposite()), limit),
        );
        let entered = if down {
            vcleq_f32(exit, entry)
        } else {
            vcleq_f32(entry, exit)
        };
        (entry, entered)
    }

    /// Which boxes the ray enters, and where.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<4>,
        links: &[u32; 4],
        limit: Limit,
    ) -> (Summed, Spans4) {
        let (entry, entered) = self.spans(planes, limit.place);
        // SAFETY: a reference to four u32; the load needs no more alignment than theirs.
        let links = unsafe { vld1q_u32(links.as_ptr()) };
        let sum = vaddvq_u32(vandq_u32(entered, links));
        (Summed(sum), Spans4 { entry, entered })
    }

    /// Which boxes the ray enters, a bit each.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn entered<const CALLER: u8>(&self, planes: &Planes<4>, limit: Limit) -> u32 {
        bits(self.spans(planes, limit.place).1)
    }

    /// Keys: how far off each box is entered, its lane in the lowest two bits. No difference of equals is −0.
    #[inline]
    #[target_feature(enable = "neon")]
    fn keys(&self, entry: float32x4_t) -> uint32x4_t {
        let way = if Course::runs_down(COURSE) {
            vsubq_f32(self.start, entry)
        } else {
            vsubq_f32(entry, self.start)
        };
        let lanes = vcombine_u32(vcreate_u32(1 << 32), vcreate_u32(2 | 3 << 32));
        let rounded = vbicq_u32(vreinterpretq_u32_f32(way), vdupq_n_u32(3));
        vorrq_u32(rounded, lanes)
    }

    /// The two boxes that the ray enters, the nearer first.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn pair<const CALLER: u8>(&self, spans: Spans4) -> [Child; 2] {
        let keys = self.keys(spans.entry);
        [
            child(vminvq_u32(vornq_u32(keys, spans.entered))),
            child(vmaxvq_u32(vandq_u32(keys, spans.entered))),
        ]
    }

    /// Keys of four boxes, the greatest number for those that are not entered.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn sort<const CALLER: u8>(&self, spans: Spans4) -> uint32x4_t {
        vornq_u32(self.keys(spans.entry), spans.entered)
    }
}

/// A link as nodes of this instruction set hold it, so that a sum over boxes is the link of a single one, and counts them:
/// the number from the fourth bit up, and one. There is no room for 2²⁹ nodes and blocks.
pub(crate) fn summand(number: u32) -> u32 {
    number << 3 | 1
}

/// The number of a link.
#[inline(always)]
pub(crate) fn summand_number(summand: u32) -> u32 {
    summand >> 3
}

/// Which boxes a ray enters: the sum of their links.
#[derive(Clone, Copy)]
pub(crate) struct Summed(u32);

impl Entered for Summed {
    #[inline(always)]
    fn is_none(self) -> bool {
        self.0 == 0
    }

    #[inline(always)]
    fn only<const W: usize>(self, _links: &[u32; W]) -> Option<u32> {
        (self.0 & 6 == 0).then_some(self.0)
    }

    #[inline(always)]
    fn other<const W: usize>(self, _links: &[u32; W], nearer: u32, _other: Child) -> u32 {
        self.0.wrapping_sub(nearer)
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

/// The box of a key.
#[inline(always)]
fn child(key: u32) -> Child {
    Child {
        lane: key as usize % 4,
        entry: key,
    }
}

/// The nearest of four boxes, and the keys of the others.
#[inline]
#[target_feature(enable = "neon")]
pub(crate) fn take4<const CALLER: u8, const COURSE: u8>(keys: uint32x4_t) -> (Child, uint32x4_t) {
    let least = vminvq_u32(keys);
    let gone = vceqq_u32(keys, vdupq_n_u32(least));
    (child(least), vorrq_u32(keys, gone))
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
