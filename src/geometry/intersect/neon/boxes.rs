//! A ray against four boxes. `unsafe` for loads.

use core::arch::aarch64::*;

use super::{DirectionClass, RayVectors, get, splat};
use crate::geometry::intersect::{Axes, Child, EnteredChildren, PlaneRow, Planes};

/// The lanes with all bits set, one bit a lane.
#[inline]
#[target_feature(enable = "neon")]
fn bits(lanes: uint32x4_t) -> u32 {
    let weights = vcombine_u32(vcreate_u32(1 | 2 << 32), vcreate_u32(4 | 8 << 32));
    vaddvq_u32(vandq_u32(lanes, weights))
}

/// Loads a row of planes.
#[inline]
#[target_feature(enable = "neon")]
fn row4(planes: &Planes<4>, row: PlaneRow) -> float32x4_t {
    // SAFETY: a row index is at most 5, and there are six rows.
    let row = unsafe { planes.as_ptr().add(row.index()) };
    // SAFETY: a row is four f32; the load needs no alignment.
    unsafe { vld1q_f32(row.cast::<f32>()) }
}

/// An upper limit of the parameter, and the coordinate there on the ray's longest axis, in all lanes.
#[derive(Clone, Copy)]
pub(crate) struct RayLimit {
    pub(super) t_max: float32x4_t,
    coordinate: float32x4_t,
}

/// A ray against four boxes, in coordinates of its longest axis
/// ([`SlabRay`](crate::geometry::intersect::SlabRay)), by fused multiply-add.
#[derive(Clone, Copy)]
pub(crate) struct SlabRay4<const CLASS: u8> {
    /// The rows that it crosses first, by permuted axis.
    near: [PlaneRow; 3],
    scale: float32x4_t,
    offset: [float32x4_t; 2],
    start: float32x4_t,
    /// Change of the coordinate per unit of the parameter.
    speed: float32x4_t,
}

