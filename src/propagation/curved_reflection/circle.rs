//! Stationary paths over a circle (Alhazen's problem): where a path from one point to another by way of the circle neither
//! lengthens nor shortens. With one reflection there are up to four. With two reflections inside the circle the path follows
//! the first one to the second, where the same slope has to vanish.
//!
//! Pure arithmetic, any thread, bounded.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::geometry::angle::unit_vector;
use crate::simd::{LaneSet, kernel};

/// Positions around the circle between which the slope's sign is compared: two stationary paths closer than this are missed,
/// next to a caustic, where they are about to vanish.
const SAMPLES: usize = 64;

/// Positions that are computed at once, and their number twice around the circle: an arc may begin anywhere.
const LANES: usize = 4;
const BATCHES: usize = 2 * SAMPLES / LANES + 1;

/// One vector per lane.
type Vectors<const N: usize> = [[f64; N]; 2];

/// The angle between two positions.
const STEP: f64 = TAU / SAMPLES as f64;

/// Halvings of an interval at most, by the secant where it converges.
const STEPS: usize = 48;

/// Width in radians at which an interval has converged.
const CONVERGED: f64 = 1e-6;

/// Steps of Newton's method, its longest one and the least one that it goes on for, in radians.
const NEWTON_STEPS: usize = 10;
const LONGEST_STEP: f64 = 0.2;
const LEAST_STEP: f64 = 1e-14;

/// Difference of angles for the slope's own slope.
const APART: f64 = 1e-4;

/// Angle of the first position in steps between positions: off the axes, on which symmetric scenes have their zeros.
const FIRST: f64 = 0.371;

/// Two positions between which paths are reflected by a circle about the origin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Circle {
    pub(super) radius_m: f64,
    pub(super) from: DVec2,
    pub(super) to: DVec2,
    /// Whether paths are reflected twice, inside the circle.
    pub(super) is_twice: bool,
}

/// Unit vectors to the positions around every circle, the same for all searches.
#[derive(Debug)]
pub(super) struct Directions([Vectors<LANES>; BATCHES]);

impl Directions {
    pub(super) fn new() -> Self {
        // Each position is the one before, turned by a step.
        let mut outward = unit_vector(STEP * FIRST);
        let turn = unit_vector(STEP);
        let mut batches = [[[0.0; LANES]; 2]; BATCHES];
        for [x, y] in &mut batches {
            for l in 0..LANES {
                (x[l], y[l]) = (outward.x, outward.y);
                outward = turn.rotate(outward);
            }
        }
        Self(batches)
    }
}

impl Circle {
    /// Whether the slope may vanish on an arc of half a width around its middle, in radians: between the positions around the
    /// circle that it lies among, the slope's sign changes.
    pub(super) fn may_be_stationary_on(
        &self,
        directions: &Directions,
        [middle, half]: [f64; 2],
    ) -> bool {
        // A position more to each side, for rounding.
        let first = ((middle - half) / STEP - FIRST).floor() - 1.0;
        let last = ((middle + half) / STEP - FIRST).ceil() + 1.0;
        let count = (last - first) as usize;
        if count >= SAMPLES {
            return true;
        }
        let first = (first as i64).rem_euclid(SAMPLES as i64) as usize;
        let mut slopes = [[0.0; LANES]; BATCHES];
        let slopes = self.sample(directions, first, count, &mut slopes);
        slopes.windows(2).any(|pair| changes_sign(pair[0], pair[1]))
    }

    /// Calls `found` with the angles of all stationary paths' first reflections.
    pub(super) fn stationary(&self, directions: &Directions, mut found: impl FnMut(f64)) {
        let angle = |index: usize| STEP * (index as f64 + FIRST);
        let mut slopes = [[0.0; LANES]; BATCHES];
        let slopes = self.sample(directions, 0, SAMPLES, &mut slopes);
        for (index, pair) in slopes.windows(2).enumerate() {
            if changes_sign(pair[0], pair[1]) {
                let ends = [(angle(index), pair[0]), (angle(index + 1), pair[1])];
                let root = root(|at| self.slope_at(unit_vector(at)), ends);
                if let Some(root) = self.near(root) {
                    found(root);
                }
            }
        }
    }

