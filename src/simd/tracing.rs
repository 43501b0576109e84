//! What the kernels of ray tracing work on: a ray made ready, boxes and triangles in lanes.
//!
//! Mindless: numbers in a layout, and the portable arithmetic that every instruction set is tested against. What they
//! mean stands in `geometry`.

/// A ray against boxes: planes of a box are crossed at `(plane − origin) · scale`, the scale of near planes a hair too
/// small and that of far planes a hair too large, so that rounding never closes a box that the ray meets.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlabRay {
    /// Start.
    pub(crate) origin: [f32; 3],
    /// One over the direction, reduced.
    pub(crate) near_scale: [f32; 3],
    /// One over the direction, enlarged.
    pub(crate) far_scale: [f32; 3],
    /// Whether the ray runs down an axis, so that upper planes are the near ones.
    pub(crate) down: [bool; 3],
}

/// A ray against boxes in fused arithmetic: planes are crossed at `plane · scale + offset`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FusedSlabRay {
    pub(crate) near_scale: [f32; 3],
    pub(crate) near_offset: [f32; 3],
    pub(crate) far_scale: [f32; 3],
    pub(crate) far_offset: [f32; 3],
}

/// Eight half units in the last place of an `f32`.
///
/// The specification crosses a plane `p` at `v = (p − o) s`, rounded twice: within 2.1 half units in the last place of
/// `v`. Fused it is `p s′ − c`, rounded once, with `s′ = s (1 ± slack)` and `c = o s′ (1 ± slack)`, whose own rounding is
/// two half units. So the near side comes out lower and the far side higher wherever `v` is positive; where it is
/// negative both sides are cut off at 0. No box is missed that the specification enters.
pub(crate) const FUSED_SLACK: f32 = 1.0 / (1u32 << 21) as f32;

/// Planes of `W` boxes: three lower, three upper.
pub(crate) type Planes<const W: usize> = [[f32; W]; 6];

impl SlabRay {
    /// Row of [`Planes`] that the ray crosses first on an axis; the other is the farther.
    #[inline(always)]
    pub(crate) fn near_row(&self, axis: usize) -> usize {
        axis + 3 * usize::from(self.down[axis])
    }

    /// Row of [`Planes`] that the ray crosses last on an axis.
    #[inline(always)]
    pub(crate) fn far_row(&self, axis: usize) -> usize {
        axis + 3 * usize::from(!self.down[axis])
    }

    /// For fused arithmetic, which may enter more boxes and never fewer.
    #[inline(always)]
    pub(crate) fn fused(&self) -> FusedSlabRay {
        let mut fused = FusedSlabRay {
            near_scale: [0.0; 3],
            near_offset: [0.0; 3],
            far_scale: [0.0; 3],
            far_offset: [0.0; 3],
        };
        for axis in 0..3 {
            let near = self.near_scale[axis] * (1.0 - FUSED_SLACK);
            let far = self.far_scale[axis] * (1.0 + FUSED_SLACK);
            let (near_at, far_at) = (near * self.origin[axis], far * self.origin[axis]);
            fused.near_scale[axis] = near;
            fused.near_offset[axis] = -(near_at + near_at.abs() * FUSED_SLACK);
            fused.far_scale[axis] = far;
            fused.far_offset[axis] = -(far_at - far_at.abs() * FUSED_SLACK);
        }
        fused
    }

    /// Parameters between which the ray is in one box, whether or not there are any.
    #[inline(always)]
    pub(crate) fn span<const W: usize>(&self, planes: &Planes<W>, lane: usize) -> (f32, f32) {
        let mut near = f32::NEG_INFINITY;
        let mut far = f32::INFINITY;
        for axis in 0..3 {
            let first = planes[self.near_row(axis)][lane] - self.origin[axis];
            let last = planes[self.far_row(axis)][lane] - self.origin[axis];
            near = near.max(first * self.near_scale[axis]);
            far = far.min(last * self.far_scale[axis]);
        }
        (near, far)
    }

