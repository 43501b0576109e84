//! Candidates made ready for all sources: a look at eight of them at once that few survive without a path.
//!
//! Unfolded, a path is one straight line from the source to the listener's image, and every surface on it a window that
//! the line has to pass: the surface's bounds, seen in the mirrors before it. Images and windows are the same for every
//! source, and whether a line passes a window costs a few products in single precision. Where reflections commute the
//! line itself says which mirror comes first; the window is then the hull of what it is in any order. Own. Refuses
//! nothing that [`crate::propagation::image_source::image_path::unfold`] accepts: rounding is allowed for.

use glam::DVec3;

use crate::propagation::image_source::direct_validation::{FEW, Looks};
use crate::propagation::image_source::image_path::{MARGIN_M, mirror_listener};
use crate::propagation::image_source::sequence::{Order, Sequence};
use crate::propagation::image_source::unfold_x4;
use crate::propagation::image_source::unfold_x4::SequenceBatch4;
use crate::propagation::path::MAX_ORDER;
use crate::scene::{Scene, Surface};
use crate::simd::{LaneSet, kernel};

/// Sequences that are looked at together.
const LANES: usize = 8;

/// Rounding of a few sums and products of single precision, relative to their largest term, with room to spare.
const ROUNDING: f64 = 24.0 * f32::EPSILON as f64;

/// Distance of an image from a plane below which no path goes there, in metres; keeps quotients finite.
const LEAST_DISTANCE_M: f64 = 1e-7;

/// Half the size of what has no end, in metres.
const ENDLESS_M: f64 = 1e12;

type Lanes = [f32; LANES];

/// Eight surfaces, each with what is seen of its sequence's image on the source's side of it.
///
/// With D the line from image to source, `q = nearness × normal · D` is how far that leads from the image's side, in units
/// of the way to the plane and negative towards it: beyond the plane where it is below −1. The point in the plane is the
/// image's plus D / −q.
#[derive(Debug, Clone, Copy)]
struct Windows {
    normal: [Lanes; 3],
    /// Over the image's signed distance from the plane.
    nearness: Lanes,
    /// From the lower bounds to the image along x, y and z; endless along the axis that the surface is seen along.
    low: [Lanes; 3],
    /// From the upper bounds to the image.
    high: [Lanes; 3],
    /// What rounding may do, as a share of image's and source's distance; infinite where there is no window.
    slack: Lanes,
}

impl Windows {
    /// Every line passes.
    const OPEN: Self = Self {
        normal: [[0.0; LANES]; 3],
        nearness: [0.0; LANES],
        low: [[0.0; LANES]; 3],
        high: [[0.0; LANES]; 3],
        slack: [f32::INFINITY; LANES],
    };

    /// Which lines pass, one a bit; mirrors them for the next window. `size` is the distance that rounding counts in.
    #[inline(always)]
    fn passed(&self, line: &mut [Lanes; 3], size: &Lanes) -> u32 {
        let mut passes = [0u32; LANES];
        for l in 0..LANES {
            let [x, y, z] = [line[0][l], line[1][l], line[2][l]];
            let n = [self.normal[0][l], self.normal[1][l], self.normal[2][l]];
            let along = n[0] * x + n[1] * y + n[2] * z;
            let q = along * self.nearness[l];
            let slack = self.slack[l] * size[l];
            // Where rounding blurs on which side of the plane the source is, everything passes.
            let slack = if slack < 0.5 { slack } else { f32::INFINITY };
            let inside = (q + 1.0 <= slack)
                & (x - self.low[0][l] * q >= -slack)
                & (x - self.high[0][l] * q <= slack)
                & (y - self.low[1][l] * q >= -slack)
                & (y - self.high[1][l] * q <= slack)
                & (z - self.low[2][l] * q >= -slack)
                & (z - self.high[2][l] * q <= slack);
            passes[l] = u32::from(inside) << l;
            let twice = 2.0 * along;
            line[0][l] = x - twice * n[0];
            line[1][l] = y - twice * n[1];
            line[2][l] = z - twice * n[2];
        }
        passes.iter().fold(0, |all, bit| all | bit)
    }

