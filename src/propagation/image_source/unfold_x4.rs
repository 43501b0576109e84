//! Four sequences of one length made ready and unfolded at once, each in lanes of its own.
//!
//! Every lane does what [`crate::propagation::image_source::image_path::Unfolded`] does, in the same order and as often rounded, so it gives the same
//! bits; only whether a point lies within its surface's bounds is left to whoever asks for the lane. Pure arithmetic, any
//! thread, allocates nothing. Own.

use glam::DVec3;

use crate::propagation::image_source::image_path::ON_PLANE_M;
use crate::propagation::image_source::sequence::{COMMUTING_COSINE, Order, Sequence};
use crate::propagation::image_source::window_cull::Ready;
use crate::propagation::path::MAX_ORDER;
use crate::scene::Scene;
use crate::simd::{LaneSet, kernel};

/// Sequences at once: a register of double precision where registers are long.
pub(crate) const LANES: usize = 4;

pub(crate) type Lanes = [f64; LANES];

/// Bits of the places that one place cannot pass.
const PLACE_BITS: usize = 8;

/// Of every place the first one.
const FIRST_OF_EACH: u64 = 0x0101_0101;

/// Of every place itself.
const OWN: u64 = 0x0804_0201;

/// The sequences, and where their points lie once they have been unfolded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SequenceBatch4 {
    normal: [[Lanes; 3]; MAX_ORDER],
    offset_m: [Lanes; MAX_ORDER],
    /// Of each place the earlier ones that it cannot pass, [`PLACE_BITS`] a place.
    behind: [u64; LANES],
    /// By how much surfaces that commute are not perpendicular.
    tilt: Lanes,
    image: [Lanes; 3],
    /// Of each place: the ear's image as it is seen there, and its signed distance from the plane.
    seen: [[Lanes; 3]; MAX_ORDER],
    seen_m: [Lanes; MAX_ORDER],
    /// Of each step: the point, where its leg points to and the surface's place, as a bit.
    points: [[Lanes; 3]; MAX_ORDER],
    images: [[Lanes; 3]; MAX_ORDER],
    places: [[u64; LANES]; MAX_ORDER],
    /// Other than 0 where the line misses a plane.
    misses: [u64; LANES],
}

impl SequenceBatch4 {
    pub(crate) const EMPTY: Self = Self {
        normal: [[[0.0; LANES]; 3]; MAX_ORDER],
        offset_m: [[0.0; LANES]; MAX_ORDER],
        behind: [0; LANES],
        tilt: [0.0; LANES],
        image: [[0.0; LANES]; 3],
        seen: [[[0.0; LANES]; 3]; MAX_ORDER],
        seen_m: [[0.0; LANES]; MAX_ORDER],
        points: [[[0.0; LANES]; 3]; MAX_ORDER],
        images: [[[0.0; LANES]; 3]; MAX_ORDER],
        places: [[0; LANES]; MAX_ORDER],
        misses: [0; LANES],
    };

    /// Puts in a sequence's surfaces.
    #[inline(always)]
    pub(crate) fn put(&mut self, scene: &Scene, lane: usize, sequence: &Sequence) {
        let lane = lane % LANES;
        let surfaces = sequence.surfaces();
        for place in 0..surfaces.len().min(MAX_ORDER) {
            let surface = scene.surface(surfaces[place]);
            let normal = &mut self.normal[place];
            normal[0][lane] = surface.normal.x;
            normal[1][lane] = surface.normal.y;
            normal[2][lane] = surface.normal.z;
            self.offset_m[place][lane] = surface.offset_m;
        }
    }

    /// What is ready of a lane whose sequence has `count` surfaces.
    #[inline(always)]
    pub(crate) fn ready(&self, lane: usize, count: usize) -> Ready {
        Ready {
            image: at(&self.image, lane % LANES),
            order: self.order(lane, count),
        }
    }

    /// Of each lane: how far from perpendicular its commuting surfaces are in all, and the ear's image.
    #[inline(always)]
    pub(crate) fn tilt_and_image(&self) -> (&Lanes, &[Lanes; 3]) {
        (&self.tilt, &self.image)
    }

    /// Of each lane and a place: the surface's normal, the ear's image as it is seen there, and its signed distance from the
    /// plane.
    #[inline(always)]
    pub(crate) fn seen(&self, place: usize) -> (&[Lanes; 3], &[Lanes; 3], &Lanes) {
        (&self.normal[place], &self.seen[place], &self.seen_m[place])
    }

    /// Which surfaces of a lane's sequence of `count` may come before others.
    #[inline(always)]
    pub(crate) fn order(&self, lane: usize, count: usize) -> Order {
        Order::of_bits(self.behind[lane % LANES] as u32, count)
    }

