//! What the kernels of ray tracing work on: a ray made ready, boxes and triangles in lanes.
//!
//! Mindless: numbers in a layout, and the portable arithmetic that every instruction set is tested against. What they
//! mean stands in `geometry`.

/// A ray against boxes: a plane is crossed at `(plane − origin) · inverse`, which lanes on x86-64 write as
/// `plane · inverse − origin · inverse`.
///
/// NEON's measure in coordinates of the axis along which the ray's direction is longest: planes across that axis are crossed
/// at themselves, which takes no arithmetic, others at `plane · scale + offset`, where `scale` is the longest component of
/// the direction over the other. Where coordinates fall along the ray, what is greatest else is least.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlabRay {
    /// Start.
    pub(crate) origin: [f32; 3],
    /// One over the direction.
    pub(crate) inverse: [f32; 3],
}

/// 1 + 2 γ(3) rounded up, γ(n) = n ε / (1 − n ε) with ε half a unit in the last place (\[IZE13\]).
pub(crate) const FAR_WIDENING: f32 = 1.000_000_5;

/// Its counterpart for near planes.
pub(crate) const NEAR_NARROWING: f32 = 0.999_999_5;

/// Planes of `W` boxes: lower and upper, axis after axis.
pub(crate) type Planes<const W: usize> = [[f32; W]; 6];

/// A row of [`Planes`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row(usize);

impl Row {
    /// The rows that a ray crosses first, from one over its direction.
    #[inline(always)]
    pub(crate) fn near(inverse: [f32; 3]) -> [Self; 3] {
        let side = |axis: usize| (inverse[axis].to_bits() >> 31) as usize;
        [Self(side(0)), Self(2 + side(1)), Self(4 + side(2))]
    }

    /// The row of the box's other side.
    #[inline(always)]
    pub(crate) fn opposite(self) -> Self {
        Self(self.0 ^ 1)
    }

    /// Its number: 5 at most.
    #[inline(always)]
    pub(crate) fn number(self) -> usize {
        self.0
    }
}

impl SlabRay {
    /// Parameters between which the ray is in one box, whether or not there are any: the first a hair too small and the
    /// last a hair too large, so that rounding never closes a box that the ray meets.
    #[inline(always)]
    pub(crate) fn span(&self, side: impl Fn(Row) -> f32) -> (f32, f32) {
        let mut near = f32::NEG_INFINITY;
        let mut far = f32::INFINITY;
        for (axis, row) in Row::near(self.inverse).into_iter().enumerate() {
            let at = |row: Row| (side(row) - self.origin[axis]) * self.inverse[axis];
            near = near.max(at(row));
            far = far.min(at(row.opposite()));
        }
        (near * NEAR_NARROWING, far * FAR_WIDENING)
    }

    /// Which of `W` boxes the ray enters before a parameter, and where.
    #[inline(always)]
    pub(crate) fn enter<const W: usize>(
        &self,
        planes: &Planes<W>,
        t_max: f32,
    ) -> (BitEach, [u32; W]) {
        let mut entered = 0;
        let entries = std::array::from_fn(|lane| {
            let (near, far) = self.span(|row| planes[row.number()][lane]);
            let entry = if near > 0.0 { near } else { 0.0 };
            entered |= u32::from(entry <= far.min(t_max)) << lane;
            entry.to_bits()
        });
        (BitEach(entered), entries)
    }
}

/// Which boxes of a node a ray enters, in whatever way lanes find it out.
pub(crate) trait Entered: Copy {
    /// Whether it enters none.
    fn is_none(self) -> bool;
    /// The link of the box, if it is a single one; asked only if it is not none.
    fn only<const W: usize>(self, links: &[u32; W]) -> Option<u32>;
    /// The link of the other box, if they are two.
    fn other<const W: usize>(self, links: &[u32; W], nearer: u32, other: Child) -> u32;
    /// Whether they are two; asked only if they are more than one.
    fn is_pair(self) -> bool;
    /// How many they are.
    fn count(self) -> usize;
}

/// A bit for each lane.
#[derive(Clone, Copy)]
pub(crate) struct BitEach(pub(crate) u32);

impl BitEach {
    /// The lowest lane and the next.
    #[inline(always)]
    pub(crate) fn lowest_two(self) -> [usize; 2] {
        let rest = self.0 & self.0.wrapping_sub(1);
        [self.0, rest].map(|bits| bits.trailing_zeros() as usize)
    }

    /// Two boxes of which the first two lanes are, the nearer first.
    #[inline(always)]
    pub(crate) fn pair<const W: usize>(self, entries: &[u32; W]) -> [Child; 2] {
        let [a, b] = self.lowest_two().map(|lane| Child {
            lane,
            entry: entries[lane % W],
        });
        if b.entry < a.entry { [b, a] } else { [a, b] }
    }
}

impl Entered for BitEach {
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

/// A box that a ray enters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Child {
    /// Its lane.
    pub(crate) lane: usize,
    /// The bits of how far off the ray enters, rounded down but for the lowest two, which may be any. Distances are never
    /// negative, so their bits order as they do.
    pub(crate) entry: u32,
}

impl Child {
    /// What entries are compared with: none of a box that the ray enters no farther off is greater.
    #[inline(always)]
    pub(crate) fn bound(farthest: f32) -> u32 {
        farthest.to_bits() | 3
    }
}

/// Lanes of triangles that a ray meets, from the lowest up: a bit each, so many places apart.
#[derive(Clone, Copy)]
pub(crate) struct Met<const APART: u32>(pub(crate) u64);