    /// Slopes at a position, by its index below [`SAMPLES`], and at up to [`SAMPLES`] positions after it.
    fn sample<'a>(
        &self,
        directions: &Directions,
        first: usize,
        count: usize,
        slopes: &'a mut [[f64; LANES]; BATCHES],
    ) -> &'a [f64] {
        let batches = first / LANES..(first + count) / LANES + 1;
        let directions = &directions.0[batches.clone()];
        slopes_at(LaneSet::best(), self, directions, &mut slopes[batches]);
        &slopes.as_flattened()[first..=first + count]
    }

    /// The stationary path near an angle, by Newton's method; none where it does not converge, such as where the direction to
    /// an end point on the circle jumps.
    pub(super) fn near(&self, mut angle: f64) -> Option<f64> {
        let aside = unit_vector(APART);
        for _ in 0..NEWTON_STEPS {
            let outward = unit_vector(angle);
            let [before, after] =
                [DVec2::new(aside.x, -aside.y), aside].map(|turn| turn.rotate(outward));
            let rise = (self.slope_at(after) - self.slope_at(before)) / (2.0 * APART);
            let step = (self.slope_at(outward) / rise).clamp(-LONGEST_STEP, LONGEST_STEP);
            if !step.is_finite() {
                return None;
            }
            angle -= step;
            if step.abs() < LEAST_STEP {
                break;
            }
        }
        (self.slope_at(unit_vector(angle)).abs() < 1e-9).then_some(angle)
    }

    fn slope_at(&self, outward: DVec2) -> f64 {
        let [slope] = self.slopes(&[[outward.x], [outward.y]]);
        slope
    }

    /// The second reflection of a path whose first one has a direction from the centre; no number for a path from outside.
    pub(super) fn second(&self, outward: DVec2) -> DVec2 {
        let [[x], [y]] = self.seconds(&[[outward.x], [outward.y]]);
        DVec2::new(x, y)
    }

    /// Slope of a path's length with the angle of its last reflection, per radius, for each direction of the first one; no number
    /// where a path that is reflected twice does not arrive inside the circle. Every lane does the same operations in the same
    /// order.
    #[inline(always)]
    fn slopes<const N: usize>(&self, outward: &Vectors<N>) -> [f64; N] {
        let from = [[self.from.x; N], [self.from.y; N]];
        if !self.is_twice {
            return self.slopes_over(&from, outward);
        }
        let (last, mut first, mut towards) = (self.seconds(outward), *outward, *outward);
        for axis in 0..2 {
            for l in 0..N {
                first[axis][l] = self.radius_m * outward[axis][l];
                towards[axis][l] = last[axis][l] / self.radius_m;
            }
        }
        let mut slopes = self.slopes_over(&first, &towards);
        for l in 0..N {
            let [x, y] = [last[0][l], last[1][l]];
            let is_inside = (x - self.to.x) * x + (y - self.to.y) * y > 0.0;
            slopes[l] = if is_inside { slopes[l] } else { f64::NAN };
        }
        slopes
    }

    /// The same for the leg from a position to the circle and the one to the end.
    #[inline(always)]
    fn slopes_over<const N: usize>(&self, before: &Vectors<N>, outward: &Vectors<N>) -> [f64; N] {
        let (mut incoming, mut outgoing) = (*outward, *outward);
        for l in 0..N {
            let [x, y] = [self.radius_m * outward[0][l], self.radius_m * outward[1][l]];
            (incoming[0][l], incoming[1][l]) = (x - before[0][l], y - before[1][l]);
            (outgoing[0][l], outgoing[1][l]) = (x - self.to.x, y - self.to.y);
        }
        normalize(&mut incoming);
        normalize(&mut outgoing);
        let mut slopes = [0.0; N];
        for l in 0..N {
            let x = incoming[0][l] + outgoing[0][l];
            let y = incoming[1][l] + outgoing[1][l];
            slopes[l] = -outward[1][l] * x + outward[0][l] * y;
        }
        slopes
    }

    /// [`Self::second`] in each lane.
    #[inline(always)]
    fn seconds<const N: usize>(&self, outward: &Vectors<N>) -> Vectors<N> {
        let (mut first, mut ray) = (*outward, *outward);
        for l in 0..N {
            (first[0][l], first[1][l]) =
                (self.radius_m * outward[0][l], self.radius_m * outward[1][l]);
            (ray[0][l], ray[1][l]) = (first[0][l] - self.from.x, first[1][l] - self.from.y);
        }
        normalize(&mut ray);
        for l in 0..N {
            let cosine = ray[0][l] * outward[0][l] + ray[1][l] * outward[1][l];
            let cosine = if cosine > 0.0 { cosine } else { f64::NAN };
            for axis in 0..2 {
                let chord = ray[axis][l] - 2.0 * cosine * outward[axis][l];
                first[axis][l] += 2.0 * self.radius_m * cosine * chord;
            }
        }
        first
    }
}

/// Scales the vectors to the length 1; those that have no direction become 0.
#[inline(always)]
fn normalize<const N: usize>(vectors: &mut Vectors<N>) {
    for l in 0..N {
        let [x, y] = [vectors[0][l], vectors[1][l]];
        let scale = 1.0 / (x * x + y * y).sqrt();
        let is_finite = scale > 0.0 && scale < f64::INFINITY;
        vectors[0][l] = if is_finite { x * scale } else { 0.0 };
        vectors[1][l] = if is_finite { y * scale } else { 0.0 };
    }
}

