//! A ray against several boxes or triangles at once: data layouts and the scalar reference.
//!
//! `x86` and `neon` have the kernels of each instruction set. Triangle kernels give the bits of the reference. Box kernels
//! may report a box that the reference does not enter, never the reverse; [`bvh`](super::bvh) enlarges boxes accordingly.

#[cfg(target_arch = "aarch64")]
pub(super) mod neon;
#[cfg(target_arch = "x86_64")]
pub(super) mod x86;

/// A ray against boxes: it crosses a plane at `(plane − origin) · inverse`. AVX2 computes
/// `plane · inverse − origin · inverse`.
///
/// NEON computes coordinates on the ray's longest axis, the axis of the largest direction component: planes across that axis
/// need no arithmetic, others are crossed at `plane · scale + offset`, where `scale` is the longest component of the
/// direction over the other. Where the ray descends along that axis, minimum and maximum swap.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlabRay {
    pub(super) origin: [f32; 3],
    /// Reciprocal of the direction.
    pub(super) inverse: [f32; 3],
}

/// 1 + 2 γ(3) rounded up, γ(n) = n ε / (1 − n ε) with ε half a unit in the last place (\[IZE13\]).
pub(super) const FAR_WIDENING: f32 = 1.000_000_5;

/// The counterpart of [`FAR_WIDENING`] for near planes.
pub(super) const NEAR_NARROWING: f32 = 0.999_999_5;

/// Planes of `W` boxes: lower and upper, axis after axis.
pub(super) type Planes<const W: usize> = [[f32; W]; 6];

/// Index of a row of [`Planes`], at most 5.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlaneRow(usize);

impl PlaneRow {
    /// The rows that a ray crosses first, from the reciprocal of its direction.
    #[inline(always)]
    pub(super) fn near(inverse: [f32; 3]) -> [Self; 3] {
        let side = |axis: usize| (inverse[axis].to_bits() >> 31) as usize;
        [Self(side(0)), Self(2 + side(1)), Self(4 + side(2))]
    }

    /// The row of the box's opposite side.
    #[inline(always)]
    pub(super) fn opposite(self) -> Self {
        Self(self.0 ^ 1)
    }

    /// The index, at most 5.
    #[inline(always)]
    pub(super) fn index(self) -> usize {
        self.0
    }
}

impl SlabRay {
    /// Parameters at which the ray enters and leaves one box, the first above the second if it misses. The first is rounded
    /// down and the second up: rounding never loses a box that the ray enters.
    #[inline(always)]
    fn span(&self, side: impl Fn(PlaneRow) -> f32) -> (f32, f32) {
        let mut near = f32::NEG_INFINITY;
        let mut far = f32::INFINITY;
        for (axis, row) in PlaneRow::near(self.inverse).into_iter().enumerate() {
            let at = |row: PlaneRow| (side(row) - self.origin[axis]) * self.inverse[axis];
            near = near.max(at(row));
            far = far.min(at(row.opposite()));
        }
        (near * NEAR_NARROWING, far * FAR_WIDENING)
    }

    /// [`Self::span`] of `W` boxes without its rounding, not t_max `near` nor after `far`. Vectorised by the compiler.
    #[inline(always)]
    pub(super) fn spans<const W: usize>(
        &self,
        planes: &Planes<W>,
        near: f32,
        far: f32,
    ) -> [[f32; W]; 2] {
        let (mut near, mut far) = ([near; W], [far; W]);
        for (axis, row) in PlaneRow::near(self.inverse).into_iter().enumerate() {
            let (first, last) = (&planes[row.index()], &planes[row.opposite().index()]);
            let (origin, inverse) = (self.origin[axis], self.inverse[axis]);
            for lane in 0..W {
                let a = (first[lane] - origin) * inverse;
                let b = (last[lane] - origin) * inverse;
                near[lane] = if a > near[lane] { a } else { near[lane] };
                far[lane] = if b < far[lane] { b } else { far[lane] };
            }
        }
        [near, far]
    }

    /// The boxes that the ray enters t_max `t_max`, and the bits of the parameters at which it does.
    #[inline(always)]
    pub(super) fn enter<const W: usize>(
        &self,
        planes: &Planes<W>,
        t_max: f32,
    ) -> (LaneMask, [u32; W]) {
        let mut entered = 0;
        let entries = std::array::from_fn(|lane| {
            let (near, far) = self.span(|row| planes[row.index()][lane]);
            let entry = if near > 0.0 { near } else { 0.0 };
            entered |= u32::from(entry <= far.min(t_max)) << lane;
            entry.to_bits()
        });
        (LaneMask(entered), entries)
    }
}

/// The children of a node that a ray enters, as an instruction set represents them.
pub(super) trait EnteredChildren: Copy {
    /// Whether there are none.
    fn is_none(self) -> bool;
    /// The link of a single child; none if there are more. Requires at least one.
    fn only<const W: usize>(self, links: &[u32; W]) -> Option<u32>;
    /// The link of the farther of two children.
    fn other<const W: usize>(self, links: &[u32; W], nearer: u32, other: Child) -> u32;
    /// Whether there are two. Requires more than one.
    fn is_pair(self) -> bool;
    /// Number of children.
    fn count(self) -> usize;
}