    /// Puts in a surface of each lane from `first` on, seen from four sequences' images of the ear; `margin_m` is how far outside
    /// a line may pass.
    #[inline(always)]
    fn set(
        &mut self,
        first: usize,
        four: &SequenceBatch4,
        place: usize,
        bounds: &Bounds,
        margin_m: f64,
    ) {
        let (normal, image, distance_m) = four.seen(place);
        let (tilt, _) = four.tilt_and_image();
        let mut widest = [1.0f64; unfold_x4::LANES];
        for axis in 0..3 {
            for l in 0..unfold_x4::LANES {
                let low = image[axis][l] - bounds.low[axis][l] + margin_m;
                let high = image[axis][l] - bounds.high[axis][l] - margin_m;
                self.normal[axis][first + l] = normal[axis][l] as f32;
                self.low[axis][first + l] = low as f32;
                self.high[axis][first + l] = high as f32;
                widest[l] += bounds.counts[axis][l] * (low.abs() + high.abs());
            }
        }
        for l in 0..unfold_x4::LANES {
            let away_m = distance_m[l].abs().max(LEAST_DISTANCE_M);
            let rounding = ROUNDING + 8.0 * tilt[l];
            self.nearness[first + l] = (1.0 / away_m.copysign(distance_m[l])) as f32;
            self.slack[first + l] = (rounding * (1.0 + widest[l] / away_m)) as f32;
        }
    }
}

/// Four surfaces' bounds, and those of their images in mirrors that may come before or after them; endless along the axis that
/// a surface is seen along.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: [unfold_x4::Lanes; 3],
    high: [unfold_x4::Lanes; 3],
    /// 0 along that axis, 1 else.
    counts: [unfold_x4::Lanes; 3],
}

impl Bounds {
    const NONE: Self = Self {
        low: [[0.0; unfold_x4::LANES]; 3],
        high: [[0.0; unfold_x4::LANES]; 3],
        counts: [[0.0; unfold_x4::LANES]; 3],
    };

    /// Puts in the surface at a place of a sequence; `aside` says which others may come on its other side.
    #[inline(always)]
    fn put(&mut self, scene: &Scene, lane: usize, sequence: &Sequence, place: usize, aside: u8) {
        let lane = lane % unfold_x4::LANES;
        let (low, high) = hull(scene, sequence, place, aside);
        let main = main_axis(scene.surface(sequence.surface_at(place)).normal);
        let (low, high) = (low.to_array(), high.to_array());
        for axis in 0..3 {
            self.low[axis][lane] = low[axis];
            self.high[axis][lane] = high[axis];
            self.counts[axis][lane] = 1.0;
        }
        self.low[main][lane] = -ENDLESS_M;
        self.high[main][lane] = ENDLESS_M;
        self.counts[main][lane] = 0.0;
    }
}

/// Hull of a surface's bounds and its images in mirrors that may as well come on its other side.
///
/// In the order of the sequence those of `aside` that are later do not mirror it and may, those that are earlier do and
/// may not.
#[inline]
fn hull(scene: &Scene, sequence: &Sequence, place: usize, aside: u8) -> (DVec3, DVec3) {
    let surfaces = sequence.surfaces();
    let surface = scene.surface(surfaces[place]);
    let (mut low, mut high) = (surface.bounds_min.as_dvec3(), surface.bounds_max.as_dvec3());
    if aside != 0 {
        for mirror in (place + 1..surfaces.len()).rev().chain(0..place) {
            if aside >> mirror & 1 == 1 {
                (low, high) = with_image(scene.surface(surfaces[mirror]), low, high);
            }
        }
    }
    (low, high)
}

/// Index of the component of largest size.
#[inline]
fn main_axis(normal: DVec3) -> usize {
    let n = normal.abs();
    if n.x >= n.y && n.x >= n.z {
        0
    } else if n.y >= n.z {
        1
    } else {
        2
    }
}

/// Bounds that hold a box and its mirror image.
#[inline]
fn with_image(mirror: &Surface, mut low: DVec3, mut high: DVec3) -> (DVec3, DVec3) {
    let n = mirror.normal;
    for axis in 0..3 {
        if n[axis].abs() == 1.0 {
            let twice = 2.0 * mirror.offset_m * n[axis];
            let (from, to) = (twice - high[axis], twice - low[axis]);
            low[axis] = low[axis].min(from);
            high[axis] = high[axis].max(to);
            return (low, high);
        }
    }
    let middle = mirror.mirror(0.5 * (low + high));
    let half = 0.5 * (high - low);
    // |1 − 2 n nᵀ| times the half lengths: how far the mirrored box reaches along each axis.
    let row = |axis: DVec3, along: f64| (axis - 2.0 * along * n).abs().dot(half);
    let reach = DVec3::new(row(DVec3::X, n.x), row(DVec3::Y, n.y), row(DVec3::Z, n.z));
    (low.min(middle - reach), high.max(middle + reach))
}

/// Up to eight sequences of one length, ready, and their surfaces' bounds by place.
#[derive(Debug)]
struct CullBatch8 {
    count: usize,
    length: usize,
    fours: [SequenceBatch4; 2],
    bounds: [[Bounds; 2]; MAX_ORDER],
    /// How far outside their surfaces lines may pass, in metres.
    margin_m: f64,
}

