//! Where the shortest path over two edges' lines crosses them, and bounds of its length.
//!
//! Pure arithmetic, any thread, bounded. Lengths in metres in the scene's local coordinates.

use glam::DVec3;

use crate::scene::edges::Edge;

/// Newton steps on the two crossings, and the step in metres at which they have converged.
const MAX_NEWTON_STEPS: usize = 12;
const CONVERGED_M: f64 = 1e-6;

/// Halvings of a Newton step that lengthens the path.
const MAX_HALVINGS: usize = 6;

/// Steps where Newton's method fails, and the width in metres at which an interval has converged.
const MAX_INTERVAL_STEPS: usize = 60;
const NARROW_M: f64 = 1e-9;

/// Smallest slope of a length distinguishable from zero.
const MIN_SLOPE: f64 = 1e-6;

/// Relative rounding error of a lower bound of lengths: a thousand times that of a few sums and roots in `f64`.
const BOUND_ROUNDING: f64 = 1e-12;

/// Least cosine between the lines of edges that are parallel.
const PARALLEL: f64 = 1.0 - 1e-12;

/// Distance below which ends of edges are one corner, in metres.
const CORNER_M: f64 = 1e-6;

/// Whether two edges meet at a corner through which the shortest path over their lines passes, without a leg between.
///
/// There the length has a cusp. It is a minimum if some vector of length 1 at most balances both ends: its component
/// along each edge is that of the unit leg at the corner. The shortest such vector lies in the edges' plane.
pub(super) fn passes_corner([a, b]: [&Edge; 2], from: DVec3, to: DVec3) -> bool {
    let ends = |edge: &Edge| [edge.origin, edge.at(edge.length_m)];
    let (of_a, of_b) = (ends(a), ends(b));
    let is_met = |end: &&DVec3| {
        let meets = |other: &DVec3| end.distance_squared(*other) < CORNER_M * CORNER_M;
        of_b.iter().any(meets)
    };
    let Some(&corner) = of_a.iter().find(is_met) else {
        return false;
    };
    let along_a = (corner - from).normalize_or_zero().dot(a.direction);
    let along_b = (to - corner).normalize_or_zero().dot(b.direction);
    let cosine = a.direction.dot(b.direction);
    let square = along_a * along_a - 2.0 * cosine * along_a * along_b + along_b * along_b;
    square <= 1.0 - cosine * cosine
}

/// Approximate crossings of the shortest path, in metres from the edges' origins: exact for parallel edges, whose half-planes unfold into
/// one.
pub(super) fn first_guess([a, b]: [&Edge; 2], from: DVec3, to: DVec3) -> [f64; 2] {
    let cosine = a.direction.dot(b.direction);
    if cosine.abs() > PARALLEL {
        let (before_m, near_m) = a.along_and_across_m(from);
        let between_m = a.line_distance_m(b.origin);
        let far_m = b.line_distance_m(to);
        let after_m = (to - a.origin).dot(a.direction);
        let slope = (after_m - before_m) / (near_m + between_m + far_m).max(1e-9);
        let first_m = before_m + slope * near_m;
        let second = a.at(first_m + slope * between_m);
        return [first_m, (second - b.origin).dot(b.direction)];
    }
    let first_m = a.apex_m(from, b.at(b.apex_m(from, to)));
    [first_m, b.apex_m(a.at(first_m), to)]
}

/// The legs of a path over the lines of two edges.
struct Legs {
    lengths: [f64; 3],
    /// Cosines of the angles between each edge and the legs before and after its crossing.
    of_a: [f64; 2],
    of_b: [f64; 2],
}

impl Legs {
    fn over([a, b]: [&Edge; 2], [first_m, second_m]: [f64; 2], from: DVec3, to: DVec3) -> Self {
        let (first, second) = (a.at(first_m), b.at(second_m));
        let (before, between, after) = (first - from, second - first, to - second);
        let lengths = [before.length(), between.length(), after.length()];
        let least = |leg: usize| lengths[leg].max(1e-9);
        Self {
            lengths,
            of_a: [
                before.dot(a.direction) / least(0),
                between.dot(a.direction) / least(1),
            ],
            of_b: [
                between.dot(b.direction) / least(1),
                after.dot(b.direction) / least(2),
            ],
        }
    }

    /// The sum of their lengths.
    fn length_m(&self) -> f64 {
        self.lengths[0] + self.lengths[1] + self.lengths[2]
    }

    /// Lower bound of the length of a path over both lines.
    ///
    /// The length is at least the sum of the legs' components along any three vectors of length 1 at most, of which those on both sides
    /// of an edge have the same component along it: the sum then does not depend on the crossings. The unit legs of the shortest path
    /// are such vectors. Those of other crossings become so with the middle one's components.
    fn least_length_m(&self) -> f64 {
        let ([a0, a1], [b1, b2]) = (self.of_a, self.of_b);
        let lengths = self.lengths.map(|length_m| length_m.max(1e-9));
        let sum =
            lengths[0] * (1.0 - (a0 - a1) * a0) + lengths[1] + lengths[2] * (1.0 - (b2 - b1) * b2);
        let longest_squared = 1.0 + (a1 * a1 - a0 * a0).max(b1 * b1 - b2 * b2).max(0.0);
        sum / longest_squared.sqrt() * (1.0 - BOUND_ROUNDING)
    }
}