/// Children as a bit mask, one bit a lane.
#[derive(Clone, Copy)]
pub(super) struct LaneMask(pub(super) u32);

impl LaneMask {
    /// The lanes in which `near` is not above `far`.
    #[inline(always)]
    pub(super) fn of_spans<const W: usize>(near: &[f32; W], far: &[f32; W]) -> Self {
        let mut bits = [0u32; W];
        for lane in 0..W {
            bits[lane] = u32::from(near[lane] <= far[lane]) << lane;
        }
        Self(bits.iter().fold(0, |all, bit| all | bit))
    }

    /// The children of the lowest two lanes, the nearer first.
    #[inline(always)]
    pub(super) fn pair<const W: usize>(self, entries: &[u32; W]) -> [Child; 2] {
        let mut children = [Child { lane: 0, entry: 0 }; 2];
        let mut bits = self.0;
        for child in &mut children {
            child.lane = bits.trailing_zeros() as usize;
            child.entry = entries[child.lane % W];
            bits &= bits.wrapping_sub(1);
        }
        let [a, b] = children;
        if b.entry < a.entry { [b, a] } else { [a, b] }
    }
}

impl EnteredChildren for LaneMask {
    #[inline(always)]
    fn is_none(self) -> bool {
        self.0 == 0
    }

    #[inline(always)]
    fn only<const W: usize>(self, links: &[u32; W]) -> Option<u32> {
        let single = self.0 & self.0.wrapping_sub(1) == 0;
        single.then(|| links[self.0.trailing_zeros() as usize % W])
    }

    #[inline(always)]
    fn other<const W: usize>(self, links: &[u32; W], _nearer: u32, other: Child) -> u32 {
        links[other.lane % W]
    }

    #[inline(always)]
    fn is_pair(self) -> bool {
        let rest = self.0 & self.0.wrapping_sub(1);
        rest & rest.wrapping_sub(1) == 0
    }

    #[inline(always)]
    fn count(self) -> usize {
        self.0.count_ones() as usize
    }
}

/// A child of a node that a ray enters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Child {
    /// Its lane.
    pub(super) lane: usize,
    /// Distance key: the bits of the distance at which the ray enters, rounded down; the lowest two bits are arbitrary.
    /// Distances are not negative, so their bits have the same order.
    pub(super) entry: u32,
}

impl Child {
    /// Upper bound of the distance keys of all children entered at most `farthest` away.
    #[inline(always)]
    pub(super) fn bound(farthest: f32) -> u32 {
        farthest.to_bits() | 3
    }
}

/// Lanes of triangles that a ray hits, one bit every `STRIDE` bits; iterates from the lowest.
#[derive(Clone, Copy)]
pub(super) struct HitLanes<const STRIDE: u32>(pub(super) u64);

impl<const STRIDE: u32> Iterator for HitLanes<STRIDE> {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let lane = self.0.trailing_zeros() / STRIDE;
        self.0 &= self.0 - 1;
        Some(lane as usize % 4)
    }
}

/// A ray against triangles: axes are permuted and sheared until it runs along z (\[WOOP13\]).
#[derive(Debug, Clone, Copy)]
pub(super) struct ShearRay {
    pub(super) origin: [f32; 3],
    /// The axes that become x, y and z.
    pub(super) axes: Axes,
    /// Shear along x and y, and the reciprocal of the direction's z.
    pub(super) shear: [f32; 3],
    /// Hits at or t_max this parameter do not count.
    pub(super) t_min: f32,
}

/// A cyclic permutation of the axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axes([usize; 3]);

impl Axes {
    /// The permutation that ends with an axis, 0 to 2.
    #[inline(always)]
    pub(super) fn ending_at(last: usize) -> Self {
        const CYCLES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];
        Self(CYCLES[last.min(2)])
    }

    /// The rows that a ray crosses first, by permuted axis; `descends` along that axis or not.
    #[cfg(target_arch = "aarch64")]
    #[inline(always)]
    pub(super) fn near_rows(self, descends: [bool; 3]) -> [PlaneRow; 3] {
        let row = |k: usize| PlaneRow(2 * self.0[k] + usize::from(descends[k]));
        [row(0), row(1), row(2)]
    }

    /// The axes, each at most 2.
    #[inline(always)]
    pub(super) fn indices(self) -> [usize; 3] {
        self.0
    }
}

/// Corners of four triangles: corner, axis, lane.
pub(super) type Corners = [[[f32; 4]; 3]; 3];

/// Smallest direction component for box tests, as a fraction of the largest: 2⁻⁴⁰. The error of the ray is far below the
/// margin of boxes.
pub(super) const SMALLEST_COMPONENT: f32 = 1.0 / (1u64 << 40) as f32;

/// Range of rays for which the kernels' arithmetic misses no box.
#[derive(Debug, Clone, Copy)]
pub(super) struct RayRange {
    /// Largest coordinate of an origin; a NaN if no ray is in range.
    pub(super) reach: f32,
}