    /// Whether a lane's line meets all its planes.
    #[inline(always)]
    pub(crate) fn meets(&self, lane: usize) -> bool {
        self.misses[lane % LANES] == 0
    }

    /// Of a step: the place of the surface, and the point.
    #[inline(always)]
    pub(crate) fn step(&self, lane: usize, step: usize) -> (usize, DVec3) {
        let (lane, step) = (lane % LANES, step % MAX_ORDER);
        let place = self.places[step][lane].trailing_zeros() as usize % MAX_ORDER;
        (place, at(&self.points[step], lane))
    }

    /// Where the line of a step points to.
    #[inline(always)]
    pub(crate) fn goal(&self, lane: usize, step: usize) -> DVec3 {
        at(&self.images[step % MAX_ORDER], lane % LANES)
    }

    /// [`Order::of`] and [`crate::propagation::image_source::image_path::mirror_listener`].
    #[inline(always)]
    fn make_ready<const COUNT: usize>(&mut self, ear: &[f64; 3]) {
        let mut behind = [0u64; LANES];
        let mut tilt = [0.0; LANES];
        for place in 1..COUNT {
            for earlier in 0..place {
                let (a, b) = (&self.normal[earlier], &self.normal[place]);
                let bit = 1u64 << (place * PLACE_BITS + earlier);
                for l in 0..LANES {
                    let dot = a[0][l] * b[0][l] + a[1][l] * b[1][l] + a[2][l] * b[2][l];
                    let cosine = dot.abs();
                    let commutes = cosine < COMMUTING_COSINE;
                    behind[l] |= if commutes { 0 } else { bit };
                    tilt[l] += if commutes { cosine } else { 0.0 };
                }
            }
        }
        let mut image = ear.map(|value| [value; LANES]);
        for place in (0..COUNT).rev() {
            let (n, offset_m) = (&self.normal[place], &self.offset_m[place]);
            for l in 0..LANES {
                let away_m = distance_m(n, offset_m, &image, l);
                let twice = 2.0 * away_m;
                image[0][l] -= twice * n[0][l];
                image[1][l] -= twice * n[1][l];
                image[2][l] -= twice * n[2][l];
                // Mirroring changes the side and nothing else of the distance.
                self.seen_m[place][l] = -away_m;
            }
            self.seen[place] = image;
        }
        (self.behind, self.tilt, self.image) = (behind, tilt, image);
    }

    /// [`crate::propagation::image_source::image_path::Unfolded::along_where`], with every lane to its end.
    #[inline(always)]
    fn unfold<const COUNT: usize>(&mut self, source: &[f64; 3]) {
        let mut from = source.map(|value| [value; LANES]);
        let mut image = self.image;
        let behind = self.behind.map(|bits| bits | OWN);
        let mut rest = [FIRST_OF_EACH * ((1 << COUNT) - 1); LANES];
        let mut misses = [0u64; LANES];
        for step in 0..COUNT {
            let mut next = Next {
                share: [f64::INFINITY; LANES],
                there_m: [0.0; LANES],
                normal: [[0.0; LANES]; 3],
                places: [0; LANES],
            };
            for place in 0..COUNT {
                // It is left, and nothing is that it cannot pass.
                let mask = 0xff << (place * PLACE_BITS);
                let own = 1 << (place * PLACE_BITS + place);
                let mut open = [0u64; LANES];
                for l in 0..LANES {
                    open[l] = all_if(behind[l] & rest[l] & mask == own);
                }
                if open == [0; LANES] {
                    continue;
                }
                let (n, offset_m) = (&self.normal[place], &self.offset_m[place]);
                let used = FIRST_OF_EACH << place;
                for l in 0..LANES {
                    let here = distance_m(n, offset_m, &from, l);
                    let there = distance_m(n, offset_m, &image, l);
                    let missed = all_if(here * there >= 0.0)
                        | all_if(here.abs() < ON_PLANE_M)
                        | all_if(there.abs() < ON_PLANE_M);
                    misses[l] |= missed & open[l];
                    let share = here / (here - there);
                    let nearer = open[l] & all_if(share < next.share[l]);
                    next.share[l] = pick(nearer, share, next.share[l]);
                    next.there_m[l] = pick(nearer, there, next.there_m[l]);
                    next.normal[0][l] = pick(nearer, n[0][l], next.normal[0][l]);
                    next.normal[1][l] = pick(nearer, n[1][l], next.normal[1][l]);
                    next.normal[2][l] = pick(nearer, n[2][l], next.normal[2][l]);
                    next.places[l] = (used & nearer) | (next.places[l] & !nearer);
                }
            }
            self.images[step] = image;
            self.places[step] = next.places;
            for l in 0..LANES {
                // Places that are no numbers have no share.
                misses[l] |= !all_if(next.share[l] < f64::INFINITY);
                rest[l] &= !next.places[l];
            }
            for axis in 0..3 {
                for l in 0..LANES {
                    from[axis][l] += (image[axis][l] - from[axis][l]) * next.share[l];
                    image[axis][l] -= 2.0 * next.there_m[l] * next.normal[axis][l];
                }
            }
            self.points[step] = from;
        }
        self.misses = misses;
    }
}

