//! A ray against four boxes. `unsafe` for loads.

use core::arch::aarch64::*;

use super::{Course, Ready, get, splat};
use crate::simd::tracing::{Axes, Child, Entered, Planes, Row};

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

/// A parameter, and where it is on a ray's longest axis, in all lanes.
#[derive(Clone, Copy)]
pub(crate) struct Limit {
    pub(super) t_max: float32x4_t,
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
