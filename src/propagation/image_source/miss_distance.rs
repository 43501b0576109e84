//! How far a listener must walk at least before a sequence that has no path can have one. Own.
//!
//! Unfolded, a line leads from the source to the listener's image, which moves as far as the listener does. It fails at a plane:
//!
//! - It does not cross the plane. The image must cross it, or, where the line crosses it too early, the point before must.
//! - It crosses the plane e metres outside the surface's bounds. The point must move by e or more, so the image must leave the
//!   cone of the lines from the source through a circle with that radius.
//!
//! Where reflections commute, the point is folded at each mirror that the line crosses before. Folding at perpendicular mirrors
//! brings no two points farther apart, so the bound holds whatever order the line has later. Among mirrors that do not commute
//! with each other it is that to the nearest of them. Pure arithmetic in local coordinates; any thread; allocates nothing.

use glam::DVec3;

use crate::propagation::image_source::image_path::outside_bounds_m;
use crate::propagation::image_source::sequence::Sequence;
use crate::propagation::image_source::unfold::vector;
use crate::propagation::image_source::unfold_x4::SequenceBatch4;
use crate::propagation::path::MAX_ORDER;
use crate::scene::{Scene, Surface};

/// What rounding may take from a distance in metres: far more than that of double precision in scenes of kilometres.
const ROUNDING_M: f64 = 1e-4;

/// Bound of what commuting planes that are not exactly perpendicular take from a distance: relative to the sum of the cosines and to
/// the lengths that are mirrored.
const SKEW: f64 = 32.0;

/// A lane of an unfolded batch, whose sequence has no line within a margin of its surfaces' bounds.
#[derive(Clone, Copy)]
pub(crate) struct Miss<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) sequence: &'a Sequence,
    pub(crate) batch: &'a SequenceBatch4,
    pub(crate) lane: usize,
    /// In local coordinates.
    pub(crate) source: DVec3,
    pub(crate) margin_m: f64,
}

