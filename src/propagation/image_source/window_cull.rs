//! Single-precision cull of candidate sequences, eight at a time, for all sources.
//!
//! Unfolded, a path is one straight line from the source to the listener's image, and every surface on it is an aperture that
//! the line has to pass: the surface's bounds, mirrored in the surfaces before it. Images and apertures are the same for
//! every source, and the test of a line against an aperture costs a few products. Where reflections commute, the order
//! depends on the line; the aperture is then the hull of its images in all orders, or, across an axis along which one plane
//! mirrors, the bounds and their one image with the gap between them. Own. The cull is conservative: rounding
//! is allowed for, and nothing is rejected that [`super::image_path::unfold`] accepts. For few sources the candidates are
//! unfolded in double precision instead.

use glam::DVec3;

use crate::propagation::image_source::hull::{Hull, Mirror};
use crate::propagation::image_source::image_path::{MARGIN_M, UnfoldedPath};
use crate::propagation::image_source::nearby_gate::{MirrorEnergies, NearbyGate};
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::unfold_x4;
use crate::propagation::image_source::unfold_x4::SequenceBatch4;
use crate::propagation::path::MAX_ORDER;
use crate::scene::{Scene, Surface};
use crate::simd::{LaneSet, kernel};

/// Sequences that are tested together.
const LANES: usize = 8;

/// Number of sources up to which candidates are unfolded instead of tested against apertures. With one source in the concert
/// hall an update executes 10 % fewer instructions on x86-64 (5.76 instead of 6.43 million), one with
/// nearby paths 22 % fewer (11.0 instead of 14.1).
const MAX_EXACT_SOURCES: usize = 3;

/// Bound of the rounding error of a few single-precision sums and products, relative to their largest term, with a margin.
const ROUNDING: f64 = 24.0 * f32::EPSILON as f64;

/// Least distance of an image from a plane in metres that enters a quotient. No path exists below it.
const MIN_DISTANCE_M: f64 = 1e-7;

/// Value of an absent bound, in metres.
const UNBOUNDED_M: f64 = 1e12;

/// All bits of a number, and all but that of the sign.
const ALL_BITS: u32 = u32::MAX;
const WITHOUT_SIGN: u32 = u32::MAX >> 1;

type Lanes = [f32; LANES];

/// One aperture of each of eight sequences.
///
/// With D the line from the image to the source, `q = nearness × normal · D` is the distance that D covers across the plane,
/// in units of the image's distance from it and negative towards it. The source is beyond the plane where q is below −1. The
/// point in the plane is the image plus D / −q. Across an axis along which the aperture is mirrored, its distance from the mirror
/// is tested instead of its coordinate.
#[derive(Debug, Clone, Copy)]
struct Aperture {
    normal: [Lanes; 3],
    /// Reciprocal of the image's signed distance from the plane.
    nearness: Lanes,
    /// The image minus the mirror; 0 without one.
    mirror: [Lanes; 3],
    /// The bits that give a distance from the mirror: [`WITHOUT_SIGN`] or, without one, [`ALL_BITS`].
    bits: [[u32; LANES]; 3],
    /// The image, or the mirror, minus the lower bounds; unbounded along the surface's main axis.
    low: [Lanes; 3],
    /// The same with the upper bounds.
    high: [Lanes; 3],
    /// Bound of the rounding error, relative to the size of image and source; infinite where there is no aperture.
    slack: Lanes,
}

impl Aperture {
    /// Every line passes.
    const OPEN: Self = Self {
        normal: [[0.0; LANES]; 3],
        nearness: [0.0; LANES],
        mirror: [[0.0; LANES]; 3],
        bits: [[ALL_BITS; LANES]; 3],
        low: [[0.0; LANES]; 3],
        high: [[0.0; LANES]; 3],
        slack: [f32::INFINITY; LANES],
    };

