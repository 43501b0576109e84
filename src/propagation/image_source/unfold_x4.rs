//! Four sequences of one length, mirrored and unfolded at once by the kernel of [`super::unfold`].
//!
//! The lanes have the bits of [`super::image_path::UnfoldedPath`]. The test of points against their surfaces' bounds is left
//! to the user of a lane. Pure arithmetic, any thread, allocates nothing. Own.

use glam::DVec3;

use crate::propagation::image_source::sequence::{Precedence, Sequence};
use crate::propagation::image_source::unfold::{Lines, Planes, Vectors, index_of, vector};
use crate::propagation::path::MAX_ORDER;
use crate::scene::Scene;
use crate::simd::{LaneSet, kernel};

/// Sequences of a batch: a register of double precision where registers are long.
pub(crate) const LANES: usize = 4;

/// One number per lane.
pub(crate) type Lanes = [f64; LANES];

/// Four sequences, their listener images ([`Self::prepare`]) and reflection points ([`Self::unfold`]).
#[derive(Debug, Clone, Copy)]
pub(crate) struct SequenceBatch4 {
    planes: Planes<LANES>,
    before: [u64; LANES],
    skew: Lanes,
    image: Vectors<LANES>,
    /// For each reflection: the listener's image as seen there, and its signed distance from the plane.
    partial_image: [Vectors<LANES>; MAX_ORDER],
    partial_image_m: [Lanes; MAX_ORDER],
    /// For each step along the lines: the point, the image that the leg leads to, and the bit of the reflection.
    points: [Vectors<LANES>; MAX_ORDER],
    targets: [Vectors<LANES>; MAX_ORDER],
    taken: [[u64; LANES]; MAX_ORDER],
    /// After each step and at last, other than 0 where a line has missed a plane.
    missed: [[u64; LANES]; MAX_ORDER],
    misses: [u64; LANES],
}

impl SequenceBatch4 {
    pub(crate) const EMPTY: Self = Self {
        planes: Planes::EMPTY,
        before: [0; LANES],
        skew: [0.0; LANES],
        image: [[0.0; LANES]; 3],
        partial_image: [[[0.0; LANES]; 3]; MAX_ORDER],
        partial_image_m: [[0.0; LANES]; MAX_ORDER],
        points: [[[0.0; LANES]; 3]; MAX_ORDER],
        targets: [[[0.0; LANES]; 3]; MAX_ORDER],
        taken: [[0; LANES]; MAX_ORDER],
        missed: [[0; LANES]; MAX_ORDER],
        misses: [0; LANES],
    };

    /// Sets the planes of a lane.
    #[inline(always)]
    pub(crate) fn put(&mut self, scene: &Scene, lane: usize, sequence: &Sequence) {
        let surfaces = sequence.surfaces();
        for index in 0..surfaces.len().min(MAX_ORDER) {
            let surface = scene.surface(surfaces[index]);
            self.planes.set(lane % LANES, index, surface);
        }
    }

    /// For each lane the sum of the cosines of commuting planes: their deviation from perpendicular.
    #[inline(always)]
    pub(crate) fn skew(&self) -> &Lanes {
        &self.skew
    }

    /// That of a lane.
    #[inline(always)]
    pub(crate) fn skew_of(&self, lane: usize) -> f64 {
        self.skew[lane % LANES]
    }

    /// Distance of a lane's listener image from plane `index`, in which it is mirrored next.
    #[inline(always)]
    pub(crate) fn distance_m(&self, lane: usize, index: usize) -> f64 {
        self.partial_image_m[index % MAX_ORDER][lane % LANES].abs()
    }

    /// For each lane the listener mirrored in all planes.
    #[inline(always)]
    pub(crate) fn image(&self) -> &Vectors<LANES> {
        &self.image
    }

    /// For each lane and a reflection: the plane's normal, the listener's image as seen there, and its signed distance from
    /// the plane.
    #[inline(always)]
    pub(crate) fn partial_image(&self, index: usize) -> (&Vectors<LANES>, &Vectors<LANES>, &Lanes) {
        let normal = &self.planes.normal[index];
        (
            normal,
            &self.partial_image[index],
            &self.partial_image_m[index],
        )
    }

    /// Precedence of the `count` reflections of a lane.
    #[inline(always)]
    pub(crate) fn precedence(&self, lane: usize, count: usize) -> Precedence {
        Precedence::from_bits(self.before[lane % LANES] as u32, count)
    }

    /// Whether the line of a lane meets all planes.
    #[inline(always)]
    pub(crate) fn meets_all(&self, lane: usize) -> bool {
        self.misses[lane % LANES] == 0
    }

    /// Whether it misses one of those that may come next at a step or before.
    #[inline(always)]
    pub(crate) fn misses_at(&self, lane: usize, step: usize) -> bool {
        self.missed[step % MAX_ORDER][lane % LANES] != 0
    }

    /// Step number `step` of a lane's line: the reflection's index in the sequence, the point, and the listener's image that
    /// the leg to the point leads to.
    #[inline(always)]
    pub(crate) fn step(&self, lane: usize, step: usize) -> (usize, DVec3, DVec3) {
        let (lane, step) = (lane % LANES, step % MAX_ORDER);
        let index = index_of(self.taken[step][lane]);
        let point = vector(&self.points[step], lane);
        (index, point, vector(&self.targets[step], lane))
    }