impl Miss<'_> {
    /// Least distance in metres that the listener must move before there is such a line, while source and scene are the same. 0 or
    /// less where nothing is known.
    #[inline(never)]
    pub(crate) fn distance_m(&self) -> f64 {
        let count = self.sequence.len().min(MAX_ORDER);
        let mut taken = 0u8;
        for step in 0..count {
            if self.batch.misses_at(self.lane, step) {
                return self.until_planes_m(step, taken);
            }
            let (index, point, _) = self.batch.step(self.lane, step);
            let outside_m = outside_bounds_m(self.surface(index), point);
            if outside_m > self.margin_m {
                let away_m = self.unfolded_m(index, point, taken, outside_m - self.margin_m);
                return self.until_out_of_cone_m(step, away_m);
            }
            taken |= 1 << index;
        }
        0.0
    }

    #[inline(always)]
    fn surface(&self, index: usize) -> &Surface {
        self.scene.surface(self.sequence.surface_at(index))
    }

    fn line_m(&self) -> f64 {
        let image = vector(self.batch.image(), self.lane);
        self.source.distance(image)
    }

    /// What rounding and planes that are not exactly perpendicular may take from a distance.
    fn slack_m(&self, line_m: f64) -> f64 {
        let count = self.sequence.len().min(MAX_ORDER);
        let skew = self.batch.skew_of(self.lane);
        if skew == 0.0 {
            return ROUNDING_M;
        }
        let mirrored = (0..count).map(|index| self.batch.distance_m(self.lane, index));
        ROUNDING_M + SKEW * skew * (line_m + 2.0 * mirrored.sum::<f64>())
    }

    /// Until the line crosses a plane that it misses at this step.
    fn until_planes_m(&self, step: usize, taken: u8) -> f64 {
        let count = self.sequence.len().min(MAX_ORDER);
        let before = self.batch.precedence(self.lane, count).bits().to_le_bytes();
        let (_, _, target) = self.batch.step(self.lane, step);
        let from = match step.checked_sub(1) {
            Some(last) => self.batch.step(self.lane, last).1,
            None => self.source,
        };
        let slack_m = self.slack_m(self.line_m());
        let mut most_m = 0.0f64;
        for (open, before) in before.into_iter().enumerate().take(count) {
            if taken >> open & 1 == 1 || before & !taken != 0 {
                continue;
            }
            let surface = self.surface(open);
            let (here_m, there_m) = (surface.distance_m(from), surface.distance_m(target));
            if here_m * there_m < 0.0 {
                continue;
            }
            // The listener's image crosses it, or the point before does, beyond which the line does not.
            let image_m = there_m.abs() - slack_m;
            let least_m = match step.checked_sub(1) {
                Some(last) if image_m > most_m => {
                    image_m.min(self.until_out_of_cone_m(last, here_m.abs()))
                }
                _ => image_m,
            };
            most_m = most_m.max(least_m);
        }
        most_m
    }

    /// Until the line no longer crosses the plane of a step within `away_m` of where it does: the distance of the listener's image
    /// from the lines through points at that distance. The nearest one is where the plane is seen at the smallest angle.
    fn until_out_of_cone_m(&self, step: usize, away_m: f64) -> f64 {
        let (index, point, target) = self.batch.step(self.lane, step);
        let (line_m, rest) = (self.line_m(), target - point);
        let rest_m = rest.length();
        let cosine = (self.surface(index).normal.dot(rest) / rest_m).abs();
        let seen_m = away_m * cosine - self.slack_m(line_m);
        line_m * seen_m / ((line_m - rest_m).max(0.0) + away_m)
    }

    /// Distance that the point of reflection `index` moves at least before it is `outside_m` elsewhere when folded. `taken` are
    /// the reflections before.
    fn unfolded_m(&self, index: usize, point: DVec3, taken: u8, outside_m: f64) -> f64 {
        let count = self.sequence.len().min(MAX_ORDER);
        let precedence = self.batch.precedence(self.lane, count);
        let before = precedence.bits().to_le_bytes();
        let has_ordered = |mirrors: u8| {
            let mut rows = (0..count).filter(|row| mirrors >> row & 1 == 1);
            rows.any(|row| before[row] & mirrors != 0)
        };
        let ordered = |other: usize| {
            before[index] >> other & 1 == 1 || before[other] >> index & 1 == 1 || other == index
        };
        let mirrors = (0..count).filter(|other| !ordered(*other));
        let mirrors = mirrors.fold(0, |mirrors, other| mirrors | 1 << other);
        if !has_ordered(mirrors) {
            return outside_m;
        }
        let mirrors = precedence.unordered()[index];
        if !has_ordered(mirrors) {
            return outside_m;
        }
        if has_ordered(mirrors & taken) {
            return 0.0;
        }
        // As long as it crosses no mirror that may be taken before it, it is folded at the same ones.
        let near = |other: &usize| {
            let is_near = taken >> other & 1 == 1 || before[*other] & !taken == 0;
            mirrors >> other & 1 == 1 && is_near
        };
        let mirrors = (0..count).filter(near);
        mirrors.fold(outside_m, |least_m, other| {
            least_m.min(self.surface(other).distance_m(point).abs())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propagation::image_source::image_path::{MARGIN_M, UnfoldedPath};
    use crate::propagation::rays::directions::{mix, unit};
    use crate::scene::{MaterialTable, SceneSettings, procedural};

    /// Margins of valid paths and of paths nearby.
    const MARGINS_M: [f64; 2] = [MARGIN_M, MARGIN_M + 0.12];

    /// Pairs of positions a room.
    const MOST_PAIRS: usize = 5000;

    fn draw(seed: u64) -> DVec3 {
        let axis = |axis: u64| f64::from(unit(mix(seed ^ axis << 60)));
        DVec3::new(axis(1), axis(2), axis(3))
    }

    /// Whether a line passes; else the distance that the listener must move.
    fn passes(
        scene: &Scene,
        sequence: &Sequence,
        batch: &mut SequenceBatch4,
        [source, listener]: [DVec3; 2],
        margin_m: f64,
    ) -> Result<(), f64> {
        let lane = 2;
        batch.put(scene, lane, sequence);
        batch.prepare(sequence.len(), listener);
        batch.unfold(sequence.len(), source);
        let mut unfolded = UnfoldedPath::default();
        if unfolded
            .take(scene, sequence, batch, lane, margin_m)
            .is_some()
        {
            return Ok(());
        }
        let miss = Miss {
            scene,
            sequence,
            batch,
            lane,
            source,
            margin_m,
        };
        Err(miss.distance_m())
    }

    /// Rooms in which reflections commute with some others, with all, and with none.
    fn rooms() -> Vec<(Scene, DVec3, DVec3)> {
        let table = MaterialTable::built_in();
        let mut meshes: Vec<_> = ["concert_hall", "doorway"]
            .iter()
            .filter_map(|name| procedural::by_name(name))
            .map(|benchmark| benchmark.mesh)
            .collect();
        // Walls of a prism commute with floor and ceiling only, and those of a leaning one with nothing.
        for lean in [0.0, 0.3] {
            let mut mesh = procedural::shoebox(glam::Vec3::new(7.0, 3.0, 5.0), "concrete");
            for vertex in &mut mesh.vertices {
                let [x, y, z] = vertex.to_array();
                let turned = glam::Vec3::new(x + 0.35 * z, y, z - 0.2 * x + 0.05 * x * z);
                *vertex = turned + lean * glam::Vec3::new(y, 0.1 * x, 0.7 * y);
            }
            meshes.push(mesh);
        }
        let commit = |mesh: &crate::scene::TriangleMesh| {
            let scene = Scene::commit(mesh, &table, &SceneSettings::default()).expect("commits");
            let surfaces = scene.surfaces().iter();
            let low = surfaces.clone().map(|s| s.bounds_min.as_dvec3());
            let high = surfaces.map(|s| s.bounds_max.as_dvec3());
            let low = low.reduce(DVec3::min).expect("surfaces");
            let high = high.reduce(DVec3::max).expect("surfaces");
            (scene, low, high)
        };
        meshes.iter().map(commit).collect()
    }

    /// From positions without a line none with one is nearer than the distance. Twice the distance would be wrong.
    #[test]
    fn no_line_passes_before_its_distance() {
        let mut batch = SequenceBatch4::EMPTY;
        for (number, (scene, low, high)) in (0u64..).zip(rooms()) {
            let count = scene.surfaces().len() as u64;
            let (mut pairs, mut useful, mut nearer_than_twice) = (0usize, 0, 0);
            for trial in 0..400_000u64 {
                if pairs > MOST_PAIRS {
                    break;
                }
                let seed = mix(number << 40 | trial);
                let length = 1 + seed % MAX_ORDER as u64;
                let surface = |step: u64| {
                    let drawn = (0..4).map(|n| (mix(seed + 17 * step + n) % count) as u32);
                    let area = |surface: &u32| scene.surface(*surface).area_m2;
                    drawn.max_by(|a, b| area(a).total_cmp(&area(b)))
                };
                let surfaces: Vec<u32> = (0..length).filter_map(surface).collect();
                let sequence = Sequence::canonical(&scene, &surfaces);
                let source = low + (high - low) * draw(seed + 1);
                let margin_m = MARGINS_M[(seed >> 20) as usize % 2];
                // A position with a line, most of whose neighbours have none.
                let listener = low + (high - low) * draw(seed + 2);
                let ends = [source, listener];
                if passes(&scene, &sequence, &mut batch, ends, margin_m).is_err() {
                    continue;
                }
                for step in 0..24 {
                    let reach_m = 4.0 / f64::from(1 << (step % 6));
                    let way = (draw(seed + 100 + step) - 0.5) * 2.0 * reach_m;
                    let ends = [source, listener + way];
                    if let Err(miss_m) = passes(&scene, &sequence, &mut batch, ends, margin_m) {
                        let moved_m = way.length();
                        assert!(
                            miss_m <= moved_m,
                            "room {number}, {sequence:?}, {ends:?}: {miss_m} m, a line after {moved_m} m"
                        );
                        pairs += 1;
                        useful += usize::from(miss_m > 0.25 * moved_m);
                        nearer_than_twice += usize::from(moved_m < 2.0 * miss_m);
                    }
                }
            }
            let counts = format!("room {number}: {pairs} pairs, {useful}, {nearer_than_twice}");
            assert!(pairs > 1000 && useful > pairs / 4, "{counts}");
            assert!(nearer_than_twice > pairs / 20, "{counts}: a loose bound");
        }
    }
}