impl RayRange {
    /// Upper limit of the largest component of a direction.
    pub(super) const LONGEST: f32 = (1u64 << 40) as f32;
    /// Lower limit of the largest component of a direction.
    pub(super) const SHORTEST: f32 = 1.0 / Self::LONGEST;
}

/// A ray as arrays.
#[derive(Debug, Clone, Copy)]
pub(super) struct RawRay<'a> {
    pub(super) origin: &'a [f32; 3],
    /// Of any length.
    pub(super) direction: &'a [f32; 3],
    /// Hits at or t_max this parameter do not count; not negative.
    pub(super) t_min: f32,
    /// Margin of the boxes of triangles.
    pub(super) margin: f32,
}

/// The scalar reference: a ray against triangles and their boxes.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScalarRay {
    pub(super) slabs: SlabRay,
    pub(super) shear: ShearRay,
    /// Margin of the boxes of triangles.
    pub(super) margin: f32,
}

impl ScalarRay {
    /// Prepares a ray with finite coordinates and a direction that is not zero.
    #[inline(always)]
    pub(super) fn new(ray: RawRay<'_>) -> Self {
        let RawRay {
            origin: &origin,
            direction: &direction,
            t_min,
            margin,
        } = ray;
        let [x, y, z] = direction;
        let size = [x.abs(), y.abs(), z.abs()];
        let largest = size[0].max(size[1]).max(size[2]);
        let smallest = (largest * SMALLEST_COMPONENT).max(f32::MIN_POSITIVE);
        let reciprocal = |k: usize| 1.0 / size[k].max(smallest).copysign(direction[k]);
        let inverse = [reciprocal(0), reciprocal(1), reciprocal(2)];
        let first_largest = size.iter().position(|&s| s == largest);
        let axes = Axes::ending_at(first_largest.unwrap_or(2));
        let [kx, ky, kz] = axes.indices();
        let shear = [
            direction[kx] * inverse[kz],
            direction[ky] * inverse[kz],
            inverse[kz],
        ];
        Self {
            slabs: SlabRay { origin, inverse },
            shear: ShearRay {
                origin,
                axes,
                shear,
                t_min,
            },
            margin,
        }
    }

    /// Parameter of the intersection with the triangle of a lane, between `t_min` and `t_max`.
    ///
    /// All triangle kernels give these bits: the order of operations is fixed and none is fused.
    #[inline(always)]
    pub(super) fn intersect(&self, corners: &Corners, lane: usize, t_max: f32) -> Option<f32> {
        let t = self.shear.intersect(corners, lane)?;
        let [a, b, c] = corners;
        let (near, far) = self.slabs.span(|row| {
            let axis = row.index() / 2;
            let (a, b, c) = (a[axis][lane], b[axis][lane], c[axis][lane]);
            match row.index() % 2 {
                0 => a.min(b).min(c) - self.margin,
                _ => a.max(b).max(c) + self.margin,
            }
        });
        let t = if near > t { near } else { t };
        (near <= far && far >= 0.0 && t < t_max).then_some(t)
    }

    /// The triangles that the ray intersects between `t_min` and `t_max`, and the parameters.
    #[inline(always)]
    pub(super) fn intersect_four<const STRIDE: u32>(
        &self,
        corners: &Corners,
        t_max: f32,
        at: &mut [f32; 4],
    ) -> HitLanes<STRIDE> {
        let all = HitLanes((0..4).fold(0, |bits, lane| bits | 1 << (lane * STRIDE)));
        self.intersect_lanes(corners, t_max, at, all)
    }

    /// [`Self::intersect_four`] for some lanes.
    #[inline(always)]
    pub(super) fn intersect_lanes<const STRIDE: u32>(
        &self,
        corners: &Corners,
        t_max: f32,
        at: &mut [f32; 4],
        lanes: HitLanes<STRIDE>,
    ) -> HitLanes<STRIDE> {
        let mut hits = HitLanes(0);
        for lane in lanes {
            if let Some(t) = self.intersect(corners, lane, t_max) {
                at[lane] = t;
                hits.0 |= 1 << (lane as u32 * STRIDE);
            }
        }
        hits
    }
}

impl ShearRay {
    /// Parameter of the intersection with the triangle of a lane, above `t_min`.
    #[inline(always)]
    fn intersect(&self, corners: &Corners, lane: usize) -> Option<f32> {
        let [kx, ky, kz] = self.axes.indices();
        let [sx, sy, sz] = self.shear;
        let sheared = |corner: &[[f32; 4]; 3]| {
            let z = corner[kz][lane] - self.origin[kz];
            let x = (corner[kx][lane] - self.origin[kx]) - sx * z;
            let y = (corner[ky][lane] - self.origin[ky]) - sy * z;
            [x, y, z]
        };
        let [ax, ay, az] = sheared(&corners[0]);
        let [bx, by, bz] = sheared(&corners[1]);
        let [cx, cy, cz] = sheared(&corners[2]);
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
        let t = (((u * az + v * bz) + w * cz) * sz) / determinant;
        (t > self.t_min).then_some(t)
    }
}