impl<const CLASS: u8> SlabRay4<CLASS> {
    /// Precomputes the terms of a ray.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn new<const CALLER: u8>(ray: &RayVectors) -> Self {
        let [x, y, z] = DirectionClass::axes(CLASS);
        let speed = splat(ray.direction, z);
        let start = splat(ray.origin, z);
        let scale = vmulq_f32(ray.inverse, speed);
        let offset = vfmsq_f32(start, ray.origin, scale);
        let descends = |axis: usize| get(ray.inverse, axis).is_sign_negative();
        let descends = [descends(x), descends(y), DirectionClass::descends(CLASS)];
        Self {
            near: Axes::ending_at(z).near_rows(descends),
            scale,
            offset: [splat(offset, x), splat(offset, y)],
            start,
            speed,
        }
    }

    /// An upper limit of the parameter, and the upper bound of distance keys before it.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn limit<const CALLER: u8>(&self, t_max: f32) -> (RayLimit, u32) {
        let t_max = vdupq_n_f32(t_max);
        let distance = vmulq_f32(t_max, self.speed);
        let coordinate = vaddq_f32(self.start, distance);
        let bound = Child::bound(vgetq_lane_f32::<0>(vabsq_f32(distance)));
        (RayLimit { t_max, coordinate }, bound)
    }

    /// Coordinates at which the ray enters each box, and a mask of the boxes that it enters.
    #[inline]
    #[target_feature(enable = "neon")]
    fn spans(&self, planes: &Planes<4>, limit: float32x4_t) -> (float32x4_t, uint32x4_t) {
        let [x, y, _] = DirectionClass::axes(CLASS);
        let descends = DirectionClass::descends(CLASS);
        let later = |a, b| {
            if descends {
                vminq_f32(a, b)
            } else {
                vmaxq_f32(a, b)
            }
        };
        let sooner = |a, b| {
            if descends {
                vmaxq_f32(a, b)
            } else {
                vminq_f32(a, b)
            }
        };
        let at_x =
            |row: PlaneRow| vfmaq_f32(self.offset[0], row4(planes, row), splat(self.scale, x));
        let at_y =
            |row: PlaneRow| vfmaq_f32(self.offset[1], row4(planes, row), splat(self.scale, y));
        let [near_x, near_y, near_z] = self.near;
        let entry = later(
            later(at_x(near_x), at_y(near_y)),
            later(row4(planes, near_z), self.start),
        );
        let exit = sooner(
            sooner(at_x(near_x.opposite()), at_y(near_y.opposite())),
            sooner(row4(planes, near_z.opposite()), limit),
        );
        let entered = if descends {
            vcleq_f32(exit, entry)
        } else {
            vcleq_f32(entry, exit)
        };
        (entry, entered)
    }

    /// The boxes that the ray enters, and their spans.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn enter<const CALLER: u8>(
        &self,
        planes: &Planes<4>,
        links: &[u32; 4],
        limit: RayLimit,
    ) -> (LinkSum, BoxSpans4) {
        let (entry, entered) = self.spans(planes, limit.coordinate);
        // SAFETY: a reference to four u32; the load needs no more alignment than theirs.
        let links = unsafe { vld1q_u32(links.as_ptr()) };
        let sum = vaddvq_u32(vandq_u32(entered, links));
        (LinkSum(sum), BoxSpans4 { entry, entered })
    }

    /// The boxes that the ray enters, one bit a lane.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn entered<const CALLER: u8>(&self, planes: &Planes<4>, limit: RayLimit) -> u32 {
        bits(self.spans(planes, limit.coordinate).1)
    }

    /// Distance keys with the lane in the lowest two bits. No difference of equal numbers is −0.
    #[inline]
    #[target_feature(enable = "neon")]
    fn keys(&self, entry: float32x4_t) -> uint32x4_t {
        let distance = if DirectionClass::descends(CLASS) {
            vsubq_f32(self.start, entry)
        } else {
            vsubq_f32(entry, self.start)
        };
        let lanes = vcombine_u32(vcreate_u32(1 << 32), vcreate_u32(2 | 3 << 32));
        let rounded = vbicq_u32(vreinterpretq_u32_f32(distance), vdupq_n_u32(3));
        vorrq_u32(rounded, lanes)
    }

    /// The two boxes that the ray enters, the nearer first.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn nearer_first<const CALLER: u8>(&self, spans: BoxSpans4) -> [Child; 2] {
        let keys = self.keys(spans.entry);
        [
            child(vminvq_u32(vornq_u32(keys, spans.entered))),
            child(vmaxvq_u32(vandq_u32(keys, spans.entered))),
        ]
    }

    /// Keys of four boxes; the maximum for a box that the ray misses.
    #[inline]
    #[target_feature(enable = "neon")]
    pub(crate) fn sort_keys<const CALLER: u8>(&self, spans: BoxSpans4) -> uint32x4_t {
        vornq_u32(self.keys(spans.entry), spans.entered)
    }
}

/// Encodes a link for a sum over boxes that is the link of a single box and counts them: the index from the fourth bit up,
/// and a one. 2²⁹ nodes and blocks do not fit into memory.
pub(crate) fn encode_link(index: u32) -> u32 {
    index << 3 | 1
}

/// The index of an encoded link.
#[inline(always)]
pub(crate) fn link_index(link: u32) -> u32 {
    link >> 3
}

/// The boxes that a ray enters: the sum of their links.
#[derive(Clone, Copy)]
pub(crate) struct LinkSum(u32);

impl EnteredChildren for LinkSum {
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

/// Coordinates at which a ray enters four boxes, and a mask of the boxes that it enters.
#[derive(Clone, Copy)]
pub(crate) struct BoxSpans4 {
    entry: float32x4_t,
    entered: uint32x4_t,
}

/// The child of a key.
#[inline(always)]
fn child(key: u32) -> Child {
    Child {
        lane: key as usize % 4,
        entry: key,
    }
}

/// Removes the nearest box from the keys.
#[inline]
#[target_feature(enable = "neon")]
pub(crate) fn pop_nearest<const CALLER: u8, const CLASS: u8>(
    keys: uint32x4_t,
) -> (Child, uint32x4_t) {
    let least = vminvq_u32(keys);
    let removed = vceqq_u32(keys, vdupq_n_u32(least));
    (child(least), vorrq_u32(keys, removed))
}