    /// Bitmask of the lanes inside the aperture less a border in metres; mirrors each line in its plane. `size` scales the rounding
    /// error.
    #[inline(always)]
    fn pass(&self, line: &mut [Lanes; 3], size: &Lanes, border_m: &Lanes) -> u32 {
        let mut passes = [0u32; LANES];
        for l in 0..LANES {
            let [x, y, z] = [line[0][l], line[1][l], line[2][l]];
            let n = [self.normal[0][l], self.normal[1][l], self.normal[2][l]];
            let along = n[0] * x + n[1] * y + n[2] * z;
            let q = along * self.nearness[l];
            let slack = self.slack[l] * size[l];
            // Where rounding blurs the source's side of the plane, every line passes.
            let slack = if slack < 0.5 { slack } else { f32::INFINITY };
            let across = |axis: usize, at: f32| {
                let beyond = at - self.mirror[axis][l] * q;
                let beyond = f32::from_bits(beyond.to_bits() & self.bits[axis][l]);
                [
                    beyond - self.low[axis][l] * q,
                    beyond - self.high[axis][l] * q,
                ]
            };
            let [x_low, x_high] = across(0, x);
            let [y_low, y_high] = across(1, y);
            let [z_low, z_high] = across(2, z);
            // A border in the plane is −q of it along the line.
            let within = slack + border_m[l] * q;
            let is_inside = (q + 1.0 <= slack)
                & (x_low >= -within)
                & (x_high <= within)
                & (y_low >= -within)
                & (y_high <= within)
                & (z_low >= -within)
                & (z_high <= within);
            passes[l] = u32::from(is_inside) << l;
            let twice = 2.0 * along;
            line[0][l] = x - twice * n[0];
            line[1][l] = y - twice * n[1];
            line[2][l] = z - twice * n[2];
        }
        let mut lanes = 0;
        for bits in passes {
            lanes |= bits;
        }
        lanes
    }

    /// Sets the lanes from `first` on to reflection `index` of a prepared batch. Lines may pass `margin_m` outside.
    #[inline(always)]
    fn set(
        &mut self,
        first: usize,
        batch: &SequenceBatch4,
        index: usize,
        bounds: &Bounds,
        margin_m: f64,
    ) {
        let (normal, image, distance_m) = batch.partial_image(index);
        let skew = batch.skew();
        let mut widest = [1.0f64; unfold_x4::LANES];
        for axis in 0..3 {
            for l in 0..unfold_x4::LANES {
                let mirror =
                    bounds.is_mirrored[axis][l] * (image[axis][l] - bounds.mirror[axis][l]);
                let low = image[axis][l] - mirror - bounds.low[axis][l] + margin_m;
                let high = image[axis][l] - mirror - bounds.high[axis][l] - margin_m;
                self.normal[axis][first + l] = normal[axis][l] as f32;
                self.mirror[axis][first + l] = mirror as f32;
                self.bits[axis][first + l] = match bounds.is_mirrored[axis][l] > 0.0 {
                    true => WITHOUT_SIGN,
                    false => ALL_BITS,
                };
                self.low[axis][first + l] = low as f32;
                self.high[axis][first + l] = high as f32;
                let size = low.abs() + high.abs() + mirror.abs();
                widest[l] += bounds.is_bounded[axis][l] * size;
            }
        }
        for l in 0..unfold_x4::LANES {
            let away_m = distance_m[l].abs().max(MIN_DISTANCE_M);
            let rounding = ROUNDING + 8.0 * skew[l];
            self.nearness[first + l] = (1.0 / away_m.copysign(distance_m[l])) as f32;
            self.slack[first + l] = (rounding * (1.0 + widest[l] / away_m)) as f32;
        }
    }
}

/// Bounds of four surfaces and of their images in all orders; unbounded along the main axis.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: [unfold_x4::Lanes; 3],
    high: [unfold_x4::Lanes; 3],
    /// See [`Hull::mirror`]; 0 without one.
    mirror: [unfold_x4::Lanes; 3],
    /// 1 where there is a mirror, 0 otherwise.
    is_mirrored: [unfold_x4::Lanes; 3],
    /// 0 along the main axis, 1 otherwise.
    is_bounded: [unfold_x4::Lanes; 3],
}

impl Bounds {
    const NONE: Self = Self {
        low: [[0.0; unfold_x4::LANES]; 3],
        high: [[0.0; unfold_x4::LANES]; 3],
        mirror: [[0.0; unfold_x4::LANES]; 3],
        is_mirrored: [[0.0; unfold_x4::LANES]; 3],
        is_bounded: [[0.0; unfold_x4::LANES]; 3],
    };