    /// Which boxes the ray enters between 0 and `t_max`, a bit each, and where.
    #[inline(always)]
    pub(crate) fn enter<const W: usize>(
        &self,
        planes: &Planes<W>,
        t_max: f32,
        entries: &mut [f32; W],
    ) -> u32 {
        let mut entered = 0;
        for (lane, entry) in entries.iter_mut().enumerate() {
            let (near, far) = self.span(planes, lane);
            *entry = if near > 0.0 { near } else { 0.0 };
            entered |= u32::from(*entry <= far.min(t_max)) << lane;
        }
        entered
    }
}

/// A ray against triangles: axes permuted and sheared so that it runs along +z ([WOOP13]).
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShearRay {
    /// Start.
    pub(crate) origin: [f32; 3],
    /// Which axis stands for x, y and z; 2 at most.
    pub(crate) axis: [usize; 3],
    /// Shear along x and y, and one over the direction's z.
    pub(crate) shear: [f32; 3],
    /// Hits at or before this parameter do not count.
    pub(crate) t_min: f32,
}

/// Four triangles: corner, axis, lane.
pub(crate) type Corners = [[[f32; 4]; 3]; 3];

impl ShearRay {
    /// Parameter at which the ray meets the triangle in a lane, if it is beyond `t_min` and not beyond `t_max`.
    ///
    /// The specification of all triangle kernels, which give the same bits: the order of operations is fixed and none
    /// is fused.
    #[inline(always)]
    pub(crate) fn meet(&self, corners: &Corners, lane: usize, t_max: f32) -> Option<f32> {
        let [kx, ky, kz] = self.axis.map(|k| k.min(2));
        let [sx, sy, sz] = self.shear;
        let sheared = corners.map(|corner| {
            let z = corner[kz][lane] - self.origin[kz];
            let x = (corner[kx][lane] - self.origin[kx]) - sx * z;
            let y = (corner[ky][lane] - self.origin[ky]) - sy * z;
            [x, y, z]
        });
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = sheared;
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        if u == 0.0 || v == 0.0 || w == 0.0 {
            // Products of two f32 are exact in f64, so the sign of their difference is true.
            let edge = |px: f32, py: f32, qx: f32, qy: f32| {
                (f64::from(px) * f64::from(qy) - f64::from(py) * f64::from(qx)) as f32
            };
            u = edge(cx, cy, bx, by);
            v = edge(ax, ay, cx, cy);
            w = edge(bx, by, ax, ay);
            if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
                return None;
            }
        }
        let determinant = (u + v) + w;
        if determinant == 0.0 {
            return None;
        }
        let t = ((u * (sz * az) + v * (sz * bz)) + w * (sz * cz)) / determinant;
        (t > self.t_min && t <= t_max).then_some(t)
    }

    /// Which of four triangles the ray meets between `t_min` and `t_max`, a bit each, and where.
    #[inline(always)]
    pub(crate) fn meet_four(&self, corners: &Corners, t_max: f32, at: &mut [f32; 4]) -> u32 {
        let mut met = 0;
        for (lane, at) in at.iter_mut().enumerate() {
            if let Some(t) = self.meet(corners, lane, t_max) {
                *at = t;
                met |= 1 << lane;
            }
        }
        met
    }

    /// Decides the lanes of `again`, where an edge function is zero, by [`Self::meet`]; the others are in `met`.
    #[cold]
    #[inline(never)]
    pub(crate) fn meet_again(
        &self,
        corners: &Corners,
        t_max: f32,
        at: &mut [f32; 4],
        met: u32,
        again: u32,
    ) -> u32 {
        let mut met = met & !again;
        for (lane, at) in at.iter_mut().enumerate() {
            if again >> lane & 1 == 1
                && let Some(t) = self.meet(corners, lane, t_max)
            {
                *at = t;
                met |= 1 << lane;
            }
        }
        met
    }
}