impl<const APART: u32> Iterator for Met<APART> {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let lane = self.0.trailing_zeros() / APART;
        self.0 &= self.0 - 1;
        Some(lane as usize % 4)
    }
}

/// A ray against triangles: axes permuted and sheared so that it runs along z (\[WOOP13\]).
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShearRay {
    /// Start.
    pub(crate) origin: [f32; 3],
    /// Which axes stand for x, y and z.
    pub(crate) axes: Axes,
    /// Shear along x and y, and one over the direction's z.
    pub(crate) shear: [f32; 3],
    /// Hits at or before this parameter do not count.
    pub(crate) t_min: f32,
}

/// Three axes in turn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axes([usize; 3]);

impl Axes {
    /// Those of which a given one, of 0 to 2, is the last.
    #[inline(always)]
    pub(crate) fn ending_at(last: usize) -> Self {
        const TURNS: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];
        Self(TURNS[last.min(2)])
    }

    /// The rows that a ray crosses first, of the axes in turn, where it runs downwards along them or up.
    #[cfg(target_arch = "aarch64")]
    #[inline(always)]
    pub(crate) fn first_rows(self, down: [bool; 3]) -> [Row; 3] {
        let row = |k: usize| Row(2 * self.0[k] + usize::from(down[k]));
        [row(0), row(1), row(2)]
    }

    /// Their numbers: 2 at most.
    #[inline(always)]
    pub(crate) fn numbers(self) -> [usize; 3] {
        self.0
    }
}

/// Four triangles: corner, axis, lane.
pub(crate) type Corners = [[[f32; 4]; 3]; 3];

/// Smallest direction component that boxes see, as a share of the largest: 2⁻⁴⁰. What it moves a ray by is far less
/// than what boxes stand off.
pub(crate) const SMALLEST_COMPONENT: f32 = 1.0 / (1u64 << 40) as f32;

/// Where rays may start and how long their directions may be for the lanes' arithmetic: outside it could miss boxes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    /// Farthest coordinate of a start; not a number if none will do.
    pub(crate) reach: f32,
}

impl Near {
    /// Greatest component of a direction.
    pub(crate) const LONGEST: f32 = (1u64 << 40) as f32;
    /// Least of the greatest components of directions.
    pub(crate) const SHORTEST: f32 = 1.0 / Self::LONGEST;
}

/// A ray as it comes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RawRay<'a> {
    /// Start.
    pub(crate) origin: &'a [f32; 3],
    /// Of any length.
    pub(crate) direction: &'a [f32; 3],
    /// Hits at or before this parameter do not count; not negative.
    pub(crate) t_min: f32,
    /// How far a triangle's box stands off it.
    pub(crate) margin: f32,
}

/// A ray against triangles and the boxes they stand in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TriangleRay {
    /// Against boxes.
    pub(crate) slabs: SlabRay,
    /// Against triangles.
    pub(crate) shear: ShearRay,
    /// How far a triangle's box stands off it.
    pub(crate) margin: f32,
}

impl TriangleRay {
    /// Of a ray whose numbers are finite and whose direction is not zero.
    #[inline(always)]
    pub(crate) fn of(ray: RawRay<'_>) -> Self {
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
        let over = |k: usize| 1.0 / size[k].max(smallest).copysign(direction[k]);
        let inverse = [over(0), over(1), over(2)];
        let first_largest = size.iter().position(|&s| s == largest);
        let axes = Axes::ending_at(first_largest.unwrap_or(2));
        let [kx, ky, kz] = axes.numbers();
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

    /// Parameter at which the ray meets the triangle in a lane: beyond `t_min`, before `before`.
    ///
    /// The specification of all triangle kernels, which give the same bits: the order of operations is fixed and none
    /// is fused.
    #[inline(always)]
    pub(crate) fn meet(&self, corners: &Corners, lane: usize, before: f32) -> Option<f32> {
        let t = self.shear.meet(corners, lane)?;
        let [a, b, c] = corners;
        let (near, far) = self.slabs.span(|row| {
            let axis = row.number() / 2;
            let (a, b, c) = (a[axis][lane], b[axis][lane], c[axis][lane]);
            match row.number() % 2 {
                0 => a.min(b).min(c) - self.margin,
                _ => a.max(b).max(c) + self.margin,
            }
        });
        let t = if near > t { near } else { t };
        (near <= far && far >= 0.0 && t < before).then_some(t)
    }

    /// Which of four triangles the ray meets between `t_min` and `before`, and where.
    #[inline(always)]
    pub(crate) fn meet_four<const APART: u32>(
        &self,
        corners: &Corners,
        before: f32,
        at: &mut [f32; 4],
    ) -> Met<APART> {
        let all = Met((0..4).fold(0, |bits, lane| bits | 1 << (lane * APART)));
        self.meet_again(corners, before, at, all)
    }

    /// As [`Self::meet_four`] for some lanes.
    #[inline(always)]
    pub(crate) fn meet_again<const APART: u32>(
        &self,
        corners: &Corners,
        before: f32,
        at: &mut [f32; 4],
        lanes: Met<APART>,
    ) -> Met<APART> {
        let mut met = Met(0);
        for lane in lanes {
            if let Some(t) = self.meet(corners, lane, before) {
                at[lane] = t;
                met.0 |= 1 << (lane as u32 * APART);
            }
        }
        met
    }
}

impl ShearRay {
    /// Parameter at which the ray meets the triangle in a lane, if it is beyond `t_min`.
    #[inline(always)]
    fn meet(&self, corners: &Corners, lane: usize) -> Option<f32> {
        let [kx, ky, kz] = self.axes.numbers();
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