    /// Sets a lane to a surface's hull.
    #[inline(always)]
    fn put(&mut self, lane: usize, surface: &Surface, hull: &Hull) {
        let lane = lane % unfold_x4::LANES;
        for axis in 0..3 {
            self.low[axis][lane] = hull.low[axis];
            self.high[axis][lane] = hull.high[axis];
            self.mirror[axis][lane] = hull.mirror[axis];
            self.is_mirrored[axis][lane] = hull.is_mirrored[axis];
            self.is_bounded[axis][lane] = 1.0;
        }
        let main = main_axis(surface.normal);
        self.low[main][lane] = -UNBOUNDED_M;
        self.high[main][lane] = UNBOUNDED_M;
        self.is_mirrored[main][lane] = 0.0;
        self.is_bounded[main][lane] = 0.0;
    }
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

/// Up to eight sequences of one length with their apertures.
#[derive(Debug)]
struct CullBatch8 {
    length: usize,
    /// Bitmask of the lanes in use.
    filled: u32,
    halves: [SequenceBatch4; 2],
    bounds: [[Bounds; 2]; MAX_ORDER],
    /// Distance in metres outside their surfaces at which lines of nearby paths may pass; 0 if none are asked for.
    nearby_m: f64,
    /// Energy that reflections leave, for the gate of nearby paths.
    reflected: Lanes,
    image: [Lanes; 3],
    /// About the images' distances from the origin, in metres.
    size: Lanes,
    apertures: [Aperture; MAX_ORDER],
}

impl CullBatch8 {
    const EMPTY: Self = Self {
        length: 0,
        filled: 0,
        halves: [SequenceBatch4::EMPTY; 2],
        bounds: [[Bounds::NONE; 2]; MAX_ORDER],
        nearby_m: 0.0,
        reflected: [0.0; LANES],
        image: [[0.0; LANES]; 3],
        size: [0.0; LANES],
        apertures: [Aperture::OPEN; MAX_ORDER],
    };

    /// Loads the sequences of these indices, all of one length, and mirrors the listener in them.
    fn load(&mut self, scene: &Scene, sequences: &[Sequence], indices: &[u32], listener: DVec3) {
        let of = |index: u32| &sequences[index as usize];
        self.filled = (1 << indices.len()) - 1;
        self.length = indices.first().map_or(0, |&index| of(index).len());
        for (lane, &index) in indices.iter().enumerate() {
            self.halves[lane / unfold_x4::LANES % 2].put(scene, lane, of(index));
        }
        let used = indices.len().div_ceil(unfold_x4::LANES);
        for half in &mut self.halves[..used] {
            half.prepare(self.length, listener);
        }
    }

    /// Computes the bounds of the loaded sequences' surfaces.
    fn load_bounds(
        &mut self,
        scene: &Scene,
        sequences: &[Sequence],
        indices: &[u32],
        energies: &MirrorEnergies,
    ) {
        for (lane, &index) in indices.iter().enumerate() {
            let half = lane / unfold_x4::LANES % 2;
            let unordered = self.halves[half].precedence(lane, self.length).unordered();
            let sequence = &sequences[index as usize];
            let surfaces = sequence.surfaces();
            let mut mirrors = [Mirror::Across(0, 0.0); MAX_ORDER];
            if unordered != [0; MAX_ORDER] {
                for (mirror, &surface) in mirrors.iter_mut().zip(surfaces) {
                    *mirror = Mirror::of(scene.surface(surface));
                }
            }
            for (step, &surface) in surfaces.iter().enumerate().take(MAX_ORDER) {
                let surface = scene.surface(surface);
                let mut hull = Hull::of(surface);
                if unordered[step] != 0 {
                    hull.add_images(&mirrors, step, unordered[step]);
                }
                self.bounds[step][half].put(lane, surface, &hull);
            }
            if self.nearby_m > 0.0 {
                self.reflected[lane % LANES] = energies.reflected(scene, sequence);
            }
        }
    }

    /// Computes images and apertures in single precision.
    #[inline(always)]
    fn make_apertures(&mut self) {
        let ([low, high], margin_m) = (&self.halves, MARGIN_M + self.nearby_m);
        for (index, bounds) in self.bounds[..self.length].iter().enumerate() {
            let aperture = &mut self.apertures[index];
            aperture.set(0, low, index, &bounds[0], margin_m);
            aperture.set(unfold_x4::LANES, high, index, &bounds[1], margin_m);
        }
        for (half, batch) in self.halves.iter().enumerate() {
            let [x, y, z] = batch.image();
            for l in 0..unfold_x4::LANES {
                let lane = half * unfold_x4::LANES + l;
                self.image[0][lane] = x[l] as f32;
                self.image[1][lane] = y[l] as f32;
                self.image[2][lane] = z[l] as f32;
                self.size[lane] = 1.0 + (x[l].abs() + y[l].abs() + z[l].abs()) as f32;
            }
        }
    }