impl CullBatch8 {
    const EMPTY: Self = Self {
        count: 0,
        length: 0,
        fours: [SequenceBatch4::EMPTY; 2],
        bounds: [[Bounds::NONE; 2]; MAX_ORDER],
        margin_m: 0.0,
    };

    /// Becomes those of these numbers, all of one length, for paths to `ear`.
    fn set(&mut self, scene: &Scene, sequences: &[Sequence], numbers: &[u32], ear: DVec3) {
        let of = |number: u32| &sequences[number as usize];
        self.count = numbers.len().min(LANES);
        self.length = numbers.first().map_or(0, |&number| of(number).len());
        for (lane, &number) in numbers.iter().enumerate() {
            self.fours[lane / unfold_x4::LANES % 2].put(scene, lane, of(number));
        }
        let halves = self.count.div_ceil(unfold_x4::LANES);
        for four in &mut self.fours[..halves] {
            unfold_x4::make_ready(four, self.length, ear);
        }
        for (lane, &number) in numbers.iter().enumerate() {
            let half = lane / unfold_x4::LANES % 2;
            let aside = self.fours[half].order(lane, self.length).aside();
            let places = self.bounds.iter_mut().zip(aside).take(self.length);
            for (place, (bounds, aside)) in places.enumerate() {
                bounds[half].put(scene, lane, of(number), place, aside);
            }
        }
    }
}

/// Eight sequences of one length, as lines are held against them.
#[derive(Debug, Clone)]
struct Pack {
    image: [Lanes; 3],
    /// The image's distance from the centre, roughly.
    size: Lanes,
    /// Length of the sequences.
    depth: usize,
    /// Lanes that have a sequence, one a bit.
    filled: u32,
    windows: [Windows; MAX_ORDER],
}

impl Pack {
    const EMPTY: Self = Self {
        image: [[0.0; LANES]; 3],
        size: [0.0; LANES],
        depth: 0,
        filled: 0,
        windows: [Windows::OPEN; MAX_ORDER],
    };

    /// Becomes these.
    #[inline(always)]
    fn set(&mut self, eight: &CullBatch8) {
        let ([low, high], margin_m) = (&eight.fours, eight.margin_m);
        self.depth = eight.length;
        self.filled = (1 << eight.count) - 1;
        for (place, bounds) in eight.bounds[..eight.length].iter().enumerate() {
            let windows = &mut self.windows[place];
            windows.set(0, low, place, &bounds[0], margin_m);
            windows.set(unfold_x4::LANES, high, place, &bounds[1], margin_m);
        }
        for (half, four) in eight.fours.iter().enumerate() {
            let (_, [x, y, z]) = four.tilt_and_image();
            for l in 0..unfold_x4::LANES {
                let lane = half * unfold_x4::LANES + l;
                self.image[0][lane] = x[l] as f32;
                self.image[1][lane] = y[l] as f32;
                self.image[2][lane] = z[l] as f32;
                self.size[lane] = 1.0 + (x[l].abs() + y[l].abs() + z[l].abs()) as f32;
            }
        }
    }

    /// Sequences that may have a path from `source`, one a bit.
    #[inline(always)]
    fn seen_from(&self, source: [f32; 3], source_size: f32) -> u32 {
        let mut line = [[0.0; LANES]; 3];
        let mut size = [0.0; LANES];
        for l in 0..LANES {
            for axis in 0..3 {
                line[axis][l] = source[axis] - self.image[axis][l];
            }
            size[l] = self.size[l] + source_size;
        }
        let mut left = self.filled;
        for windows in &self.windows[..self.depth] {
            left &= windows.passed(&mut line, &size);
            if left == 0 {
                break;
            }
        }
        left
    }
}

/// A share of the guide rays' sequences, ready for every source. Apart as the shares of the rays are.
#[derive(Debug)]
#[repr(align(128))]
pub(crate) struct Candidates {
    first: usize,
    capacity: usize,
    /// The eight at hand: large, and looked at from everywhere before the next.
    eight: CullBatch8,
    pack: Pack,
    /// Of each eight which they are, from [`Self::first`].
    numbers: Vec<[u32; LANES]>,
    /// Which of each eight may have a path, one a bit; source after source.
    seen: Vec<u8>,
    /// What the sources have seen already, where they are few.
    few: Looks,
}

/// Places that look at candidates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Onlookers<'a> {
    /// The listener, and by how many metres paths to it may miss their surfaces, if they may.
    pub(crate) ear: DVec3,
    pub(crate) reach_m: Option<f64>,
    /// The sources.
    pub(crate) sources: &'a [DVec3],
}

