//! The unfolding kernel: precedence of commuting reflections, and the points where lines meet planes.
//!
//! Generic over the number of lanes, one sequence a lane. One lane is the specification. Every lane does the same operations
//! in the same order and rounds every product: the number of lanes does not change a bit. Pure `f64` arithmetic in local
//! coordinates; any thread; allocates nothing. Own.

use glam::DVec3;

use crate::propagation::image_source::sequence::{COMMUTING_COSINE, Precedence, Sequence};
use crate::propagation::path::MAX_ORDER;
use crate::scene::{Scene, Surface};

/// Distance from a plane below which a point counts as lying in it, in metres.
const ON_PLANE_M: f64 = 1e-6;

/// Bits of a precedence mask.
const MASK_BITS: usize = 8;

/// Bit 0 of every mask.
const FIRST_BITS: u64 = 0x0101_0101;

/// Of every reflection's mask the bit of the reflection itself.
const OWN_BITS: u64 = 0x0804_0201;

/// Of each reflection its mask among all, its bit there, and its bit in every mask. Tables: a shift by an index is four instructions.
const MASKS: [u64; MAX_ORDER] = [0xff, 0xff << 8, 0xff << 16, 0xff << 24];
const OWN: [u64; MAX_ORDER] = [1, 1 << 9, 1 << 18, 1 << 27];
const BITS: [u64; MAX_ORDER] = [
    FIRST_BITS,
    FIRST_BITS << 1,
    FIRST_BITS << 2,
    FIRST_BITS << 3,
];

/// One vector per lane.
pub(crate) type Vectors<const N: usize> = [[f64; N]; 3];

/// The vector of a lane.
#[inline(always)]
pub(crate) fn vector<const N: usize>(of: &Vectors<N>, lane: usize) -> DVec3 {
    DVec3::new(of[0][lane], of[1][lane], of[2][lane])
}

/// Planes of `N` sequences of one length.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Planes<const N: usize> {
    pub(crate) normal: [Vectors<N>; MAX_ORDER],
    offset_m: [[f64; N]; MAX_ORDER],
}

impl<const N: usize> Planes<N> {
    pub(crate) const EMPTY: Self = Self {
        normal: [[[0.0; N]; 3]; MAX_ORDER],
        offset_m: [[0.0; N]; MAX_ORDER],
    };

    /// Sets the plane of a lane's reflection `index`.
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, index: usize, surface: &Surface) {
        for (axis, value) in surface.normal.to_array().into_iter().enumerate() {
            self.normal[index][axis][lane] = value;
        }
        self.offset_m[index][lane] = surface.offset_m;
    }

    /// For the first `count` planes of each lane: the bits of [`Precedence`], and the sum of the commuting planes' cosines,
    /// their total deviation from perpendicular.
    #[inline(always)]
    pub(crate) fn precedence(&self, count: usize) -> ([u64; N], [f64; N]) {
        let (mut before, mut skew) = ([0u64; N], [0.0; N]);
        for index in 1..count {
            for earlier in 0..index {
                let (a, b) = (&self.normal[earlier], &self.normal[index]);
                let bit = 1u64 << (index * MASK_BITS + earlier);
                for l in 0..N {
                    let dot = a[0][l] * b[0][l] + a[1][l] * b[1][l] + a[2][l] * b[2][l];
                    let cosine = dot.abs();
                    let commutes = cosine < COMMUTING_COSINE;
                    before[l] |= if commutes { 0 } else { bit };
                    skew[l] += if commutes { cosine } else { 0.0 };
                }
            }
        }
        (before, skew)
    }

    /// Mirrors each lane's point in plane `index`. Returns the image's signed distance from the plane.
    #[inline(always)]
    pub(crate) fn mirror(&self, index: usize, point: &mut Vectors<N>) -> [f64; N] {
        let (n, mut image_m) = (&self.normal[index], [0.0; N]);
        for l in 0..N {
            let distance_m = self.distance_m(index, point, l);
            let twice = 2.0 * distance_m;
            point[0][l] -= twice * n[0][l];
            point[1][l] -= twice * n[1][l];
            point[2][l] -= twice * n[2][l];
            image_m[l] = -distance_m;
        }
        image_m
    }

    #[inline(always)]
    fn distance_m(&self, index: usize, point: &Vectors<N>, l: usize) -> f64 {
        let n = &self.normal[index];
        n[0][l] * point[0][l] + n[1][l] * point[1][l] + n[2][l] * point[2][l]
            - self.offset_m[index][l]
    }
}