    /// Bitmask of the sequences that may have a path from a source, or a nearby one that passes the gate.
    #[inline(always)]
    fn visible_from(&self, source: [f32; 3], source_size: f32, gate: NearbyGate) -> u32 {
        let mut line = [[0.0; LANES]; 3];
        let mut size = [0.0; LANES];
        for l in 0..LANES {
            for axis in 0..3 {
                line[axis][l] = source[axis] - self.image[axis][l];
            }
            size[l] = self.size[l] + source_size;
        }
        // Nearby paths that pass the gate may be outside of their surfaces' bounds, others not.
        let mut border_m = [0.0; LANES];
        if self.nearby_m > 0.0 {
            for l in 0..LANES {
                let [x, y, z] = [line[0][l], line[1][l], line[2][l]];
                border_m[l] = match gate.passes(self.reflected[l], x * x + y * y + z * z) {
                    true => 0.0,
                    false => self.nearby_m as f32,
                };
            }
        }
        let mut inside = self.filled;
        for aperture in &self.apertures[..self.length] {
            if inside == 0 {
                break;
            }
            inside &= aperture.pass(&mut line, &size, &border_m);
        }
        inside
    }
}

/// Per-thread scratch, reused across shares.
#[derive(Debug)]
pub(crate) struct CullScratch {
    batch: CullBatch8,
    unfolded: UnfoldedPath,
    /// Indices of a share's sequences, the shortest first.
    by_length: Vec<u32>,
}

impl Default for CullScratch {
    fn default() -> Self {
        Self {
            batch: CullBatch8::EMPTY,
            unfolded: UnfoldedPath::default(),
            by_length: Vec::new(),
        }
    }
}

/// A share of the candidate sequences, culled for every source. Aligned to two cache lines: threads work on neighbouring
/// shares.
#[derive(Debug)]
#[repr(align(128))]
pub(crate) struct CandidateCull {
    /// Index of the share's first sequence among all.
    first: usize,
    capacity: usize,
    /// For each batch its sequences, counted from [`Self::first`].
    indices: Vec<[u32; LANES]>,
    /// For each batch the energies that its reflections leave, if they are known.
    reflected: Vec<[f32; LANES]>,
    /// Masks of the sequences that may have a path, by source and then by batch.
    visible: Vec<u8>,
}

/// Positions between which candidates are culled, in local coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CullViews<'a> {
    pub(crate) listener: DVec3,
    /// Distance in metres by which paths may miss their surfaces; `None` for valid paths only.
    pub(crate) nearby_m: Option<f64>,
    pub(crate) sources: &'a [DVec3],
    /// Of each source.
    pub(crate) gates: &'a [NearbyGate],
    pub(crate) energies: &'a MirrorEnergies,
}

impl CandidateCull {
    /// Room for `capacity` sequences.
    pub(crate) fn with_capacity(capacity: usize) -> Self {
        Self {
            first: 0,
            capacity,
            indices: Vec::with_capacity(capacity.div_ceil(LANES) + MAX_ORDER),
            reflected: Vec::new(),
            visible: Vec::new(),
        }
    }