/// Lower bound of the length of a path over the lines of two edges, from the legs between two crossings.
pub(super) fn least_length_m(
    lines: [&Edge; 2],
    crossings_m: [f64; 2],
    from: DVec3,
    to: DVec3,
) -> f64 {
    Legs::over(lines, crossings_m, from, to).least_length_m()
}

/// Whether the shortest path over two lines crosses the first beyond an end of its edge that is not free, tested at the end
/// that `guess_m` exceeds. Minimised over the second line the length is convex along the first, so a descent at an end is
/// decisive.
pub(super) fn minimum_lies_beyond_end(
    [a, b]: [&Edge; 2],
    guess_m: f64,
    from: DVec3,
    to: DVec3,
) -> bool {
    let slope = |first_m: f64| slope_at([a, b], a.at(first_m), from, to).0;
    !a.free_ends[0] && guess_m < 0.0 && slope(0.0) > MIN_SLOPE
        || !a.free_ends[1] && guess_m > a.length_m && slope(a.length_m) < -MIN_SLOPE
}

/// Slope of the length along the first edge at a crossing, and the best crossing of the second.
fn slope_at([a, b]: [&Edge; 2], first: DVec3, from: DVec3, to: DVec3) -> (f64, DVec3) {
    let second = b.at(b.apex_m(first, to));
    let turn = (first - from).normalize_or_zero() - (second - first).normalize_or_zero();
    (turn.dot(a.direction), second)
}

/// How a search for the crossings of the shortest path over two lines ends.
pub(super) enum Crossings {
    Found([DVec3; 2]),
    /// The path is longer than asked for.
    TooLong,
    /// The length has a cusp where the lines nearly meet.
    NotConverged,
}

/// Crossings of the shortest path over two lines by Newton's method on the length, which is convex in both, if it may be as short as
/// `most_m`.
pub(super) fn newton(
    [a, b]: [&Edge; 2],
    [mut first_m, mut second_m]: [f64; 2],
    most_m: f64,
    from: DVec3,
    to: DVec3,
) -> Crossings {
    let between = a.direction.dot(b.direction);
    let mut legs = Legs::over([a, b], [first_m, second_m], from, to);
    for _ in 0..MAX_NEWTON_STEPS {
        let lengths = legs.lengths.map(|length_m| length_m.max(1e-9));
        let ([a0, a1], [b1, b2]) = (legs.of_a, legs.of_b);
        let slope = [a0 - a1, b1 - b2];
        let across = |c: f64, leg: usize| (1.0 - c * c) / lengths[leg];
        let curve = [across(a0, 0) + across(a1, 1), across(b1, 1) + across(b2, 2)];
        let both = -(between - a1 * b1) / lengths[1];
        let determinant = curve[0] * curve[1] - both * both;
        if determinant <= 1e-12 * curve[0] * curve[1] {
            return Crossings::NotConverged;
        }
        let steps = [
            (curve[1] * slope[0] - both * slope[1]) / determinant,
            (curve[0] * slope[1] - both * slope[0]) / determinant,
        ];
        let length_m: f64 = lengths.iter().sum();
        let after = |share: f64| [first_m - share * steps[0], second_m - share * steps[1]];
        let mut share = 1.0;
        legs = Legs::over([a, b], after(share), from, to);
        for _ in 0..MAX_HALVINGS {
            if legs.length_m() <= length_m + 1e-12 {
                break;
            }
            share *= 0.5;
            legs = Legs::over([a, b], after(share), from, to);
        }
        [first_m, second_m] = after(share);
        if steps.iter().all(|step| step.abs() < CONVERGED_M) {
            return Crossings::Found([a.at(first_m), b.at(second_m)]);
        }
        // The bound of each step is much nearer to the length than the last one's.
        if legs.least_length_m() > most_m {
            return Crossings::TooLong;
        }
    }
    Crossings::NotConverged
}

/// The same within the first edge, by secants and bisections in turn: where the slope jumps, at a cusp, secants alone are slow.
pub(super) fn within_first_edge(lines: [&Edge; 2], from: DVec3, to: DVec3) -> [DVec3; 2] {
    let a = lines[0];
    let slope = |first_m: f64| slope_at(lines, a.at(first_m), from, to).0;
    // The slope rises along the edge.
    let [mut low, mut high] = [0.0, a.length_m].map(|first_m| (first_m, slope(first_m)));
    if low.1 >= 0.0 {
        high = low;
    } else if high.1 <= 0.0 {
        low = high;
    }
    for step in 0..MAX_INTERVAL_STEPS {
        let width_m = high.0 - low.0;
        if width_m < NARROW_M {
            break;
        }
        let share = match step % 2 {
            0 => (low.1 / (low.1 - high.1)).clamp(0.0, 1.0),
            _ => 0.5,
        };
        // Beyond the secant's zero on the longer side, so that the other end moves as well.
        let aside_m = 0.25 * NARROW_M * if share < 0.5 { 1.0 } else { -1.0 };
        let first_m = low.0 + share * width_m + aside_m;
        let middle = (first_m, slope(first_m));
        match middle.1 > 0.0 {
            true => high = middle,
            false => low = middle,
        }
    }
    let first = a.at(0.5 * (low.0 + high.0));
    [first, slope_at(lines, first, from, to).1]
}