    #[inline(always)]
    fn prepare_lanes<const COUNT: usize>(&mut self, listener: DVec3) {
        let (before, skew) = self.planes.precedence(COUNT);
        let mut image = [
            [listener.x; LANES],
            [listener.y; LANES],
            [listener.z; LANES],
        ];
        for index in (0..COUNT).rev() {
            self.partial_image_m[index] = self.planes.mirror(index, &mut image);
            self.partial_image[index] = image;
        }
        (self.before, self.skew, self.image) = (before, skew, image);
    }

    #[inline(always)]
    fn unfold_lanes<const COUNT: usize>(&mut self, source: DVec3) {
        let mut lines = Lines::new(source, self.image, self.before, COUNT);
        for step in 0..COUNT {
            self.targets[step] = lines.image;
            self.taken[step] = lines.advance(&self.planes, COUNT);
            self.points[step] = lines.from;
            self.missed[step] = lines.misses;
        }
        self.misses = lines.misses;
    }

    /// Computes the precedence of the `count` reflections of each lane and mirrors the listener in them.
    #[inline(always)]
    pub(crate) fn prepare(&mut self, count: usize, listener: DVec3) {
        prepare_by(LaneSet::best(), self, count, &listener);
    }

    /// Unfolds the prepared lines from the source through their `count` planes.
    #[inline(always)]
    pub(crate) fn unfold(&mut self, count: usize, source: DVec3) {
        unfold_by(LaneSet::best(), self, count, &source);
    }
}

kernel! {
    /// [`SequenceBatch4::prepare`] with given lanes.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn prepare_by<L>(batch: &mut SequenceBatch4, count: usize, listener: &DVec3) {
        match count {
            1 => batch.prepare_lanes::<1>(*listener),
            2 => batch.prepare_lanes::<2>(*listener),
            3 => batch.prepare_lanes::<3>(*listener),
            _ => batch.prepare_lanes::<4>(*listener),
        }
    }
}

kernel! {
    /// [`SequenceBatch4::unfold`] with given lanes.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn unfold_by<L>(batch: &mut SequenceBatch4, count: usize, source: &DVec3) {
        match count {
            1 => batch.unfold_lanes::<1>(*source),
            2 => batch.unfold_lanes::<2>(*source),
            3 => batch.unfold_lanes::<3>(*source),
            _ => batch.unfold_lanes::<4>(*source),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::image_source::image_path::{MARGIN_M, UnfoldedPath, mirror_listener};
    use crate::propagation::rays::directions::mix;
    use crate::scene::{MaterialTable, SceneSettings, procedural};

    /// Sequences that a path could have, anywhere in a scene. Most have none.
    fn sequences(scene: &Scene, length: usize, count: u64) -> Vec<Sequence> {
        let surfaces = scene.surfaces().len() as u64;
        let surface = |seed: u64| {
            // The largest commute most often.
            let draw = |n: u64| (mix(seed.wrapping_mul(8) + n) % surfaces) as u32;
            let larger = |a: &u32, b: &u32| {
                let area = |s: u32| scene.surface(s).area_m2;
                area(*a).total_cmp(&area(*b))
            };
            (0..8).map(draw).max_by(larger).expect("eight")
        };
        let of = |number: u64| {
            let surfaces: Vec<u32> = (0..4).map(|n| surface(4 * number + n)).collect();
            Sequence::canonical(scene, &surfaces[..length])
        };
        (0..count).map(of).collect()
    }

    #[test]
    fn lanes_have_the_bits_of_one_sequence_at_a_time() {
        let mut met = 0;
        for name in procedural::NAMES {
            let benchmark = procedural::by_name(name).expect("a name of the list");
            let settings = SceneSettings::default();
            let table = MaterialTable::built_in();
            let scene = Scene::commit(&benchmark.mesh, &table, &settings).expect("commits");
            let source = scene.to_local(benchmark.sources[0].1);
            let ear = scene.to_local(benchmark.walk.from);
            let sets = LaneSet::vector_units()
                .into_iter()
                .chain([LaneSet::Portable]);
            for (set, length) in sets.flat_map(|set| (1..=MAX_ORDER).map(move |n| (set, n))) {
                let mut batch = SequenceBatch4::EMPTY;
                for some in sequences(&scene, length, 4000).chunks(LANES) {
                    for (lane, sequence) in some.iter().enumerate() {
                        batch.put(&scene, lane, sequence);
                    }
                    prepare_by(set, &mut batch, length, &ear);
                    unfold_by(set, &mut batch, length, &source);
                    for (lane, sequence) in some.iter().enumerate() {
                        let precedence = Precedence::of(&scene, sequence);
                        let image = vector(batch.image(), lane);
                        assert_eq!(image, mirror_listener(&scene, sequence, ear));
                        assert_eq!(batch.precedence(lane, length), precedence);
                        let (mut one, mut taken) =
                            (UnfoldedPath::default(), UnfoldedPath::default());
                        let line = [source, image];
                        let is_there = one.unfold(&scene, sequence, &precedence, line);
                        let meets = taken
                            .take(&scene, sequence, &batch, lane, MARGIN_M)
                            .is_some();
                        assert_eq!(is_there, meets && taken.lies_on_surfaces(&scene));
                        if is_there {
                            assert_eq!(one.finish(&scene, line), taken.finish(&scene, line));
                            assert_eq!(taken.listener_image(), image);
                            met += 1;
                        }
                    }
                }
            }
        }
        assert!(met > 50, "{met} paths show little");
    }
}