/// Remaining part of `N` unfolded lines.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lines<const N: usize> {
    /// The last point of each.
    pub(crate) from: Vectors<N>,
    /// The listener's image that each leads to.
    pub(crate) image: Vectors<N>,
    /// [`Precedence`] bits, each reflection's own bit set.
    before: [u64; N],
    /// The remaining reflections, repeated in each mask.
    remaining: [u64; N],
    /// Other than 0 where a line misses a plane. Its further values are meaningless.
    pub(crate) misses: [u64; N],
}

impl<const N: usize> Lines<N> {
    /// Lines from the source to the listener's images, with `count` reflections each.
    #[inline(always)]
    pub(crate) fn new(source: DVec3, image: Vectors<N>, before: [u64; N], count: usize) -> Self {
        let mut own = before;
        for bits in &mut own {
            *bits |= OWN_BITS;
        }
        Self {
            from: [[source.x; N], [source.y; N], [source.z; N]],
            image,
            before: own,
            remaining: [FIRST_BITS * ((1 << count) - 1); N],
            misses: [0; N],
        }
    }

    /// Advances each line to the first plane that it meets among those that may come next, and mirrors its end there. Returns
    /// the reflection of each line, as a bit of every mask.
    ///
    /// Reflections that may come next commute: mirroring in one changes no distance from another. A plane that is not met
    /// now, or only behind one that is taken first, is never met.
    #[inline(always)]
    pub(crate) fn advance(&mut self, planes: &Planes<N>, count: usize) -> [u64; N] {
        let (mut nearest, mut beyond_m) = ([f64::INFINITY; N], [0.0; N]);
        let (mut normal, mut taken) = ([[0.0; N]; 3], [0u64; N]);
        for index in 0..count {
            // Only its own bit is left of its mask: it remains, and all that precede it are taken.
            let (mask, own) = (MASKS[index], OWN[index]);
            let mut is_open = [0u64; N];
            for l in 0..N {
                is_open[l] = all_if(self.before[l] & self.remaining[l] & mask == own);
            }
            if is_open == [0; N] {
                continue;
            }
            let (n, bit) = (&planes.normal[index], BITS[index]);
            for l in 0..N {
                let here_m = planes.distance_m(index, &self.from, l);
                let there_m = planes.distance_m(index, &self.image, l);
                let is_missed = all_if(here_m * there_m >= 0.0)
                    | all_if(here_m.abs() < ON_PLANE_M)
                    | all_if(there_m.abs() < ON_PLANE_M);
                self.misses[l] |= is_missed & is_open[l];
                let fraction = here_m / (here_m - there_m);
                let is_nearer = is_open[l] & all_if(fraction < nearest[l]);
                nearest[l] = select(is_nearer, fraction, nearest[l]);
                beyond_m[l] = select(is_nearer, there_m, beyond_m[l]);
                normal[0][l] = select(is_nearer, n[0][l], normal[0][l]);
                normal[1][l] = select(is_nearer, n[1][l], normal[1][l]);
                normal[2][l] = select(is_nearer, n[2][l], normal[2][l]);
                taken[l] = (bit & is_nearer) | (taken[l] & !is_nearer);
            }
        }
        for l in 0..N {
            // Positions that are not numbers have no nearest plane.
            self.misses[l] |= !all_if(nearest[l] < f64::INFINITY);
            self.remaining[l] &= !taken[l];
        }
        for axis in 0..3 {
            for l in 0..N {
                self.from[axis][l] += (self.image[axis][l] - self.from[axis][l]) * nearest[l];
                self.image[axis][l] -= 2.0 * beyond_m[l] * normal[axis][l];
            }
        }
        taken
    }
}

/// The reflection that [`Lines::advance`] returned for a lane.
#[inline(always)]
pub(crate) fn index_of(taken: u64) -> usize {
    taken.trailing_zeros() as usize % MAX_ORDER
}

impl Precedence {
    /// Precedence of a sequence's reflections.
    #[inline]
    pub(crate) fn of(scene: &Scene, sequence: &Sequence) -> Self {
        let count = sequence.len().min(MAX_ORDER);
        let ([before], _) = planes_of(scene, sequence).precedence(count);
        Self::from_bits(before as u32, count)
    }
}

/// One lane with the planes of a sequence.
#[inline(always)]
pub(crate) fn planes_of(scene: &Scene, sequence: &Sequence) -> Planes<1> {
    let mut planes = Planes::EMPTY;
    for (index, &surface) in sequence.surfaces().iter().enumerate().take(MAX_ORDER) {
        planes.set(0, index, scene.surface(surface));
    }
    planes
}

/// All bits or none.
#[inline(always)]
fn all_if(condition: bool) -> u64 {
    u64::from(condition).wrapping_neg()
}

/// `a` where the mask has all bits, `b` where it has none.
#[inline(always)]
fn select(mask: u64, a: f64, b: f64) -> f64 {
    f64::from_bits((a.to_bits() & mask) | (b.to_bits() & !mask))
}