kernel! {
    /// The slopes in these directions. Every product is rounded, so all machines give the same bits.
    #[allow(clippy::extra_unused_type_parameters, reason = "lanes are chosen by the function's features alone")]
    fn slopes_at<L>(circle: &Circle, directions: &[Vectors<LANES>], slopes: &mut [[f64; LANES]]) {
        for (slopes, outward) in slopes.iter_mut().zip(directions) {
            *slopes = circle.slopes(outward);
        }
    }
}

/// Whether two slopes are numbers of different signs.
fn changes_sign(before: f64, after: f64) -> bool {
    before * after <= 0.0 && (before < 0.0) != (after < 0.0)
}

/// A zero between two arguments with values of different signs: regula falsi of Illinois.
fn root(of: impl Fn(f64) -> f64, [mut low, mut high]: [(f64, f64); 2]) -> f64 {
    let mut side = 0;
    for _ in 0..STEPS {
        let width = high.0 - low.0;
        if width.abs() < CONVERGED {
            break;
        }
        let at = low.0 - low.1 * width / (high.1 - low.1);
        let value = of(at);
        if value == 0.0 {
            return at;
        }
        if (value < 0.0) == (low.1 < 0.0) {
            low = (at, value);
            high.1 *= if side == 1 { 0.5 } else { 1.0 };
            side = 1;
        } else {
            high = (at, value);
            low.1 *= if side == 2 { 0.5 } else { 1.0 };
            side = 2;
        }
    }
    match low.1.abs() < high.1.abs() {
        true => low.0,
        false => high.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_of_incidence_and_reflection_are_equal() {
        let directions = Directions::new();
        let mut most = 0;
        for number in 0..200u32 {
            let unit = |k: u32| {
                let n = (number * 7 + k).wrapping_mul(2_654_435_761) >> 8;
                f64::from(n) / f64::from(1u32 << 24) * 6.0 - 3.0
            };
            let (from, to) = (DVec2::new(unit(0), unit(1)), DVec2::new(unit(2), unit(3)));
            let mut count = 0;
            let circle = Circle {
                radius_m: 2.0,
                from,
                to,
                is_twice: false,
            };
            circle.stationary(&directions, |angle| {
                count += 1;
                assert!(
                    circle.may_be_stationary_on(&directions, [angle, 1e-3]),
                    "{number}"
                );
                let point = 2.0 * DVec2::from_angle(angle);
                let along = DVec2::from_angle(angle).perp();
                let [a, b] = [from, to].map(|end| (end - point).normalize().dot(along));
                assert!((a + b).abs() < 1e-9, "{number}: {a} {b}");
            });
            assert!(count >= 2, "{number}: the shortest and the longest");
            most = most.max(count);
        }
        assert_eq!(most, 4);
    }

    #[test]
    fn most_short_arcs_have_no_stationary_path() {
        let directions = Directions::new();
        let circle = Circle {
            radius_m: 2.0,
            from: DVec2::new(0.7, 0.4),
            to: DVec2::new(-0.3, 1.1),
            is_twice: false,
        };
        let arcs = (0..36).map(|n| [TAU * f64::from(n) / 36.0, 0.1]);
        let some = arcs
            .filter(|arc| circle.may_be_stationary_on(&directions, *arc))
            .count();
        assert!((2..18).contains(&some), "{some} of 36 arcs");
    }

    #[test]
    fn paths_with_two_reflections_obey_the_law_at_both() {
        let directions = Directions::new();
        let mut all = 0;
        for number in 0..200u32 {
            let unit = |k: u32| {
                let n = (number * 7 + k).wrapping_mul(2_654_435_761) >> 8;
                f64::from(n) / f64::from(1u32 << 24) * 2.8 - 1.4
            };
            let (from, to) = (DVec2::new(unit(0), unit(1)), DVec2::new(unit(2), unit(3)));
            let circle = Circle {
                radius_m: 2.0,
                from,
                to,
                is_twice: true,
            };
            circle.stationary(&directions, |angle| {
                all += 1;
                assert!(
                    circle.may_be_stationary_on(&directions, [angle + 0.4, 0.41]),
                    "{number}"
                );
                let first = 2.0 * DVec2::from_angle(angle);
                let last = circle.second(first / 2.0);
                assert!((last.length() - 2.0).abs() < 1e-9, "{number}: {last}");
                for [before, at, after] in [[from, first, last], [first, last, to]] {
                    let [a, b] = [before, after].map(|end| (end - at).normalize().dot(at.perp()));
                    assert!((a + b).abs() < 1e-8, "{number}: {a} {b}");
                }
            });
        }
        // A shortest and a longest path of each sense of rotation, or more.
        assert!(all >= 2 * 200, "{all}");
    }
}