/// Of each lane the plane that its line meets first so far.
struct Next {
    /// Where on the line, from 0 to 1.
    share: Lanes,
    /// Distance of the line's end from it.
    there_m: Lanes,
    normal: [Lanes; 3],
    /// Its place, as the first bit of each.
    places: [u64; LANES],
}

/// All bits or none.
#[inline(always)]
fn all_if(is_so: bool) -> u64 {
    u64::from(is_so).wrapping_neg()
}

#[inline(always)]
fn pick(mask: u64, a: f64, b: f64) -> f64 {
    f64::from_bits((a.to_bits() & mask) | (b.to_bits() & !mask))
}

#[inline(always)]
fn distance_m(normal: &[Lanes; 3], offset_m: &Lanes, point: &[Lanes; 3], l: usize) -> f64 {
    normal[0][l] * point[0][l] + normal[1][l] * point[1][l] + normal[2][l] * point[2][l]
        - offset_m[l]
}

#[inline(always)]
fn at(lanes: &[Lanes; 3], lane: usize) -> DVec3 {
    DVec3::new(lanes[0][lane], lanes[1][lane], lanes[2][lane])
}

kernel! {
    /// Finds out which surfaces commute, and mirrors `ear` in all `count` of each lane. Every product is rounded, so all machines
    /// give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn ready_by<L>(four: &mut SequenceBatch4, count: usize, ear: &[f64; 3]) {
        match count {
            1 => four.make_ready::<1>(ear),
            2 => four.make_ready::<2>(ear),
            3 => four.make_ready::<3>(ear),
            _ => four.make_ready::<4>(ear),
        }
    }
}

kernel! {
    /// Follows each lane's line from `source` through its `count` planes.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn unfold_by<L>(four: &mut SequenceBatch4, count: usize, source: &[f64; 3]) {
        match count {
            1 => four.unfold::<1>(source),
            2 => four.unfold::<2>(source),
            3 => four.unfold::<3>(source),
            _ => four.unfold::<4>(source),
        }
    }
}

/// Makes the lanes' sequences of `count` surfaces ready for paths to `ear`.
#[inline(always)]
pub(crate) fn make_ready(four: &mut SequenceBatch4, count: usize, ear: DVec3) {
    ready_by(LaneSet::best(), four, count, &ear.to_array());
}

/// Unfolds the lanes' sequences of `count` surfaces, which are ready.
#[inline(always)]
pub(crate) fn unfold(four: &mut SequenceBatch4, count: usize, source: DVec3) {
    unfold_by(LaneSet::best(), four, count, &source.to_array());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::image_source::image_path::{Unfolded, mirror_listener};
    use crate::propagation::rays::directions::mix;
    use crate::scene::{MaterialTable, SceneSettings, procedural};

    /// Sequences of surfaces that a path could have, anywhere in a scene: most have none.
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
                let mut four = SequenceBatch4::EMPTY;
                for some in sequences(&scene, length, 4000).chunks(LANES) {
                    for (lane, sequence) in some.iter().enumerate() {
                        four.put(&scene, lane, sequence);
                    }
                    ready_by(set, &mut four, length, &ear.to_array());
                    unfold_by(set, &mut four, length, &source.to_array());
                    for (lane, sequence) in some.iter().enumerate() {
                        let (order, ready) =
                            (Order::of(&scene, sequence), four.ready(lane, length));
                        assert_eq!(ready.image, mirror_listener(&scene, sequence, ear));
                        assert_eq!(format!("{:?}", ready.order), format!("{order:?}"));
                        let (mut one, mut taken) = (Unfolded::default(), Unfolded::default());
                        let line = [source, ready.image];
                        let is_there = one.along(&scene, sequence, &order, line);
                        let meets = taken.take(&scene, sequence, &four, lane);
                        assert_eq!(is_there, meets && taken.lies_on_surfaces(&scene));
                        if is_there {
                            assert_eq!(one.finish(&scene, line), taken.finish(&scene, line));
                            assert_eq!(taken.goal(), ready.image);
                            met += 1;
                        }
                    }
                }
            }
        }
        assert!(met > 50, "{met} paths show little");
    }
}