/// What of a sequence is the same for every source.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ready {
    /// The listener mirrored in all its surfaces.
    pub(crate) image: DVec3,
    /// Which of them commute.
    pub(crate) order: Order,
}

impl Ready {
    /// For paths to `ear`.
    #[inline]
    pub(crate) fn of(scene: &Scene, sequence: &Sequence, ear: DVec3) -> Self {
        Self {
            image: mirror_listener(scene, sequence, ear),
            order: Order::of(scene, sequence),
        }
    }
}

impl Candidates {
    /// Room for `capacity` sequences.
    pub(crate) fn with_capacity(capacity: usize) -> Self {
        Self {
            first: 0,
            capacity,
            eight: CullBatch8::EMPTY,
            pack: Pack::EMPTY,
            numbers: Vec::with_capacity(capacity.div_ceil(LANES) + MAX_ORDER),
            seen: Vec::new(),
            few: Looks::with_capacity(capacity),
        }
    }

    /// Makes sequences ready, the first of which is number `first` of all, and looks at them from every source.
    pub(crate) fn prepare(
        &mut self,
        scene: &Scene,
        sequences: &[Sequence],
        first: usize,
        from: &Onlookers<'_>,
    ) {
        self.first = first;
        self.numbers.clear();
        self.seen.clear();
        self.few.clear();
        let (ear, sources) = (from.ear, from.sources);
        if sources.len() <= FEW && from.reach_m.is_none() {
            self.few.look(scene, sequences, ear, sources);
            return;
        }
        let mut counts = [0usize; MAX_ORDER + 1];
        for sequence in sequences {
            counts[sequence.len() % counts.len()] += 1;
        }
        let packs = counts[1..].iter().map(|count| count.div_ceil(LANES));
        let packs: usize = packs.sum();
        let most = (self.capacity.div_ceil(LANES) + MAX_ORDER) * sources.len();
        self.seen.reserve(most);
        self.seen.resize(packs * sources.len(), 0);
        self.eight.margin_m = MARGIN_M + from.reach_m.unwrap_or(0.0);
        for length in 1..=MAX_ORDER {
            let mut numbers = [0u32; LANES];
            let mut count = 0;
            let of_length = |(_, sequence): &(u32, &Sequence)| sequence.len() == length;
            for (number, _) in (0..).zip(sequences).filter(of_length) {
                numbers[count] = number;
                count += 1;
                if count == LANES {
                    self.eight.set(scene, sequences, &numbers, ear);
                    self.look(numbers, sources, packs);
                    count = 0;
                }
            }
            if count > 0 {
                self.eight.set(scene, sequences, &numbers[..count], ear);
                self.look(numbers, sources, packs);
            }
        }
    }

    /// Looks at the eight at hand from all sources; they are those of these numbers.
    fn look(&mut self, numbers: [u32; LANES], sources: &[DVec3], packs: usize) {
        let (eight, pack, seen) = (&self.eight, &mut self.pack, &mut self.seen);
        let number = self.numbers.len();
        look(LaneSet::best(), pack, eight, sources, seen, number, packs);
        self.numbers.push(numbers);
    }

    /// Calls `give` with the number of every sequence that may have a path from source number `place`.
    #[inline]
    pub(crate) fn seen_from(&self, place: usize, mut give: impl FnMut(usize)) {
        self.few.of(place, |number| give(self.first + number));
        let packs = self.numbers.len();
        let seen = &self.seen[place * packs..][..packs];
        for (seen, numbers) in seen.iter().zip(&self.numbers) {
            let mut left = u32::from(*seen);
            while left != 0 {
                let lane = left.trailing_zeros() as usize % LANES;
                left &= left - 1;
                give(self.first + numbers[lane] as usize);
            }
        }
    }
}

kernel! {
    /// Makes pack `number` of `packs` and looks at it from all places. Arrays of lanes are the machine's
    /// own registers here too; every product is rounded, so all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn look<L>(
        pack: &mut Pack,
        eight: &CullBatch8,
        sources: &[DVec3],
        seen: &mut [u8],
        number: usize,
        packs: usize,
    ) {
        pack.set(eight);
        for (source, seen) in sources.iter().zip(seen.chunks_mut(packs)) {
            seen[number] = pack.seen_from(source.as_vec3().to_array(), size_m(*source)) as u8;
        }
    }
}

/// Metres that rounding of a place counts in; never nothing.
fn size_m(place: DVec3) -> f32 {
    1.0 + place.abs().element_sum() as f32
}