    /// Culls sequences for every source. `first` is the index of the first one among all candidates. Allocates while the
    /// number of sources is new.
    pub(crate) fn cull(
        &mut self,
        scene: &Scene,
        sequences: &[Sequence],
        first: usize,
        views: &CullViews<'_>,
        scratch: &mut CullScratch,
    ) {
        self.first = first;
        self.indices.clear();
        self.reflected.clear();
        self.visible.clear();
        let mut counts = [0usize; MAX_ORDER + 1];
        for sequence in sequences {
            counts[sequence.len() % counts.len()] += 1;
        }
        let batches = counts[1..].iter().map(|count| count.div_ceil(LANES));
        let batches: usize = batches.sum();
        let most = (self.capacity.div_ceil(LANES) + MAX_ORDER) * views.sources.len();
        self.visible.reserve(most);
        self.visible.resize(batches * views.sources.len(), 0);
        scratch.batch.nearby_m = views.nearby_m.unwrap_or(0.0);
        let mut by_length = std::mem::take(&mut scratch.by_length);
        by_length.clear();
        by_length.reserve(self.capacity);
        by_length.resize(sequences.len(), 0);
        // For each length the index of its next entry, at last its end.
        let (mut ends, mut start) = (counts, 0);
        for end in &mut ends {
            start += std::mem::replace(end, start);
        }
        for (index, sequence) in (0..).zip(sequences) {
            let next = &mut ends[sequence.len() % counts.len()];
            by_length[*next] = index;
            *next += 1;
        }
        for ends in ends.windows(2) {
            for of_batch in by_length[ends[0]..ends[1]].chunks(LANES) {
                let mut indices = [0; LANES];
                indices[..of_batch.len()].copy_from_slice(of_batch);
                self.cull_batch(scene, sequences, of_batch, (views, batches), scratch);
                self.indices.push(indices);
            }
        }
        scratch.by_length = by_length;
    }

    /// Culls the next of `batches` batches for all sources.
    fn cull_batch(
        &mut self,
        scene: &Scene,
        sequences: &[Sequence],
        indices: &[u32],
        (views, batches): (&CullViews<'_>, usize),
        CullScratch {
            batch, unfolded, ..
        }: &mut CullScratch,
    ) {
        let (visible, number) = (&mut self.visible, self.indices.len());
        batch.load(scene, sequences, indices, views.listener);
        let length = batch.length;
        if views.sources.len() > MAX_EXACT_SOURCES {
            batch.load_bounds(scene, sequences, indices, views.energies);
            if views.nearby_m.is_some() {
                self.reflected.push(batch.reflected);
            }
            cull_batch(LaneSet::best(), batch, views, visible, number, batches);
            return;
        }
        let lanes = indices.chunks(unfold_x4::LANES);
        let margin_m = MARGIN_M + batch.nearby_m;
        for (half, (batch, indices)) in batch.halves.iter_mut().zip(lanes).enumerate() {
            let sources = views.sources.iter().zip(views.gates);
            for ((source, gate), visible) in sources.zip(visible.chunks_mut(batches)) {
                batch.unfold(length, *source);
                for (lane, &index) in indices.iter().enumerate() {
                    let sequence = &sequences[index as usize];
                    let outside_m = unfolded.take(scene, sequence, batch, lane, margin_m);
                    let is_found = outside_m.is_some_and(|outside_m| {
                        let image = unfolded.listener_image();
                        let square_m2 = source.distance_squared(image) as f32;
                        outside_m <= MARGIN_M
                            || gate.passes(views.energies.reflected(scene, sequence), square_m2)
                    });
                    visible[number] |= u8::from(is_found) << (half * unfold_x4::LANES + lane);
                }
            }
        }
    }

    /// Calls `found` with the index of every sequence that may have a path from source number `source`, and the energy that its
    /// reflections leave ([`MirrorEnergies::reflected`]), if it is known.
    #[inline]
    pub(crate) fn visible_from(&self, source: usize, mut found: impl FnMut(usize, Option<f32>)) {
        let batches = self.indices.len();
        let visible = &self.visible[source * batches..][..batches];
        for (batch, (visible, indices)) in visible.iter().zip(&self.indices).enumerate() {
            let mut left = u32::from(*visible);
            while left != 0 {
                let lane = left.trailing_zeros() as usize % LANES;
                left &= left - 1;
                let reflected = self.reflected.get(batch).map(|reflected| reflected[lane]);
                found(self.first + indices[lane] as usize, reflected);
            }
        }
    }
}

kernel! {
    /// Makes the apertures of batch `number` of `batches` and tests the lines from all sources. Arrays of lanes fill the
    /// machine's registers. Every product is rounded, so all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn cull_batch<L>(
        batch: &mut CullBatch8,
        views: &CullViews<'_>,
        visible: &mut [u8],
        number: usize,
        batches: usize,
    ) {
        batch.make_apertures();
        let sources = views.sources.iter().zip(views.gates);
        for ((source, gate), visible) in sources.zip(visible.chunks_mut(batches)) {
            let size_m = 1.0 + source.abs().element_sum() as f32;
            let position = source.as_vec3().to_array();
            visible[number] = batch.visible_from(position, size_m, *gate) as u8;
        }
    }
}
